"""Fits of Preetham's sky, stored and new, in a parametrisation that makes it nearly polynomial."""

import functools
import math
from importlib.resources import as_file, files
from typing import Literal, get_args

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import (
    check_batches,
    check_choice,
    check_degree,
    check_options,
    check_type,
    check_vectors,
)
from .._core.host import read_only_cache
from ..harmonics import window as harmonics_window
from ._angles import kept, zenith_angle
from ._color import xyz_to_srgb
from ._error import smallest_luminance
from ._fit import OPTIONS, fit
from ._preetham import (
    gradation,
    indicatrix,
    preetham_constants,
    preetham_radiance,
    zenith_luminance,
    zenith_value,
)
from ._sky_fit import Axis, SkyFit, check_range, evaluate

Table = Literal["small", "precise", "wide"]
Window = Literal["habel", "sinc", "lanczos", "hann"]

_KINDS: dict[str, Literal["zonal-sinc", "lanczos", "hann"]] = {
    "habel": "zonal-sinc",
    "sinc": "lanczos",
    "lanczos": "lanczos",
    "hann": "hann",
}

# From X, Y and W = X + Y + Z to linear sRGB.
MIX = xyz_to_srgb() @ np.array([[1.0, 0, 0], [0, 1, 0], [-1, -1, 1]])


def preetham_harmonics(
    sun: Float[ArrayLike, "*suns 3"],
    turbidity: Float[ArrayLike, "*turbidities"],
    degree: int = 6,
    *,
    window: Window | None = None,
    table: Table | None = None,
) -> Float[Array, "*out 3 k"]:
    """Coefficients of Preetham's sky without the sun's disc, from a stored fit: (..., 3, K).

    Linear sRGB, kcd/m², the paper's constants (Habel et al. 2008, with a better parametrisation:
    see `preetham_fit`). Far cheaper than `project_preetham`, most of all in a batch: one sun's
    call costs more than its arithmetic. The sun's own light is `sun_harmonics`.

    **Arguments**

    - `sun`: (..., 3), of any length, not below the horizon; `turbidity`: (...). Batches
      broadcast. Differentiable in both: the model's kink where the sun stands in the zenith is
      kept, with a derivative of the zenith's brightness of zero there.
    - `degree`: up to 6.
    - `window`: against ringing. `"habel"` is the paper's zonal sinc (eq. 5), `"sinc"` or
      `"lanczos"` the same on all orders, `"hann"` the strongest; see `harmonics.window`.
    - `table`: by default `"small"` for float32 and `"precise"` for float64.

    | table | terms | turbidity | bytes | worst E_mean (eq. 3), 5 / 7 bands |
    |---|---|---|---|---|
    | small | 12 × 6 | 2.5 to 6 | 24,192 | 0.0033 % / 0.0043 % in float32 |
    | precise | 14 × 8 | 2.5 to 6 | 75,264 | 0.0003 % / 0.0004 % in float64 |
    | wide | 14 × 10 | 2 to 10 | 47,040 | 0.0008 % / 0.0010 % in float64 |

    Out of range: a `ValueError` where values are known, else NaN.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import sky
    >>> sun = np.array([[0.6, 0.0, 0.8], [0.0, 0.8, 0.6]])
    >>> sky.preetham_harmonics(sun, 3.0, degree=4, window="habel").shape
    (2, 3, 25)
    """
    sun = kept(sun, "sun")
    check_vectors("sun", sun)
    turbidity = kept(turbidity, "turbidity").astype(sun.dtype)
    if table is None:
        table = "precise" if sun.dtype == jnp.float64 else "small"
    if window is not None:
        check_choice("window", window, _KINDS)
    degree = check_degree(degree)
    check_batches(sun=sun.shape, turbidity=(*turbidity.shape, 1))
    check_range(stored_axes(table), True, sun, (turbidity,))
    return _harmonics(sun, turbidity, degree, window, table)


@functools.partial(jax.jit, static_argnames=("degree", "window", "table"))
def _harmonics(sun, turbidity, degree: int, window: Window | None, table: Table):
    # The table is a constant of the compiled program, on whatever device that runs.
    coefficients = evaluate(preetham_table(table, degree), sun, (turbidity,))
    if window is None:
        return coefficients
    weights = harmonics_window(_KINDS[window], degree).astype(coefficients.dtype)
    return coefficients * weights.reshape((1,) * (coefficients.ndim - 1) + (-1,))


def preetham_table(table: Table, degree: int = 6) -> SkyFit:
    """Reads one of the stored fits behind `preetham_harmonics`, up to `degree` (at most 6).

    `table`: `"small"`, `"precise"` or `"wide"`. Coefficients are in JAX's default float or the
    table's own, whichever is shorter. Made by `tools/make_sky_table.py`.

    **Example**

    >>> from jaxsh import sky
    >>> stored = sky.preetham_table("small")
    >>> stored.degree, stored.coefficients.shape, stored.axes[1].name
    (6, (3, 28, 12, 6), 'turbidity')
    """
    axes = stored_axes(table)
    # With their type said: JAX 0.10 keeps what it made of a NumPy array in a trace without x64,
    # and gives that float32 again where x64 is on.
    values, mix = (jnp.asarray(a, jnp.result_type(a)) for a in (_stored()[table][0], MIX))
    return SkyFit(values, mix, axes, True, prefactor).truncated(degree)


def stored_axes(table: Table) -> tuple[Axis, ...]:
    check_choice("table", table, get_args(Table))
    return _axes()[table]


@functools.cache
def _axes() -> dict[str, tuple[Axis, ...]]:
    return {table: preetham_axes(*turbidity) for table, (_, turbidity) in _stored().items()}


@read_only_cache(maxsize=None)
def _stored() -> dict[str, tuple[np.ndarray, tuple[float, float]]]:
    """Coefficients and range of turbidity by table, on the host: see `tools/make_sky_table.py`."""
    with as_file(files("jaxsh.sky") / "preetham.npz") as path, np.load(path) as stored:
        return {
            name: (stored[name], tuple(stored[f"{name}_turbidity"].tolist()))
            for name in get_args(Table)
        }


def prefactor(sun: Float[Array, "n 3"], turbidity: Float[Array, " n"]) -> Float[Array, "n 3"]:
    """Divisors of X, Y and W before the fit: p_Y p_x / p_y, p_Y and p_Y / p_y.

    p_q = q_z(θ, τ) / F_q(0, θ) is all of the model that is not smooth where the sun passes the
    zenith, and nearly vanishes at τ ≈ 2, where the rest does not.
    """
    theta, cos_theta, table = zenith_angle(*sun.T), sun[:, 2], preetham_constants("paper")
    # The quantities Y, x and y as rows, so that each function below is one call for all three.
    lines = np.array([table.luminance, table.x, table.y], sun.dtype).T[..., None]
    a, b, c, d, e = (
        slope * turbidity[None] + intercept for slope, intercept in zip(*lines, strict=True)
    )
    zenith = jnp.stack(
        [
            zenith_luminance(theta, turbidity),
            zenith_value(table.zenith_x, theta, turbidity),
            zenith_value(table.zenith_y, theta, turbidity),
        ]
    )
    seen = gradation(a, b, jnp.ones_like(theta)[None]) * indicatrix(
        c, d, e, theta[None], cos_theta[None]
    )
    luminance, x, y = zenith / seen
    return jnp.stack([luminance * x / y, luminance, luminance / y], axis=-1)


def preetham_fit(
    terms: tuple[int, int] = (12, 6),
    turbidity: tuple[float, float] = (2.5, 6.0),
    degree: int = 6,
    *,
    lawson: int = 0,
    **options,
) -> SkyFit:
    """Fits Preetham's sky as `preetham_harmonics` does, with any terms, range and degree.

    X, Y and W = X + Y + Z over their `prefactor`, as sin^m θ · T_i(θ²) T_j(log τ), weighted by
    1/L_min. Linear sRGB, kcd/m², the paper's constants. Further options as for `fit`.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import sky
    >>> fitted = sky.preetham_fit((4, 3), turbidity=(3.0, 4.0), degree=1, solver="qr")
    >>> fitted(np.array([0.6, 0.0, 0.8]), 3.5).shape
    (3, 4)
    """
    check_type("terms", terms, tuple, list)
    check_options("preetham_fit", options, OPTIONS)
    return fit(
        _MODEL,
        {"turbidity": turbidity},
        degree=degree,
        terms=terms,
        log=["turbidity"],
        prefactor=prefactor,
        mix=MIX,
        weight=_weight,
        lawson=lawson,
        **options,
    )


def preetham_axes(low: float, high: float) -> tuple[Axis, ...]:
    """Variables of a `preetham_fit` for turbidities in [low, high]."""
    return (Axis("θ²", 0.0, math.pi**2 / 4), Axis("turbidity", low, high, log=True))


_MODEL = functools.partial(preetham_radiance, check="allow")


def _weight(sun, turbidity):
    return 1 / smallest_luminance(sun, turbidity)[..., 0]
