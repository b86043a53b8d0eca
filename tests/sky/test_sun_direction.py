"""The sun from date and place, beside published places of the sun and a formula of our own."""

import datetime
import importlib.util
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from sun_formula import almanac_sun

from jaxsh import sky

needs_ephem = pytest.mark.skipif(
    importlib.util.find_spec("ephem") is None,
    reason="ephem is not installed: sky.sun_direction is not tried",
)
UTC, MUNICH = datetime.UTC, (48.137, 11.575)
NOON = datetime.datetime(2026, 6, 21, 12, tzinfo=UTC)


def at(altitude, azimuth):
    """East, north, up from degrees, azimuth from north over east."""
    a, b = np.radians(altitude), np.radians(azimuth)
    return np.stack([np.cos(a) * np.sin(b), np.cos(a) * np.cos(b), np.sin(a)], axis=-1)


def degrees_between(a, b):
    return np.degrees(2 * np.arcsin(np.linalg.norm(a - b, axis=-1) / 2))


@needs_ephem
def test_the_published_example():
    """Reda and Andreas 2004, table A5.1: 12:30:30 in zone -7 near Denver, without refraction."""
    found = sky.sun_direction("2003-10-17T12:30:30-07:00", 39.742476, -105.1786)
    assert degrees_between(found, at(39.872046, 194.340241)) < 2e-5  # 7e-6 measured


@needs_ephem
@pytest.mark.parametrize(
    ("time", "latitude", "longitude", "altitude", "azimuth"),
    [
        ("1000-03-05T10:00Z", 48.137, 11.575, 32.5532, 154.2736),
        ("1850-12-21T15:00Z", 48.137, 11.575, 2.1264, 230.3314),
        ("2026-06-21T03:12Z", -33.87, 151.21, 29.9706, 340.0685),
        ("2026-11-30T13:49:07Z", 78.22, 15.65, -13.2761, 223.1539),
        ("2100-01-01T00:00Z", 0.0, -150.0, 53.4604, 228.9715),
        ("3000-07-01T18:30Z", -54.8, -68.3, 8.7900, 334.4055),
    ],
)
def test_against_nrels_algorithm(time, latitude, longitude, altitude, azimuth):
    """Printed by pvlib 0.16.1, `spa.solar_position_numpy`, with its own ΔT."""
    found = sky.sun_direction(time, latitude, longitude)
    assert degrees_between(found, at(altitude, azimuth)) < 5e-4  # 4e-4 measured, in 2100


@needs_ephem
def test_against_a_short_formula(rng):
    """Also over places, which broadcast with times."""
    since = [datetime.datetime(year, 1, 1, tzinfo=UTC).timestamp() for year in (1950, 2050)]
    times = rng.uniform(*since, size=200)
    latitudes, longitudes = rng.uniform(-90, 90, (3, 1)), rng.uniform(-180, 360, (3, 1))
    found = sky.sun_direction(times, latitudes, longitudes)
    assert found.shape == (3, 200, 3)
    apart = degrees_between(found, almanac_sun(times, latitudes, longitudes))
    assert apart.max() < 0.015  # 0.012 measured
    np.testing.assert_allclose(np.linalg.norm(found, axis=-1), 1, rtol=0, atol=1e-15)


@needs_ephem
def test_air_lifts_the_sun(rng):
    """Sæmundsson 1986, as Meeus prints it (16.4): minutes of arc at 1010 hPa and 10 °C."""
    times = NOON.timestamp() + 86400 * rng.uniform(0, 365, size=200)
    straight, seen = (
        np.asarray(sky.sun_direction(times, *MUNICH, refraction=on)) for on in (False, True)
    )
    altitude, lifted = (np.degrees(np.arcsin(s[:, 2])) for s in (straight, seen))
    expected = 1.02 / np.tan(np.radians(altitude + 10.3 / (altitude + 5.11))) / 60
    expected *= 1013.25 / 1010 * 283 / (273 + 12)
    up = altitude > 0
    np.testing.assert_allclose((lifted - altitude)[up], expected[up], rtol=0, atol=6e-3)  # 4e-3
    # Straight up, and along the same azimuth.
    east, north = np.moveaxis(np.stack([straight[up, :2], seen[up, :2]]), -1, 0)
    np.testing.assert_allclose(east[0] * north[1], east[1] * north[0], rtol=0, atol=1e-7)


@needs_ephem
def test_kinds_of_times_agree():
    zone = datetime.timezone(datetime.timedelta(hours=2))
    expected = sky.sun_direction(NOON, *MUNICH)
    assert expected.dtype == jnp.float64
    for time in (
        NOON.astimezone(zone),
        "2026-06-21 14:00+02:00",
        NOON.timestamp(),
        int(NOON.timestamp()),
        np.datetime64("2026-06-21T12:00").astype("datetime64[s]").astype(int),
    ):
        np.testing.assert_array_equal(sky.sun_direction(time, *MUNICH), expected)
    for times in ([NOON, NOON], ["2026-06-21T12Z", NOON], np.array([NOON, NOON])):
        np.testing.assert_array_equal(sky.sun_direction(times, *MUNICH), [expected] * 2)
    assert sky.sun_direction([], *MUNICH).shape == (0, 3)
    with jax.enable_x64(False):
        single = sky.sun_direction(NOON, *MUNICH)
    assert single.dtype == jnp.float32
    np.testing.assert_allclose(single, expected, rtol=0, atol=1e-7)


@pytest.mark.parametrize(
    ("time", "message"),
    [
        (datetime.datetime(2026, 6, 21), r"time with a time zone, got '2026-06-21 00:00:00'"),
        ("2026-06-21 12:00", r"time with a time zone, got '2026-06-21 12:00', which has none"),
        (np.datetime64("2026-06-21"), r"got datetime64\[D\], which has none: if it is UTC, give"),
        ([NOON, NOON.replace(tzinfo=None)], "time with a time zone, got '2026-06-21 12:00:00'"),
        (datetime.date(2026, 6, 21), "expected time as a datetime with a time zone, .* a date"),
        ("noon", "expected time as a datetime with a time zone, ISO text .*, got 'noon'"),
        (np.float32(1.8e9), "time in float64 or integers, got float32, which holds seconds"),
        (NOON.timestamp() * 1000, r"time in the years 1000 to 3000, got 1\.78204e\+12 s"),
        (np.nan, "time in the years 1000 to 3000, got nan s"),
        (True, "expected real numbers for time, got True"),
        ([[1.0, 2.0], [3.0]], "expected real numbers for time, got a list of 2"),
    ],
)
def test_times_that_are_refused(unchecked, time, message):
    with pytest.raises(ValueError, match=message):
        sky.sun_direction(time, *MUNICH)


def test_places_that_are_refused(unchecked):
    with pytest.raises(ValueError, match=r"latitude must be degrees in \[-90, 90\], got 91"):
        sky.sun_direction(NOON, 91.0, 0.0)
    with pytest.raises(ValueError, match=r"longitude must be degrees in \[-180, 360\], got -181"):
        sky.sun_direction(NOON, 0.0, np.array([0.0, -181.0]))
    with pytest.raises(ValueError, match=r"got time \(2,\), latitude \(3,\) and longitude \(\)"):
        sky.sun_direction([NOON, NOON], np.zeros(3), 0.0)
    with pytest.raises(ValueError, match="known values for time, got traced ones"):
        jax.jit(lambda time: sky.sun_direction(time, *MUNICH))(0.0)


def test_it_says_what_it_needs(monkeypatch):
    monkeypatch.setitem(sys.modules, "ephem", None)
    with pytest.raises(ImportError, match=r"needs the package PyEphem.*`pip install ephem`"):
        sky.sun_direction(NOON, *MUNICH)
