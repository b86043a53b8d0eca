"""The scene of figures 7 and 8: a blue light before a red one, which it hides in part."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import midrange

from ..shared.lights import exact_light, rectangle

# The blue light has no red in it: in the red channel it is a blocker and nothing else. Their green
# makes both together near white, where red and blue alone would be purple everywhere.
_RED, _BLUE = (1.0, 0.4, 0.08), (0.0, 0.5, 1.0)
_FAR = np.array([-1.6, -2.7, 2.5])  # the red light's center
_TOP = np.array([0.0, 0.0, 0.9])  # from up here the blue light's center hides the red one's
_BETWEEN = 0.55
_FILL = 2048


def overlapping() -> tuple[midrange.Polygon, midrange.Polygon]:
    """The red light, and the blue one: seen from the top of the object it is right before it."""
    near = _TOP + _BETWEEN * (_FAR - _TOP)
    red = rectangle(_FAR, (0.0, 0.0, 0.0), (2.2, 2.2), 3.0 * np.array(_RED))
    blue = rectangle(near, (0.0, 0.0, 0.0), (1.3, 1.3), 1.5 * np.array(_BLUE))
    return red, blue


def overlapping_light(
    lights: Sequence[midrange.Polygon], positions: Float[Array, "*batch 3"], degree: int
) -> Float[Array, "*batch 3 k"]:
    """Exact coefficients of both, the red one where the blue one leaves it free."""
    red, blue = lights
    hidden = filled_light(red, positions, degree, blockers=[blue])
    return hidden + filled_light(blue, positions, degree)


def filled_light(
    light: midrange.Polygon,
    positions: Float[Array, "*batch 3"],
    degree: int,
    *,
    blockers: Sequence[midrange.Polygon] = (),
) -> Float[Array, "*batch 3 k"]:
    """`exact_light`, its positions filled up: few numbers of them compile, and that takes long."""
    flat = positions.reshape(-1, 3)
    filled = jnp.pad(flat, ((0, -len(flat) % _FILL), (0, 0)), mode="edge")
    exact = exact_light([light], filled, degree, blockers=blockers)[: len(flat)]
    return exact.reshape(*positions.shape[:-1], *exact.shape[1:])
