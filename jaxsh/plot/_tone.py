"""Radiance as a screen shows it, for pictures in a light's own colors."""

from typing import Literal, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from .._core.checks import check_choice, check_number
from ..imaging import auto_exposure, tone_map

Curve = Literal["clip", "reinhard"]


class Tone(NamedTuple):
    """Holds arguments of `imaging.tone_map`, with no exposure where the picture chooses it."""

    exposure: float | None
    curve: Curve
    white: float

    def colors(
        self, radiance: Float[np.ndarray, "h w c"], inside: Bool[np.ndarray, "h w"] | None = None
    ) -> Float[np.ndarray, "h w 3"]:
        """Encode one or three channels as RGB; pixels `inside` choose the exposure."""
        picture = jnp.broadcast_to(jnp.asarray(radiance), (*radiance.shape[:2], 3))
        exposure = self.exposure
        if exposure is None:
            exposure = float(
                auto_exposure(picture, None if inside is None else jnp.asarray(inside))
            )
        return np.asarray(tone_map(picture, exposure, curve=self.curve, white=self.white))


def read_tone(exposure: float | None, curve: Curve, white: float) -> Tone:
    """Check the arguments; raises `ValueError` for what is out of range."""
    check_choice("curve", curve, ("clip", "reinhard"))
    white = check_number("white", white, above=0.0, infinite=True)
    if exposure is not None:
        exposure = check_number("exposure", exposure, least=0.0)
    return Tone(exposure, curve, white)
