"""The lights of a page: coefficients that are given, the sky, and a lamp."""

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import as_host_float, check_coefficients, check_finite, check_type
from ..harmonics import degree_of, num_coefficients, window
from ..transfer import Material, Transfer, shade_diffuse, shade_glossy
from ._gloss import split_material
from ._lamp import Lamp, lamp_part, lamp_radiance
from ._sky import Sky, sky_light, sky_part

# Degrees that are tried in a browser; WebGL2 promises registers for a few more.
MOST_DEGREE = 10
_WINDOWS = ("none", "hann", "lanczos", "zonal-sinc", "positive")


class Lights(NamedTuple):
    """Holds what a page is told of its lights: those that are given, the sky, the lamp."""

    # Of the sky, those of its first sun; of a lamp, 0.
    coefficients: Float[np.ndarray, "lights 3 k"]
    kinds: list[str]  # "given", "sky" or "lamp", of each
    facts: dict[str, Any]  # for the header
    arrays: dict[str, np.ndarray]

    @property
    def degree(self) -> int:
        return degree_of(self.coefficients.shape[-1])

    def names(self) -> list[str]:
        """Name them for the menu where nothing else is said."""
        known = {"sky": "Clear sky", "lamp": "Lamp near the mesh"}
        return [known.get(kind, f"Light {i + 1}") for i, kind in enumerate(self.kinds)]


def make_lights(light: Any, sky: Sky | None, lamp: Lamp | None, transfer: Transfer) -> Lights:
    """Check the lights and list what the page needs; raises `ValueError` or `TypeError`."""
    if sky is not None:
        check_type("sky", sky, Sky)
    if lamp is not None:
        check_type("lamp", lamp, Lamp)
    if light is None and sky is None and lamp is None:
        raise ValueError("expected a light, a sky or a lamp, got none of them")
    if light is None:
        degree = min(transfer.degree, MOST_DEGREE)
        given = np.zeros((0, 3, num_coefficients(degree)))
    else:
        given = checked_lights(light, transfer.degree)
        degree = degree_of(given.shape[-1])
    kinds = ["given"] * len(given)
    facts: dict[str, Any] = {"windows": _windows(degree)}
    arrays: dict[str, np.ndarray] = {}
    coefficients = [given]
    if lamp is not None:
        positions = np.asarray(transfer.positions, np.float64)
        facts["near"], terms = lamp_part(lamp, positions, degree)
        if terms is not None:
            arrays["nearTerms"] = terms.astype("<f4")
    if sky is not None:
        first = sky_light(sky, degree)
        gain = sky.scale
        if gain is None:
            gain = _gain(first, given, lamp, transfer)
        facts["sky"], table = sky_part(sky, degree, float(gain))
        arrays["skyTable"] = table.astype("<f4")
        kinds.append("sky")
        coefficients.append(gain * first[None])
    if lamp is not None:
        kinds.append("lamp")
        coefficients.append(np.zeros((1, *given.shape[1:])))
    facts["kinds"] = kinds
    return Lights(np.concatenate(coefficients), kinds, facts, arrays)


def shaded(
    kind: str,
    light: Float[ArrayLike, "3 k"],
    transfer: Transfer,
    albedo: Float[ArrayLike, "..."] | Material,
    eye: Float[ArrayLike, " 3"],
    lamp: Lamp | None,
) -> Float[Array, "v 3"]:
    """Compute what the vertices send to an eye under a light as a page first has it."""
    diffuse, material = split_material(albedo)
    light = jnp.asarray(light, transfer.dtype)
    if kind == "lamp":
        assert lamp is not None
        return lamp_radiance(lamp, transfer, degree_of(light.shape[-1]), diffuse)
    if material is None:
        return shade_diffuse(light, transfer, diffuse)
    return shade_glossy(light, transfer, eye, material)


def checked_lights(light: Any, degree: int) -> Float[np.ndarray, "lights 3 k"]:
    """Lights as float64 (n, 3, K); raises `ValueError` for others, and above a degree."""
    array = as_host_float(light, "light").astype(np.float64)
    if array.ndim not in (2, 3) or array.shape[-2] != 3 or array.size == 0:
        raise ValueError(f"expected light (3, K) or (n, 3, K), got shape {array.shape}")
    most = min(degree, MOST_DEGREE)
    if (own := check_coefficients("light", array)) > most:
        whose = "the transfer's" if degree <= MOST_DEGREE else "what the viewer shades with"
        raise ValueError(
            f"the light's degree {own} is above {whose}, {most}; cut it to "
            f"light[..., :{num_coefficients(most)}]"
        )
    check_finite("light", array, wait=True)
    return array.reshape(-1, *array.shape[-2:])


def _windows(degree: int) -> dict[str, Any]:
    """Weights of the bands of each window at every degree that the page can cut at."""
    made = {}
    for kind in _WINDOWS:
        rows = []
        for own in range(degree + 1):
            weights = np.asarray(window(kind, own), np.float64)
            rows.append([float(weights[l * (l + 1)]) for l in range(own + 1)])
        made[kind] = {"bands": rows, "zonal": kind == "zonal-sinc"}
    return made


def _gain(
    first: Float[np.ndarray, "3 k"],
    given: Float[np.ndarray, "lights 3 k"],
    lamp: Lamp | None,
    transfer: Transfer,
) -> float:
    """The factor that makes the sky as bright over the mesh as the first of the other lights."""
    coefficients = np.asarray(transfer.vectors(first.shape[-1]), np.float64)
    if len(given):
        other = coefficients @ given[0].T
    elif lamp is not None:
        other = np.asarray(lamp_radiance(lamp, transfer, degree_of(first.shape[-1]), np.pi))
    else:
        return 1.0
    own, other = float((coefficients @ first.T).mean()), float(other.mean())
    return other / own if own > 0 and other > 0 else 1.0
