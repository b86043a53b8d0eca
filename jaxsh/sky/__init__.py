"""Sky light: radiance of daylight, its exact projection, and fits of it (Habel et al. 2008)."""

from ._almanac import sun_direction
from ._cie import cie_radiance
from ._color import xyz_to_srgb
from ._error import FitError, fit_error, smallest_luminance
from ._fit import fit
from ._ground import horizontal_irradiance, with_ground
from ._habel import c_header, habel2008_evaluate, habel2008_fit, habel2008_monomials
from ._hosek import hosek_radiance
from ._preetham import PreethamConstants, preetham_constants, preetham_radiance
from ._preetham_fit import preetham_fit, preetham_harmonics, preetham_table
from ._project import project, project_preetham
from ._sky_fit import Axis, SkyFit
from ._solve import Solution, least_squares
from ._sun import SUN_RADIUS, sun_harmonics, sun_radiance
from ._validity import SkyWarning

__all__ = [
    "SUN_RADIUS",
    "Axis",
    "FitError",
    "PreethamConstants",
    "SkyFit",
    "SkyWarning",
    "Solution",
    "c_header",
    "cie_radiance",
    "fit",
    "fit_error",
    "habel2008_evaluate",
    "habel2008_fit",
    "habel2008_monomials",
    "horizontal_irradiance",
    "hosek_radiance",
    "least_squares",
    "preetham_constants",
    "preetham_fit",
    "preetham_harmonics",
    "preetham_radiance",
    "preetham_table",
    "project",
    "project_preetham",
    "smallest_luminance",
    "sun_direction",
    "sun_harmonics",
    "sun_radiance",
    "with_ground",
    "xyz_to_srgb",
]
