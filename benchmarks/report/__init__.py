"""One report of speed, memory and fidelity: see `benchmarks.report.__main__`."""
