"""Precomputed radiance transfer with shadows and a bounce, after Sloan et al. 2002."""
