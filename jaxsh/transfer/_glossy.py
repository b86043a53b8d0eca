"""Diffuse and glossy shading, in full (Lee & Kim 2014, equations 2 to 6)."""

import functools
import math

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align
from .._core.linalg import tall_product
from ..harmonics import degree_of
from ._checks import checked_eye, checked_light, checked_material
from ._light_product import LightProduct, seen
from ._lobe import lobe_polynomial, mirrored, reflected
from ._lobe_products import lobe_products
from ._material import Material
from ._quantized import QuantizedTransfer
from ._sampled import SampledTransfer
from ._transfer import Transfer


def shade_glossy(
    light: Float[ArrayLike, "... 3 k"] | None,
    transfer: Transfer | SampledTransfer | LightProduct,
    eye: Float[ArrayLike, " 3"],
    material: Material,
    *,
    distant: bool = False,
    normalized: bool = True,
) -> Float[Array, "... v 3"]:
    """Radiance that leaves each of V vertices towards the eye, reflected diffusely and glossily.

    Lee & Kim 2014, "Locally adaptive products", equations 2 to 6, with every function cut to the
    light's degree: the product R of light and transfer, convolved with the lobe (bands times α_l),
    and evaluated in the direction B towards the eye, mirrored about the normal:

        ρ_d/π Σ_i L_i O_i + ρ_s Σ_i α_i y_i(B) R_i,   R_i = Σ_j L̂_ij O_j.

    The second sum is ∫ L O lobe(B·ω) dω, and an integral of three functions of one degree is a
    sum over as few directions as integrate it exactly. So it is computed: L̂ need not be built,
    nor multiplied with. The result is the same to rounding.

    **Arguments**

    - `light`: coefficients (3, K) that all vertices share, or with more axes (..., V, 3, K), one
      light for each vertex. So in a batch of shared lights an axis of length 1 takes the vertices'
      place: (batch, 1, 3, K). A batch of shared ones costs little more than one; lights of their
      own cost several times as much.
    - `transfer`: of the light's degree or above, cut to the light's. For frame after frame
      `sample` it at that degree once, which leaves little of the work. Where only the camera
      moves, a `LightProduct` holds R already, and `light` is None; where only the light turns,
      an `eye_product` takes the place of this function.
    - `eye`: a point, or with `distant` the direction, of any length, to an eye far away.
    - `material`: albedos and the lobe's exponent. The lobe is cut to the light's degree.
    - `normalized`: whether the lobe max(0, B·ω)^k integrates to one (λ_0 = 1), so that the glossy
      part is the albedo times a mean of incoming light, and equal to it where light times
      transfer is one everywhere. Otherwise the bare power, as in the paper.

    **Returns** (..., V, 3), in the dtype of the transfer. Light through the transfer carries the
    cosine of the transfer, as in the paper. Vertices that face away from the eye get the same
    formula's value, which nobody sees: B then points into the surface. Where the normal is zero
    or not finite, B is -ω_o; an eye on a vertex is taken to be above it. Linear in light and
    transfer, and differentiable in all arguments, forward and reverse; light that rings below
    zero stays there.

    Raises `ValueError` for shapes that do not fit, and for a sampled transfer of another degree
    than the light's.
    """
    if isinstance(transfer, QuantizedTransfer):
        raise ValueError("glossy shading needs a transfer, or samples of it, not its eight bits")
    held = transfer.irradiance if isinstance(transfer, LightProduct) else transfer.coefficients
    count, dtype = held.shape[0], held.dtype
    eye, material = checked_eye(eye, dtype), checked_material(material, count, dtype)
    if isinstance(transfer, LightProduct):
        if light is not None:
            raise ValueError("a LightProduct holds its light: expected light None beside it")
    elif light is None:
        raise ValueError("expected a light: only a LightProduct holds its own")
    else:
        light = checked_light(light, count, transfer.degree, dtype)
        degree = degree_of(light.shape[-1])
        if isinstance(transfer, SampledTransfer) and degree != transfer.degree:
            raise ValueError(
                f"expected a light of the sampled transfer's degree, {transfer.degree}, got "
                f"{degree}; sample the transfer at that degree"
            )
    return _shade_glossy(light, transfer, eye, material, distant, normalized)


@functools.partial(jax.jit, static_argnames=("distant", "normalized"))
def _shade_glossy(light, transfer, eye, material, distant, normalized):
    mirror = reflected if isinstance(transfer, Transfer) else mirrored
    axis = mirror(eye, transfer.positions, transfer.normals, distant)
    if isinstance(transfer, LightProduct):
        glossy, irradiance = seen(transfer, axis, material.exponent, normalized)
    else:
        lobes = lobe_polynomial(material.exponent, degree_of(light.shape[-1]), normalized)
        glossy, irradiance = _gather(light, transfer, axis, lobes)
    diffuse = jnp.multiply(*align(irradiance, material.diffuse / math.pi))
    return diffuse + jnp.multiply(*align(glossy, material.specular))


def _gather(light, transfer, axis, lobes):
    """What each vertex receives through its lobe, and over its hemisphere: (..., V, 3) both."""
    *batch, _, width = light.shape
    coefficients = transfer.coefficients[:, :width]
    if len(batch) and batch[-1] != 1:
        # A light of its own meets the product of transfer and lobe, which needs every harmonic.
        unit_lights = jnp.eye(width, dtype=light.dtype)
        products = lobe_products(unit_lights, transfer, axis, lobes).T, coefficients
        return tuple(
            jnp.sum(jnp.multiply(*align(light, product[:, None])), axis=-1) for product in products
        )
    rows = light.reshape(math.prod(light.shape[:-1]), width)
    glossy = lobe_products(rows, transfer, axis, lobes).T
    return tuple(
        jnp.moveaxis(product.reshape(-1, *batch[:-1], 3), 0, -2)
        for product in (glossy, tall_product(coefficients, rows))
    )
