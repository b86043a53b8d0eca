"""Every public function of arrays at full size: a table to lower for devices that are not here.

`calls()` of each module gives them by the names of `valid_calls`, the same function on something
else after a comma; `WITHOUT` says why a function of that table is not here. What is marked there as
running on the host needs no reason.
"""

import functools
import types

from . import adaptive, geometry, harmonics, imaging, inverse, midrange, sky, sphere, transfer
from .shared import DEGREE, Call, K, V

__all__ = ["DEGREE", "MODULES", "K", "V", "table", "without"]

MODULES: dict[str, types.ModuleType] = {
    "adaptive": adaptive,
    "geometry": geometry,
    "harmonics": harmonics,
    "imaging": imaging,
    "inverse": inverse,
    "midrange": midrange,
    "sky": sky,
    "sphere": sphere,
    "transfer": transfer,
}


@functools.cache
def table(module: str) -> dict[str, Call]:
    """The calls of a module by name."""
    return MODULES[module].calls()


def without(module: str) -> dict[str, str]:
    """Functions of a module that are not lowered, with why."""
    return MODULES[module].WITHOUT
