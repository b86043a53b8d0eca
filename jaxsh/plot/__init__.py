"""Pictures of lights and of coefficients, on matplotlib axes.

Every function draws on the axes it is given, or on new ones, and returns them: it neither shows a
figure nor chooses a backend. Arrays may be JAX's or NumPy's; their values are read, so nothing
here works inside `jit`, and nothing differentiates.
"""

from ._bands import bands
from ._light import light
from ._lobes import lobes

__all__ = ["bands", "light", "lobes"]
