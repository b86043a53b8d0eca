"""Soft shadows of compact sources: the rays from each point of a surface to them, cast once."""

import math
from concurrent.futures import ThreadPoolExecutor

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, UInt32

from .._core.checks import (
    as_float,
    as_host_float,
    check_cosine,
    check_finite,
    check_known,
    check_size,
    check_type,
)
from .._core.devices import Devices, mesh_of, share, whole
from .._core.host import cores, put
from .._core.known import host_known, is_concrete
from ..geometry import Mesh, Points, RayScene, Texels, ray_scene
from ..sphere import Suns
from ._bake._directions import spread
from ._bake._faults import check_mesh, check_surface
from ._bake._origins import origins
from ._bake._receivers import units_of
from ._forms import SampledTransfer
from ._glossy_kernels import unit
from ._transfer import Transfer

Surface = Mesh | Points | Texels | Transfer | SampledTransfer

RAYS = 16
# Points whose rays one thread makes and casts at a time.
_BLOCK = 4096


class SunVisibility(eqx.Module):
    """Holds which of the rays from V points towards S compact sources get out.

    Made by `sun_visibility`, and taken by `shade_sun` in the place of a scene, as often as
    radiance, material or eye change. `seen` tells of the R rays to each source, `draw` which of
    all rays to it the point takes; `direction` and `solid_angle` are the sources'. A pytree.
    Visibility is a step: it is constant to derivatives.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import geometry, sphere, transfer
    >>> sun = sphere.Suns([[0.6, 0.0, 0.8]], solid_angle=[6.8e-5], radiance=[[9e4, 8e4, 7e4]])
    >>> seen = transfer.sun_visibility(sun, geometry.knot(300))
    >>> seen.seen.shape, seen.fraction.shape
    ((300, 1, 16), (300, 1))
    """

    seen: Bool[Array, "v s r"]
    draw: UInt32[Array, " v"]
    direction: Float[Array, "s 3"]
    solid_angle: Float[Array, " s"]

    @property
    def num_points(self) -> int:
        """V."""
        return self.seen.shape[0]

    @property
    def fraction(self) -> Float[Array, "v s"]:
        """The share of each source's rays that get out; those below the surface do not."""
        return jnp.mean(self.seen, axis=-1, dtype=self.solid_angle.dtype)

    def sharded(self, devices: Devices = None) -> "SunVisibility":
        """Share the points out over devices, as `Transfer.sharded` does; what fills up is dark."""
        check_known("visibility", self)
        mesh = mesh_of(devices)
        return SunVisibility(
            share(self.seen, mesh),
            share(self.draw, mesh),
            whole(self.direction, mesh),
            whole(self.solid_angle, mesh),
        )


def sun_visibility(
    suns: Suns,
    surface: Surface,
    scene: RayScene | Mesh | None = None,
    *,
    rays: int | None = None,
    ray_bias: float | None = None,
    offset: float | None = None,
    seed: int = 0,
) -> SunVisibility:
    """Cast rays from every point of a surface towards compact sources, for their soft shadows.

    A point casts `rays` at each source, those alone that leave above its surface, and none where
    the source is below its horizon. Of a disc each point takes the same spiral of equal areas,
    turned about the disc's middle by an angle of its own; of a source with a `shape`, one of each
    group of neighboring vectors. So what is left of the error in a half shadow is noise from point
    to point, where rays that all points share would give bands: 4 % of a disc and 6 % of a `shape`
    (RMS, 16 rays past a straight edge, `tests/transfer/test_sun_visibility.py`). Points at one
    position take the same rays, and a seam does not show.

    **Arguments**

    - `suns`: from `sphere.split_sun`, or written down.
    - `surface`: a `Mesh`, `Texels` or `Points` with normals, or a `Transfer`, also a sampled one.
      Only a mesh and its texels have edges and rims, by which rays start near the surface as the
      bake's do; of points, and of a transfer's, rays start along the normal alone.
    - `scene`: the surfaces that stop rays, a `Mesh` or any `geometry.RayScene`. By default those of
      the mesh itself, or that of the texels, by `geometry.ray_scene(mesh)`, which casts by JAX
      where Embree is not installed. Building it takes as long as some rays: build it once where
      suns move.
    - `rays`: to each source, 16 by default, or all of a `shape` with fewer. For a `shape` of N
      vectors a number that divides N. Of 32 or more some 16 are cast first, and where these agree
      they speak for all: 64 take much less than four times as long.
    - `ray_bias`, `offset`: where rays start off the surface, as for `bake`.
    - `seed`: draws the angles. The same one gives the same bits, whatever the number of threads.

    **Returns** a `SunVisibility`. Raises `ValueError` for arguments and values out of range, for
    points or a transfer without a scene, for points without normals, and under `jit`: runs in NumPy
    on the host, before it.

    **Example**

    >>> from jaxsh import geometry, sphere, transfer
    >>> mesh = geometry.knot(300)
    >>> sun = sphere.Suns([[0.6, 0.0, 0.8]], solid_angle=[6.8e-5], radiance=[[9e4, 8e4, 7e4]])
    >>> visibility = transfer.sun_visibility(sun, mesh, rays=4)
    >>> transfer.shade_sun(sun, mesh, visibility, 0.5).shape
    (300, 3)
    """
    check_suns(suns)
    positions, normals = points_of(surface)
    seed = check_size("seed", seed, least=0)
    count = ray_count(suns, rays)
    if scene is not None:
        check_type("scene", scene, RayScene, Mesh)
    elif not isinstance(surface, Mesh | Texels):
        raise ValueError(
            "expected a scene for points, or those of a transfer, which have no faces that stop "
            "rays: give a mesh or geometry.ray_scene(mesh), or the mesh as the surface"
        )
    for name in ("direction", "solid_angle"):
        as_host_float(getattr(suns, name), f"{name} of the suns")
    given, stopping = surface, scene
    if isinstance(given, Transfer | SampledTransfer):
        given = Mesh(positions, put(np.zeros((0, 3), np.int32)), normals)
    check_surface(given, ray_bias, offset)
    if scene is None:
        stopping = given.mesh if isinstance(given, Texels) else given
    mesh = stopping if isinstance(stopping, Mesh) else None
    if isinstance(scene, Mesh):
        check_mesh("scene", scene)
    caster = ray_scene(mesh) if mesh is not None else stopping
    assert isinstance(caster, RayScene)
    upright = units_of(given)
    start = origins(given, upright, caster, ray_bias, offset, mesh=mesh).positions
    draw = _draws(np.asarray(positions), seed)
    towards, middle = (np.asarray(a, upright.dtype) for a in aimed(suns, count))
    # Of a shape, groups of neighbors. Double: within a small source products differ by little.
    groups = towards.astype(np.float64).reshape(len(middle), count, towards.shape[1] // count, 3)
    groups = groups.mean(axis=2)
    groups /= np.linalg.norm(groups, axis=2, keepdims=True)
    guides = [spread(rays, RAYS if count >= 2 * RAYS else count) for rays in groups]
    seen = np.zeros((len(start), len(middle), count), bool)

    def cast(part: slice) -> None:
        for sun in range(len(middle)):
            vectors = _rays(draw[part], towards[sun], middle[sun], suns, count)
            # Not as a matrix product, whose threads would stand in each other's way.
            a, b, c = (vectors[..., i] * upright[part, None, i] for i in range(3))
            seen[part, sun] = _seen(caster, start[part], vectors, a + b + c > 0, guides[sun])

    # `with jax.enable_x64(True)` holds on its own thread alone.
    double = jnp.result_type(float) == jnp.float64

    def run(part: slice) -> None:
        with jax.enable_x64(double):
            cast(part)

    parts = [slice(first, first + _BLOCK) for first in range(0, len(start), _BLOCK)]
    with ThreadPoolExecutor(cores()) as pool:
        list(pool.map(run, parts))
    return SunVisibility(put(seen), put(draw), suns.direction, suns.solid_angle)


def _seen(scene, start, vectors, above, guides):
    """Finds which rays of each point get out; of many, first some that speak for the rest."""
    seen = np.zeros_like(above)

    def cast(wanted):
        point, ray = np.nonzero(wanted)
        if len(point):
            stopped = scene.occluded(np.take(start, point, axis=0), vectors[point, ray])
            seen[point, ray] = ~stopped

    first = np.zeros_like(above)
    first[:, guides] = above[:, guides]
    cast(first)
    answers = seen[:, guides]
    alike = above.all(axis=1) & (answers == answers[:, :1]).all(axis=1)
    seen[alike] = answers[alike, :1]
    cast(above & ~first & ~alike[:, None])
    return seen


def _rays(draw, towards, middle, suns, count):
    """Makes the rays of each of V points to one source, (V, R, 3)."""
    if suns.shape is not None:
        number = len(towards) // count
        return np.take(towards, np.arange(count) * number + picks(draw, count, number), axis=0)
    along, aside, across = about(towards, middle[None])
    angle = turns(draw).astype(towards.dtype)[:, None, None]
    return along + np.cos(angle) * aside + np.sin(angle) * across


def turns(draw):
    """Makes an angle of each draw."""
    return draw.astype(np.float32) * np.float32(2 * math.pi / 2**32)


def picks(draw, count: int, number: int):
    """Picks one of `number` vectors in each of `count` groups, (V, count), in 32-bit integers."""
    numpy = np if isinstance(draw, np.ndarray) else jnp
    # Odd factors, so that each group's upper bits go their own way.
    factors = (2 * np.arange(count, dtype=np.uint32) + np.uint32(1)) * np.uint32(0x9E3779B9)
    high = (draw[:, None] * numpy.asarray(factors)[None]) >> np.uint32(16)
    return (high * np.uint32(number) >> np.uint32(16)).astype(np.int32)


def about(rays, middle):
    """Takes rays apart: along the middle, aside, and aside after a quarter turn about it."""
    x, y, z = (middle[..., i, None] for i in range(3))
    u, v, w = (rays[..., i, None] for i in range(3))
    along = (x * u + y * v + z * w) * middle
    numpy = np if isinstance(rays, np.ndarray) else jnp
    across = numpy.concatenate([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)
    return along, rays - along, across


def _draws(positions: Float[np.ndarray, "v 3"], seed: int) -> UInt32[np.ndarray, " v"]:
    """Draws a number for each position, the same one wherever it stands in the array."""
    bits = np.ascontiguousarray(positions + 0.0, np.float32).view(np.uint32)  # -0 as 0
    state = np.full(len(bits), seed % 2**32, np.uint32) * np.uint32(0x9E3779B9)
    for word in bits.T:  # the finalizer of MurmurHash3, once for each word
        state = state ^ word
        for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35)):
            state = (state ^ (state >> np.uint32(shift))) * np.uint32(factor)
        state = state ^ (state >> np.uint32(16))
    return state


def aimed(suns: Suns, count: int) -> tuple[Float[Array, "s n 3"], Float[Array, "s 3"]]:
    """Returns rays to each source, all of those with a shape, and the middle that they surround."""
    rays = suns.rays(count if suns.shape is None else None)
    if host_known(suns.direction):
        direction = np.asarray(suns.direction)
        largest = np.abs(direction).max(axis=1, keepdims=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            direction = direction / largest
            direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        return rays, put(np.where((largest > 0) & np.isfinite(largest), direction, 0))
    return rays, _middle(suns.direction)


@jax.jit
def _middle(direction):
    return unit(direction.T).T


def points_of(surface: Surface) -> tuple[Float[Array, "v 3"], Float[Array, "v 3"]]:
    """Returns positions and normals of any surface."""
    check_type("surface", surface, Mesh, Points, Texels, Transfer, SampledTransfer)
    if isinstance(surface, Mesh):
        return as_float(surface.vertices, "vertices"), as_float(surface.normals, "normals")
    if isinstance(surface, Points | Texels):
        if surface.normals is None:
            raise ValueError("expected points with normals, of a surface, got points without")
        return surface.positions, surface.normals
    check_cosine(surface)
    if isinstance(surface, SampledTransfer):
        return surface.positions.T, surface.normals.T
    return surface.positions, surface.normals


def ray_count(suns: Suns, rays: int | None) -> int:
    """Returns how many rays each source gets, which must divide the vectors of a shape."""
    has = None if suns.shape is None else suns.shape.shape[1]
    if rays is None:
        return (
            RAYS if has is None else next(n for n in range(min(RAYS, has), 0, -1) if has % n == 0)
        )
    count = check_size("rays", rays)
    if has is not None and has % count:
        raise ValueError(
            f"rays must divide the {has} vectors that the shape of the suns has, got {count}"
        )
    return count


def check_suns(suns: Suns) -> None:
    """Raises where suns are none, or have values at hand that are not those of small sources."""
    check_type("suns", suns, Suns)
    for name, least in (("direction", None), ("radiance", None), ("solid_angle", 0.0)):
        check_finite(f"{name} of the suns", getattr(suns, name), least=least)
    if is_concrete(suns.direction) and not np.asarray(suns.direction).any(axis=1).all():
        raise ValueError("expected a direction other than zero for each of the suns")
    if is_concrete(suns.solid_angle) and (np.asarray(suns.solid_angle) >= 2 * math.pi).any():
        raise ValueError(
            "expected suns of less than a hemisphere, got a solid angle of "
            f"{np.asarray(suns.solid_angle).max():g}"
        )
