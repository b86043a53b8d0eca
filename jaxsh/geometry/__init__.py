"""Shapes and the rays between them: triangle meshes, points, texels of a mesh, and ray casting.

Meshes are JAX arrays and their normals differentiate. Rays run on all cores through Embree, or
through JAX where there is no Embree, in float32; they take NumPy or JAX arrays and give NumPy
arrays back. Space is right-handed with z up.
"""

from ._base_color import BaseColor
from ._cast import JaxRayScene
from ._embree import EmbreeRayScene, ray_scene
from ._files._write import write_mesh
from ._knot import knot
from ._make import make_mesh
from ._mesh import Mesh, vertex_normals
from ._points import Points
from ._rays import Hit, RayScene
from ._read import read_mesh
from ._read_points import read_points
from ._texels import Surface, Texels, texels
from ._topology import Topology, neighbors, topology
from ._trace import Trace, trace
from ._tree import RayTree
from ._trimesh import from_trimesh, to_trimesh

__all__ = [
    "BaseColor",
    "EmbreeRayScene",
    "Hit",
    "JaxRayScene",
    "Mesh",
    "Points",
    "RayScene",
    "RayTree",
    "Surface",
    "Texels",
    "Topology",
    "Trace",
    "from_trimesh",
    "knot",
    "make_mesh",
    "neighbors",
    "ray_scene",
    "read_mesh",
    "read_points",
    "texels",
    "to_trimesh",
    "topology",
    "trace",
    "vertex_normals",
    "write_mesh",
]
