"""Spherical-harmonic gradients for mid-range illumination (Annen, Kautz, Durand, Seidel 2004)."""
