"""jaxsh beside its peers, measured interleaved in one run: ``python -m benchmarks``."""
