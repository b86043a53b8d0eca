"""Moments Σ_n y_i(ω_n) dω_n f_n of functions on a cube's texels, by the cube's symmetry.

A half turn takes each face of `cube_map` to the opposite one, texel by texel, and a reflection
each face's upper rows to its lower ones. Every y_lm is even or odd under both. So sums and
differences of the four texels that belong together need a table of one quarter of the texels, and
of each combination only the y_lm of its own parity: a quarter of the table and of the products.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._core.host import read_only_cache
from .._core.linalg import matmul
from .._core.xla import device_cache
from ..harmonics import degrees, evaluate, orders
from ._cube import texels

# Tables: one for each pair of faces x, y, z, each parity in the turn, and each in the reflection.
Tables = tuple[Float[Array, "_ m"], ...]


class _Parity(NamedTuple):
    """Names the y_lm that a table holds."""

    axis: int
    rows: Int[np.ndarray, " rows"]


@device_cache(maxsize=16)
def moment_tables(resolution: int, degree: int, dtype) -> Tables:
    """y_i dω at a quarter of the texels, kept: they are worth their memory (§4.2 of the paper)."""
    cube, part = texels(resolution), (slice(None), 0, slice(_rows(resolution) * resolution))
    shape = 3, 2, resolution**2
    # By NumPy, which has nothing to compile.
    vectors = np.asarray(cube.directions).reshape(*shape, 3)[part]
    weights = np.asarray(cube.weights).reshape(shape)[part]
    table = np.asarray(evaluate(vectors, degree, axis=0)) * weights
    parts = [table[each.rows, each.axis] for each in _parities(resolution, degree)]
    return tuple(jnp.asarray(part, dtype) for part in parts)


def moments(
    tables: Tables, columns: Float[Array, "n c"], resolution: int, degree: int
) -> Float[Array, "k c"]:
    """All columns' moments up to the tables' degree."""
    folded = _fold(columns, resolution)
    products = [matmul(t, f) for t, f in zip(tables, folded, strict=True)]
    rows = np.concatenate([each.rows for each in _parities(resolution, degree)])
    order = np.argsort(rows, kind="stable").reshape(-1, 3).T
    x, y, z = (jnp.concatenate(products)[i] for i in order.astype(np.int32))
    return x + y + z


def _rows(resolution: int) -> int:
    """Rows of a face that are left: a middle row has no other to be folded on."""
    return resolution if resolution % 2 else resolution // 2


def _fold(columns: Float[Array, "n c"], resolution: int) -> list[Float[Array, "m c"]]:
    """Sums and differences of texels that belong together, in the order of the tables."""
    count, half = columns.shape[1], _rows(resolution)
    faces = columns.reshape(3, 2, resolution, resolution * count)
    result = []
    for first, second in faces:
        for turned in (first + second, first - second):
            if half == resolution:
                parts = [turned]
            else:
                upper, lower = turned[:half], turned[half:][::-1]
                parts = [upper + lower, upper - lower]
            result += [part.reshape(half * resolution, count) for part in parts]
    return result


@read_only_cache(maxsize=32)
def _parities(resolution: int, degree: int) -> list[_Parity]:
    l, m = degrees(degree), orders(degree)
    y, z = (
        np.where(m < 0, -1, 1),
        1 - 2 * ((l + m) % 2),
    )  # under the reflections y -> -y and z -> -z
    x = (1 - 2 * (m % 2)) * y
    about_y, about_x = x * z, y * z  # under half turns
    result = []
    for axis, (turn, reflection) in enumerate([(about_y, y), (about_x, z), (about_y, y)]):
        for a in (1, -1):
            for b in (1, -1) if resolution % 2 == 0 else (None,):
                rows = np.flatnonzero((turn == a) & ((reflection == b) | (b is None)))
                result.append(_Parity(axis, rows.astype(np.int32)))
    return result
