"""A lamp near the mesh, which is dragged in the page."""

import dataclasses
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import as_host_float, check_finite, check_type
from ..harmonics import num_coefficients
from ..midrange import (
    Expansion,
    Grid,
    Sphere,
    grid_around,
    make_expansion,
    shade,
    sphere_harmonics_with_gradient,
)
from ..transfer import Transfer

_MOST_SAMPLES = 512  # WebGL2 promises textures of 2048 texels along a side, four for each
_SHAPE = (8, 8, 8)


@dataclasses.dataclass(frozen=True)
class Lamp:
    """Describes a lamp near the mesh, which is dragged in the page.

    Its light is known, with the gradient, at the samples of a grid around the mesh, and carried to
    each vertex by `midrange.interpolate(…, rule="half")`. It is shadowed by the mesh itself, as
    all light is by the transfer, up to the page's degree.

    - `light`: a `midrange.Sphere`, whose coefficients at the samples the page finds in closed
      form wherever it is dragged; or the `midrange.Expansion` of order 1 or more of any lamp at
      the samples of `grid`, which is sent once and moves with its lamp. With the second, blockers
      that were captured move along.
    - `grid`: by default that of `midrange.grid_around` the mesh with 8 × 8 × 8 samples, and never
      more than these 512. An expansion needs its own; the lamp can be dragged as far as the grid
      holds the mesh.
    - `position`: (3,), where the lamp is: by default the sphere's center. An expansion needs it.

    Raises `ValueError` for shapes that do not fit and a missing grid or position.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange, viewer
    >>> ball = midrange.Sphere(jnp.array([0.0, -1.0, 2.0]), jnp.array(0.3), jnp.full(3, 20.0))
    >>> viewer.Lamp(ball).grid is None  # around the mesh, once that is known
    True
    """

    light: Sphere | Expansion
    grid: Grid | None = None
    position: Any = None

    def __post_init__(self):
        check_type("light", self.light, Sphere, Expansion)
        if self.grid is not None:
            check_type("grid", self.grid, Grid)
            if self.grid.size > _MOST_SAMPLES:
                raise ValueError(
                    f"expected a grid of at most {_MOST_SAMPLES} samples, got {self.grid.size}"
                )
        if isinstance(self.light, Expansion):
            if self.grid is None or self.position is None:
                raise ValueError("a lamp's expansion needs the grid and the position of the lamp")
            if self.light.order < 1 or self.light.point.shape != (self.grid.size, 3):
                raise ValueError(
                    f"expected an expansion of order 1 or more at the grid's {self.grid.size} "
                    f"samples, got order {self.light.order} at points {self.light.point.shape}"
                )
            check_finite("terms of the lamp's expansion", np.asarray(self.light.terms), wait=True)
        lamp_place(self)


def lamp_place(lamp: Lamp) -> Float[np.ndarray, " 3"]:
    """Find where a lamp is at first, in float64."""
    given = lamp.position
    return checked_place(
        lamp.light.center if given is None and isinstance(lamp.light, Sphere) else given
    )


def checked_place(place: Any) -> Float[np.ndarray, " 3"]:
    """A lamp's position in float64; raises `ValueError` where it is none."""
    array = as_host_float(place, "position of the lamp").astype(np.float64)
    check_finite("position of the lamp", array, wait=True)
    if array.shape != (3,):
        raise ValueError(f"expected position of the lamp (3,), got shape {array.shape}")
    return array


def lamp_samples(
    lamp: Lamp, positions: Float[np.ndarray, "v 3"], degree: int
) -> tuple[Grid, Expansion]:
    """Make the grid, and the light at its samples where the lamp is at first, to a degree.

    Raises `ValueError` for a sphere that a sample is inside of, and a lamp of a lower degree.
    """
    dtype = jnp.result_type(float)
    grid = lamp.grid
    if grid is None:
        grid = grid_around(jnp.asarray(_box(positions), dtype), _SHAPE)
    if isinstance(lamp.light, Expansion):
        if lamp.light.degree < degree:
            raise ValueError(
                f"expected a lamp's expansion of degree {degree} or more, got {lamp.light.degree}"
            )
        known = lamp.light.truncated(1)
        return grid, Expansion(known.point, known.terms[..., : num_coefficients(degree), :])
    points = jnp.asarray(grid.points, dtype)
    ball = Sphere(jnp.asarray(lamp_place(lamp), dtype), lamp.light.radius, lamp.light.radiance)
    return grid, make_expansion(points, *sphere_harmonics_with_gradient(ball, points, degree))


def _box(positions: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, "2 3"]:
    """Two corners around a mesh; a flat one gets a height, since a grid needs one."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    lacking = np.maximum(0.05 * (high - low).max() - (high - low), 0) / 2
    return np.stack([low - lacking, high + lacking])


def lamp_radiance(
    lamp: Lamp, transfer: Transfer, degree: int, albedo: ArrayLike
) -> Float[Array, "v 3"]:
    """Compute the radiance of the vertices under a lamp where it is at first."""
    grid, light = lamp_samples(lamp, np.asarray(transfer.positions), degree)
    return shade(light, transfer, albedo, weights=grid.weights(transfer.positions), rule="half")


def lamp_part(
    lamp: Lamp, positions: Float[np.ndarray, "v 3"], degree: int
) -> tuple[dict[str, Any], np.ndarray | None]:
    """List what the page needs to find the lamp's light at the vertices, wherever it is.

    Facts, and the light at the samples (samples, terms, channels, K) where the page cannot compute
    it.
    """
    grid, light = lamp_samples(lamp, positions, degree)
    lower, upper = (np.asarray(x, np.float64) for x in (grid.lower, grid.upper))
    place = lamp_place(lamp)
    facts = {
        "lamp": place.tolist(),
        "grid": {"lower": lower.tolist(), "upper": upper.tolist(), "shape": list(grid.shape)},
    }
    if isinstance(lamp.light, Sphere):
        radius = float(lamp.light.radius)
        outside = np.maximum(np.maximum(lower - place, place - upper), 0)
        facts |= {
            "radius": radius,
            "radiance": np.asarray(lamp.light.radiance, np.float64).tolist(),
            # From the samples' box, within which they tell little of its light.
            "gap": min(1.5 * radius, float(np.linalg.norm(outside))),
        }
        return facts, None
    ends = positions.max(axis=0) - upper, positions.min(axis=0) - lower
    travel = np.stack([np.minimum(ends[0], 0), np.maximum(ends[1], 0)], axis=-1)
    terms = np.asarray(light.terms, np.float32).transpose(0, 3, 1, 2)
    return facts | {"travel": travel.tolist()}, terms
