"""A transfer on a sphere, for the tests of tiles."""

import jax.numpy as jnp
import numpy as np

from jaxsh import harmonics, sphere, transfer

COUNT, DEGREE = 300, 3
WIDTH = (DEGREE + 1) ** 2


def shadowed_ball(rng) -> transfer.Transfer:
    """A sphere with shadows that differ from vertex to vertex."""
    normals = sphere.fibonacci(COUNT).directions
    cosine = harmonics.clamped_cosine(DEGREE)[harmonics.degrees(DEGREE)]
    open_sky = harmonics.evaluate(normals, DEGREE) * cosine[None]
    shadows = rng.normal(size=(COUNT, WIDTH)) * 0.05
    ring = (np.arange(COUNT)[:, None] + np.array([-1, 1])) % COUNT
    return transfer.Transfer(open_sky + shadows, normals, normals, jnp.asarray(ring, jnp.int32))
