"""Reads what was given: how an array may hold coefficients, and the lights they may be of."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from .._core.checks import as_host_float, check_finite
from .._core.srgb import decode, encode
from ..harmonics import degrees, orders
from ..sphere import lat_long, project_lat_long
from ._placements import values

# Channels are told apart from those of the picture from this ratio of their factors on.
_TINT = 1.03
# Larger degrees add hardly anything to a verdict.
MOST = 8


class Reading(NamedTuple):
    """An array taken for coefficients in one layout."""

    layout: str
    channels: Float[np.ndarray, "c k"]
    said: str = ""  # what is wrong with the array's shape
    cost: float = 0.0
    one_channel: bool = False
    apart: float = 0.0  # how far its channels are from multiples of one function

    @property
    def hides_layout(self) -> bool:
        """True where most layouts look the same."""
        return self.one_channel and self.layout != "cosine-sine"


class Light(NamedTuple):
    """A light that coefficients may be of, in our convention, and how it came about."""

    coefficients: Float[np.ndarray, "c k"]
    said: str = ""
    cost: float = 0.0


def read(given) -> list[Reading]:
    """All layouts that an array's shape allows; raises `ValueError` where there is none."""
    array = as_host_float(given, "given").astype(np.float64)
    check_finite("given", array, wait=True)
    readings = [r._replace(one_channel=len(r.channels) == 1) for r in _readings(array)]
    if not readings:
        raise ValueError(
            "expected given as coefficients of one light, (C, K), (K, C), (K,), (3·K,) or "
            f"(C, 2, L+1, L+1) with C <= 4 and K = (L+1)² = 1, 4, 9, 16, …, got shape {array.shape}"
        )
    if not array.any():
        raise ValueError("given must not be zero throughout: there is nothing to check")
    return readings


def _readings(array: np.ndarray) -> Iterator[Reading]:
    shape: list[int] = list(array.shape)
    size = array.size
    if len(shape) == 1 and _square(size):
        yield Reading("coefficients-last", array[None])
    if len(shape) == 2 and shape[0] <= 4 and _square(shape[1]):
        yield Reading("coefficients-last", array)
    if len(shape) == 2 and shape[1] <= 4 and _square(shape[0]):
        yield Reading("channels-last", array.T)
    if len(shape) in (3, 4) and shape[-3] == 2 and shape[-1] == shape[-2] and size:
        planes = array.reshape(-1, 2, *shape[-2:])
        l, m = degrees(shape[-1] - 1), orders(shape[-1] - 1)
        if len(planes) <= 4:
            yield Reading("cosine-sine", planes[:, (m < 0).astype(int), l, np.abs(m)])
    if size % 3 or not _square(size // 3) or size == 3 or len(shape) > 2:
        return
    flat = len(shape) == 1
    if flat or shape[1] == 3:
        said = "" if flat else f"channel by channel in memory, though its shape is {array.shape}"
        yield Reading("by-channel", array.reshape(3, -1), said, 0.0 if flat else 4.0)
    if flat or shape[0] == 3:
        said = (
            ""
            if flat
            else f"coefficient by coefficient in memory, though its shape is {array.shape}"
        )
        yield Reading("by-coefficient", array.reshape(-1, 3).T, said, 0.0 if flat else 4.0)


def _square(count: int) -> bool:
    return count > 0 and math.isqrt(count) ** 2 == count


# Red, green and blue in a gray light: the usual sums, and each alone.
_GRAYS = {
    "": (0.2126, 0.7152, 0.0722),
    "the mean of red, green and blue": (1 / 3, 1 / 3, 1 / 3),
    "Rec. 601 luma": (0.299, 0.587, 0.114),
    "red alone": (1.0, 0.0, 0.0),
    "green alone": (0.0, 1.0, 0.0),
    "blue alone": (0.0, 0.0, 1.0),
}


def of_direction(direction: Float[np.ndarray, " 3"], degree: int) -> list[Light]:
    """A light from one direction alone: its coefficients are the basis there."""
    unit = direction / np.linalg.norm(direction)
    return [Light(values(unit[None], degree))]


def of_picture(picture: Float[np.ndarray, "h w c"], degree: int, channels: int) -> list[Light]:
    """The lights that a picture may mean in so many channels; none where they do not fit."""
    return _in_channels(_project(picture, degree), channels)


def mistaken(picture: Float[np.ndarray, "h w c"], degree: int, channels: int) -> list[Light]:
    """The lights that a picture gives by a usual mistake."""
    height, width, _ = picture.shape
    weights = np.asarray(lat_long(height, width).weights).reshape(height, width, 1)
    equal = picture * (4 * np.pi / (height * width) / weights)
    shown = np.clip(picture, 0, 1)
    solid = "its pixels were weighted equally, without the sine of the polar angle"
    made = {
        "it was made from a gamma-encoded picture, as stored, not from linear light": encode(shown),
        "it was made from a gamma-encoded picture above 1 too, not from linear light": encode(
            picture
        ),
        "the picture is gamma-encoded, and was decoded to linear light before": decode(
            np.maximum(picture, 0)
        ),
        "it was made from a picture clipped at 1": shown,
        solid: equal,
    }
    if picture.max() <= 1:  # there is nothing above 1
        made = {said: other for said, other in made.items() if " 1" not in said}
    found = []
    for said, other in made.items():
        for light in _in_channels(_project(other, degree), channels):
            found.append(light._replace(said="; ".join(filter(None, (said, light.said))), cost=6.0))
    return found


def tinted(reading: Reading, lights: list[Light]) -> list[Light]:
    """The light with channels multiplied so that its constants are those given, where they differ.

    All facts change the constants of all channels alike, so that these show the factors exactly.
    """
    plain = next((light.coefficients for light in lights if not light.said), None)
    if plain is None or len(plain) < 2 or plain[:, 0].min() <= 0:
        return []
    gains = reading.channels[:, 0] / plain[:, 0]
    if gains.min() <= 0 or gains.max() < _TINT * gains.min():
        return []
    gains = gains / np.median(gains)
    words = ", ".join(f"{gain:.3g}" for gain in gains)
    said = f"its channels are those of the picture times {words}: a white balance, say"
    return [Light(plain * gains[:, None], said, 8.0)]


def _project(picture, degree: int) -> Float[np.ndarray, "c k"]:
    dtype = np.float64 if picture.dtype == np.float64 else np.float32
    return np.asarray(project_lat_long(picture.astype(dtype), degree), np.float64)


def _in_channels(light: Float[np.ndarray, "c k"], channels: int) -> list[Light]:
    count = len(light)
    if channels == 1 and count >= 3:
        gray = {said: np.array(weights) @ light[:3] for said, weights in _GRAYS.items()}
        return [
            Light(row[None], f"gray: {said}" if said else "", 0.0 if not said else 1.0)
            for said, row in gray.items()
        ]
    if count == 1:
        return [Light(np.repeat(light, channels, axis=0))]
    if channels == count:
        lights = [Light(light)]
        if channels == 3:
            lights.append(Light(light[::-1], "channels as blue, green, red", 4.0))
        return lights
    return []
