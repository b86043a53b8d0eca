"""Radiance cubes: cube maps of radiance and of the planes that it comes from."""

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._core.checks import as_float
from .._core.xla import device_cache
from ..sphere import Quadrature, cube_map


class RadianceCube(eqx.Module):
    """Holds the N = 6·resolution² texels of a cube map around `point`, in the order of `cube_map`.

    With s the way from the point to what a texel's center sees, its surface has the unit `normal`
    n, turned towards the point, the `distance` r = |s| and the signed `plane_distance` h = n·s < 0.
    A texel that sees nothing near has r = inf, h = -inf and n = 0; its radiance is that of the sky.
    The leading axes are those of the points. Each surface is taken to send the same radiance to
    all sides (Annen et al. 2004, §4).

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> corners = jnp.array([[1.0, -1, 2], [-1, -1, 2], [-1, 1, 2], [1, 1, 2]])
    >>> light = midrange.Polygon(corners, jnp.ones(3))
    >>> cube = midrange.capture(midrange.Scene([light]), jnp.zeros(3), 8, rays="analytic")
    >>> cube.resolution, cube.plane_distance.shape
    (8, (384,))
    """

    radiance: Float[Array, "*batch n 3"] = eqx.field(converter=as_float)
    distance: Float[Array, "*batch n"] = eqx.field(converter=as_float)
    plane_distance: Float[Array, "*batch n"] = eqx.field(converter=as_float)
    normal: Float[Array, "*batch n 3"] = eqx.field(converter=as_float)
    point: Float[Array, "*batch 3"] = eqx.field(converter=as_float)

    def __check_init__(self):
        *batch, count = self.distance.shape
        shapes = {
            "radiance": (*batch, count, 3),
            "plane_distance": (*batch, count),
            "normal": (*batch, count, 3),
            "point": (*batch, 3),
        }
        wrong = [name for name, shape in shapes.items() if getattr(self, name).shape != shape]
        if count == 0 or count != 6 * math.isqrt(count // 6) ** 2 or wrong:
            said = ", ".join(
                f"{name} {getattr(self, name).shape}" for name in ("distance", *shapes)
            )
            raise ValueError(f"expected N = 6·resolution² texels in the same batch, got {said}")

    @property
    def resolution(self) -> int:
        """Texels along a side of a face."""
        return math.isqrt(self.distance.shape[-1] // 6)

    @property
    def directions(self) -> Float[Array, "n 3"]:
        """Unit vectors ω through the texels' centers."""
        return texels(self.resolution).directions.astype(self.distance.dtype)

    @property
    def solid_angles(self) -> Float[Array, " n"]:
        """Exact ones dω of the texels; their sum is 4π."""
        return texels(self.resolution).weights.astype(self.distance.dtype)


@device_cache(maxsize=8)
def texels(resolution: int) -> Quadrature:
    """`cube_map`, kept."""
    return cube_map(resolution)


def inverse_distances(cube: RadianceCube) -> tuple[Float[Array, "... n"], Float[Array, "... n 3"]]:
    """1/r and q = n/h of each texel: all that derivatives need of a plane, for 1/r = q·ω.

    Both are zero, exactly, where nothing is near, and where the plane is seen edge on to rounding,
    which no texel of a captured cube has much of.
    """
    epsilon = jnp.finfo(cube.distance.dtype).eps
    near = jnp.abs(cube.plane_distance) > epsilon * cube.distance  # false also for infinite ones
    inverse = jnp.where(near, 1 / jnp.where(near, cube.distance, 1), 0)
    offset = jnp.where(near, cube.plane_distance, 1)
    return inverse, jnp.where(near[..., None], cube.normal / offset[..., None], 0)
