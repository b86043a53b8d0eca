"""The paper's measure of error, and the readings of the intensity that it is relative to."""

from typing import Literal, NamedTuple, get_args

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, as_float
from .._core.linalg import matmul
from ..sphere import reconstruct
from ._angles import directions, parameter
from ._color import xyz_to_srgb
from ._preetham import preetham_radiance
from ._project import project_preetham

Reading = Literal["luminance", "channel", "harmonics", "range"]

_RINGS, _SPOKES = 61, 120


class FitError(NamedTuple):
    """Relative upper bounds, one per channel; times 100 for per cent."""

    mean: Float[Array, "*batch"]
    max: Float[Array, "*batch"]


def fit_error(
    approximate: Float[ArrayLike, "*batch k"],
    exact: Float[ArrayLike, "*batch k"],
    smallest: Float[ArrayLike, "*lows"],
) -> FitError:
    """E_mean and E_max of Habel et al. 2008, eqs. 3 and 2: (...), one for each channel.

    The 2-norm and the 1-norm of the coefficients' error over L_min, `smallest`, which broadcasts
    against the leading axes. For fewer bands pass fewer coefficients.
    """
    difference = jnp.subtract(*align(as_float(approximate), as_float(exact)))
    low = as_float(smallest)
    mean, largest = jnp.linalg.norm(difference, axis=-1), jnp.sum(jnp.abs(difference), axis=-1)
    return FitError(*(jnp.divide(*align(value, low)) for value in (mean, largest)))


def smallest_luminance(
    sun: Float[ArrayLike, "*suns 3"],
    turbidity: Float[ArrayLike, "*turbidities"],
    *,
    reading: Reading = "luminance",
    degree: int = 6,
) -> Float[Array, "*out 3"]:
    """L_min of Preetham's sky, which the paper leaves undefined, for each linear sRGB channel.

    - `"luminance"`: the smallest luminance of the sky's hemisphere at that sun and turbidity,
      the same for all channels. With it the paper's claims come out as measured.
    - `"channel"`: the smallest of each channel. Blue turns negative near sunset, where this
      reading has no meaning.
    - `"harmonics"`: the smallest luminance of the hemisphere in the projected sky of `degree`,
      the paper's ground truth.
    - `"range"`: the smallest of `"luminance"` over all suns and turbidities given.

    On a grid of 1.5 by 3 degrees from zenith to horizon: up to 1e-3 above the true minimum. Not
    for derivatives.
    """
    if reading not in get_args(Reading):
        raise ValueError(f"reading must be one of {', '.join(get_args(Reading))}, got {reading!r}")
    sun = directions(sun, "sun")
    turbidity = parameter(turbidity, sun.dtype)
    batch = jnp.broadcast_shapes(sun.shape[:-1], turbidity.shape)
    suns = jnp.broadcast_to(align(sun, jnp.zeros((*batch, 1)))[0], (*batch, 3)).reshape(-1, 3)
    numbers = jnp.broadcast_to(align(turbidity, jnp.zeros(batch))[0], batch).reshape(-1)
    views = _hemisphere(sun.dtype)
    if reading == "harmonics":
        coefficients = project_preetham(suns, numbers, degree, space="xyz", check="allow")
        smallest = jax.lax.map(lambda c: reconstruct(c, views).min(axis=-1), coefficients[:, 1:2])
    else:
        luminance, channel = jax.lax.map(
            lambda row: _smallest(views, *row), (suns, numbers), batch_size=16
        )
        smallest = channel if reading == "channel" else luminance
    if reading == "range":
        smallest = jnp.broadcast_to(smallest.min(), smallest.shape)
    return jnp.broadcast_to(smallest, (len(suns), 3)).reshape(*batch, 3)


def _smallest(views, sun, turbidity):
    xyz = preetham_radiance(views, sun, turbidity, space="xyz", check="allow")
    srgb = matmul(xyz, jnp.asarray(xyz_to_srgb().T, xyz.dtype))
    return xyz[:, 1:2].min(axis=0), srgb.min(axis=0)


def _hemisphere(dtype) -> Float[Array, "n 3"]:
    """From the zenith to the horizon itself, both included."""
    theta = np.linspace(0, np.pi / 2, _RINGS)[:, None]
    phi = 2 * np.pi * np.arange(_SPOKES) / _SPOKES
    z = np.broadcast_to(np.maximum(np.cos(theta), 0), (_RINGS, _SPOKES))
    views = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), z], axis=-1)
    return jnp.asarray(views.reshape(-1, 3), dtype)
