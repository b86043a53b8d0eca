"""Shapes and the rays between them: triangle meshes, read from files or made, and an Embree scene.

Meshes are JAX arrays and their normals differentiate; rays run on all cores through Embree, in
float32, take NumPy or JAX arrays and give NumPy arrays back. Space is right-handed with z up.
"""

from ._knot import knot
from ._mesh import Mesh, make_mesh, vertex_normals
from ._rays import Hit, RayScene
from ._read import read_mesh

__all__ = [
    "Hit",
    "Mesh",
    "RayScene",
    "knot",
    "make_mesh",
    "read_mesh",
    "vertex_normals",
]
