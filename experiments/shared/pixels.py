"""Irradiance by all pixels of a lat-long picture, without harmonics."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import sphere


def solid_angles(height: int, width: int) -> Float[np.ndarray, "h 1"]:
    """Exact solid angles of the pixels, the same along a row."""
    edges = np.cos(np.arange(height + 1) * np.pi / height)
    return (edges[:-1, None] - edges[1:, None]) * 2 * np.pi / width


@jax.jit
def direct_irradiance(
    normals: Float[Array, "v 3"], environment: Float[Array, "h w 3"]
) -> Float[Array, "v 3"]:
    """∫ L(ω) max(0, n·ω) dω over all pixels, with their exact solid angles as weights."""
    height, width, _ = environment.shape
    weights = jnp.asarray(solid_angles(height, width), environment.dtype)
    weighted = (environment * weights[..., None]).reshape(-1, 3)
    directions = sphere.lat_long(height, width).directions.astype(environment.dtype)

    def one(normal):
        cosine = jnp.maximum(jnp.matmul(directions, normal, precision="highest"), 0)
        return jnp.matmul(cosine, weighted, precision="highest")

    return jax.lax.map(one, normals, batch_size=64)  # 32 MB of cosines at a time
