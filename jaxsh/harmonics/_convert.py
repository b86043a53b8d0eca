"""Conversion of coefficients between conventions."""

import functools
import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, as_float, described
from .._core.linalg import matmul
from ._convention import Convention, axes_matrix, places, scales
from ._conventions import look_up
from ._indexing import degrees, num_coefficients, orders
from ._turns import axes_blocks


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
    functions, degree = _unpack(as_float(coefficients, "coefficients"), source)
    for name, convention in (("source", source), ("target", target)):
        if convention.degree is not None and degree > convention.degree:
            raise ValueError(
                f"the {name} has coefficients up to degree {convention.degree}, expected no more, "
                f"got degree {degree}"
            )
    factors = _factors(source, target, degree)
    incoming, outgoing = scales(source, degree), 1 / scales(target, degree)
    turn = axes_matrix(target) @ axes_matrix(source).T
    if (turn == np.eye(3)).all():
        scale = _rounded(incoming * outgoing * factors, functions.dtype)
        functions = jnp.multiply(*align(functions, scale))
    else:
        bands = []
        for l, block in enumerate(axes_blocks(tuple(map(tuple, turn.tolist())), degree)):
            band = slice(l * l, (l + 1) ** 2)
            matrix = outgoing[band, None] * block * (incoming * factors)[band]
            bands.append(matmul(functions[..., band], _rounded(matrix, functions.dtype).T))
        functions = jnp.concatenate(bands, axis=-1)
    return _pack(functions, target, degree)


def _factors(source: Convention, target: Convention, degree: int) -> Float[np.ndarray, " k"]:
    """Multiply to turn one quantity into the other, for each coefficient."""
    factor = np.ones(num_coefficients(degree))
    if source.quantity == target.quantity:
        return factor
    lambdas = np.array([math.pi, 2 * math.pi / 3, math.pi / 4])
    for convention, power in ((source, -1), (target, 1)):
        if convention.quantity == "irradiance/pi":
            factor = factor / math.pi**power
    crossed = (source.quantity == "radiance") != (target.quantity == "radiance")
    if not crossed:
        return factor
    if degree > 2:
        raise ValueError(
            "between radiance and irradiance expected coefficients up to degree 2, since the "
            f"clamped cosine has no bands 3, 5, …, got degree {degree}"
        )
    lambdas = lambdas[degrees(degree)]
    return factor * lambdas if source.quantity == "radiance" else factor / lambdas


def _rounded(values: Float[np.ndarray, "..."], dtype) -> Float[Array, "..."]:
    """Round to a dtype what was computed in float64, or say that it does not fit."""
    with np.errstate(over="ignore", under="ignore"):
        rounded = values.astype(dtype)
    least = float(jnp.finfo(dtype).tiny)
    if not np.isfinite(rounded).all() or (np.abs(values[values != 0]) < least).any():
        raise ValueError(
            f"the factors of these conventions do not fit into the dtype {np.dtype(dtype)} of "
            "coefficients: expected a lower degree, or float64"
        )
    return jnp.asarray(rounded)


def _unpack(array: Float[Array, "..."], convention: Convention):
    """Bring coefficients into our order on the last axis, and find their degree."""
    shape, layout = array.shape, convention.layout
    expected, count, channels = "(..., K)", 0, 1
    if layout == "coefficients-last":
        count = shape[-1] if shape else 0
    elif layout == "channels-last":
        expected, count = "(..., K, C)", shape[-2] if len(shape) > 1 else 0
    elif layout == "cosine-sine":
        expected = "(..., 2, degree + 1, degree + 1)"
        if len(shape) > 2 and shape[-3] == 2 and shape[-2] == shape[-1]:
            count = shape[-1] ** 2
    else:
        expected, channels = "(..., 3·K)", 3
        count = shape[-1] // 3 if shape and shape[-1] % 3 == 0 else 0
    degree = math.isqrt(count) - 1
    if degree < 0 or (degree + 1) ** 2 != count:
        raise ValueError(
            f"expected coefficients {expected} with K = (degree + 1)² = 1, 4, 9, 16, …, layout "
            f"{layout!r}, got shape {shape}"
        )
    if layout == "channels-last":
        array = jnp.swapaxes(array, -1, -2)
    elif layout == "by-channel":
        array = array.reshape(*shape[:-1], channels, count)
    elif layout == "by-coefficient":
        array = jnp.swapaxes(array.reshape(*shape[:-1], count, channels), -1, -2)
    elif layout == "cosine-sine":
        flat = array.reshape(*shape[:-3], 2 * count)
        return flat[..., _cosine_sine(degree)], degree
    if convention.order != "ascending" and (
        convention.degree is None or degree <= convention.degree
    ):
        array = array[..., places(convention, degree)]
    return array, degree


def _pack(functions: Float[Array, "... k"], convention: Convention, degree: int):
    """Bring coefficients from our order on the last axis into a layout."""
    layout, count = convention.layout, num_coefficients(degree)
    if layout == "cosine-sine":
        slots = _cosine_sine(degree)
        taken = np.zeros(2 * count, np.int32)
        taken[slots] = np.arange(count)
        used = np.zeros(2 * count, bool)
        used[slots] = True
        used, flat = align(jnp.asarray(used), functions[..., taken])
        flat = jnp.where(used, flat, jnp.zeros_like(flat))
        return flat.reshape(*functions.shape[:-1], 2, degree + 1, degree + 1)
    if convention.order != "ascending":
        functions = functions[..., np.argsort(places(convention, degree))]
    if layout == "coefficients-last":
        return functions
    if functions.ndim < 2 or (layout != "channels-last" and functions.shape[-2] != 3):
        channels = "C" if layout == "channels-last" else "3"
        raise ValueError(
            f"expected coefficients of {channels} channels for the layout {layout!r}, (..., "
            f"{channels}, K) in ours, got {described(functions)}"
        )
    if layout != "by-channel":
        functions = jnp.swapaxes(functions, -1, -2)
    if layout == "channels-last":
        return functions
    return functions.reshape(*functions.shape[:-2], 3 * count)


@functools.cache
def _cosine_sine(degree: int) -> np.ndarray:
    """Places of our coefficients in (2, L+1, L+1), flattened."""
    l, m = degrees(degree), orders(degree)
    return np.where(m < 0, degree + 1, 0) * (degree + 1) + l * (degree + 1) + np.abs(m)
