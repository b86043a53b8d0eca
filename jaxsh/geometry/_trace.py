"""Rays through a tree of boxes, in JAX: many lanes walk in step, each with a ray of its own."""

import math
from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from .._core.checks import as_float, as_integer, check_size, check_type, described
from .._core.xla import keep_rows, on_mesh, rows_are_split
from ._tree import RayTree
from ._triangle import meet

# Boxes that each lane passes between two tests of triangles.
_BURST = 4
# Boxes grow by this share of the distance, more than it is rounded by (Ize 2013: 2.4e-7).
_SLACK = 1e-6


class Trace(NamedTuple):
    """Holds what n rays met, as `trace` gives it.

    A miss has infinite `distance`, `triangle` -1 and zero `barycentric`.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import geometry
    >>> ray = jnp.array([[0.0, 0.0, 3.0]], jnp.float32)
    >>> found = geometry.trace(geometry.JaxRayScene(geometry.knot(300)).tree, ray, ray)
    >>> found.triangle.tolist(), found.distance.tolist()
    ([-1], [inf])
    """

    distance: Float[Array, " n"]  # in lengths of the direction
    triangle: Int[Array, " n"]  # through the faces of all meshes, in order
    barycentric: Float[Array, "n 3"]


class _Lanes(NamedTuple):
    """Holds where each of L lanes is, and what all rays so far have met."""

    ray: Int[Array, " L"]  # n: none
    origin: Float[Array, "3 L"]
    direction: Float[Array, "3 L"]
    node: Int[Array, " L"]  # 0: through with its ray
    pending: Int[Array, " L"]  # bit k: the sibling of the node's k-th ancestor is to be seen yet
    distance: Float[Array, " L"]  # to the nearest triangle so far
    leaf: Int[Array, " L"]  # which one; -1: none
    started: Int[Array, ""]  # rays that have been given to a lane
    found: Int[Array, " n"]  # the leaf of each ray that is through


def trace(
    tree: RayTree,
    origins: Float[Array, "n 3"],
    directions: Float[Array, "n 3"],
    max_distance: float | Float[Array, " n"] = math.inf,
    *,
    first: bool | Bool[Array, ""] = True,
    count: int | Int[Array, ""] | None = None,
    lanes: int = 2048,
) -> Trace:
    """Find the first triangle that each ray meets, or with `first=False` any one (for shadows).

    The pure core of `JaxRayScene`, for use inside `jit` and `vmap`: values are not looked at,
    distances are in lengths of the direction, and all is float32. `origins` and `directions` are
    (n, 3), directions of any length, origins in the coordinates of the meshes, wherever these lie
    and however large they are; only origins of many thousand times their size lose digits.
    `count` rays are cast (default: all), the rest miss; it may be traced, so that one compiled
    program serves any number of rays. A ray with a zero or NaN direction misses.

    A lane that is through takes the next ray as soon as a quarter are (Aila & Laine 2009); more
    `lanes` suit an accelerator. Rays shard: on a mesh of devices each has a lane of its own, and
    the tree must be whole on each device.

    Triangles are tested as by Woop, Benthin & Wald 2013: the test of an edge gives the same answer
    from both its faces, so nothing slips between them. Boxes are walked near to far without a
    stack, one bit for each level (Áfra & Szirmay-Kalos 2014). Constant to differentiation: zero
    gradients in all arguments.

    **Example**

    >>> import jax, jax.numpy as jnp
    >>> from jaxsh import geometry
    >>> tree = geometry.JaxRayScene(geometry.knot(300)).tree
    >>> origins = jnp.array([[0.0, 0.0, 3.0], [3.0, 0.0, 0.0]], jnp.float32)
    >>> found = jax.jit(geometry.trace)(tree, origins, -origins)
    >>> found.triangle.shape, found.barycentric.shape
    ((2,), (2, 3))
    """
    check_type("tree", tree, RayTree)
    origins, directions = as_float(origins, "origins"), as_float(directions, "directions")
    max_distance = as_float(max_distance, "max_distance")
    for name, rays in (("origins", origins), ("directions", directions)):
        if rays.ndim != 2 or rays.shape != (len(origins), 3):
            raise ValueError(f"expected {name} (n, 3), got shape {rays.shape}")
    if max_distance.shape not in ((), (len(origins),)):
        raise ValueError(
            f"expected max_distance as a number or ({len(origins)},), got shape "
            f"{max_distance.shape}"
        )
    lanes = check_size("lanes", lanes)
    if not isinstance(first, bool) and not (isinstance(first, Array) and first.shape == ()):
        raise ValueError(f"first must be True or False, got {described(first)}")
    if count is not None and as_integer(count, "count").ndim:
        raise ValueError(f"expected count as a number, got {described(count)}")
    tree, origins, directions, max_distance = lax.stop_gradient(
        (tree, origins, directions, max_distance)
    )
    size = len(origins)
    limits = jnp.broadcast_to(jnp.asarray(max_distance, jnp.float32), size)
    if size == 0:
        return Trace(limits, jnp.zeros(0, jnp.int32), jnp.zeros((0, 3), jnp.float32))
    end = jnp.asarray(size if count is None else count, jnp.int32)
    # Lanes that take rays from one queue would gather shared-out rays on each device.
    apart = on_mesh(origins, directions)
    like = origins if rows_are_split(origins) else directions

    def within(tree: RayTree, origins, directions, limits, end) -> Trace:
        center = tree.center.astype(origins.dtype)[None]
        origins = (origins - center).astype(jnp.float32) * tree.scale
        directions = directions.astype(jnp.float32)
        length = _power_of_two(jnp.max(jnp.abs(directions), axis=1))
        directions = directions / length[:, None]
        limits = limits * tree.scale * length
        found = cast(
            tree, origins, directions, limits, first=first, count=end, lanes=lanes, apart=apart
        )
        return found._replace(distance=found.distance / tree.scale / length)

    return keep_rows(within, tree, origins, directions, limits, end, like=like, axis=0, out=0)


def cast(
    tree: RayTree,
    origins: Float[Array, "n 3"],
    directions: Float[Array, "n 3"],
    limits: Float[Array, " n"],
    *,
    first: bool | Bool[Array, ""],
    count: Int[Array, ""] | int,
    lanes: int,
    apart: bool = False,
) -> Trace:
    """Cast float32 rays that are in the tree's frame, with directions of about unit length."""
    end = jnp.asarray(count, jnp.int32)
    if apart:
        return _cast_apart(tree, origins, directions, limits, end, first)
    rays = jnp.concatenate([origins, directions], axis=1)

    def ray_of(at: Int[Array, " L"]) -> tuple[Array, Array, Array]:
        vectors = rays[at].T
        return vectors[:3], vectors[3:], limits[at]

    leaf = walk_in_lanes(tree, ray_of, len(rays), None, first=first, count=end, lanes=lanes)
    return met(tree, rays, leaf)


def _power_of_two(x: Float[Array, " n"]) -> Float[Array, " n"]:
    """Give the largest power of two up to x; 1 for zero, NaN and infinity."""
    bits = lax.bitcast_convert_type(x, jnp.int32) & 0x7F800000
    power = lax.bitcast_convert_type(bits, jnp.float32)
    return jnp.where((power > 0) & (power < jnp.inf), power, 1)


def walk_in_lanes(
    tree: RayTree,
    ray_of: Callable[[Int[Array, " L"]], tuple[Array, Array, Array]],
    size: int,
    queue: Int[Array, " n"] | None,
    *,
    first: bool | Bool[Array, ""],
    count: Int[Array, ""],
    lanes: int,
) -> Int[Array, " n"]:
    """Find the leaf that each of `size` rays meets, -1 for none, in lanes that take ray after ray.

    `ray_of` gives the origins (3, L), directions (3, L) and limits (L,) of rays by their numbers.
    `queue` begins with the numbers of the `count` rays that are cast; without one they are the
    first ones.
    """
    lanes = min(lanes, size)
    beyond = size + jnp.arange(lanes, dtype=jnp.int32)

    def refill(state: _Lanes) -> _Lanes:
        idle = state.node == 0
        # What is dropped has a place of its own beyond the end, so that no two write to one.
        place = jnp.where(idle & (state.ray < size), state.ray, beyond)
        found = state.found.at[place].set(state.leaf, mode="drop", unique_indices=True)
        turn = state.started + jnp.cumsum(idle, dtype=jnp.int32) - 1
        take = idle & (turn < count)
        new = turn if queue is None else _rows(queue, jnp.minimum(turn, size - 1))
        ray = jnp.where(take, new, jnp.where(idle, size, state.ray))
        origin, direction, limit = ray_of(jnp.minimum(ray, size - 1))
        return _Lanes(
            ray=ray,
            origin=origin,
            direction=direction,
            node=jnp.where(take, 1, state.node),
            pending=jnp.where(take, 0, state.pending),
            distance=jnp.where(take, limit, state.distance),
            leaf=jnp.where(take, -1, state.leaf),
            started=jnp.minimum(state.started + jnp.sum(idle, dtype=jnp.int32), count),
            found=found,
        )

    def busy(state: _Lanes) -> Bool[Array, ""]:
        enough = jnp.where(state.started < count, lanes * 3 // 4, 0)
        return jnp.sum(state.node > 0, dtype=jnp.int32) > enough

    def advance(state: _Lanes) -> _Lanes:
        return lax.while_loop(busy, lambda state: _burst(tree, state, first), refill(state))

    start = _Lanes(
        ray=jnp.full(lanes, size, jnp.int32),
        origin=jnp.zeros((3, lanes), jnp.float32),
        direction=jnp.zeros((3, lanes), jnp.float32),
        node=jnp.zeros(lanes, jnp.int32),
        pending=jnp.zeros(lanes, jnp.int32),
        distance=jnp.zeros(lanes, jnp.float32),
        leaf=jnp.full(lanes, -1, jnp.int32),
        started=jnp.int32(0),
        found=jnp.full(size, -1, jnp.int32),
    )
    last = lax.while_loop(lambda state: state.started < count, advance, start)
    return refill(last).found


def _cast_apart(tree: RayTree, origins, directions, limits, end, first: bool | Array) -> Trace:
    """Cast each ray in a lane of its own, so that rays may be shared out between devices."""
    rays = jnp.concatenate([origins, directions], axis=1)
    # Made of the rays, so that in `shard_map` each array varies over the devices as they do.
    zero = ((rays[:, 0] > 0) & False).astype(jnp.int32)
    place = jnp.arange(len(rays), dtype=jnp.int32) + zero
    start = _Lanes(
        ray=place,
        origin=rays[:, :3].T,
        direction=rays[:, 3:].T,
        node=jnp.where(place < end, 1, zero),
        pending=zero,
        distance=limits + zero.astype(jnp.float32),
        leaf=zero - 1,
        started=end,
        found=zero,
    )
    last = lax.while_loop(
        lambda state: jnp.any(state.node > 0), lambda state: _burst(tree, state, first), start
    )
    return met(tree, rays, last.leaf)


def met(tree: RayTree, rays: Float[Array, "n 6"], leaf: Int[Array, " n"]) -> Trace:
    """Give the distance and weights of each ray at the leaf that it met."""
    hit = leaf >= 0
    _, distance, weights = meet(tree.corners[jnp.where(hit, leaf, 0)], rays[:, :3].T, rays[:, 3:].T)
    return Trace(
        jnp.where(hit, distance, jnp.inf),
        jnp.where(hit, tree.triangle[leaf], -1),
        jnp.where(hit[:, None], jnp.stack(weights, axis=1), 0),
    )


def _burst(tree: RayTree, state: _Lanes, first: bool | Array) -> _Lanes:
    """Pass some boxes, then test the triangle of each lane that has come to a leaf."""
    # Without a division by zero: an axis along which the ray is constant never limits it.
    still = jnp.abs(state.direction) < 1e-20
    inverse = lax.optimization_barrier(1 / jnp.where(still, 1e-20, state.direction))
    node, pending = lax.fori_loop(
        0,
        _BURST,
        lambda _, place: _pass_box(tree, state, inverse, *place),
        (state.node, state.pending),
    )
    leaves = len(tree.corners)
    here = node >= leaves
    leaf = jnp.where(here, node - leaves, 0)
    inside, distance, _ = meet(_rows(tree.corners, leaf), state.origin, state.direction)
    nearer = here & inside & (distance > 0) & (distance <= state.distance)
    after, rest = _return(node, pending)
    node, pending = jnp.where(here, after, node), jnp.where(here, rest, pending)
    return state._replace(
        node=jnp.where(nearer & jnp.logical_not(first), 0, node),
        pending=pending,
        distance=jnp.where(nearer, distance, state.distance),
        leaf=jnp.where(nearer, leaf, state.leaf),
    )


def _pass_box(
    tree: RayTree, state: _Lanes, inverse: Array, node: Array, pending: Array
) -> tuple[Array, Array]:
    """Step from an inner node to the nearer child that the ray passes, or back; leaves stay."""
    inner = (node > 0) & (node < len(tree.boxes))
    boxes = _rows(tree.boxes, jnp.where(inner, node, 0))

    def entry(first: int) -> tuple[Array, Array]:
        near, far = jnp.zeros_like(state.distance), state.distance
        for axis in range(3):
            low = (boxes[:, first + axis] - state.origin[axis]) * inverse[axis]
            high = (boxes[:, first + axis + 3] - state.origin[axis]) * inverse[axis]
            near = jnp.maximum(near, jnp.minimum(low, high))
            far = jnp.minimum(far, jnp.maximum(low, high))
        return near, near <= far * (1 + _SLACK)

    (near0, hit0), (near1, hit1) = entry(0), entry(6)
    second = hit1 & ~(hit0 & (near0 <= near1))
    down = 2 * node + second.astype(jnp.int32)
    rest = 2 * pending + (hit0 & hit1).astype(jnp.int32)
    after, left = _return(node, pending)
    after, left = jnp.where(hit0 | hit1, down, after), jnp.where(hit0 | hit1, rest, left)
    return jnp.where(inner, after, node), jnp.where(inner, left, pending)


def _return(node: Array, pending: Array) -> tuple[Array, Array]:
    """Step to the sibling that waits deepest in the tree; to node 0 where none does."""
    up = lax.population_count((pending & -pending) - 1) & 31
    waits = pending != 0
    node = jnp.where(waits, lax.shift_right_logical(node, up) ^ 1, 0)
    return node, jnp.where(waits, lax.shift_right_logical(pending, up) ^ 1, 0)


def _rows(table: Array, index: Array) -> Array:
    """Gather `table[index]` for indices known to be in range."""
    return table.at[index].get(mode="promise_in_bounds", wrap_negative_indices=False)
