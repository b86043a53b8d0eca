"""Glossy shading for a fixed eye: transfer times lobe, computed once, times light after light."""

import functools
import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import as_finite, check_cosine, check_flag, check_type
from .._core.linalg import in_full, shading_tall_product
from ..harmonics import degree_of, num_coefficients
from ._glossy_kernels import lobe_polynomial, lobe_products, reflection
from ._material import Material, checked_eye, checked_material
from ._transfer import Transfer, checked_degree


class FixedView(eqx.Module):
    """Maps a light to the radiance that V vertices send to one eye: made by `fixed_view`.

    `coefficients` are (V, K), or (V, 3, K) where an albedo differs between the channels. Their
    product with those of a light is radiance.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import transfer
    >>> up = jnp.asarray([[0.0, 0.0, 1.0]])
    >>> made, mirror = transfer.unshadowed(up, up, degree=1), transfer.Material(0.5, 0.5, 8.0)
    >>> view = transfer.fixed_view(made, jnp.asarray([0.0, 0.0, 5.0]), mirror)
    >>> view.degree, view(jnp.ones((2, 3, 4))).shape  # a batch of two lights
    (1, (2, 1, 3))
    """

    coefficients: Float[Array, "v k"] | Float[Array, "v 3 k"]

    @property
    def degree(self) -> int:
        return degree_of(self.coefficients.shape[-1])

    def __call__(self, light: Float[ArrayLike, "... 3 k"]) -> Float[Array, "... v 3"]:
        """Compute the radiance (..., V, 3) towards the eye, as `shade_glossy` does.

        `light` (..., 3, K) is of the view's degree, since `shade_glossy` cuts every function to
        the light's. All vertices share it: axes in front are a batch of lights, and none of them
        stands for the vertices. Bilinear and differentiable. Raises `ValueError` for other shapes,
        and for a light that is at hand and not finite.
        """
        light, width = as_finite(light, "light"), self.coefficients.shape[-1]
        if light.shape[-2:] != (3, width):
            raise ValueError(
                f"expected light (..., 3, {width}), of the view's degree {self.degree}, got "
                f"shape {light.shape}"
            )
        return _shade(self.coefficients, light.astype(self.coefficients.dtype))


@in_full
def fixed_view(
    transfer: Transfer,
    eye: Float[ArrayLike, " 3"],
    material: Material,
    *,
    degree: int | None = None,
    distant: bool = False,
    normalized: bool = True,
) -> FixedView:
    """Compute once all of glossy shading but the product with the light, for one eye.

    `shade_glossy` is linear in the light: Σ_k L_k G_k, where G are the coefficients, at the
    light's degree, of the transfer times ρ_d/π + ρ_s lobe(B·ω). The integral of G with any light
    of that degree is one of three functions, so the result is the same to rounding. A frame is
    then one product with G, which costs what diffuse shading does, or three times that where an
    albedo differs between the channels.

    **Arguments**

    - `transfer`: cut to `degree` (default: all of it), that of the lights to come.
    - `eye`, `material`, `distant`, `normalized`: as for `shade_glossy`.

    **Returns** a `FixedView`, to be called with a light (..., 3, K). Differentiable in all
    arguments, forward and reverse. Raises `ValueError` for shapes that do not fit, and for a
    degree that the transfer does not have.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import transfer
    >>> up = jnp.asarray([[0.0, 0.0, 1.0]])
    >>> made, mirror = transfer.unshadowed(up, up, degree=1), transfer.Material(0.5, 0.5, 8.0)
    >>> view = transfer.fixed_view(made, jnp.asarray([0.0, 0.0, 5.0]), mirror)
    >>> view(jnp.ones((3, 4))).shape
    (1, 3)
    """
    check_type("transfer", transfer, Transfer)
    check_cosine(transfer)
    distant, normalized = check_flag("distant", distant), check_flag("normalized", normalized)
    count, dtype = transfer.num_points, transfer.dtype
    eye, material = checked_eye(eye, dtype), checked_material(material, count, dtype)
    degree = checked_degree(transfer, degree)
    return FixedView(_fixed_view(transfer, eye, material, degree, distant, normalized))


@functools.partial(jax.jit, static_argnames=("degree", "distant", "normalized"))
def _fixed_view(transfer, eye, material, degree, distant, normalized):
    axis = transfer.reflections(eye, distant)
    zonal, specular = reflection(material, axis, transfer.normal_rows(), degree, normalized)
    unit_lights = jnp.eye(num_coefficients(degree), dtype=axis.dtype)
    glossy = lobe_products(unit_lights, transfer, axis, lobe_polynomial(zonal))
    diffuse = transfer.vectors(len(unit_lights))[:, None]
    coefficients = _column(material.diffuse / math.pi) * diffuse
    coefficients += _column(specular) * glossy.T[:, None]
    return coefficients[:, 0] if coefficients.shape[1] == 1 else coefficients


def _column(albedo: Float[Array, "..."]) -> Float[Array, "vertices channels 1"]:
    """Aligns an albedo with coefficients: axes of length 1 for what it does not depend on."""
    return jnp.atleast_2d(albedo)[..., None]


@jax.jit
def _shade(coefficients, light):
    *batch, _, width = light.shape
    rows = light.reshape(math.prod(batch) * 3, width)
    if coefficients.ndim == 3:
        # Each channel's row is zero where the coefficients are another channel's.
        own = jnp.tile(jnp.eye(3, dtype=bool), (math.prod(batch), 1))
        rows = jnp.where(own[..., None], rows[:, None], 0.0).reshape(len(rows), 3 * width)
    products = shading_tall_product(coefficients.reshape(len(coefficients), rows.shape[1]), rows)
    return jnp.moveaxis(products.reshape(len(coefficients), *batch, 3), 0, -2)
