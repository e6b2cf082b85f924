"""Scripts that build the shipped samples from public data; run as ``python -m samples.build``."""
