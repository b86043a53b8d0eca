"""Every public function of arrays at full size: a table to lower for devices that are not here.

`calls()` of each module gives them by the names of `valid_calls`; `WITHOUT` says why a function of
that table is not here. All that runs on the host there needs no reason here.
"""

import functools
import types

from . import harmonics
from .shared import DEGREE, Call, K, V

__all__ = ["DEGREE", "MODULES", "K", "V", "table", "without"]

MODULES: dict[str, types.ModuleType] = {
    "harmonics": harmonics,
}


@functools.cache
def table(module: str) -> dict[str, Call]:
    """The calls of a module by name."""
    return MODULES[module].calls()


def without(module: str) -> dict[str, str]:
    """Functions of a module that are not lowered, with why."""
    return MODULES[module].WITHOUT
