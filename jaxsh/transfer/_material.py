"""What a surface does with light."""

import equinox as eqx
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import as_float, is_concrete


def _as_strong(value: ArrayLike) -> Float[Array, "..."]:
    """Of a type of its own, so that numbers and arrays run the same compiled programs."""
    array = as_float(value)
    return array.astype(array.dtype)


class Material(eqx.Module):
    """A diffuse and a Phong-like glossy share of the light, for a mesh of V vertices.

    `diffuse` and `specular` are albedos: a number, RGB (3,), or per vertex (V, 1) or (V, 3).
    `exponent` is that of the glossy lobe, a number or (V,). Differentiable in all three.

    Raises `ValueError` for other shapes, and where values are known and an albedo is not finite
    and >= 0, or an exponent not finite and above -1.
    """

    diffuse: Float[Array, "..."] = eqx.field(converter=_as_strong)
    specular: Float[Array, "..."] = eqx.field(converter=_as_strong)
    exponent: Float[Array, "..."] = eqx.field(converter=_as_strong)

    def __check_init__(self):
        for name in ("diffuse", "specular"):
            array = getattr(self, name)
            if array.ndim > 2 or (
                array.ndim and array.shape[-1] not in ((3,), (1, 3))[array.ndim - 1]
            ):
                raise ValueError(
                    f"expected {name} as a number, (3,), (V, 1) or (V, 3), got shape {array.shape}"
                )
            if is_concrete(array) and not (np.isfinite(array) & (np.asarray(array) >= 0)).all():
                raise ValueError(f"{name} must be finite and >= 0 everywhere")
        if self.exponent.ndim > 1:
            raise ValueError(f"expected exponent as a number or (V,), got {self.exponent.shape}")
        if is_concrete(self.exponent):
            exponent = np.asarray(self.exponent)
            if not (np.isfinite(exponent) & (exponent > -1)).all():
                raise ValueError("exponent must be finite and above -1 everywhere")
        counts = {
            name: len(array)
            for name, array, ndim in (
                ("diffuse", self.diffuse, 2),
                ("specular", self.specular, 2),
                ("exponent", self.exponent, 1),
            )
            if array.ndim == ndim
        }
        if len(set(counts.values())) > 1:
            raise ValueError(f"a material is of one mesh, but its numbers of vertices are {counts}")
