"""Range checks of the sky models: raise, warn or pass."""

import warnings
from typing import Literal, get_args

import numpy as np
from jaxtyping import Array

from .._core.checks import check_choice
from .._core.known import is_concrete

Check = Literal["raise", "warn", "allow"]

# Sines of elevation that rounding may turn negative for a sun on the horizon.
_ROUNDING = 1e-6


class SkyWarning(UserWarning):
    """Warning of a sky model that is used outside of the range it holds in (`check="warn"`).

    **Example**

    >>> import warnings
    >>> import numpy as np
    >>> from jaxsh import sky
    >>> zenith = np.array([0.0, 0.0, 1.0])
    >>> with warnings.catch_warnings(record=True) as said:
    ...     warnings.simplefilter("always")
    ...     _ = sky.preetham_radiance(zenith, zenith, 12.0, check="warn")
    >>> said[0].category is sky.SkyWarning
    True
    """


def check_turbidity(turbidity: Array, check: Check) -> None:
    check_range("turbidity", turbidity, check, 1.7, 10.0)


def check_range(name: str, value: Array, check: Check, low: float, high: float) -> None:
    if check == "allow" or not is_concrete(value):
        return
    values = np.asarray(value, np.float64)
    # Compared in the values' own precision: 1.7 in float32 is in the range.
    slack = float(np.finfo(value.dtype).eps) * high
    bad = ~((values >= low - slack) & (values <= high + slack))
    if bad.any():
        _say(f"{name} must be in [{low:g}, {high:g}], got {values[bad].flat[0]:g}", check)


def check_sun(sun: Array, check: Check) -> None:
    if check == "allow" or not is_concrete(sun):
        return
    vectors = np.asarray(sun, np.float64)
    length = np.linalg.norm(vectors, axis=-1)
    if not length.all():
        raise ValueError("expected sun as a direction, got a vector of length 0")
    sine = vectors[..., 2] / length
    bad = ~(sine >= -_ROUNDING)
    if bad.any():
        elevation = np.degrees(np.arcsin(sine[bad].flat[0]))
        _say(f"the sun must be at 0 to 90 degrees above the horizon, got {elevation:g}", check)


def check_luminance(luminance: Array, check: Check) -> None:
    if check == "allow" or not is_concrete(luminance):
        return
    values = np.asarray(luminance)
    bad = values < 0
    if bad.any():
        _say(
            f"the sky's luminance must be at least 0, but the model gives {values[bad][0]:g}", check
        )


def check_option(check: str) -> None:
    check_choice("check", check, get_args(Check))


def _say(what: str, check: Check) -> None:
    if check == "raise":
        raise ValueError(f'{what}; check="warn" or "allow" computes it all the same')
    warnings.warn(what, SkyWarning, stacklevel=4)
