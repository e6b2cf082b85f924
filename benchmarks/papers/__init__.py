"""The figures and tables of the three papers, made again; see `docs/papers.md`."""
