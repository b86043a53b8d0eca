"""A chunk of a bake's vertices as one program for any device, rays included."""

import functools
import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float, Int

from ..._core.linalg import matmul
from ...geometry import RayTree
from ...geometry._pairs import cast_pairs, met_along
from ._directions import Directions
from ._receivers import Faces, unshadowed

# Numbers that a bounce looks up at once at the ends of its rays, for each lane.
_LOOKED_UP = 128


class Lights(NamedTuple):
    """Holds D directions on a device, the G guides first; see `Directions`."""

    vectors: Float[Array, "d 3"]
    rays: Float[Array, "d 3"]  # the same in float32
    basis: Float[Array, "d k"]  # y_i times the directions' weight
    nearest: Int[Array, " r"]  # the guide of each direction that is none
    around: Int[Array, "n g"]


class Reflectors(NamedTuple):
    """Holds the faces that light bounces off, and what leaves their vertices, on a device."""

    vectors: Float[Array, "d 3"]  # of equal weight
    rays: Float[Array, "d 3"]  # the same in float32
    faces: Int[Array, "f 3"]
    outward: Float[Array, "f 3"]  # float32, the largest component of each about 1
    outgoing: Float[Array, "v k"]


def lights(directions: Directions) -> Lights:
    """Put directions on the default device."""
    return Lights(
        vectors=jnp.asarray(directions.vectors),
        rays=jnp.asarray(directions.vectors.astype(np.float32)),
        basis=jnp.asarray(directions.basis),
        nearest=jnp.asarray(directions.nearest.astype(np.int32)),
        around=jnp.asarray(directions.around.astype(np.int32)),
    )


def reflectors(
    vectors: Float[np.ndarray, "d 3"], surface: Faces, outgoing: Float[Array, "v k"]
) -> Reflectors:
    """Put what a bounce needs on the default device; only signs are asked of `outward`."""
    _, exponent = np.frexp(np.abs(surface.outward).max(axis=1, keepdims=True, initial=0))
    return Reflectors(
        vectors=jnp.asarray(vectors),
        rays=jnp.asarray(vectors.astype(np.float32)),
        faces=jnp.asarray(surface.faces.astype(np.int32)),
        outward=jnp.asarray(np.ldexp(surface.outward, -exponent).astype(np.float32)),
        outgoing=outgoing,
    )


@functools.partial(jax.jit, static_argnames=("degree", "lanes", "cosine"))
def shadowed_rows(
    tree: RayTree,
    origins: Float[Array, "m 3"],
    normals: Float[Array, "m 3"],
    lights: Lights,
    *,
    degree: int,
    lanes: int,
    cosine: bool = True,
) -> Float[Array, "m k"]:
    """Compute what `shadowed` does, in one program: cosines, two casts of rays and a product.

    `origins` are float32, in the tree's frame. All rays of the guides are cast first, and then
    those of the other directions whose guide does not speak for them.
    """
    cosines = _cosines(normals, lights.vectors, cosine)
    above = cosines > 0
    cast = functools.partial(cast_pairs, tree, origins, first=False, lanes=lanes)
    guides = lights.around.shape[1]
    known = above[:, :guides]
    answer = cast(lights.rays[:guides], known) >= 0
    blocked = answer
    if len(lights.nearest):
        doubtful = ~known
        for other in lights.around:
            doubtful |= (answer != answer[:, other]) & known[:, other]
        rest = above[:, guides:]
        asked = rest & doubtful[:, lights.nearest]
        told = rest & ~asked & answer[:, lights.nearest]
        blocked = jnp.concatenate([answer, told | (cast(lights.rays[guides:], asked) >= 0)], axis=1)
    exact = unshadowed(normals, degree, cosine)
    coefficients = exact - matmul(jnp.where(blocked, cosines, 0), lights.basis)
    dark = jnp.any(above, axis=1) & jnp.all(above == blocked, axis=1)
    return jnp.where(dark[:, None], 0, coefficients)


@functools.partial(jax.jit, static_argnames=("lanes", "cosine"))
def bounced_rows(
    tree: RayTree,
    origins: Float[Array, "m 3"],
    normals: Float[Array, "m 3"],
    reflectors: Reflectors,
    *,
    lanes: int,
    cosine: bool = True,
) -> Float[Array, "m k"]:
    """Compute what `bounced` does, in one program."""
    cosines = _cosines(normals, reflectors.vectors, cosine)
    rays = reflectors.rays
    leaf = cast_pairs(tree, origins, rays, cosines > 0, first=True, lanes=lanes)
    faces, outward, outgoing = reflectors.faces, reflectors.outward, reflectors.outgoing

    def gathered(row: tuple[Array, Array, Array]) -> Float[Array, " k"]:
        origin, cosine, leaf = row
        found = met_along(tree, origin, rays, leaf)
        ours = (found.triangle >= 0) & (found.triangle < len(faces))
        face = jnp.where(ours, found.triangle, 0)
        front = jnp.sum(outward[face] * rays, axis=1) < 0
        weight = jnp.where(ours & front, cosine * (4 * math.pi / len(rays)), 0)
        share = weight[:, None] * found.barycentric.astype(cosine.dtype)
        corner = faces[face]
        each = (jnp.sum(share[:, i, None] * outgoing[corner[:, i]], axis=0) for i in range(3))
        return functools.reduce(jnp.add, each)

    # Not all rows at once, for what is looked up takes K numbers for each corner and ray.
    most = max(_LOOKED_UP * lanes // (3 * len(rays) * outgoing.shape[1]), 1)
    together = min(1 << most.bit_length() - 1, len(origins))
    return lax.map(gathered, (origins, cosines, leaf), batch_size=together)


def _cosines(
    normals: Float[Array, "m 3"], vectors: Float[Array, "d 3"], cosine: bool
) -> Float[Array, "m d"]:
    """Compute by what light along each direction counts: without cosine 1, but for zero normals.

    Those fill the last chunk up, and cast no ray.
    """
    if cosine:
        return matmul(normals, vectors.T)
    defined = jnp.any(normals != 0, axis=1, keepdims=True).astype(normals.dtype)
    return jnp.broadcast_to(defined, (len(normals), len(vectors)))
