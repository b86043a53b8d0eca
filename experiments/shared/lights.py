"""Area lights with their exact coefficients, and windows over coefficients."""

from collections.abc import Sequence
from typing import Literal

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxsh import harmonics, midrange

Vector = Sequence[float] | Float[Array | np.ndarray, " 3"]

_KINDS: dict[str, Literal["zonal-sinc", "lanczos", "hann"]] = {
    "zonal sinc (eq. 5)": "zonal-sinc",
    "sinc": "lanczos",
    "Hann": "hann",
}


def rectangle(
    center: Vector,
    target: Vector,
    size: tuple[float, float],
    radiance: Vector,
    *,
    two_sided: bool = False,
) -> midrange.Polygon:
    """An area light of this width and height that faces the target; its width is level."""
    center, target = np.asarray(center, np.float64), np.asarray(target, np.float64)
    normal = (target - center) / np.linalg.norm(target - center)
    # Beside the vertical any direction is level.
    upright = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 1 - 1e-9 else np.array([0.0, 1.0, 0.0])
    across = np.cross(upright, normal)
    across /= np.linalg.norm(across)
    up = np.cross(normal, across)
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * (np.array(size) / 2)
    vertices = center + corners @ np.stack([across, up])
    dtype = jnp.result_type(float)
    return midrange.Polygon(
        jnp.asarray(vertices, dtype), jnp.asarray(radiance, dtype), two_sided=two_sided
    )


def exact_light(
    lights: Sequence[midrange.Polygon],
    positions: Float[ArrayLike, "*batch 3"],
    degree: int,
    *,
    occluded: bool = False,
    blockers: Sequence[midrange.Polygon] = (),
) -> Float[Array, "*batch 3 k"]:
    """Coefficients at each position without sampling: the reference of all figures.

    `occluded`: whether lights hide each other, at a cost that grows with the square of
    their number.
    """
    total = 0.0
    for number, light in enumerate(lights):
        others = [*lights[:number], *lights[number + 1 :]] if occluded else []
        total = total + midrange.polygon_harmonics(
            light, positions, degree, blockers=(*others, *blockers)
        )
    return jnp.asarray(total)


def windowed(light: Float[Array, "3 k"], name: str) -> Float[Array, "3 k"]:
    """Under a window; `dering` takes the least strength that suits every channel."""
    degree = harmonics.degree_of(light.shape[-1])
    if name == "none":
        return light
    if name == "dering":
        return harmonics.dering(light, of="light", shared=True)[0]
    return light * harmonics.window(_KINDS[name], degree)[None]
