"""A round light."""

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from .._core.checks import as_float, is_concrete


class Sphere(eqx.Module):
    """A sphere that emits `radiance` outwards, linear RGB (3,), the same everywhere.

    Raises `ValueError` for shapes that do not fit and, where values are known, for numbers that
    are not finite and a radius that is not positive.
    """

    center: Float[Array, " 3"] = eqx.field(converter=as_float)
    radius: Float[Array, ""] = eqx.field(converter=as_float)
    radiance: Float[Array, " 3"] = eqx.field(converter=as_float)

    def __check_init__(self):
        for name, shape in (("center", (3,)), ("radius", ()), ("radiance", (3,))):
            value = getattr(self, name)
            if value.shape != shape:
                raise ValueError(f"expected {name} of shape {shape}, got {value.shape}")
            if is_concrete(value) and not np.isfinite(value).all():
                raise ValueError(f"a sphere's {name} must be finite, got {value}")
        if is_concrete(self.radius) and not self.radius > 0:
            raise ValueError(f"a sphere's radius must be positive, got {self.radius}")
