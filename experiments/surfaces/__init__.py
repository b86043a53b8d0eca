"""Surfaces other than vertices of one color: textures, beside a path tracer."""
