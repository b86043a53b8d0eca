"""The sky by day, whose sun the page moves."""

import dataclasses
import datetime
import math
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._core.checks import as_host_float, check_finite, check_flag, check_number, check_type
from ..harmonics import disc, num_coefficients
from ..sky import (
    preetham_constants,
    preetham_harmonics,
    preetham_table,
    sun_harmonics,
    xyz_to_srgb,
)
from ..sky._sun import SUN_RADIUS, atmosphere

_DEGREE = 6  # of the stored fit
_TURBIDITY = (2.0, 10.0)


@dataclasses.dataclass(frozen=True)
class Sky:
    """Describes a clear sky whose sun is moved in the page, by hand or by date and place.

    Preetham's sky from the stored fit, `sky.preetham_harmonics(sun, turbidity, table="wide")` up
    to degree 6, and the sun's own light, `sky.sun_harmonics`, up to the page's degree. Directions
    are those of a map: x to the east, y to the north, z up.

    - `sun`: (3,), where the sun first stands; of any length, not below the horizon.
    - `turbidity`: the haze at first, 2 to 10.
    - `disc`: False leaves out the sun's own light, and its shadows. The page can switch it.
    - `place`: latitude and longitude in degrees, north and east positive, where the page's date
      and time apply.
    - `time`: the date and time that the page's controls first show: a `datetime` with a time zone
      or a text in ISO form with an offset. They move the sun once they are changed; `sun` may
      be had of them by `sky.sun_direction`.
    - `scale`: a factor on kcd/m². By default the sky is, at first, as bright over the mesh as the
      first of the other lights.

    Raises `ValueError` for values outside of these ranges.

    **Example**

    >>> from jaxsh import viewer
    >>> viewer.Sky(sun=(0.6, -0.6, 0.5), turbidity=4.0).turbidity
    4.0
    """

    sun: Any = (0.55, -0.65, 0.53)
    turbidity: float = 3.0
    disc: bool = True
    place: tuple[float, float] = (48.2, 16.4)
    time: datetime.datetime | str = "2026-06-21T10:00+00:00"
    scale: float | None = None

    def __post_init__(self):
        if checked_sun(self.sun)[2] < 0:
            raise ValueError(f"expected a sun that is not below the horizon, got {self.sun}")
        checked_turbidity(self.turbidity)
        check_flag("disc", self.disc)
        place = as_host_float(self.place, "place").astype(np.float64)
        if place.shape != (2,) or not (abs(place) <= (90, 360)).all():
            raise ValueError(
                "expected place as latitude, -90 to 90, and longitude, -360 to 360, got "
                f"{self.place}"
            )
        _milliseconds(self.time)
        if self.scale is not None:
            check_number("scale", self.scale, above=0.0)


def checked_sun(sun: Any) -> Float[np.ndarray, " 3"]:
    """The direction of a sun, of unit length; raises `ValueError` where it is none."""
    array = as_host_float(sun, "sun").astype(np.float64)
    check_finite("sun", array, wait=True)
    if array.shape != (3,) or not array.any():
        raise ValueError(f"expected sun as a vector (3,) that is not zero, got {sun}")
    return array / np.linalg.norm(array)


def checked_turbidity(turbidity: Any) -> float:
    low, high = _TURBIDITY
    return check_number("turbidity", turbidity, least=low, most=high)


def sky_light(sky: Sky, degree: int) -> Float[np.ndarray, "3 k"]:
    """Compute the coefficients of the first sun and sky, in kcd/m²."""
    sun, turbidity = jnp.asarray(checked_sun(sky.sun), jnp.result_type(float)), float(sky.turbidity)
    own = min(degree, _DEGREE)
    light = np.zeros((3, num_coefficients(degree)))
    known = preetham_harmonics(sun, turbidity, own, table="wide")
    light[:, : known.shape[-1]] = known
    return light + np.asarray(sun_harmonics(sun, turbidity, degree)) if sky.disc else light


def sky_part(sky: Sky, degree: int, gain: float) -> tuple[dict[str, Any], np.ndarray]:
    """List what the page needs to find the light of any sun and turbidity: facts and a table."""
    own = min(degree, _DEGREE)
    fit = preetham_table("wide", own)
    table = np.asarray(fit.coefficients, np.float32)
    constants, air = preetham_constants("paper"), atmosphere()
    zonal = np.asarray(disc(4 * math.pi * math.sin(SUN_RADIUS / 2) ** 2, degree), np.float64)
    bands = zonal * np.sqrt(4 * np.pi / (2 * np.arange(degree + 1) + 1))
    facts = {
        "sun": checked_sun(sky.sun).tolist(),
        "turbidity": float(sky.turbidity),
        "hasDisc": sky.disc,
        "place": [float(x) for x in sky.place],
        "time": _milliseconds(sky.time),
        "gain": gain,
        "degree": own,
        "terms": list(table.shape[2:]),
        "range": list(_TURBIDITY),
        "mix": np.asarray(fit.mix, np.float64).tolist(),
        "constants": {
            "luminance": constants.luminance,
            "x": constants.x,
            "y": constants.y,
            "zenithX": constants.zenith_x,
            "zenithY": constants.zenith_y,
        },
        "disc": {
            "rayleigh": air.rayleigh.tolist(),
            "aerosol": air.aerosol.tolist(),
            "ozone": air.ozone.tolist(),
            "water": air.water.tolist(),
            "colors": (xyz_to_srgb() @ air.weights).tolist(),
            "bands": bands.tolist(),
        },
    }
    return facts, table


def _milliseconds(time: datetime.datetime | str) -> float:
    """Time since 1970 UTC; raises `ValueError` for one without a time zone."""
    check_type("time", time, datetime.datetime, str)
    if isinstance(time, str):
        try:
            time = datetime.datetime.fromisoformat(time)
        except ValueError as error:
            raise ValueError(f"expected time in ISO form, got {time!r}") from error
    if time.tzinfo is None:
        raise ValueError(f"expected time with a time zone, got {time}")
    return 1000 * time.timestamp()
