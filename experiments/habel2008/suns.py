"""Suns and turbidities of the experiments on Habel et al. 2008, and their exact coefficients."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxsh import harmonics, sky

from ..runner import Data

ZENITH = sky.Axis("θ", 0.0, np.pi / 2)
TURBIDITY = sky.Axis("turbidity", 2.5, 6.0)
PLAIN = 14, 8  # the paper's degrees, 13 and 7, as numbers of polynomials

# Upper bounds on E_mean by bands, in percent: "drops below 1.5% for 7 bands, introducing
# virtually no error (< 0.005%) up to 5 bands" (section 3.2).
CLAIM = {**dict.fromkeys(range(1, 6), 0.005), 7: 1.5}

Columns = Callable[[sky.Axis, Float[np.ndarray, " n"], int], Float[np.ndarray, "n c"]]


class Suns(NamedTuple):
    """All pairs of a zenith angle and a turbidity; suns are at azimuth 0."""

    theta: Float[np.ndarray, " h"]
    turbidity: Float[np.ndarray, " t"]

    @classmethod
    def even(cls, heights: int, turbidities: int) -> "Suns":
        """Evenly spaced, the ends of both ranges included, where fits are worst."""
        ends = (ZENITH.low, ZENITH.high), (TURBIDITY.low, TURBIDITY.high)
        return cls(np.linspace(*ends[0], heights), np.linspace(*ends[1], turbidities))

    @classmethod
    def nodes(cls, heights: int, turbidities: int) -> "Suns":
        """Chebyshev's, on which polynomials are fitted."""
        return cls(ZENITH.nodes(heights), TURBIDITY.nodes(turbidities))

    @property
    def directions(self) -> Float[np.ndarray, "h 1 3"]:
        theta = self.theta[:, None]
        # The sun on the horizon is not below it, whatever cos π/2 rounds to.
        return np.stack([np.sin(theta), 0 * theta, np.maximum(np.cos(theta), 0)], axis=-1)


def project(grids: Sequence[Suns], bands: int) -> list[Float[np.ndarray, "h t 3 k"]]:
    """Exact coefficients on each grid, linear sRGB: all in one call, to compile one."""
    sizes = [(len(grid.theta), len(grid.turbidity)) for grid in grids]
    suns, turbidities = (
        np.concatenate(
            [
                np.broadcast_to(a, (*n, *a.shape[2:])).reshape(-1, *a.shape[2:])
                for a, n in zip(arrays, sizes, strict=True)
            ]
        )
        for arrays in ([g.directions for g in grids], [g.turbidity[None] for g in grids])
    )
    exact = np.asarray(sky.project_preetham(suns, turbidities, bands - 1))
    ends = np.cumsum([h * t for h, t in sizes])[:-1]
    parts = np.split(exact, ends)
    return [part.reshape(*size, 3, -1) for part, size in zip(parts, sizes, strict=True)]


def scaled(axis: sky.Axis, values: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """From the axis' range to [-1, 1]."""
    return np.asarray(axis.scaled(jnp.asarray(values)))


def polynomials(
    axis: sky.Axis, values: Float[np.ndarray, " n"], count: int
) -> Float[np.ndarray, "n c"]:
    """Chebyshev polynomials of one variable on its range: the best basis for any polynomial."""
    return np.polynomial.chebyshev.chebvander(scaled(axis, values), count - 1)


def published(data: Data) -> Float[np.ndarray, "49 14 8 3"] | None:
    """The authors' tables for our harmonics, in kcd/m²; none where the data has them not."""
    arrays = data.reference("habel2008_tables")
    if arrays is None:
        return None
    phase = (-1.0) ** harmonics.orders(6)  # theirs have the Condon-Shortley phase
    return arrays["coefficients"] * phase[:, None, None, None] / 1000
