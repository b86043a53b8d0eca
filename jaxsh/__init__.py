"""Spherical-harmonic lighting in JAX.

Each module below loads when it is first used, so that ``import jaxsh`` costs little beyond
``import jax``:

>>> import jaxsh
>>> jaxsh.harmonics.evaluate([[0.0, 0.0, 1.0]], degree=1).shape
(1, 4)
"""

import importlib as _importlib
from typing import TYPE_CHECKING as _TYPE_CHECKING

if _TYPE_CHECKING:
    from . import adaptive as adaptive
    from . import geometry as geometry
    from . import harmonics as harmonics
    from . import imaging as imaging
    from . import inverse as inverse
    from . import midrange as midrange
    from . import plot as plot
    from . import sky as sky
    from . import sphere as sphere
    from . import transfer as transfer
    from . import viewer as viewer
    from ._check import Verdict as Verdict
    from ._check import check as check

__all__ = [
    "Verdict",
    "adaptive",
    "check",
    "geometry",
    "harmonics",
    "imaging",
    "inverse",
    "midrange",
    "plot",
    "sky",
    "sphere",
    "transfer",
    "viewer",
]
__version__ = "0.1.0"


# What is no module but stands at the top, and where it is defined.
_ELSEWHERE = {"Verdict": "_check", "check": "_check"}


def __getattr__(name: str):
    if name in _ELSEWHERE:
        return getattr(_importlib.import_module(f".{_ELSEWHERE[name]}", __name__), name)
    if name in __all__:
        return _importlib.import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has {__all__}")


def __dir__():
    return [*__all__, "__version__"]
