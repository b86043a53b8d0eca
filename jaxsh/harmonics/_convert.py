"""Conversion of coefficients between conventions."""

import functools
import itertools
import math

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from .._core.checks import align, as_float
from .._core.host import read_only_cache
from .._core.linalg import matmul
from ._convention import Convention, axes_matrix, places, scales
from ._conventions import look_up
from ._indexing import degrees, num_coefficients, orders
from ._turns import axes_blocks

# Up to this degree one product is faster than one for each band, in spite of the zeros.
_DENSE = 8


def convert(
    coefficients: Float[ArrayLike, "..."], source: str | Convention, target: str | Convention
) -> Float[Array, "..."]:
    """Convert coefficients from one convention to another: the same function, said otherwise.

    **Arguments**

    - `coefficients`: in the layout of the source, any batch in front.
    - `source`, `target`: a name of `conventions()`, or a `Convention`.

    **Returns** the coefficients in the layout of the target, in the dtype that came. Linear, so
    differentiable to any order, and lossless: the way back gives what came, to rounding. Axes are
    turned by exact matrices, at any degree.

    Raises `ValueError` where the shape does not fit the layout or the degree is higher than a
    convention has, and above degree 2 for radiance to irradiance and back: the clamped cosine has
    no band 3, 5, …, which would be lost, or divided by zero. Truncate to degree 2 first, or
    `convolve` with `clamped_cosine`.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import harmonics
    >>> probe = jnp.zeros((9, 3)).at[1].set(1.0)  # three.js: light from above, +y
    >>> light = harmonics.convert(probe, "three.js", "jaxsh")
    >>> light.shape, int(jnp.argmax(light[0]))  # along our z
    ((3, 9), 2)
    """
    source, target = look_up("source", source), look_up("target", target)
    array = as_float(coefficients, "coefficients")
    degree = _check_layout(array.shape, source.layout)
    for name, convention in (("source", source), ("target", target)):
        if convention.degree is not None and degree > convention.degree:
            raise ValueError(
                f"the {name} has coefficients up to degree {convention.degree}, expected no more, "
                f"got degree {degree}"
            )
    _check_channels(array.shape, source.layout, target.layout)
    _check_range(source, target, degree, array.dtype)
    return _convert(array, source, target, degree)


@functools.partial(jax.jit, static_argnums=(1, 2, 3))
def _convert(
    array: Float[Array, "..."], source: Convention, target: Convention, degree: int
) -> Float[Array, "..."]:
    functions = _unpack(array, source, degree)
    matrices = [matrix.astype(array.dtype) for matrix in _matrices(source, target, degree)]
    if matrices[0].ndim == 1:
        functions = jnp.multiply(*align(functions, jnp.asarray(matrices[0])))
    else:
        ends = np.cumsum([0, *map(len, matrices)])
        bands = [functions[..., a:b] for a, b in itertools.pairwise(ends)]
        turned = [matmul(band, matrix.T) for band, matrix in zip(bands, matrices, strict=True)]
        functions = jnp.concatenate(turned, axis=-1) if len(turned) > 1 else turned[0]
    return _pack(functions, target, degree)


@read_only_cache(maxsize=32)
def _matrices(source: Convention, target: Convention, degree: int) -> list[np.ndarray]:
    """Combine all but order and layout: one row of factors, or matrices along the diagonal.

    In float64, so that all is rounded once.
    """
    incoming, outgoing = _factors(source, target, degree)
    turn = _turn(source, target)
    if turn is None:
        return [incoming * outgoing]
    bands = [slice(l * l, (l + 1) ** 2) for l in range(degree + 1)]
    blocks = axes_blocks(turn, degree)
    if degree > _DENSE:
        both = zip(bands, blocks, strict=True)
        return [outgoing[band, None] * block * incoming[band] for band, block in both]
    whole = np.zeros(2 * (len(incoming),))
    for band, block in zip(bands, blocks, strict=True):
        whole[band, band] = block
    return [outgoing[:, None] * whole * incoming]


@read_only_cache(maxsize=32)
def _factors(
    source: Convention, target: Convention, degree: int
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """Factors before and after the axes are turned."""
    incoming = scales(source, degree) * _quantity_factors(source, target, degree)
    return incoming, 1 / scales(target, degree)


@functools.lru_cache(maxsize=32)
def _turn(source: Convention, target: Convention) -> tuple[tuple[int, ...], ...] | None:
    """Find the turn between axes; None where they stay."""
    turn = axes_matrix(target) @ axes_matrix(source).T
    return None if (turn == np.eye(3)).all() else tuple(map(tuple, turn.tolist()))


def _quantity_factors(
    source: Convention, target: Convention, degree: int
) -> Float[np.ndarray, " k"]:
    """Factors that turn one quantity into the other, for each coefficient."""
    per_unit = {"radiance": 1.0, "irradiance": 1.0, "irradiance/pi": math.pi}
    factors = np.full(num_coefficients(degree), per_unit[source.quantity])
    factors = factors / per_unit[target.quantity]
    seen = [convention.quantity != "radiance" for convention in (source, target)]
    if seen[0] == seen[1]:
        return factors
    if degree > 2:
        raise ValueError(
            "between radiance and irradiance expected coefficients up to degree 2, since the "
            f"clamped cosine has no bands 3, 5, …, got degree {degree}"
        )
    lambdas = np.array([math.pi, 2 * math.pi / 3, math.pi / 4])[degrees(degree)]
    return factors / lambdas if seen[0] else factors * lambdas


def _check_range(source: Convention, target: Convention, degree: int, dtype) -> None:
    """Raises `ValueError` where factors are too large or too small for a dtype.

    Elements of a turn may vanish: beside them in their row are others, of which none is lost.
    """
    most, least = float(jnp.finfo(dtype).max), float(jnp.finfo(dtype).tiny)
    incoming, outgoing = _factors(source, target, degree)
    with np.errstate(invalid="ignore"):  # infinite times zero
        if _turn(source, target) is None:
            size = np.abs(incoming * outgoing)
        else:
            ends = [np.array([np.abs(f).min(), np.abs(f).max()]) for f in (incoming, outgoing)]
            size = np.multiply.outer(*ends)
    if not ((size >= least) & (size <= most)).all():
        raise ValueError(
            f"the factors of these conventions do not fit into the dtype {dtype} of "
            "coefficients: expected a lower degree, or float64"
        )


_SHAPES = {
    "coefficients-last": "(..., K)",
    "channels-last": "(..., K, C)",
    "by-channel": "(..., 3·K)",
    "by-coefficient": "(..., 3·K)",
    "cosine-sine": "(..., 2, degree + 1, degree + 1)",
}


def _check_layout(shape: tuple[int, ...], layout: str) -> int:
    """The degree of coefficients in a layout; raises `ValueError` where a shape does not fit."""
    last = (*([0] * 3), *shape)[-3:]
    if layout == "cosine-sine":
        count = last[2] ** 2 if last[0] == 2 and last[1] == last[2] else 0
    elif layout == "coefficients-last":
        count = last[2]
    elif layout == "channels-last":
        count = last[1]
    else:
        count = 0 if last[2] % 3 else last[2] // 3
    degree = math.isqrt(count) - 1
    if degree < 0 or (degree + 1) ** 2 != count:
        raise ValueError(
            f"expected coefficients {_SHAPES[layout]} with K = (degree + 1)² = 1, 4, 9, 16, …, "
            f"layout {layout!r}, got shape {shape}"
        )
    return degree


def _check_channels(shape: tuple[int, ...], source: str, target: str) -> None:
    """Raises `ValueError` where a layout with channels is to be made of what has none, or not 3."""
    channels = {
        "coefficients-last": shape[-2:-1],
        "channels-last": shape[-1:],
        "cosine-sine": shape[-4:-3],
    }.get(source, (3,))
    if target == "channels-last" and not channels:
        raise ValueError(
            f"expected coefficients of some channels for the layout {target!r}, got shape {shape} "
            f"in the layout {source!r}"
        )
    if target in ("by-channel", "by-coefficient") and channels != (3,):
        raise ValueError(
            f"expected coefficients of 3 channels for the layout {target!r}, got shape {shape} in "
            f"the layout {source!r}"
        )


def _unpack(array: Float[Array, "..."], convention: Convention, degree: int) -> Float[Array, "..."]:
    """Bring coefficients into our order on the last axis."""
    layout, count = convention.layout, num_coefficients(degree)
    if layout == "cosine-sine":
        flat = array.reshape(*array.shape[:-3], 2 * count)
        return flat[..., _cosine_sine(degree)]
    if layout == "by-channel":
        array = array.reshape(*array.shape[:-1], 3, count)
    elif layout == "by-coefficient":
        array = array.reshape(*array.shape[:-1], count, 3)
    if layout in ("channels-last", "by-coefficient"):
        array = jnp.swapaxes(array, -1, -2)
    if convention.order == "ascending":
        return array
    return array[..., places(convention, degree)]


def _pack(functions: Float[Array, "..."], convention: Convention, degree: int):
    """Bring coefficients from our order on the last axis into a layout."""
    layout, count = convention.layout, num_coefficients(degree)
    if layout == "cosine-sine":
        slots = _cosine_sine(degree)
        taken, used = np.zeros(2 * count, np.int32), np.zeros(2 * count, bool)
        taken[slots], used[slots] = np.arange(count), True
        used, flat = align(jnp.asarray(used), functions[..., taken])
        flat = jnp.where(used, flat, jnp.zeros_like(flat))
        return flat.reshape(*functions.shape[:-1], 2, degree + 1, degree + 1)
    if convention.order != "ascending":
        functions = functions[..., np.argsort(places(convention, degree))]
    if layout in ("channels-last", "by-coefficient"):
        functions = jnp.swapaxes(functions, -1, -2)
    if layout in ("by-channel", "by-coefficient"):
        return functions.reshape(*functions.shape[:-2], 3 * count)
    return functions


def _cosine_sine(degree: int) -> Int[np.ndarray, " k"]:
    """Places of our coefficients in (2, L+1, L+1), flattened."""
    l, m = degrees(degree), orders(degree)
    return np.where(m < 0, degree + 1, 0) * (degree + 1) + l * (degree + 1) + np.abs(m)
