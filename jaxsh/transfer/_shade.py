"""Diffuse and glossy shading, by products of coefficients and sums over directions."""

import functools
import math
from typing import overload

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, as_float, check_cosine, check_flag, check_type
from ..harmonics import degree_of
from ._fluence import received
from ._glossy_kernels import lobe_polynomial, lobe_products, reflected, reflection
from ._material import Material, checked_albedo, checked_eye, checked_light, checked_material
from ._stored import StoredTransfer
from ._streamed import streamed_diffuse, streamed_glossy
from ._transfer import AbstractTransfer


@overload
def shade_diffuse(light, transfer: StoredTransfer, albedo) -> Float[np.ndarray, "... v 3"]: ...


@overload
def shade_diffuse(light, transfer: AbstractTransfer, albedo) -> Float[Array, "... v 3"]: ...


def shade_diffuse(
    light: Float[ArrayLike, "... 3 k"],
    transfer: AbstractTransfer | StoredTransfer,
    albedo: Float[ArrayLike, "..."],
) -> Float[Array | np.ndarray, "... v 3"]:
    """Compute the radiance albedo/π · Σ_k light_k T_k that leaves each of V diffuse vertices.

    **Arguments**

    - `light`: coefficients (3, K) that all vertices share, or with more axes (..., V, 3, K), one
      light for each vertex. So in a batch of shared lights an axis of length 1 takes the vertices'
      place: (batch, 1, 3, K).
    - `transfer`: of the light's degree or above. A lower light is exact, since harmonics are
      orthogonal; a higher one raises, since its upper bands would be dropped silently. The result
      of `quantize` takes less time and memory, and shared lights alone. A `StoredTransfer` is read
      block by block, the next while one is shaded.
    - `albedo`: a number, RGB (3,), or per vertex (V, 1) or (V, 3).

    **Returns** (..., V, 3), in the dtype of the transfer. Linear in light, coefficients and
    albedo, and differentiable in each, forward and reverse; the positions and normals of the
    transfer do not enter. Float32 is multiplied in full, or as `jax.default_matmul_precision` says
    where it is set (`docs/devices.md`). For a `StoredTransfer` a NumPy array, without derivatives
    and outside `jit`.

    Raises `ValueError` for shapes that do not fit, and for a light or an albedo that is at hand
    (`docs/conventions.md`) and not finite, or an albedo below 0.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import transfer
    >>> up = jnp.asarray([[0.0, 0.0, 1.0]])
    >>> sky = jnp.full((3, 1), (4 * jnp.pi) ** 0.5)  # radiance 1 from everywhere
    >>> color = transfer.shade_diffuse(sky, transfer.unshadowed(up, up, degree=0), 0.25)
    >>> color.shape, round(float(color[0, 0]), 4)
    ((1, 3), 0.25)
    """
    check_type("transfer", transfer, AbstractTransfer, StoredTransfer)
    check_cosine(transfer)
    count, dtype = transfer.num_points, transfer.dtype
    light = checked_light(light, count, transfer.degree, dtype)
    albedo = checked_albedo(albedo, count, dtype)
    if isinstance(transfer, StoredTransfer):
        return streamed_diffuse(_shade_diffuse, light, transfer, albedo)
    return _shade_diffuse(light, transfer, albedo)


@jax.jit
def _shade_diffuse(light, transfer, albedo):
    return jnp.multiply(*align(received(light, transfer), albedo / math.pi))


@overload
def shade_glossy(
    light, transfer: StoredTransfer, eye, material, *, distant=..., normalized=...
) -> Float[np.ndarray, "... v 3"]: ...


@overload
def shade_glossy(
    light, transfer: AbstractTransfer, eye, material, *, distant=..., normalized=...
) -> Float[Array, "... v 3"]: ...


def shade_glossy(
    light: Float[ArrayLike, "... 3 k"],
    transfer: AbstractTransfer | StoredTransfer,
    eye: Float[ArrayLike, " 3"],
    material: Material,
    *,
    distant: bool = False,
    normalized: bool = True,
) -> Float[Array | np.ndarray, "... v 3"]:
    """Compute the radiance that V vertices send to the eye, reflected diffusely and glossily.

    Lee & Kim 2014, "Locally adaptive products", equations 2 to 6, with every function cut to the
    light's degree: the product R of light and transfer, convolved with the lobe (bands times α_l),
    and evaluated in the direction B towards the eye, mirrored about the normal:

        ρ_d/π Σ_i L_i O_i + ρ_s Σ_i α_i y_i(B) R_i,   R_i = Σ_j L̂_ij O_j.

    The second sum is ∫ L V max(0, n·ω) lobe(B·ω) dω, since the transfer O holds visibility and
    cosine. An integral of three functions of one degree is a sum over as few directions as
    integrate it exactly, so L̂ need not be built, nor multiplied with. The result is the same to
    rounding.

    **Arguments**

    - `light`: coefficients (3, K) that all vertices share, or with more axes (..., V, 3, K), one
      light for each vertex. So in a batch of shared lights an axis of length 1 takes the vertices'
      place: (batch, 1, 3, K). A batch of shared ones costs little more than one; lights of their
      own cost several times as much.
    - `transfer`: of the light's degree or above, cut to the light's. For frame after frame
      `sample` it at that degree once, which leaves little of the work. Where only the camera
      moves, `fixed_light` has computed R already; where only the light turns, `fixed_view` all
      but the product with it. A `StoredTransfer` is read block by block, the next while one is
      shaded.
    - `eye`: a point, or with `distant` the direction, of any length, to an eye far away.
    - `material`: albedos and lobe, Phong's or GGX's, which is cut to the light's degree.
    - `normalized`: whether Phong's lobe max(0, B·ω)^k is divided by its integral 2π/(k+1).
      Otherwise the bare power, as in the paper.

    The cosine of the transfer stays inside the integral, as in the paper, so the glossy part of a
    normalized lobe is less than the albedo times the mean of light over the lobe: for light of
    radiance 1 from everywhere and nothing in its way it is (k+1)/(k+2) of the albedo where the
    eye looks along the normal, and about n·ω_o of it elsewhere. `Material.modified_phong` makes
    up for that along the normal.

    **Returns** (..., V, 3), in the dtype of the transfer. Vertices that face away from the eye get
    the same formula's value, which nobody sees: B then points into the surface. Where the normal
    is zero or not finite, B is -ω_o; an eye on a vertex is taken to be above it. Linear in light
    and transfer, and differentiable in all arguments, forward and reverse; light that rings below
    zero stays there. For a `StoredTransfer` a NumPy array, without derivatives and outside `jit`.

    Raises `ValueError` for shapes that do not fit, for a sampled transfer of another degree than
    the light's, and for a light or an eye that is at hand (`docs/conventions.md`) and not finite.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import transfer
    >>> up = jnp.asarray([[0.0, 0.0, 1.0]])
    >>> sky = jnp.zeros((3, 4)).at[:, 0].set((4 * jnp.pi) ** 0.5)
    >>> made, mirror = transfer.unshadowed(up, up, degree=1), transfer.Material(0.0, 1.0, 8.0)
    >>> color = transfer.shade_glossy(sky, made, jnp.asarray([0.0, 0.0, 5.0]), mirror)
    >>> color.shape
    (1, 3)
    """
    check_type("transfer", transfer, AbstractTransfer, StoredTransfer)
    check_cosine(transfer)
    count, dtype = transfer.num_points, transfer.dtype
    eye, material = checked_eye(eye, dtype), checked_material(material, count, dtype)
    light = checked_light(light, count, transfer.degree, dtype)
    distant, normalized = check_flag("distant", distant), check_flag("normalized", normalized)
    if isinstance(transfer, StoredTransfer):
        shade = functools.partial(_shade_glossy, distant=distant, normalized=normalized)
        return streamed_glossy(shade, light, transfer, eye, material)
    form = transfer.glossy_form(degree_of(light.shape[-1]))
    return _shade_glossy(light, form, eye, material, distant, normalized)


@functools.partial(jax.jit, static_argnames=("distant", "normalized"))
def _shade_glossy(light, transfer, eye, material, distant, normalized):
    axis = transfer.reflections(eye, distant)
    degree = degree_of(light.shape[-1])
    zonal, specular = reflection(material, axis, transfer.normal_rows(), degree, normalized)
    glossy, irradiance = _gather(light, transfer, axis, lobe_polynomial(zonal))
    diffuse = jnp.multiply(*align(irradiance, material.diffuse / math.pi))
    return diffuse + jnp.multiply(*align(glossy, specular))


def _gather(light, transfer, axis, lobes):
    """Computes what each vertex receives through its lobe and over its hemisphere: (..., V, 3)."""
    *batch, _, width = light.shape
    if len(batch) and batch[-1] != 1:
        # A light of its own meets the product of transfer and lobe, which needs every harmonic.
        unit_lights = jnp.eye(width, dtype=light.dtype)
        products = lobe_products(unit_lights, transfer, axis, lobes).T, transfer.vectors(width)
        return tuple(
            jnp.sum(jnp.multiply(*align(light, product[:, None])), axis=-1) for product in products
        )
    rows = light.reshape(math.prod(light.shape[:-1]), width)
    glossy = lobe_products(rows, transfer, axis, lobes).T
    return tuple(
        jnp.moveaxis(product.reshape(-1, *batch[:-1], 3), 0, -2)
        for product in (glossy, transfer.irradiances(rows))
    )


def reflected_direction(
    eye: Float[ArrayLike, " 3"],
    positions: Float[ArrayLike, "v 3"],
    normals: Float[ArrayLike, "v 3"],
    *,
    distant: bool = False,
) -> Float[Array, "v 3"]:
    """Mirror the direction towards the eye about each normal: B(ω_o) = 2 (n·ω_o) n - ω_o.

    The direction in which glossy shading looks (Lee & Kim 2014, equation 4), always of unit
    length. A normal that is zero or not finite counts as zero, which turns B into -ω_o; an eye on
    the vertex itself is taken to be straight above it.

    **Arguments**

    - `eye`: a point, or with `distant` the direction, of any length, to an eye far away.
    - `positions`, `normals`: of V vertices, normals of any length.

    **Returns** (V, 3). Differentiable in all, forward and reverse. Raises `ValueError` for shapes
    that do not fit.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import transfer
    >>> eye, up = jnp.asarray([3.0, 0.0, 4.0]), jnp.asarray([[0.0, 0.0, 1.0]])
    >>> [round(float(x), 2) for x in transfer.reflected_direction(eye, 0 * up, up)[0]]
    [-0.6, 0.0, 0.8]
    """
    distant = check_flag("distant", distant)
    positions, normals = as_float(positions, "positions"), as_float(normals, "normals")
    if positions.ndim != 2 or positions.shape[1] != 3 or positions.shape != normals.shape:
        raise ValueError(
            f"expected positions and normals (V, 3), got shapes {positions.shape} and "
            f"{normals.shape}"
        )
    eye = checked_eye(eye, positions.dtype)
    return reflected(eye, positions, normals.astype(positions.dtype), distant).T
