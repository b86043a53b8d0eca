"""Locally adaptive products of spherical harmonics (Lee and Kim 2014)."""
