"""Shading read backwards: the light that made the colors of a surface, and how surely.

Every fit gives one `Recovered`: value, result code, statistics and confidence. Each starts from
many places at once, so that it does not end in the wrong valley, and none that has not converged
stays silent.
"""

from ._daylight import Daylight
from ._fit_colors import fit_colors
from ._fit_daylight import fit_daylight
from ._fit_light import fit_light
from ._fit_polygons import fit_polygons
from ._fit_sky import SkyLight, fit_sky
from ._light_prior import light_variances
from ._light_result import RecoveredLight
from ._rectangle import Rectangle, rectangle_of
from ._result import Confidence, Recovered, Statistics

__all__ = [
    "Confidence",
    "Daylight",
    "Recovered",
    "RecoveredLight",
    "Rectangle",
    "SkyLight",
    "Statistics",
    "fit_colors",
    "fit_daylight",
    "fit_light",
    "fit_polygons",
    "fit_sky",
    "light_variances",
    "rectangle_of",
]
