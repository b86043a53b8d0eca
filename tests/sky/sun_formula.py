"""The sun by the Astronomical Almanac's short formula, beside which `sky.sun_direction` is held."""

import numpy as np


def almanac_sun(seconds, latitude, longitude):
    """Unit vectors, x east, y north, z up, from seconds since 1970-01-01 UTC and degrees.

    Astronomical Almanac, section C, "Low precision formulas for the Sun's coordinates": 0.01°
    between 1950 and 2050.
    """
    days = (np.asarray(seconds) - 946728000) / 86400  # since 2000-01-01 12:00 UTC
    anomaly = np.radians(357.528 + 0.9856003 * days)
    along = 280.460 + 0.9856474 * days + 1.915 * np.sin(anomaly) + 0.020 * np.sin(2 * anomaly)
    ecliptic, tilt = np.radians(along), np.radians(23.439 - 4e-7 * days)
    # Towards the equinox, 90° east of it on the equator, and the north pole.
    x, y, z = np.cos(ecliptic), np.cos(tilt) * np.sin(ecliptic), np.sin(tilt) * np.sin(ecliptic)
    # Local sidereal time: the meridian's angle from the equinox.
    turned = np.radians(280.46062 + 360.98564737 * days + longitude)
    meridian = x * np.cos(turned) + y * np.sin(turned)  # on the equator, in the meridian
    east = y * np.cos(turned) - x * np.sin(turned)
    phi = np.radians(latitude)
    north, up = np.cos(phi) * z - np.sin(phi) * meridian, np.cos(phi) * meridian + np.sin(phi) * z
    return np.stack([east, north, up], axis=-1)
