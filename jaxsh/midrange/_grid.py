"""A grid of samples, and the cells between them."""

import functools
import itertools
import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from .._core.checks import as_finite, check_size, described
from .._core.known import is_concrete
from .._core.xla import on_mesh, rounded_once
from ._expansion import check_positions
from ._weights import Cells, Weights

_BLOCK = 128
_CORNERS = np.array(list(itertools.product((0, 1), repeat=3)), np.int32)


class Grid(eqx.Module):
    """Describes samples at even steps between two corners: Greger et al. 1998's irradiance volume.

    `shape` counts samples along x, y and z, at least two each. Samples are numbered with z
    fastest and x slowest.

    Raises `ValueError` for a shape that is not three such integers, and for bounds out of order
    where their values are known.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> grid = midrange.Grid(-jnp.ones(3), jnp.ones(3), (2, 2, 3))
    >>> grid.size, grid.points.shape
    (12, (12, 3))
    """

    lower: Float[Array, " 3"] = eqx.field(converter=lambda v: as_finite(v, "lower", wait=True))
    upper: Float[Array, " 3"] = eqx.field(converter=lambda v: as_finite(v, "upper", wait=True))
    shape: tuple[int, int, int] = eqx.field(static=True)

    def __check_init__(self):
        _check_shape(self.shape)
        if self.lower.shape != (3,) or self.upper.shape != (3,):
            raise ValueError(
                f"expected bounds (3,), got shapes {self.lower.shape} and {self.upper.shape}"
            )
        known = is_concrete(self.lower) and is_concrete(self.upper)
        if known and not np.all(np.asarray(self.lower) < np.asarray(self.upper)):
            bounds = np.asarray(self.lower).tolist(), np.asarray(self.upper).tolist()
            raise ValueError(f"expected lower < upper, got {bounds[0]} and {bounds[1]}")

    @property
    def points(self) -> Float[Array, "s 3"]:
        """Positions of the samples."""
        steps = np.stack([i.ravel() for i in np.indices(self.shape)], axis=-1)
        share = jnp.asarray(steps / (np.array(self.shape) - 1), self.lower.dtype)
        return self.lower[None] * (1 - share) + self.upper[None] * share

    def weights(self, positions: Float[ArrayLike, "v 3"]) -> Weights:
        """Weigh the eight samples around each position trilinearly.

        They sum to one and reproduce linear functions, Σ w_j (x - p_j) = 0, so the rule "half"
        of `interpolate` fits. Outside the grid they are those of the nearest cell, carried on:
        still linear, so a position that rounding puts outside is served as well as the others,
        but negative, and growing with the distance.

        The positions are sorted by cell, too, which is what makes shading fast. It takes longer
        than the shading: make the weights once where mesh and grid move together.

        **Returns** sparse `Weights` (V, 8) in the dtype of `positions`; those of a single cell,
        which all positions share, are dense, and so are those of positions on a mesh of devices,
        since sorting would gather them. Differentiable in positions and bounds; across the
        faces of cells there is a kink.

        Raises `ValueError` unless positions are (V, 3).
        """
        positions = check_positions(positions)
        if positions.ndim != 2:
            raise ValueError(f"expected positions (V, 3), got shape {positions.shape}")
        lower, upper = self.lower.astype(positions.dtype), self.upper.astype(positions.dtype)
        if on_mesh(positions):
            return Weights(_dense(positions, lower, upper, self.shape))
        values, cell = _trilinear(positions, lower, upper, self.shape)
        samples = self._samples()
        if len(samples) == 1:
            return Weights(values)
        rows, place = _sorted(cell, len(samples))
        return Weights(values, Cells(jnp.asarray(samples), cell, rows, place, self.size))

    @property
    def size(self) -> int:
        """Number of samples."""
        return math.prod(self.shape)

    def _samples(self) -> Int[np.ndarray, "c 8"]:
        """The samples at the corners of each cell."""
        numbers = np.arange(self.size, dtype=np.int32).reshape(self.shape)
        spans = [n - 1 for n in self.shape]
        corners = [
            numbers[i : i + spans[0], j : j + spans[1], k : k + spans[2]] for i, j, k in _CORNERS
        ]
        return np.stack([corner.ravel() for corner in corners], axis=-1)


def grid_around(positions: Float[ArrayLike, "v 3"], shape: tuple[int, int, int]) -> Grid:
    """Make a grid for an object: the box of its positions, drawn in to cos(π/2n) along each axis.

    n samples are so far apart as n roots of Chebyshev's polynomial: what is extrapolated at the
    border errs no more than what is interpolated, in one dimension. The whole box puts samples
    where there is no object, and nearer to the lights.

    Raises `ValueError` as `Grid` does: for one, where the box is flat.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> grid = midrange.grid_around(jnp.array([[-1.0, -1, -1], [1, 1, 1]]), (2, 2, 2))
    >>> round(float(grid.upper[0]), 3)
    0.707
    """
    positions = check_positions(positions)
    _check_shape(shape)
    if not positions.size:
        raise ValueError(f"expected positions of at least one point, got shape {positions.shape}")
    lower, upper = (bound(positions.reshape(-1, 3), axis=0) for bound in (jnp.min, jnp.max))
    share = jnp.asarray([math.cos(math.pi / (2 * n)) for n in shape], positions.dtype)
    middle, half = (lower + upper) / 2, (upper - lower) / 2 * share
    return Grid(middle - half, middle + half, shape)


def _check_shape(shape: tuple[int, int, int]) -> None:
    if not isinstance(shape, tuple) or len(shape) != 3:
        raise ValueError(f"expected shape as a tuple of three integers, got {described(shape)}")
    for count in shape:
        check_size("each number of the shape", count, 2)


@functools.partial(jax.jit, static_argnums=3)
def _trilinear(
    positions: Float[Array, "v 3"],
    lower: Float[Array, " 3"],
    upper: Float[Array, " 3"],
    shape: tuple[int, int, int],
) -> tuple[Float[Array, "v 8"], Int[Array, " v"]]:
    """Weights of the corners of the cell that each position is in, and that cell."""
    spans = np.array(shape, np.int32) - 1
    whole, share = rounded_once(functools.partial(_places, spans=spans), positions, lower, upper)
    sides = jnp.stack([1 - share, share])
    x, y, z = (sides[_CORNERS[:, axis], :, axis] for axis in range(3))
    cell = (whole[:, 0] * spans[1] + whole[:, 1]) * spans[2] + whole[:, 2]
    return (x * y * z).T, cell


def _places(positions, lower, upper, spans):
    """The cell of each position along each axis, and where in it, (V, 3) each."""
    scaled = (positions - lower[None]) / (upper - lower)[None]
    scaled = scaled * jnp.asarray(spans, positions.dtype)[None]
    whole = jnp.clip(jnp.floor(scaled).astype(jnp.int32), 0, spans[None] - 1)
    return whole, scaled - whole.astype(positions.dtype)


@functools.partial(jax.jit, static_argnums=3)
def _dense(
    positions: Float[Array, "v 3"],
    lower: Float[Array, " 3"],
    upper: Float[Array, " 3"],
    shape: tuple[int, int, int],
) -> Float[Array, "v s"]:
    """The same weights for all samples, most of them zero."""
    places = functools.partial(_places, spans=np.array(shape, np.int32) - 1)
    whole, share = rounded_once(places, positions, lower, upper)
    along = []
    for axis, count in enumerate(shape):
        sample, cell = np.arange(count, dtype=np.int32)[None], whole[:, axis, None]
        part = share[:, axis, None]
        along.append(jnp.where(sample == cell, 1 - part, jnp.where(sample == cell + 1, part, 0)))
    x, y, z = along
    products = x[:, :, None, None] * y[:, None, :, None] * z[:, None, None, :]
    return products.reshape(len(positions), math.prod(shape))


@functools.partial(jax.jit, static_argnums=1)
def _sorted(
    cell: Int[Array, " v"], count: int
) -> tuple[Int[Array, "blocks size"], Int[Array, " v"]]:
    """`rows` and `place` of `Cells`. As many blocks as may be needed, whatever the cells."""
    size = len(cell)
    blocks = size // _BLOCK + min(count, size)
    order = jnp.argsort(cell).astype(jnp.int32)
    held = jnp.zeros(count, jnp.int32).at[cell].add(1)
    needed = (held + _BLOCK - 1) // _BLOCK
    shift = (jnp.cumsum(needed) - needed) * _BLOCK - (jnp.cumsum(held) - held)
    place = jnp.arange(size, dtype=jnp.int32) + shift[cell[order]].astype(jnp.int32)
    rows = jnp.full(blocks * _BLOCK, size, jnp.int32).at[place].set(order)
    return rows.reshape(blocks, _BLOCK), jnp.zeros(size, jnp.int32).at[order].set(place)
