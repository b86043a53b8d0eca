"""Baking transfer: rays for every vertex, projected."""

import functools
import math
import os

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from ... import geometry
from ..._core.checks import as_path, check_degree, check_size, check_type
from ...geometry import Mesh, RayScene, ray_scene
from .._transfer import Transfer
from ._blind import why_blind
from ._checkpoint import Checkpoint, fingerprint
from ._directions import guided, turned_fibonacci
from ._faults import check_arguments, report
from ._gather import TILE, bounced, shadowed
from ._origins import origins
from ._passes import Passes, progress_bar
from ._receivers import Receivers, surface, unit_normals, unshadowed


def bake(
    mesh: Mesh,
    degree: int,
    *,
    directions: int = 2048,
    shadows: bool = True,
    bounces: int = 0,
    albedo: Float[ArrayLike, "*v"] = 0.5,
    ray_bias: float | None = None,
    offset: float | None = None,
    scene: RayScene | None = None,
    seed: int = 0,
    chunk: int = 256,
    checkpoint: str | os.PathLike[str] | None = None,
    progress: bool = True,
) -> Transfer:
    """Bake the transfer of a mesh: for each vertex ∫ V(ω) max(0, n·ω) y_i(ω) dω, by rays.

    Sloan, Kautz & Snyder 2002, "Precomputed radiance transfer". All vertices share one even set
    of directions, turned at random by `seed`. Rays are spent where they matter most:

    - The blocked part is measured and subtracted from the cosine's exact coefficients. Where
      nothing is blocked no error is left.
    - The set holds 2¼ times `directions`. Half of `directions`, spread evenly over it, are cast
      first, and others only next to where neighbors among these disagree: along the edges of
      shadows. A blocker so thin that it lies between them is missed.

    **Arguments**

    - `degree`: the largest l; K = (degree+1)² coefficients.
    - `directions`: rays granted, over the whole sphere. About half as many leave a vertex, more
      where shadows are intricate, fewer where there are none. The coefficients' relative RMS error
      falls about as its power -3/4; at degree 10 and 2,048 it is 0.4 % on a head and 1.4 % on a
      statue with fine folds (experiment `sloan2002.first_light`).
    - `shadows`: `False` leaves out visibility, and all rays.
    - `bounces`: how often light may be reflected diffusely on its way. Each casts the half
      of an even set of `directions` that leaves a vertex, again from every vertex.
    - `albedo`: of the bounces only, a number or one per vertex (V,). Backs of faces reflect
      nothing, and neither do further meshes of a `scene`.
    - `ray_bias`: where rays start along the normal, as a share of half the mesh's longest extent
      along an axis, the same at each vertex. By default 1e-5 of it, and at most 1/1000 of the
      vertex's shortest edge and half of the gap to the next surface above it. Never less than 4
      times what coordinates are rounded to: a surface nearer than that casts no shadow. Larger
      ones lose fine shadows; one `UserWarning` says where they pass 1/10 of the shortest edge.
    - `offset`: the same as a distance in the unit of the vertices, in place of `ray_bias`.
    - `scene`: the surfaces that stop rays, where these are not the mesh alone: any
      `geometry.RayScene`. For bounces the mesh must be the first in it. By default
      `geometry.ray_scene(mesh)`, which casts by JAX where Embree is not installed.
    - `chunk`: vertices in a block, rounded up to a multiple of 64. Each core works on one block.
    - `checkpoint`: a file that keeps the blocks finished so far. A bake that was stopped goes on
      from it when called again with the same arguments; it is removed when the bake is done. It
      does not record `scene`: pass the same one when you resume.
    - `progress`: shows a bar when standard error is a terminal and the bake takes over a second.

    **Returns** a `Transfer` of the dtype of the mesh's vertices. On one machine a seed gives the
    same bits whatever the chunk, the number of threads and the interruptions.

    Meshes may have any size and lie anywhere. What float32 rounds coordinates to is lost: give
    those of a map less their middle, or in float64.

    The direct light's coefficients are zero where the normal is undefined (it is zero, NaN or
    infinite, or the vertex's faces cancel) and where all rays are blocked, as they are inside the
    mesh; one `UserWarning` counts these vertices and says why. Surfaces that coincide are in front
    of each other by chance: leave a gap. Of rays that graze a surface within rounding a few hit
    what they miss, by Embree more than by `geometry.JaxRayScene`.

    Raises `ValueError` for arguments and values out of range, and for the checkpoint of another
    bake. Runs in NumPy on the host, outside `jit`, and does not shard: give the result's arrays to
    `jax.device_put`. Not differentiable: visibility is a step.

    **Example**

    >>> from jaxsh import geometry, transfer
    >>> baked = transfer.bake(geometry.knot(300), degree=2, directions=64)
    >>> baked.coefficients.shape, baked.degree
    ((300, 9), 2)
    """
    degree = check_degree(degree)
    seed = check_size("seed", seed, least=0)
    if scene is not None:
        check_type("scene", scene, RayScene)
    if checkpoint is not None:
        checkpoint = as_path(checkpoint, "checkpoint")
    check_arguments(mesh, directions, shadows, bounces, albedo, ray_bias, offset, chunk)
    normals = unit_normals(mesh)
    exact = unshadowed(normals, degree)
    if not shadows:
        report(mesh, normals, exact, lambda blind: [])
        return _transfer(mesh, exact)

    shape, dtype = exact.shape, exact.dtype
    reflected = np.asarray(albedo, dtype).reshape(-1, 1) / math.pi
    file = None
    if checkpoint is not None:
        identity = {
            "mesh": fingerprint(mesh.vertices, mesh.faces, mesh.normals),
            "degree": degree,
            "directions": directions,
            "bounces": bounces,
            "albedo": fingerprint(reflected),
            "ray_bias": ray_bias,
            "offset": offset,
            "scene": scene is not None,
            "seed": seed,
        }
        file = Checkpoint(checkpoint, identity, (TILE, shape[1]), dtype)
    scene = ray_scene(mesh) if scene is None else scene
    start = origins(mesh, normals, scene, ray_bias, offset)
    points = Receivers(start.positions, normals, exact)
    with progress_bar((1 + bounces) * len(normals), progress) as bar:
        passes = Passes(shape, dtype, chunk, file, bar)
        lights = guided(directions, degree, seed, dtype)
        direct = passes.run(0, functools.partial(shadowed, scene, points, lights))
        report(mesh, normals, direct, lambda blind: why_blind(mesh, scene, blind, normals, start))
        coefficients = direct
        if bounces:
            vectors, met = turned_fibonacci(directions, seed, dtype), surface(mesh)
            for bounce in range(1, bounces + 1):
                # T_{b+1} = T_0 + ∫ over blocked directions of cosine · albedo/π · T_b at the hit.
                outgoing = reflected * coefficients
                gather = functools.partial(bounced, scene, points, vectors, met, outgoing)
                coefficients = direct + passes.run(bounce, gather)
    if file:
        file.remove()
    return _transfer(mesh, coefficients)


def _transfer(mesh: Mesh, coefficients: Float[np.ndarray, "v k"]) -> Transfer:
    return Transfer(
        coefficients=jnp.asarray(coefficients),
        positions=jnp.asarray(mesh.vertices),
        normals=jnp.asarray(mesh.normals),
        neighbors=geometry.neighbors(mesh),
    )
