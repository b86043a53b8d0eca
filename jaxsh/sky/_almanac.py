"""Direction of the sun from date and place."""

import contextlib
import datetime
import math
from collections.abc import Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import as_host_float, check_flag, described

Time = datetime.datetime | str | ArrayLike | Sequence[Any]

_DAY = 86400.0
_EPOCH = 25567.5  # 1970-01-01 00:00 UTC in PyEphem's days, which start at noon, 1899-12-31
_FIRST, _LAST = 1000, 3000  # years in which it was compared with pvlib's SPA
_START, _END = ((year - 1970) * 365.2425 * _DAY for year in (_FIRST, _LAST + 1))
_PRESSURE, _CELSIUS = 1013.25, 12.0
_SAID = "a datetime with a time zone, ISO text with an offset, or seconds since 1970-01-01 UTC"
_ZONE = "for UTC give datetime(…, tzinfo=datetime.UTC), or text that ends in Z or +00:00"


def sun_direction(
    time: Time,
    latitude: Float[ArrayLike, "*latitudes"],
    longitude: Float[ArrayLike, "*longitudes"],
    *,
    refraction: bool = False,
) -> Float[Array, "*out 3"]:
    """Looks up where the sun stands at a time and place: unit vectors (..., 3), z up.

    **x points east, y north, z to the zenith**: at altitude a and azimuth A, counted from north
    over east, (cos a sin A, cos a cos A, sin a). Below the horizon z is negative. The axes are
    those of a map: a scene whose north is elsewhere is turned about z.

    **Arguments**

    - `time`: a `datetime` with a time zone, ISO text with an offset (`"2026-06-21 12:00+02:00"`),
      seconds since 1970-01-01 UTC (`datetime.timestamp()`), or an array or list of those, (...).
      Years 1000 to 3000. Without a time zone a `datetime`, a text and NumPy's `datetime64` are
      refused: they would be hours off.
    - `latitude` in [-90, 90], north positive, `longitude` in [-180, 360], east positive: degrees,
      (...). Shapes broadcast.
    - `refraction`: True lifts the sun to where the air shows it, by 0.02° at an altitude of 40°
      and 0.5° on the horizon (sea level, 1013.25 hPa, 12 °C). False gives the straight line.

    Computed by PyEphem (`pip install ephem`, or the extra `sun`), seen from sea level. It agrees
    with NREL's solar position algorithm (Reda and Andreas 2004; pvlib 0.16) to 0.0005° over the
    years 1000 to 3000. On the host, 0.03 ms a direction, so not differentiable.

    **Returns** directions in JAX's default float type. Raises `ValueError` for times and places as
    said, and `ImportError` where PyEphem is not installed.

    **Example**

    >>> import importlib.util
    >>> from jaxsh import sky
    >>> if importlib.util.find_spec("ephem"):
    ...     hours = [f"2026-06-21T{hour:02d}:00+02:00" for hour in range(6, 21)]
    ...     suns = sky.sun_direction(hours, 48.137, 11.575)  # a day in Munich
    ...     assert suns.shape == (15, 3) and suns[0, 0] > 0 > suns[-1, 0]  # from east to west
    """
    refraction = check_flag("refraction", refraction)
    seconds = _seconds(time)
    latitude = _degrees("latitude", latitude, -90.0, 90.0)
    longitude = _degrees("longitude", longitude, -180.0, 360.0)
    try:
        each = np.broadcast_arrays(seconds, latitude, longitude)
    except ValueError:
        raise ValueError(
            f"shapes must broadcast, got time {seconds.shape}, latitude {latitude.shape} and "
            f"longitude {longitude.shape}"
        ) from None
    found = _look_up(np.stack([array.ravel() for array in each], axis=-1), refraction)
    altitude, azimuth = np.moveaxis(found.reshape(*each[0].shape, 2), -1, 0)
    across = np.cos(altitude)
    east, north = across * np.sin(azimuth), across * np.cos(azimuth)
    return jnp.asarray(
        np.stack([east, north, np.sin(altitude)], axis=-1), dtype=jnp.result_type(float)
    )


def _look_up(instants: Float[np.ndarray, "n 3"], refraction: bool) -> Float[np.ndarray, "n 2"]:
    """Altitude and azimuth from north over east, radians."""
    try:
        import ephem
    except ImportError as error:
        raise ImportError(
            "sky.sun_direction needs the package PyEphem, which is not installed here: "
            "`pip install ephem`"
        ) from error

    observer, sun = ephem.Observer(), ephem.Sun()
    observer.pressure, observer.temp = _PRESSURE if refraction else 0.0, _CELSIUS
    found = np.empty((len(instants), 2))
    for row, (second, latitude, longitude) in enumerate(instants.tolist()):
        observer.lat, observer.lon = math.radians(latitude), math.radians(longitude)
        observer.date = second / _DAY + _EPOCH
        sun.compute(observer)
        found[row] = sun.alt, sun.az
    return found


def _degrees(name: str, value: Any, least: float, most: float) -> np.ndarray:
    array = as_host_float(value, name).astype(np.float64)
    wrong = array[~((array >= least) & (array <= most))]  # also NaN
    if wrong.size:
        raise ValueError(f"{name} must be degrees in [{least:g}, {most:g}], got {wrong.flat[0]:g}")
    return array


def _seconds(time: Any) -> np.ndarray:
    """Seconds since 1970-01-01 UTC in float64."""
    try:
        array = np.asarray(time)
    except (TypeError, ValueError):  # traced, or lists of several lengths: said below
        array = np.empty(0)
    if array.dtype.kind in "UO":
        instants = [_instant(each) for each in array.ravel().tolist()]
        seconds = np.array(instants, np.float64).reshape(array.shape)
    elif array.dtype.kind == "M":
        raise ValueError(
            f"expected time with a time zone, got {array.dtype}, which has none: if it is UTC, "
            'give time.astype("datetime64[s]").astype(int)'
        )
    else:
        seconds = as_host_float(time, "time")
        if seconds.dtype.itemsize < 8:
            raise ValueError(
                f"expected time in float64 or integers, got {seconds.dtype}, which holds seconds "
                "since 1970 to minutes only"
            )
    wrong = seconds[~((seconds >= _START) & (seconds <= _END))]  # also NaN
    if wrong.size:
        raise ValueError(
            f"expected time in the years {_FIRST} to {_LAST}, got {wrong.flat[0]:g} s since 1970"
        )
    return seconds


def _instant(time: Any) -> float:
    moment = time
    if isinstance(time, str):
        with contextlib.suppress(ValueError):  # said below
            moment = datetime.datetime.fromisoformat(time)
    if not isinstance(moment, datetime.datetime):
        raise ValueError(f"expected time as {_SAID}, got {described(time)}")
    if moment.tzinfo is None or moment.utcoffset() is None:
        raise ValueError(
            f"expected time with a time zone, got {str(time)!r}, which has none: {_ZONE}"
        )
    return moment.timestamp()
