"""Make a source: the motions of a face from its own modelled shapes, or constructed from its feature points."""
