"""Radiance cubes made up at random: every texel sees a plane of its own."""

import jax.numpy as jnp
import numpy as np

from jaxsh import harmonics
from jaxsh.midrange import (
    RadianceCube,
)
from jaxsh.sphere import cube_map


def random_cube(rng, resolution=4, dtype=np.float64, batch=(), sky=0.1):
    directions = np.asarray(cube_map(resolution).directions)
    shape = (*batch, len(directions))
    normal = rng.normal(size=(*shape, 3))
    normal -= directions * (1.3 * np.abs(np.sum(normal * directions, -1)) + 0.3)[..., None]
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    normal *= -np.sign(np.sum(normal * directions, -1))[..., None]
    distance = rng.uniform(1, 3, shape)
    offset = distance * np.sum(normal * directions, -1)
    nothing = rng.uniform(size=shape) < sky
    arrays = {
        "radiance": rng.uniform(size=(*shape, 3)),
        "distance": np.where(nothing, np.inf, distance),
        "plane_distance": np.where(nothing, -np.inf, offset),
        "normal": np.where(nothing[..., None], 0, normal),
        "point": rng.normal(size=(*batch, 3)),
    }
    return RadianceCube(**{name: jnp.asarray(array, dtype) for name, array in arrays.items()})


def moved(cube, d, degree):
    """The texel form at point + d, Σ L dω (1 - n·d/h) y(ω′) (r/r′)³: (3, K)."""
    near = jnp.isfinite(cube.distance)
    r, h = jnp.where(near, cube.distance, 1), jnp.where(near, cube.plane_distance, 1)
    s = cube.directions * r[:, None] - jnp.outer(near.astype(d.dtype), d)
    shrunk = (r / jnp.sqrt(jnp.sum(s * s, axis=-1))) ** 3 * (1 - cube.normal @ d / h)
    basis = harmonics.evaluate(s, degree)
    return jnp.einsum("nc,n,nk->ck", cube.radiance, shrunk * cube.solid_angles, basis)
