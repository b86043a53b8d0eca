"""Baking transfer: rays for every vertex, point or texel, projected."""

import os
import warnings
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from ..._core.checks import as_path
from ...geometry import Mesh, RayScene, Surface
from .._surfaces import points_and_normals
from .._transfer import Transfer
from ._blind import why_blind
from ._device import DeviceJob, jobs_of, scene_for
from ._faults import check_first, checked, faults
from ._job import DIRECT, BakeArguments, Prepared
from ._kept import BakeStore, neighbors_of, refuse
from ._origins import origins
from ._passes import Passes, progress_bar
from ._receivers import unit_normals, units_of


def bake(
    surface: Surface,
    degree: int,
    *,
    directions: int = 2048,
    shadows: bool = True,
    bounces: int = 0,
    albedo: Float[ArrayLike, "*v"] = 0.5,
    ray_bias: float | None = None,
    offset: float | None = None,
    scene: RayScene | Mesh | None = None,
    device: bool | None = None,
    seed: int = 0,
    chunk: int = 256,
    store: str | os.PathLike[str] | None = None,
    progress: bool = True,
) -> Transfer:
    """Bake the transfer of a surface: at each point ∫ V(ω) max(0, n·ω) y_i(ω) dω, by rays.

    Sloan, Kautz & Snyder 2002, "Precomputed radiance transfer". All points share one even set
    of directions, turned at random by `seed`. Rays are spent where they matter most:

    - The blocked part is measured and subtracted from the cosine's exact coefficients. Where
      nothing is blocked no error is left.
    - The set holds 2¼ times `directions`. Half of `directions`, spread evenly over it, are cast
      first, and others only next to where neighbors among these disagree: along the edges of
      shadows. A blocker so thin that it lies between them is missed.

    **Arguments**

    - `surface`: a `Mesh`, whose vertices are the points; `geometry.Texels`; or `geometry.Points`,
      of which those without normals are of a volume, with visibility alone: ∫ V(ω) y_i(ω) dω over
      the whole sphere, for `fluence`.
    - `degree`: the largest l; K = (degree+1)² coefficients.
    - `directions`: rays granted, over the whole sphere. About half as many leave a vertex (a point
      of a volume as many), more where shadows are intricate, fewer where there are none. The
      coefficients' relative RMS error falls about as its power -3/4; at degree 10 and 2,048 it is
      0.4 % on a head and 1.4 % on a statue with fine folds (experiment `sloan2002.first_light`).
    - `shadows`: `False` leaves out visibility, and all rays.
    - `bounces`: how often light may be reflected diffusely on its way. Each casts the half
      of an even set of `directions` that leaves a vertex, again from every vertex. Light bounces
      off the vertices of a mesh: the surface itself, that of the texels, or the `scene`, whose own
      transfer is then baked first, with one bounce less, and gathered at the points.
    - `albedo`: of the bounces only, a number or one per vertex of that mesh. Backs of faces reflect
      nothing, and neither do further meshes of a `scene`.
    - `ray_bias`: where rays start along the normal, as a share of half the mesh's longest extent
      along an axis (of points under a scene of rays, theirs), the same at each vertex. By default
      1e-5 of it, and at most 1/1000 of the vertex's shortest edge and half of the gap to the next
      surface above it. Never less than 4 times what coordinates are rounded to: a surface nearer
      than that casts no shadow. Larger ones lose fine shadows; one `UserWarning` says where they
      pass 1/10 of the shortest edge.
    - `offset`: the same as a distance in the unit of the vertices, in place of `ray_bias`.
    - `scene`: the surfaces that stop rays, in place of the mesh, or that of the texels, alone:
      another `Mesh`, or any `geometry.RayScene`. For bounces the mesh must be the first in the
      latter. `Points` stop no rays, and need one of the two; for bounces a `Mesh`. By default
      `geometry.ray_scene(mesh)`, which casts by JAX where Embree is not installed.
    - `device`: `True` casts the rays on JAX's default device, in one program for each of a few
      chunks of points, and the coefficients stay there; a `scene` must then be a `Mesh` or a
      `geometry.JaxRayScene`, on whose device it is done. `False` casts them on the host. By default
      they are cast on a GPU or TPU where that is the default device and `scene` allows it. The two
      differ where rays graze an edge, by far less than two seeds do (experiment `devices.bake`).
    - `chunk`: points in a block, rounded up to a multiple of 64. Each core works on one block. On
      a device its size and `directions` decide.
    - `store`: a folder, made here, that keeps the blocks finished so far and in the end the whole
      transfer, for any reader of Zarr 3. A bake that was stopped goes on from it when called again
      with the same arguments, and blocks that are damaged are baked again. It does not record
      a scene of rays: pass the same one when you resume.
    - `progress`: shows a bar when standard error is a terminal and the bake takes over a second.

    **Returns** a `Transfer` of the dtype of the positions, which says what its points are
    (`surface`, `cosine`, `belongs_to`); points and texels have no neighbors. On one machine a seed
    gives the same bits whatever the chunk, the number of threads and the interruptions.

    Rays of texels start off the curved surface that the normals of their face's vertices tell of,
    where that lies above the face (Hanika 2021, "Hacking the shadow terminator"): from the flat
    face light from the side would be lost between the vertices of a coarse mesh. `Points` that lie
    a little inside the mesh see nothing: give an `offset`. Those without normals start their rays
    where they are: exactly on a surface they see one side of it or nothing, by chance.

    Meshes may have any size and lie anywhere. What float32 rounds coordinates to is lost: give
    those of a map less their middle, or in float64.

    The direct light's coefficients are zero where the normal is undefined (it is zero, NaN or
    infinite, or the vertex's faces cancel) and where all rays are blocked, as they are inside the
    mesh; one `UserWarning` counts these points and says why. Surfaces that coincide are in front
    of each other by chance: leave a gap. Of rays that graze a surface within rounding a few hit
    what they miss, by Embree more than by `geometry.JaxRayScene`.

    Raises `ValueError` for arguments and values out of range, and for the store of another bake or
    another thing, which is left as it is; `OSError` where the store cannot be written. Runs outside
    `jit`, what is done once for the mesh in NumPy, and does not shard: `Transfer.sharded` shares
    the result out. Not differentiable: visibility is a step.

    **Example**

    >>> from jaxsh import geometry, transfer
    >>> baked = transfer.bake(geometry.knot(300), degree=2, directions=64)
    >>> baked.coefficients.shape, baked.degree
    ((300, 9), 2)
    >>> space = geometry.Points(baked.positions + 2)
    >>> around = transfer.bake(space, degree=2, directions=64, scene=geometry.knot(300))
    >>> around.surface, around.cosine
    ('points', False)
    """
    path = None if store is None else as_path(store, "store").absolute()
    arguments, mesh, cast = checked(
        surface,
        degree,
        directions=directions,
        shadows=shadows,
        bounces=bounces,
        albedo=albedo,
        ray_bias=ray_bias,
        offset=offset,
        seed=seed,
        chunk=chunk,
        scene=scene,
        device=device,
    )
    identity = {} if path is None else arguments.identity(surface)
    if path is not None:
        refuse(path, identity)
    normals = units_of(surface)
    caster, start, reflector = None, None, None
    positions = np.asarray(points_and_normals(surface)[0])
    if shadows:
        caster = scene_for(mesh, arguments.device) if cast is None else cast
        start = origins(surface, normals, caster, ray_bias, offset, mesh=mesh)
        positions = start.positions
        if arguments.bounces:
            assert mesh is not None
            known, off = normals, start
            if arguments.apart:
                known = unit_normals(mesh)
                off = origins(mesh, known, caster, ray_bias, offset)
                reflector = Prepared(known, off.positions)
            if cast is not None:
                check_first(mesh, cast, known, off)

    def why(blind: Int[np.ndarray, " n"]) -> list[str]:
        if caster is None or start is None:
            return []
        return why_blind(surface, mesh, caster, blind, normals, start)

    prepared = Prepared(normals, positions)
    jobs = jobs_of(mesh, arguments, caster, prepared, reflector)
    kept = None
    if path is not None:
        kept = BakeStore.of(path, surface, mesh, arguments, prepared, reflector, identity)
    steps = jobs.steps
    with progress_bar(sum(jobs.of(n).num_points for n in range(len(steps))), progress) as bar:
        passes = Passes(jobs, chunk, kept, bar)

        def run(number: int, before: Any = None, direct: Any = None) -> Any:
            job = jobs.of(number)
            if kept is None and isinstance(job, DeviceJob):
                return job.whole(bar, steps[number].before is not None, before, direct)
            return passes.run(number, before, direct)

        if kept is not None and kept.finished:
            said = kept.attributes["warning"]
            coefficients = run(len(steps) - 1)
        else:
            said, done = "", dict[int | None, Any]()
            for number, step in enumerate(steps):
                done[number] = run(number, done.get(step.before), done.get(step.direct))
                if step == DIRECT:
                    blind = ~np.asarray(done[number].any(axis=1)) & normals.any(axis=1)
                    said = faults(surface, normals, np.flatnonzero(blind), why)
                wanted = {n for later in steps[number + 1 :] for n in (later.before, later.direct)}
                done = {n: rows for n, rows in done.items() if n in wanted or n == number}
            coefficients = done[len(steps) - 1]
            if kept is not None:
                kept.finish(said)
    if said:
        warnings.warn(said, UserWarning, stacklevel=2)
    return _transfer(surface, arguments, coefficients, kept)


def _transfer(
    surface: Surface,
    arguments: BakeArguments,
    coefficients: Float[np.ndarray | Array, "v k"],
    kept: BakeStore | None,
) -> Transfer:
    # Where JAX computes in single precision its arrays are single, as those of the surface become.
    dtype = jax.dtypes.canonicalize_dtype(coefficients.dtype)
    positions, normals = points_and_normals(surface)
    return Transfer(
        coefficients=jax.device_put(coefficients.astype(dtype, copy=False)),
        positions=jnp.asarray(positions),
        normals=jnp.zeros_like(positions) if normals is None else jnp.asarray(normals),
        neighbors=neighbors_of(surface) if kept is None else kept.whole("neighbors"),
        surface=arguments.surface,
        cosine=arguments.cosine,
    )
