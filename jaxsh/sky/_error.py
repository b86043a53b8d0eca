"""Error measure of Habel et al. 2008, and readings of the intensity that it is relative to."""

import functools
from typing import Literal, NamedTuple, get_args

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import (
    align,
    as_finite,
    as_float,
    check_batches,
    check_choice,
    check_coefficients,
    check_degree,
)
from .._core.host import read_only_cache
from .._core.linalg import matmul
from ..sphere import reconstruct
from ._angles import directions, each_sun
from ._color import xyz_to_srgb
from ._preetham import preetham_radiance
from ._project import project_preetham

Reading = Literal["luminance", "channel", "harmonics", "range"]

_RINGS, _SPOKES = 61, 120


class FitError(NamedTuple):
    """Upper bounds of a fit's error relative to L_min, one per channel; times 100 for percent.

    `mean` is E_mean, eq. 3 of Habel et al. 2008, `max` is E_max, eq. 2. Made by `fit_error`.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import sky
    >>> error = sky.fit_error(np.zeros((3, 4)), np.ones((3, 4)), 1.0)
    >>> [round(float(bound[0]), 3) for bound in (error.mean, error.max)]
    [2.0, 4.0]
    """

    mean: Float[Array, "*batch"]
    max: Float[Array, "*batch"]


def fit_error(
    approximate: Float[ArrayLike, "*batch k"],
    exact: Float[ArrayLike, "*batch k"],
    smallest: Float[ArrayLike, "*lows"],
) -> FitError:
    """Errors E_mean and E_max of Habel et al. 2008, eqs. 3 and 2: (...), one for each channel.

    The 2-norm and the 1-norm of the coefficients' error over L_min, `smallest`, which broadcasts
    against the leading axes. For fewer bands pass fewer coefficients. Differentiable, but for the
    2-norm where the error is zero. Raises `ValueError` for shapes that do not fit.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import sky
    >>> sun = np.array([0.6, 0.0, 0.8])
    >>> fitted, exact = sky.preetham_harmonics(sun, 3.0, 2), sky.project_preetham(sun, 3.0, 2)
    >>> error = sky.fit_error(fitted, exact, sky.smallest_luminance(sun, 3.0))
    >>> bool(100 * error.mean.max() < 0.005)
    True
    """
    approximate, exact = as_float(approximate, "approximate"), as_float(exact, "exact")
    low = as_float(smallest, "smallest")
    check_coefficients("approximate", approximate)
    if approximate.shape[-1:] != exact.shape[-1:]:
        raise ValueError(
            f"expected approximate and exact of one degree, got shapes {approximate.shape} and "
            f"{exact.shape}"
        )
    check_batches(approximate=approximate.shape, exact=exact.shape, smallest=(*low.shape, 1))
    difference = jnp.subtract(*align(approximate, exact))
    mean, largest = jnp.linalg.norm(difference, axis=-1), jnp.sum(jnp.abs(difference), axis=-1)
    return FitError(*(jnp.divide(*align(value, low)) for value in (mean, largest)))


def smallest_luminance(
    sun: Float[ArrayLike, "*suns 3"],
    turbidity: Float[ArrayLike, "*turbidities"],
    *,
    reading: Reading = "luminance",
    degree: int = 6,
) -> Float[Array, "*out 3"]:
    """Smallest intensity L_min of Preetham's sky, for each linear sRGB channel: (..., 3), kcd/m².

    Habel et al. 2008 divide by it in eqs. 2 and 3 and leave it undefined. `reading` is one of:

    - `"luminance"`: the smallest luminance of the sky's hemisphere at that sun and turbidity,
      the same for all channels. With it the paper's claims come out as measured.
    - `"channel"`: the smallest of each channel. Blue turns negative near sunset, where this
      reading has no meaning.
    - `"harmonics"`: the smallest luminance of the hemisphere in the projected sky of `degree`,
      the paper's ground truth.
    - `"range"`: the smallest of `"luminance"` over all suns and turbidities given.

    On a grid of 1.5 by 3 degrees from zenith to horizon: up to 1e-3 above the true minimum. Not
    for derivatives. Batches of sun and turbidity broadcast; `degree` is that of the third reading.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import sky
    >>> sky.smallest_luminance(np.array([0.6, 0.0, 0.8]), 3.0).shape
    (3,)
    """
    check_choice("reading", reading, get_args(Reading))
    sun = directions(sun, "sun")
    turbidity = as_finite(turbidity, "turbidity", dtype=sun.dtype)
    check_batches(sun=sun.shape, turbidity=(*turbidity.shape, 1))
    return _smallest(sun, turbidity, reading, check_degree(degree))


@functools.partial(jax.jit, static_argnames=("reading", "degree"))
def _smallest(sun, turbidity, reading: Reading, degree: int):
    views = jnp.asarray(_hemisphere(), sun.dtype)

    def of_harmonics(sun, turbidity):
        luminance = project_preetham(sun, turbidity, degree, space="xyz", check="allow")[1]
        return jnp.broadcast_to(reconstruct(luminance, views).min(), (3,))

    def of_radiance(sun, turbidity):
        xyz = preetham_radiance(views, sun, turbidity, space="xyz", check="allow")
        if reading == "channel":
            return matmul(xyz, jnp.asarray(xyz_to_srgb().T, xyz.dtype)).min(axis=0)
        return jnp.broadcast_to(xyz[:, 1].min(), (3,))

    function, size = (of_harmonics, 1) if reading == "harmonics" else (of_radiance, 16)
    smallest = each_sun(function, sun, turbidity, size=size, most=1024)
    return jnp.full_like(smallest, smallest.min()) if reading == "range" else smallest


@read_only_cache(maxsize=None)
def _hemisphere() -> Float[np.ndarray, "n 3"]:
    """Views from the zenith to the horizon itself, both included."""
    theta = np.linspace(0, np.pi / 2, _RINGS)[:, None]
    phi = 2 * np.pi * np.arange(_SPOKES) / _SPOKES
    z = np.broadcast_to(np.maximum(np.cos(theta), 0), (_RINGS, _SPOKES))
    views = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), z], axis=-1)
    return views.reshape(-1, 3)
