"""What `ringing` looks at: lights, what is made of them, and windows for that."""

import warnings
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import harmonics, sky, sphere

from . import peers

SUNNY = "sunny"
WINDOWS = (
    "none",
    "lanczos",
    "hann",
    "positive",
    "Sloan 2008",
    "Sloan 2017",
    "dering",
    "dering light",
)


class Need(NamedTuple):
    """What is made of the light: its name, and the exponent of its lobe where it is glossy."""

    name: str
    exponent: float | None

    def of(self, light: Float[Array, "c k"]) -> Float[Array, "c k"]:
        degree = harmonics.degree_of(light.shape[-1])
        if self.exponent is None:
            return harmonics.convolve(light, harmonics.clamped_cosine(degree))
        return harmonics.convolve(light, harmonics.phong(self.exponent, degree, normalized=True))

    def window(self, light: Float[Array, "3 k"], kind: str) -> Float[Array, " k"]:
        """Of this kind, one for all channels, for this need."""
        degree = harmonics.degree_of(light.shape[-1])
        match kind:
            case "none" | "lanczos" | "hann" | "positive":
                return harmonics.window(kind, degree)
            case "Sloan 2008":
                return jnp.asarray(peers.sloan2008(self.of(light)), light.dtype)
            case "Sloan 2017":
                return jnp.asarray(peers.sloan2017(self.of(light)), light.dtype)
            case "dering light":
                strength = harmonics.dering(light, of="light", shared=True)[1]
            case _ if self.exponent is None:
                strength = harmonics.dering(light, shared=True)[1]
            case _:
                strength = harmonics.dering(
                    light, of="glossy", exponent=self.exponent, shared=True
                )[1]
        return harmonics.softening(strength, degree)


class Probe(NamedTuple):
    """A picture, and its two parts."""

    name: str
    image: Float[Array, "h w 3"]
    suns: sphere.Suns
    rest: Float[Array, "h w 3"]

    @classmethod
    def of(cls, name: str, image: Float[Array, "h w 3"], count: int) -> "Probe":
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # nothing to split: said by the table
            return cls(name, image, *sphere.split_sun(image, count))

    @property
    def taken(self) -> float:
        """The share of the light that the sources have, in percent."""
        whole, rest = (sphere.project_lat_long(x, 0).sum() for x in (self.image, self.rest))
        return 100 * (1 - float(rest / whole))


def sunny(height: int = 256) -> Float[Array, "h w 3"]:
    """A clear sky over gray ground, with the sun: its light in a disc of 1.5° around it."""
    sun = np.array([-0.45, -0.7, 0.55])
    sun /= np.linalg.norm(sun)
    grid = sphere.lat_long(height, 2 * height)
    directions = np.asarray(grid.directions)
    above = directions[:, 2] > 0
    light = np.zeros((len(directions), 3))
    light[above] = sky.preetham_radiance(directions[above], sun, 2.5)
    disc = directions @ sun > np.cos(np.radians(1.5))
    weights = np.asarray(grid.weights)
    flux = 4 * np.pi * np.sin(sky.SUN_RADIUS / 2) ** 2 * np.asarray(sky.sun_radiance(sun, 2.5))
    light[disc] += flux / weights[disc].sum()
    down = (light * (weights * np.maximum(directions[:, 2], 0))[:, None]).sum(axis=0)
    light[~above] = 0.25 / np.pi * down
    return jnp.asarray(light.reshape(height, 2 * height, 3), jnp.float32)
