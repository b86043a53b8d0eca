"""The sphere: quadratures, lat-long pictures, and the way from functions to coefficients."""

from ._lat_long import project_lat_long, reconstruct_lat_long
from ._project import irradiance, project, reconstruct
from ._quadrature import Quadrature, cube_map, fibonacci, gauss_legendre, lat_long
from ._split_sun import split_sun
from ._suns import Suns

__all__ = [
    "Quadrature",
    "Suns",
    "cube_map",
    "fibonacci",
    "gauss_legendre",
    "irradiance",
    "lat_long",
    "project",
    "project_lat_long",
    "reconstruct",
    "reconstruct_lat_long",
    "split_sun",
]
