"""A valid call of every public function and constructor, on small arrays: a table to break."""

import functools

from . import (
    adaptive,
    check,
    geometry,
    harmonics,
    imaging,
    inverse,
    midrange,
    plot,
    sky,
    sphere,
    transfer,
    viewer,
)
from .shared import Call, K

__all__ = ["MADE", "K", "table"]

_MODULES = {
    "_check": check,
    "adaptive": adaptive,
    "geometry": geometry,
    "harmonics": harmonics,
    "imaging": imaging,
    "inverse": inverse,
    "midrange": midrange,
    "plot": plot,
    "sky": sky,
    "sphere": sphere,
    "transfer": transfer,
    "viewer": viewer,
}


@functools.cache
def table(module: str) -> dict[str, Call]:
    """The calls of a module's functions and constructors by name, methods as `Class.method`."""
    return _MODULES[module].calls()


# Classes that functions make: not for a user to make by hand.
MADE = {
    "_check": {"Verdict"},
    "adaptive": {"AbstractMethod", "AdaptiveResult", "StagedTransfer", "Tiling"},
    "inverse": {
        "Confidence",
        "Daylight",
        "Recovered",
        "RecoveredLight",
        "Rectangle",
        "SkyLight",
        "Statistics",
    },
    "geometry": {"BaseColor", "Hit", "Mesh", "RayScene", "RayTree", "Texels", "Topology", "Trace"},
    "imaging": {"Raster"},
    "midrange": {"Update", "Weights"},
    "sky": {"Axis", "FitError", "PreethamConstants", "SkyFit", "SkyWarning", "Solution"},
    "transfer": {
        "AbstractTransfer",
        "CompressedTransfer",
        "QuantizedTransfer",
        "SampledTransfer",
        "StoredTransfer",
        "SunVisibility",
    },
}
