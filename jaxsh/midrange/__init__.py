"""Annen, Kautz, Durand and Seidel 2004: light from near emitters, and its gradient.

A `Scene` of emitters and blockers is captured as a radiance cube at one or a few points and
projected with its derivatives; extrapolation and interpolation carry that to every vertex. Beside
it stand exact lights, polygons and spheres, that need no cube.
"""

from ._capture import capture
from ._cube import RadianceCube
from ._emitters import EmissiveMesh, Polygon, Sphere
from ._expansion import Expansion, extrapolate, make_expansion, monomials
from ._grid import Grid, grid_around
from ._interpolate import interpolate
from ._placement import Update, place_samples, update_samples
from ._polygon_harmonics import polygon_harmonics, polygon_harmonics_with_gradient
from ._scene import Scene
from ._shade import shade
from ._sphere_harmonics import sphere_harmonics, sphere_harmonics_with_gradient
from ._surface import (
    SurfaceSamples,
    project_surface,
    project_surface_with_gradient,
    surface_samples,
)
from ._taylor import project_cube, project_cube_with_gradient, taylor
from ._visible_weights import visible_weights
from ._weights import Weights, inverse_distance_weights, moving_least_squares_weights

__all__ = [
    "EmissiveMesh",
    "Expansion",
    "Grid",
    "Polygon",
    "RadianceCube",
    "Scene",
    "Sphere",
    "SurfaceSamples",
    "Update",
    "Weights",
    "capture",
    "extrapolate",
    "grid_around",
    "interpolate",
    "inverse_distance_weights",
    "make_expansion",
    "monomials",
    "moving_least_squares_weights",
    "place_samples",
    "polygon_harmonics",
    "polygon_harmonics_with_gradient",
    "project_cube",
    "project_cube_with_gradient",
    "project_surface",
    "project_surface_with_gradient",
    "shade",
    "sphere_harmonics",
    "sphere_harmonics_with_gradient",
    "surface_samples",
    "taylor",
    "update_samples",
    "visible_weights",
]
