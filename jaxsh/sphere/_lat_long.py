"""Lat-long pictures: projection and reconstruction that separate into rows and meridians.

Since y_lm(θ, φ) = P_lm(θ) · cos or sin(|m|φ), a picture's sums along its rows, one per order, are
all that its coefficients need: W·H·(2L+1) + H·K multiplications in place of W·H·K.
"""

import functools

import jax
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import as_float, check_coefficients, check_degree, check_size
from .._core.host import read_only_cache
from .._core.linalg import einsum
from .._core.pictures import as_radiance, check_result, check_shape
from .._core.xla import keep_rows
from ..harmonics import degree_of, degrees, index, legendre, orders
from ._quadrature import fejer_weights


def project_lat_long(image: Float[ArrayLike, "h w c"], degree: int) -> Float[Array, "c k"]:
    """Project a lat-long picture onto the basis: light from an environment map.

    **Arguments**

    - `image`: (H, W, C), linear radiance in floats, about twice as wide as high. Row 0 touches
      +z, column 0 starts at φ = 0 and φ grows to the right (`docs/conventions.md`).
    - `degree`: the largest l, known at trace time.

    **Returns** coefficients (C, K) in the dtype of the picture, exact for a picture of a function
    of degree D where degree + D < H and degree + D < W; the weights are those of `lat_long`.
    Linear and differentiable. Rows, columns or channels may be sharded over a mesh; inside
    `shard_map` a part of a picture would pass for a whole one, so only channels may be. Raises
    `ValueError` for a picture too small for the degree (height and width must be above 2·degree),
    for integers, which are to be decoded first, for a picture less than 1.5 times as wide as high,
    or with its channels first, and, on a CPU, for one with NaN or infinite values. Any other grid
    goes through `project` with `lat_long(H, W)`.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import sphere
    >>> light = sphere.project_lat_long(jnp.ones((8, 16, 3)), degree=2)
    >>> light.shape, round(float(light[0, 0]), 3)  # √(4π)
    ((3, 9), 3.545)
    """
    image, degree = as_radiance("image", image), check_degree(degree)
    check_shape("image", image.shape, lat_long=True)
    height, width, _ = image.shape
    if min(height, width) <= 2 * degree:
        raise ValueError(
            f"an image of {height} rows and {width} columns is too small for degree "
            f"{degree}: both must be above {2 * degree}"
        )
    coefficients = _project(image, degree)
    check_result("image", image, coefficients)
    return coefficients


def reconstruct_lat_long(
    coefficients: Float[ArrayLike, "c k"], height: int, width: int
) -> Float[Array, "h w c"]:
    """Draw functions as a lat-long picture, sampled at the pixel centers: (C, K) -> (H, W, C).

    Linear and differentiable. The inverse of `project_lat_long` on large enough pictures. Raises
    `ValueError` where K is not a square or a size is not an integer >= 1.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import sphere
    >>> sphere.reconstruct_lat_long(jnp.zeros((3, 9)), height=4, width=8).shape
    (4, 8, 3)
    """
    coefficients = as_float(coefficients, "coefficients")
    if coefficients.ndim != 2:
        raise ValueError(f"expected coefficients (channels, K), got shape {coefficients.shape}")
    check_coefficients("coefficients", coefficients)
    height, width = check_size("height", height), check_size("width", width)
    return _reconstruct(coefficients, height, width)


@functools.partial(jax.jit, static_argnums=1)
def _project(image, degree: int):
    height, width, _ = image.shape
    meridians, azimuths = _tables(height, width, degree)
    weights = fejer_weights(height) * 2 * np.pi / width

    def sums(image):
        along_rows = einsum("hwc,mw->mhc", image, azimuths.astype(image.dtype))
        return einsum("mhc,mlh->cml", along_rows, (meridians * weights).astype(image.dtype))

    def over_columns(image):
        return keep_rows(sums, image, like=image, axis=1, out=None)

    padded = keep_rows(over_columns, image, like=image, axis=0, out=None)
    l, m = degrees(degree), orders(degree)
    return padded[:, m + degree, l]


@functools.partial(jax.jit, static_argnums=(1, 2))
def _reconstruct(coefficients, height: int, width: int):
    degree = degree_of(coefficients.shape[-1])
    meridians, azimuths = _tables(height, width, degree)
    # A coefficient (l, m) with l < |m| does not exist: whatever is there meets a zero meridian.
    place = np.array(
        [[index(max(l, abs(m)), m) for l in range(degree + 1)] for m in range(-degree, degree + 1)],
        dtype=np.int32,
    )
    dtype = coefficients.dtype
    along_rows = einsum("cml,mlh->mhc", coefficients[:, place], meridians.astype(dtype))
    return einsum("mhc,mw->hwc", along_rows, azimuths.astype(dtype))


@read_only_cache(maxsize=32)
def _tables(
    height: int, width: int, degree: int
) -> tuple[Float[np.ndarray, "m l h"], Float[np.ndarray, "m w"]]:
    """Meridians P_lm by order, degree and row, zero where l < |m|; azimuths cos mφ or sin |m|φ."""
    theta = (np.arange(height) + 0.5) * np.pi / height
    phi = (np.arange(width) + 0.5) * 2 * np.pi / width
    meridians = np.zeros((2 * degree + 1, degree + 1, height))
    meridians[orders(degree) + degree, degrees(degree)] = legendre(np.cos(theta), degree)
    m = np.arange(-degree, degree + 1)[:, None]
    return meridians, np.where(m < 0, np.sin(-m * phi), np.cos(m * phi))
