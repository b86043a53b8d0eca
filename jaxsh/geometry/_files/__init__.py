"""Mesh files: one parser a format, each giving `Polygons`, and the writers."""
