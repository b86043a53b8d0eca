"""Pictures of lights, coefficients, meshes, skies and errors, on matplotlib axes.

Every function draws on the axes it is given, or on new ones, and returns them: it neither shows a
figure nor chooses a backend. Arrays may be JAX's or NumPy's; their values are read, so nothing
here works inside `jit`, and nothing differentiates.
"""

from ._ball import ball
from ._bands import bands
from ._basis import basis
from ._coefficients import coefficients
from ._dome import dome
from ._error_map import error_map
from ._gradients import gradients
from ._light import light
from ._lobes import balloon, lobes
from ._shaded import shaded
from ._transfer_lobes import transfer_lobes
from ._vertices import vertices

__all__ = [
    "ball",
    "balloon",
    "bands",
    "basis",
    "coefficients",
    "dome",
    "error_map",
    "gradients",
    "light",
    "lobes",
    "shaded",
    "transfer_lobes",
    "vertices",
]
