"""Daylight in a few numbers: sun, sky and ground, and the light they make together."""

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from .. import sky as sky_room
from .._core.checks import check_degree, check_flag, check_function
from ..harmonics import evaluate, num_coefficients
from ..sphere import Suns
from ._fit_sky import Sky, preetham

# Irradiance of a surface that faces a uniform disc of the sun's size and radiance 1. The light is
# taken to come from its center: of degree 10 a coefficient of the disc itself is 3e-4 smaller.
DISC = math.pi * math.sin(sky_room.SUN_RADIUS) ** 2


class Daylight(eqx.Module):
    """Sun, sky and ground: what lights a surface outdoors.

    - `sun`: unit vector (3,) towards the sun.
    - `turbidity`, `exposure`: those of the sky, as in `SkyLight`.
    - `sun_radiance`: of the sun's disc (3,), of radius `sky.SUN_RADIUS`, before the exposure. Over
      `sky.sun_radiance(sun, turbidity)` it says how clear the sun is, in each channel.
    - `ground`: albedo (3,) of diffuse ground below the horizon, lit by sun and sky.

    In a `Confidence` the deviations of each; √(x² + y² + z²) of the sun's is the RMS angle, in
    radians, by which it may be off. Found by `fit_daylight`.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import inverse, sky
    >>> sun, haze = jnp.asarray([0.6, 0.0, 0.8]), jnp.asarray(3.0)
    >>> disc, ground = sky.sun_radiance(sun, haze), jnp.full(3, 0.2)
    >>> noon = inverse.Daylight(sun, haze, jnp.asarray(1.0), disc, ground)
    >>> noon.harmonics(4).shape
    (3, 25)
    """

    sun: Float[Array, " 3"]
    turbidity: Float[Array, ""]
    exposure: Float[Array, ""]
    sun_radiance: Float[Array, " 3"]
    ground: Float[Array, " 3"]

    def harmonics(
        self, degree: int, *, sun: bool = True, sky: Sky | None = None
    ) -> Float[Array, "3 k"]:
        """Coefficients (3, K) of the light, in the unit of what was observed.

        `sun=False` leaves out the sun's disc, which `suns` is beside it, though not what it makes
        of the ground. `sky`: as for `fit_daylight`, Preetham's by default, of degree 6 at most:
        what is beyond is zero. Differentiable. Raises `ValueError` for a degree below 1, which
        cannot tell ground from sky.
        """
        degree = check_degree(degree)
        if degree < 1:
            raise ValueError("daylight needs degree >= 1, got 0")
        if sky is None:
            sky = preetham(min(degree, 6), (2.0, 10.0))
        check_function("sky", sky)
        diffuse, disc = self.parts(num_coefficients(degree), sky)
        return diffuse + disc if check_flag("sun", sun) else diffuse

    @property
    def suns(self) -> Suns:
        """The sun's disc, for `transfer.shade_sun`, in the unit of what was observed."""
        size = jnp.full(1, 4 * math.pi * math.sin(sky_room.SUN_RADIUS / 2) ** 2, self.sun.dtype)
        return Suns(self.sun[None], size, (self.exposure * self.sun_radiance)[None])

    def parts(self, count: int, sky: Sky) -> tuple[Float[Array, "3 k"], Float[Array, "3 k"]]:
        """`count` coefficients of sky and ground, which the sun lights too, and of the sun."""
        above = sky(self.sun, self.turbidity)[:, :count]
        above = self.exposure * jnp.pad(above, ((0, 0), (0, count - above.shape[1])))
        basis = evaluate(self.sun, math.isqrt(count) - 1)
        sun = self.facing[:, None] * basis[None]
        return sky_room.with_ground(above + sun, self.ground) - sun, sun

    @property
    def facing(self) -> Float[Array, " 3"]:
        """Irradiance (3,) of a surface that faces the sun, by the sun alone."""
        return DISC * self.exposure * self.sun_radiance
