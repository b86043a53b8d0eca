"""Shading by compact sources, diffuse and glossy, with soft shadows at every vertex."""

import functools
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, check_flag, check_type
from .._core.known import is_concrete
from .._core.linalg import einsum, matmul
from .._core.xla import in_blocks, rows_at_once
from ..geometry import Mesh, RayScene
from ..sphere import Suns
from ._glossy_kernels import reflected, unit
from ._material import Material, checked_albedo, checked_eye, checked_material
from ._sun_disc import disc_irradiance, lobe_over_disc
from ._sun_visibility import (
    SunVisibility,
    Surface,
    about,
    aimed,
    check_suns,
    picks,
    points_of,
    sun_visibility,
    turns,
)

# Vertices whose rays stay in cache, and rays of few vertices that do without a loop: it would take
# longer to compile than it saves.
_BLOCK, _NUMBERS = 1024, 2**21
# Of one direction that was cast for another: what float32 rounds it to, and some.
_TURNED = 1e-5


def shade_sun(
    suns: Suns,
    surface: Surface,
    scene: RayScene | Mesh | SunVisibility | None = None,
    albedo: Float[ArrayLike, "..."] | None = None,
    *,
    material: Material | None = None,
    eye: Float[ArrayLike, " 3"] | None = None,
    shadows: bool = True,
    distant: bool = False,
    normalized: bool = True,
) -> Float[Array, "v 3"]:
    """Compute the radiance that V vertices send on of compact sources, in soft shadows.

    What `sphere.split_sun` took out of a picture, in the units of `shade_diffuse` and
    `shade_glossy`, to be added to theirs under the rest of its light:

        albedo/π Σ_s L_s ∫ V max(0, n·ω) dω + ρ_s Σ_s L_s ∫ V max(0, n·ω) lobe(B·ω) dω

    over each source. Unshadowed, integrals over a disc are exact in the first term, also where the
    horizon cuts it. In the second they are to 3e-4 of the lobe's own or the disc's, however narrow
    the lobe; where the horizon cuts the disc, to 2e-3 up to 0.3 sr and to 8e-3 near a hemisphere
    (`tests/transfer/test_sun.py`). For a source with a `shape` they are sums over its vectors. Of
    this the share remains that rays see, each weighted by its cosine and by the lobe, though none
    narrower than rays tell.

    **Arguments**

    - `suns`: S sources, each of less than a hemisphere; S may be 0.
    - `surface`: a `Mesh`, `Texels` or `Points` with normals, a `Transfer`, or a sampled one.
    - `scene`: what casts the shadows: the result of `sun_visibility`, cast once for these suns and
      this surface; or a `Mesh` or `geometry.RayScene`, with 16 rays to each source and vertex. By
      default the mesh's own, or that of the texels. Points and a transfer have none.
    - `albedo`: of a diffuse surface, as for `shade_diffuse`; or in its place
    - `material` and `eye`, `distant`, `normalized`: as for `shade_glossy`.
    - `shadows`: `False` leaves out visibility, and all rays.

    Light of the sun that bounces is not in it. Where transfer is baked both with bounces and
    without, `shade_diffuse(suns.harmonics(degree), bounces)` adds it, with `bounces` the `Transfer`
    of the difference of their coefficients: what bounces is soft, and few degrees carry it
    (experiment `sloan2002.first_light`).

    **Returns** (V, 3), in the dtype of the surface. Zero where a normal is zero or not finite.
    Linear in radiance and albedos, and differentiable in these, exponent, eye, positions and
    normals, and in direction and solid angle, forward and reverse, with visibility as it was cast:
    that shadows move is not in the slope. In the solid angle of a `shape` the slope is that of its
    light alone. Under `jit`, where suns or surface are traced, give a `SunVisibility` or
    `shadows=False`. Keeps the sharding of the vertices.

    Raises `ValueError` for shapes that do not fit, visibility of another number of vertices or suns
    or of suns elsewhere, and values at hand that are not finite.

    **Example**

    >>> from jaxsh import geometry, sphere, transfer
    >>> mesh = geometry.knot(300)
    >>> sun = sphere.Suns([[0.0, 0.0, 1.0]], solid_angle=[6.8e-5], radiance=[[1e4, 1e4, 1e4]])
    >>> color = transfer.shade_sun(sun, mesh, albedo=0.5)
    >>> color.shape, round(float(color.max()), 3)
    ((300, 3), 0.102)
    """
    check_suns(suns)
    positions, normals = points_of(surface)
    count, dtype = len(positions), positions.dtype
    if (eye is None) != (material is None):
        raise ValueError(
            "a material needs the eye that looks at it, which eye=None does not say"
            if eye is None
            else "expected no eye with an albedo: a diffuse surface looks the same from everywhere"
        )
    shadows, distant = check_flag("shadows", shadows), check_flag("distant", distant)
    normalized = check_flag("normalized", normalized)
    given = checked_material(_material(albedo, material, count, dtype), count, dtype)
    if given.exponent is None:
        raise ValueError(
            "expected a material with an exponent, got a roughness: through a lobe of GGX light of "
            "compact sources is not integrated; give shade_glossy suns.harmonics(degree)"
        )
    eye = None if eye is None else checked_eye(eye, dtype)
    visibility = _visibility(suns, surface, scene, shadows, count)
    rays, middle = aimed(suns, 1 if visibility is None else visibility.seen.shape[2])
    return _shade_sun(
        suns,
        rays,
        middle,
        positions,
        normals,
        visibility,
        given,
        eye,
        distant=distant,
        normalized=normalized,
    )


def _material(albedo, material: Material | None, count: int, dtype) -> Material:
    if material is not None and albedo is None:
        return material
    if material is None and albedo is not None:
        return Material(checked_albedo(albedo, count, dtype), 0.0, 1.0)
    raise ValueError(
        "expected albedo, of a diffuse surface, or material, of a glossy one, got "
        f"{'neither' if albedo is None else 'both'}"
    )


def _visibility(suns, surface, scene, shadows, count) -> SunVisibility | None:
    if not shadows:
        if scene is not None:
            raise ValueError("expected no scene with shadows=False, which casts no rays")
        return None
    if not isinstance(scene, SunVisibility):
        if scene is not None:
            check_type("scene", scene, RayScene, Mesh, SunVisibility)
        return sun_visibility(suns, surface, scene)
    if scene.num_points != count:
        raise ValueError(
            f"the surface has {count} vertices, but visibility is of {scene.num_points}"
        )
    number = len(suns.solid_angle)
    if len(scene.solid_angle) != number:
        raise ValueError(f"there are {number} suns, but visibility is of {len(scene.solid_angle)}")
    if suns.shape is not None and suns.shape.shape[1] % scene.seen.shape[2]:
        raise ValueError(
            f"the suns have a shape of {suns.shape.shape[1]} vectors, but visibility is of "
            f"{scene.seen.shape[2]} rays, which do not divide them"
        )
    for name in ("direction", "solid_angle"):
        given, cast = getattr(suns, name), getattr(scene, name)
        if is_concrete(given) and is_concrete(cast):
            largest = np.abs(np.asarray(cast)).max(initial=0)
            if np.abs(np.asarray(given) - np.asarray(cast)).max(initial=0) > _TURNED * largest:
                raise ValueError(
                    f"visibility was cast for suns of another {name}: call sun_visibility for these"
                )
    return scene


@functools.partial(jax.jit, static_argnames=("distant", "normalized"))
def _shade_sun(
    suns, rays, middle, positions, normals, visibility, material, eye, *, distant, normalized
):
    dtype, shaped = positions.dtype, suns.shape is not None
    upright = unit(normals.astype(dtype).T).T
    rows = {"normals": upright}
    if eye is not None:
        rows["axis"] = reflected(eye, positions, upright, distant).T
        rows["exponent"] = jnp.broadcast_to(material.exponent, (len(positions),))
    if visibility is not None:
        rows |= {"seen": visibility.seen, "draw": visibility.draw}
    # Of each vertex, all held at once on an accelerator: one with each vector of a shape, or some
    # with each ray to a disc, and through the lobe as many again.
    products = (1 if shaped else 4) * math.prod(rays.shape[:2]) * (1 if eye is None else 2)
    rays = rays.astype(dtype) if shaped or visibility is not None else None
    middle, solid_angle = middle.astype(dtype), suns.solid_angle.astype(dtype)

    def block(*some):
        return _integrals(dict(zip(rows, some, strict=True)), rays, middle, solid_angle, shaped)

    most = rows_at_once(products * dtype.itemsize)
    size = max(_BLOCK, _NUMBERS // max(products, 1))
    parts = in_blocks(block, *rows.values(), size=size, most=most)
    radiance = suns.radiance.astype(dtype)
    total = jnp.multiply(*align(matmul(parts[0], radiance), material.diffuse / math.pi))
    if eye is None:
        return total
    lobes = parts[1]
    if normalized:
        lobes = lobes * ((rows["exponent"] + 1) / (2 * math.pi))[:, None]
    return total + jnp.multiply(*align(matmul(lobes, radiance), material.specular))


def _integrals(rows, rays, middle, solid_angle, shaped):
    """Computes what reaches vertices of each source per radiance, and that through their lobes."""
    normals, glossy = rows["normals"], "axis" in rows
    seen, draw = rows.get("seen"), rows.get("draw")
    defined = jnp.any(normals != 0, axis=1)[:, None]
    whole, some = _along(normals, rays, middle, draw, seen, shaped)
    if shaped:
        lit = solid_angle[None] * jnp.mean(jnp.maximum(whole, 0), axis=(2, 3))
    else:
        cosine = jnp.clip(matmul(normals, middle.T), -1, 1)
        lit = jnp.where(defined, disc_irradiance(cosine, solid_angle[None]), 0)
    weights = None if some is None else jnp.maximum(some, 0)
    parts = [lit if weights is None else lit * _share(weights, seen)]
    if glossy:
        axis, exponent = rows["axis"], rows["exponent"]
        at_lobe, some = _along(axis, rays, middle, draw, seen, shaped)
        if shaped:
            lobe = jnp.exp(exponent[:, None, None, None] * _logarithm(at_lobe))
            product = jnp.where(at_lobe > 0, lobe, 0) * jnp.maximum(whole, 0)
            through = solid_angle[None] * jnp.mean(product, axis=(2, 3))
        else:
            through = lobe_over_disc(axis, normals, middle, solid_angle, exponent)
            through = jnp.where(defined, through, 0)
        if weights is not None:
            # Rays tell no lobes apart that are narrower than their own distance.
            finest = math.pi * seen.shape[2] / 2 / solid_angle
            power = jnp.minimum(exponent[:, None], finest[None])[..., None] * _logarithm(some)
            # Of rays above the horizon: beside one below it, theirs might all be next to nothing.
            above = jnp.where(weights > 0, power, -jnp.inf)
            most = jax.lax.stop_gradient(jnp.max(above, axis=2, keepdims=True))
            power = jnp.where(weights > 0, power - most, 0)
            through = through * _share(weights * jnp.exp(power), seen)
        parts.append(through)
    return tuple(parts)


def _along(vectors, rays, middle, draw, seen, shaped) -> tuple[Any, Any]:
    """Computes products of a vector of each vertex with all vectors of a shape, and with its rays.

    The former (V, S, R, N/R), for a disc None; the latter (V, S, R), without visibility None.
    """
    if rays is None:
        return None, None
    if shaped:
        count = 1 if seen is None else seen.shape[2]
        groups = rays.reshape(len(rays), count, rays.shape[1] // count, 3)
        whole = einsum("vi,srgi->vsrg", vectors, groups)
        if seen is None:
            return whole, None
        number = groups.shape[2]
        picked = (
            picks(draw, count, number)[..., None] == jnp.arange(number, dtype=np.int32)[None, None]
        )
        return whole, jnp.sum(jnp.where(picked[:, None], whole, 0), axis=3)
    along, aside, across = (
        einsum("vi,sri->vsr", vectors, part) for part in about(rays, middle[:, None])
    )
    angle = turns(draw).astype(along.dtype)[:, None, None]
    return None, along + jnp.cos(angle) * aside + jnp.sin(angle) * across


def _share(weights, seen):
    """Computes the share of weights that is seen; 1 without any, as above a sliver of a disc."""
    total = jnp.sum(weights, axis=2)
    some = jnp.sum(jnp.where(seen, weights, 0), axis=2)
    return jnp.where(total > 0, some / jnp.where(total > 0, total, 1), 1)


def _logarithm(x):
    least = jnp.finfo(x.dtype).tiny
    return jnp.log(jnp.maximum(x, least))
