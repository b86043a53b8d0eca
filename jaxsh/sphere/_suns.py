"""Compact sources of light apart from the rest: what they are, their rays, their coefficients."""

import functools
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import as_float, check_degree, check_size
from .._core.host import put
from .._core.known import host_known
from .._core.linalg import einsum
from .._core.vectors import checked_rotation, components_first, normalize
from .._core.xla import keep_rows
from ..harmonics import convolve, disc, evaluate

_RAYS = 16


def _array(name: str):
    return eqx.field(converter=lambda value: as_float(value, name))


class Suns(eqx.Module):
    """Holds S small bright sources, far away, apart from the rest of a light.

    - `direction`: (S, 3), towards each one, nonzero, of any length.
    - `solid_angle`: (S,), in steradians, above 0.
    - `radiance`: (S, 3), linear RGB, the mean over the solid angle, in excess of the rest.
    - `shape`: how its light spreads: (S, N, 3) unit vectors in each source's own frame, whose z
      points towards it, each standing for 1/N of its light; None for uniform discs.

    `split_sun` makes them from a picture, with `shape`. They may as well be written down: the sun
    is 6.8e-5 sr wide. S may be 0. A pytree; differentiable in direction and radiance, and in the
    solid angle where they are discs. A `shape` follows a changed direction by itself.
    Raises `ValueError` where shapes do not fit.

    **Example**

    >>> from jaxsh import sphere
    >>> sun = sphere.Suns([[0.6, 0.0, 0.8]], solid_angle=[6.8e-5], radiance=[[9e4, 8e4, 7e4]])
    >>> sun.rays(16).shape, sun.harmonics(degree=2).shape
    ((1, 16, 3), (3, 9))
    """

    direction: Float[Array, "s 3"] = _array("direction")
    solid_angle: Float[Array, " s"] = _array("solid_angle")
    radiance: Float[Array, "s 3"] = _array("radiance")
    shape: Float[Array, "s n 3"] | None = eqx.field(
        default=None, converter=lambda value: None if value is None else as_float(value, "shape")
    )

    def __check_init__(self):
        shapes = self.direction.shape, self.solid_angle.shape, self.radiance.shape
        count = self.solid_angle.shape[:1]
        if shapes != ((*count, 3), count, (*count, 3)):
            raise ValueError(
                f"expected direction (S, 3), solid_angle (S,) and radiance (S, 3), got shapes "
                f"{shapes[0]}, {shapes[1]} and {shapes[2]}"
            )
        shape = self.shape
        if shape is not None and (
            shape.ndim != 3 or shape.shape[::2] != (*count, 3) or not shape.shape[1]
        ):
            raise ValueError(
                f"expected shape of {count[0]} suns as ({count[0]}, N, 3), got shape {shape.shape}"
            )

    @property
    def irradiance(self) -> Float[Array, "s 3"]:
        """Radiance times solid angle: what a small surface facing each of them receives."""
        return self.radiance * self.solid_angle.astype(self.radiance.dtype)[:, None]

    def rays(self, count: int | None = None) -> Float[Array, "s n 3"]:
        """Aim `count` rays at each source, each standing for 1/count of its light.

        Of discs, points on a spiral of equal areas, 16 by default. Of sources with a `shape` of N
        vectors, all N by default, or the middles of N/count neighbors, for which `count` must
        divide N.

        **Returns** (S, count, 3) unit vectors in the dtype of the direction, the same in every
        call. Raises `ValueError` where `count` does not divide N.

        **Example**

        >>> from jaxsh import sphere
        >>> sphere.Suns([[0.0, 0.0, 1.0]], [0.1], [[1.0, 1.0, 1.0]]).rays(64).shape
        (1, 64, 3)
        """
        if self.shape is None:
            count = check_size("count", _RAYS if count is None else count)
        else:
            has = self.shape.shape[1]
            count = has if count is None else check_size("count", count)
            if has % count:
                raise ValueError(f"count must divide the {has} vectors of the shape, got {count}")
        given = (self.direction, self.solid_angle, self.shape)
        if not host_known(*given):
            return _traced_rays(*given, count)
        # A few vectors: NumPy has them before a program is compiled.
        with np.errstate(divide="ignore", invalid="ignore"):
            direction, angle, shape = (None if a is None else np.asarray(a) for a in given)
            return put(_rays(direction, angle, shape, count))

    def harmonics(self, degree: int) -> Float[Array, "3 k"]:
        """Project all of the sources onto the basis: coefficients of their light together.

        Of discs in closed form, otherwise the sum over their rays. Added to those of the rest, they
        are the coefficients of the picture that `split_sun` has split, but for rays that fill
        pixels, which `project_lat_long` takes at their middles, and that may be few: at degree 10
        to 0.3 % of `imaging.studio(64, 128)`.

        **Example**

        >>> from jaxsh import sphere
        >>> moon = sphere.Suns([[0.0, 0.0, 1.0]], [6e-5], [[1.0, 1.0, 1.0]])
        >>> round(float(moon.harmonics(degree=1)[0, 0] / 6e-5), 3)  # √(1/4π)
        0.282
        """
        return _harmonics(self, check_degree(degree))

    def rotate(self, rotation: Float[ArrayLike, "3 3"]) -> "Suns":
        """Turn all of the sources by a rotation matrix R, as `harmonics.rotate` turns a light.

        Raises `ValueError` unless the rotation is (3, 3) and, where it is known, orthogonal.

        **Example**

        >>> import jax.numpy as jnp
        >>> from jaxsh import sphere
        >>> moon = sphere.Suns([[0.0, 0.0, 1.0]], [6e-5], [[1.0, 1.0, 1.0]])
        >>> moon.rotate(jnp.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])).direction.tolist()
        [[1.0, 0.0, 0.0]]
        """
        turn = checked_rotation(rotation).astype(self.direction.dtype)
        if turn.ndim != 2:
            raise ValueError(f"expected rotation (3, 3), got shape {turn.shape}")
        return _rotated(self, turn)


def _rays(direction: Any, solid_angle: Any, shape: Any, count: int) -> Any:
    numpy, dtype = np if isinstance(direction, np.ndarray) else jnp, direction.dtype
    if shape is None:
        local = _spiral(count)
        within = solid_angle.astype(dtype)[:, None] / (2 * np.pi)  # 1 - cos of the rim
        area = numpy.asarray(local[:, 2], dtype)[None] * within
        radius = numpy.sqrt(numpy.maximum(area * (2 - area), 0))
        flat = numpy.asarray(local[:, :2], dtype)[None] * radius[..., None]
        vectors = numpy.concatenate([flat, (1 - area)[..., None]], axis=-1)
    else:
        suns, has, _ = shape.shape
        groups = shape.astype(dtype).reshape(suns, count, has // count, 3)
        vectors = _unit(groups.sum(axis=2)) if count < has else groups[:, :, 0]
    frames = local_frames(direction)
    if numpy is np:
        return np.einsum("sij,snj->sni", frames, vectors)
    return einsum("sij,snj->sni", frames, vectors)


_traced_rays = jax.jit(_rays, static_argnums=3)


@functools.partial(jax.jit, static_argnums=1)
def _harmonics(suns: Suns, degree: int):
    if suns.shape is None:
        light = suns.radiance
        spread = convolve(evaluate(suns.direction, degree), disc(suns.solid_angle, degree))
    else:
        light = suns.irradiance
        spread = evaluate(suns.rays(), degree).mean(axis=1)
    total = functools.partial(einsum, "sc,sk->ck")
    return keep_rows(total, light, spread.astype(light.dtype), like=light, axis=0, out=None)


@jax.jit
def _rotated(suns: Suns, turn):
    direction = einsum("ij,sj->si", turn, suns.direction)
    shape = suns.shape
    if shape is not None:
        before, after = local_frames(suns.direction), local_frames(direction)
        turned = einsum("sji,jk,skl->sil", after, turn, before).astype(shape.dtype)
        shape = einsum("sij,snj->sni", turned, shape)
    return Suns(direction, suns.solid_angle, suns.radiance, shape)


def _unit(vectors: Any) -> Any:
    if isinstance(vectors, np.ndarray):
        vectors = vectors / np.abs(vectors).max(axis=-1, keepdims=True, initial=0)
        return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    unit, _ = normalize(components_first(vectors))
    return unit[:, 0].T.reshape(vectors.shape)


def local_frames(direction: Any) -> Any:
    """Rotations (s, 3, 3) whose last column is the direction (s, 3), in NumPy of NumPy's arrays.

    Duff et al. 2017, "Building an orthonormal basis, revisited", smooth in each of the hemispheres
    about the z axis.
    """
    numpy = np if isinstance(direction, np.ndarray) else jnp
    x, y, z = _unit(direction).T
    sign = numpy.copysign(numpy.ones_like(z), z)
    a = -1 / (sign + z)
    b = x * y * a
    rows = ((1 + sign * x * x * a, b, x), (sign * b, sign + y * y * a, y), (-sign * x, -y, z))
    return numpy.stack([numpy.stack(row, axis=-1) for row in rows], axis=-2)


def _spiral(count: int) -> Float[np.ndarray, "n 3"]:
    """Points of a disc of equal areas: cosine and sine of the azimuth, and the area within."""
    n = np.arange(count)
    angle = np.pi * (3 - np.sqrt(5)) * n
    return np.stack([np.cos(angle), np.sin(angle), (n + 0.5) / count], axis=-1)
