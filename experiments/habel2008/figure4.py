"""Ringing from the horizon, and what windows do about it and cost."""

import dataclasses
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import harmonics, sky, sphere

from ..runner import Context, Table, experiment
from ..shared.lights import windowed
from ..shared.plots import plt, save
from . import spheres

_WINDOWS = ("none", "zonal sinc (eq. 5)", "sinc", "Hann", "dering")
_BELOW = np.sin(np.radians(20))


@dataclasses.dataclass(frozen=True)
class Figure4:
    zeniths: tuple[float, ...] = (30.0, 60.0, 89.0)
    """suns, in degrees from the zenith"""
    turbidity: float = 3.0
    bands: int = 7
    """bands, up to 7"""
    shown: int = 1
    """which of the suns is in the picture, from 0"""

    def __post_init__(self):
        if not 0 <= self.shown < len(self.zeniths):
            raise ValueError(f"shown must be from 0 to {len(self.zeniths) - 1}, got {self.shown}")
        if not 2 <= self.bands <= 7:
            raise ValueError(f"bands must be from 2 to 7, got {self.bands}")
        if not 2.5 <= self.turbidity <= 6 or not 0 <= min(self.zeniths) <= max(self.zeniths) <= 90:
            raise ValueError("turbidity must be in [2.5, 6] and zeniths in [0, 90]")


@experiment("habel2008.figure4", x64=True)
def figure4(config: Figure4, context: Context) -> list[Table]:
    """Ringing before and after windows, and what each costs (figure 4)."""
    degree = config.bands - 1
    for number, zenith in enumerate(config.zeniths):
        sun = spheres.sun_at(zenith)
        light = sky.preetham_harmonics(jnp.asarray(sun), config.turbidity, degree)
        lights = {name: windowed(light, name) for name in _WINDOWS}
        for name, filtered in lights.items():
            context.record({"zenith": zenith, "window": name, **measures(filtered, light)})
        if number == config.shown:
            caption = (
                f"the sun {90 - zenith:g}° up, turbidity {config.turbidity:g}, {config.bands} "
                "bands: the light, blue where it is below zero; what should be black below "
                "the horizon; and both along the meridian of the sun"
            )
            _draw(context.path("figure4.png", caption), sun, config.turbidity, lights)
    return _tables(config, context.rows)


def measures(filtered: Float[Array, "3 k"], light: Float[Array, "3 k"]) -> dict[str, float]:
    """Of luminance, in units of the mean over the hemisphere of the sky itself."""
    degree = harmonics.degree_of(light.shape[-1])
    quadrature = sphere.gauss_legendre(120)
    z, weights = (np.asarray(a) for a in (quadrature.directions[:, 2], quadrature.weights))
    coefficients = spheres.LUMINANCE @ np.asarray(filtered)
    parts = [np.where(harmonics.orders(degree) == 0, coefficients, 0), coefficients]
    zonal, whole = np.asarray(
        sphere.reconstruct(jnp.asarray(np.stack(parts)), quadrature.directions)
    )
    mean, low, under = spheres.mean_luminance(light), z < -_BELOW, z < 0
    shares = [np.sum((weights * f**2)[under]) for f in (whole - zonal, zonal, whole)]
    up = jnp.array([[0.0, 0.0, 1.0]])
    cosine = harmonics.clamped_cosine(degree)
    received = sphere.reconstruct(harmonics.convolve(filtered, cosine), up)[:, 0]
    exact = spheres.LUMINANCE @ np.asarray(sky.horizontal_irradiance(light))
    return {
        "rms": float(np.sqrt(np.average(whole[low] ** 2, weights=weights[low]))) / mean,
        "negative": float(whole.min()) / mean,
        "cost": 100 * float(spheres.LUMINANCE @ np.asarray(received) / exact - 1),
        "blur": 100
        * float(np.linalg.norm(coefficients - spheres.LUMINANCE @ np.asarray(light)))
        / float(np.linalg.norm(spheres.LUMINANCE @ np.asarray(light))),
        "nonzonal": 100 * shares[0] / (shares[0] + shares[1]),
    }


def _tables(config: Figure4, rows: list[dict[str, Any]]) -> list[Table]:
    ringing = Table(
        "Ringing and what stops it",
    )
    shares = Table(
        '"Only the zonal part rings"',
        rows=[row for row in rows if row["window"] == "none"],
    )
    return [ringing, shares]


def _draw(path, sun, turbidity: float, lights: dict[str, Array]) -> None:
    mean = spheres.mean_luminance(lights["none"])
    columns = 1 + len(lights)
    figure = plt.figure(figsize=(2.9 * columns, 6.6), layout="constrained")
    axes = figure.subplot_mosaic(
        [
            [f"light {i}" for i in range(columns)],
            [f"below {i}" for i in range(columns)],
            ["meridian"] * columns,
        ],
        height_ratios=[1, 0.6, 1.9],
    )
    itself = spheres.sky_picture(sun, turbidity, 90)
    spheres.show_sphere(axes["light 0"], itself, 0.5 / mean, "the sky")
    angle = np.linspace(-180, 180, 721)  # from the zenith, towards the sun
    meridian = jnp.asarray(
        np.stack([np.sin(np.radians(angle)), 0 * angle, np.cos(np.radians(angle))], axis=-1)
    )
    profile = axes["meridian"]
    exact = sky.preetham_radiance(meridian, jnp.asarray(sun), turbidity) @ spheres.LUMINANCE
    profile.plot(angle, exact / mean, "k", linewidth=1, label="the sky")
    for number, (name, light) in enumerate(lights.items(), start=1):
        image = sphere.reconstruct_lat_long(light, 90, 180)
        spheres.show_sphere(axes[f"light {number}"], image, 0.5 / mean, name)
        below = np.array(image @ spheres.LUMINANCE)[len(image) // 2 :] / mean
        spheres.show_signed(axes[f"below {number}"], below, 0.5, "below the horizon", top=0)
        curve = sphere.reconstruct(light, meridian).T @ spheres.LUMINANCE
        profile.plot(angle, curve / mean, color=f"C{number - 1}", linewidth=1.8, label=name)
    spheres.show_scale(axes["below 0"], 0.5, "in mean skies")
    for edge in (-90, 90):
        profile.axvline(edge, color="grey", linewidth=0.8, linestyle=":")
    profile.axhline(0, color="grey", linewidth=0.8)
    top = max(
        float(jnp.max(sphere.reconstruct(lights["none"], meridian).T @ spheres.LUMINANCE)), mean
    )
    profile.set(xlim=(-180, 180), ylim=(-0.7, 1.4 * top / mean))
    profile.set_xticks([-180, -90, 0, 90, 180], ["nadir", "horizon", "zenith", "horizon", "nadir"])
    profile.set_ylabel("luminance, in mean skies")
    profile.legend(frameon=False, ncols=3, loc="upper left")
    save(figure, path, dpi=140)
