"""The Preetham sky in spherical harmonics (Habel et al. 2008)."""
