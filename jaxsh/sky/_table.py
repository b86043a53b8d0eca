"""The shipped fits of Preetham's sky."""

import functools
from importlib.resources import as_file, files
from pathlib import Path
from typing import Literal, get_args

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from ..harmonics import window as harmonics_window
from ._angles import directions
from ._preetham_fit import MIX, preetham_axes, prefactor
from ._sky_fit import SkyFit

Table = Literal["small", "precise", "wide"]
Window = Literal["habel", "sinc", "lanczos", "hann"]

_KINDS: dict[str, Literal["zonal-sinc", "lanczos", "hann"]] = {
    "habel": "zonal-sinc",
    "sinc": "lanczos",
    "lanczos": "lanczos",
    "hann": "hann",
}
_FILE = "preetham.npz"


def preetham_harmonics(
    sun: Float[ArrayLike, "*suns 3"],
    turbidity: Float[ArrayLike, "*turbidities"],
    degree: int = 6,
    *,
    window: Window | None = None,
    table: Table | None = None,
) -> Float[Array, "*out 3 k"]:
    """Coefficients of Preetham's sky without the sun's disc, from a stored fit: (..., 3, K).

    Linear sRGB, kcd/m², the paper's constants. Far cheaper than
    `project_preetham`, most of all in a batch: one sun's call costs more than its arithmetic.

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
    """
    sun = directions(sun, "sun")
    if table is None:
        table = "precise" if sun.dtype == jnp.float64 else "small"
    coefficients = preetham_table(table, degree)(sun, turbidity)
    if window is None:
        return coefficients
    if window not in _KINDS:
        raise ValueError(f"window must be one of {', '.join(_KINDS)} or None, got {window!r}")
    weights = harmonics_window(_KINDS[window], degree).astype(coefficients.dtype)
    return coefficients * weights.reshape((1,) * (coefficients.ndim - 1) + (-1,))


def preetham_table(table: Table, degree: int = 6) -> SkyFit:
    """A stored fit, read when it is first used: see `preetham_harmonics`."""
    if table not in get_args(Table):
        raise ValueError(f"table must be one of {', '.join(get_args(Table))}, got {table!r}")
    return _load(table, degree, jnp.result_type(float))


@functools.lru_cache(maxsize=16)
def _load(table: Table, degree: int, default) -> SkyFit:
    # Kept for each default float type, which arrays are read in. And where the first use is inside
    # of a trace, these are constants and no tracers.
    with (
        jax.ensure_compile_time_eval(),
        as_file(files("jaxsh.sky") / _FILE) as path,
    ):
        return read_tables(path)[table].truncated(degree)


def write_tables(path: Path, tables: dict[Table, SkyFit]) -> None:
    """Coefficients and the range of turbidity of each: all that is not in the code."""
    arrays = {}
    for name, fit in tables.items():
        arrays[name] = np.asarray(fit.coefficients, np.float64 if name == "precise" else np.float32)
        arrays[f"{name}_turbidity"] = np.array([fit.axes[1].low, fit.axes[1].high])
    np.savez(path, **arrays)


def read_tables(path: Path) -> dict[str, SkyFit]:
    with np.load(path) as stored:
        return {
            name: SkyFit(
                jnp.asarray(stored[name]),
                jnp.asarray(MIX),
                preetham_axes(*stored[f"{name}_turbidity"].tolist()),
                True,
                prefactor,
            )
            for name in get_args(Table)
        }
