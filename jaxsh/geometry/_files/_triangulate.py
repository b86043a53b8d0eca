"""Triangles of polygons, convex or not: their area and their side are kept."""

import itertools

import numpy as np
from jaxtyping import Float, Int

# Twice the area over the longest edge squared: below, cleaning drops a triangle.
_THIN = 2.5e-7
_EPS = 1e-12  # below, it is rounding
# Up to here every corner is tried as the apex of a fan.
_FAN = 32
# Triangles that are tried at a time.
_BATCH = 1_000_000


def triangulate(
    positions: Float[np.ndarray, "n 3"],
    corners: Int[np.ndarray, " c"],
    sizes: Int[np.ndarray, " p"],
) -> tuple[Int[np.ndarray, "t 3"], Int[np.ndarray, " t"], int]:
    """Give triangles as rows of `corners`, the polygon of each, and how many polygons cross over.

    A polygon becomes a fan around a corner that sees all of it, found for all polygons at once:
    any convex one has such corners, and many others. The rest is cut by earcut in the plane of
    Newell's normal. What comes does not depend on the corner that a polygon starts at. Triangles
    of one polygon stand together, polygons in their order.
    """
    start = np.cumsum(sizes) - sizes
    if (sizes == 3).all():
        return start[:, None] + np.arange(3), np.arange(len(sizes)), 0
    # What cleaning drops as infinite is not looked at.
    huge = np.logical_not((np.abs(positions) < np.finfo(np.float32).max).all(axis=1))
    positions = np.where(huge[:, None], 0, positions)
    lost = np.logical_or.reduceat(huge[corners], start)
    slots, counts = _without_repeats(positions, corners, sizes)
    first = np.cumsum(counts) - counts
    triangles, owners, crossed = [], [], 0
    for size in np.unique(counts):
        which = np.flatnonzero(counts == size)
        rings = slots[first[which][:, None] + np.arange(size)]
        if size == 3:
            triangles.append(rings)
            owners.append(which)
            continue
        if size > _FAN:
            apex = np.full(len(which), -1)
        else:
            choose = _diagonals if size == 4 else _apexes
            step = max(_BATCH // int(size) ** 2, 1)
            apex = np.concatenate(
                [
                    choose(positions[corners[rings[i : i + step]]])
                    for i in range(0, len(rings), step)
                ]
            )
        apex[lost[which]] = 0
        fanned = apex >= 0
        turned = np.take_along_axis(
            rings[fanned], (apex[fanned, None] + np.arange(size)) % size, axis=1
        )
        fans = np.stack(
            [np.broadcast_to(turned[:, :1], turned[:, 1:-1].shape), turned[:, 1:-1], turned[:, 2:]],
            axis=2,
        )
        triangles.append(fans.reshape(-1, 3))
        owners.append(np.repeat(which[fanned], size - 2))
        for polygon, ring in zip(which[~fanned], rings[~fanned], strict=True):
            cut, crosses = _cut(positions[corners[ring]])
            triangles.append(ring[cut])
            owners.append(np.full(len(cut), polygon))
            crossed += crosses
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(triangles)[order], owner[order], crossed


def _without_repeats(positions, corners, sizes):
    """Leave out corners where the one before stands; of at least three a polygon keeps three."""
    start = np.cumsum(sizes) - sizes
    before = np.arange(len(corners)) - 1
    before[start] = start + sizes - 1
    repeats = (positions[corners] == positions[corners[before]]).all(axis=1)
    few = np.add.reduceat(~repeats, start) < 3 if len(start) else np.zeros(0, bool)
    # Of a polygon without area any three corners do: cleaning counts and drops it.
    place = np.arange(len(corners)) - np.repeat(start, sizes)
    keep = np.where(np.repeat(few, sizes), place < 3, ~repeats)
    return np.flatnonzero(keep), np.add.reduceat(keep.astype(np.int64), start)


def _diagonals(rings: np.ndarray) -> np.ndarray:
    """Choose for each quadrilateral (m, 4, 3) the corner to fan from, as `_apexes` does.

    Of two diagonals inside it is the shorter; of equals that from the smallest x, then y, then z.
    """
    p = np.ascontiguousarray(np.moveaxis(rings - rings[:, :1], 0, 2))  # (4, 3, m)
    one, two = p[2] - p[0], p[3] - p[1]
    normal = _cross(one, two)
    total = (normal * normal).sum(axis=0)
    # Twice the areas, seen along the normal and times its length, on the two sides of a diagonal.
    beside_one = (_cross(p[1] - p[0], one) * normal).sum(axis=0)
    beside_two = (_cross(p[2] - p[1], two) * normal).sum(axis=0)
    length_one, length_two = (one * one).sum(axis=0), (two * two).sum(axis=0)
    longest = np.maximum(length_one, length_two)
    side_one = np.minimum(beside_one, total - beside_one) / np.where(total > 0, np.sqrt(total), 1)
    side_two = np.minimum(beside_two, total - beside_two) / np.where(total > 0, np.sqrt(total), 1)
    # One that cleaning leaves whole comes before one that is only inside.
    rank_one, rank_two = (
        (side > _THIN * longest) * 1 + (side > _EPS * longest) for side in (side_one, side_two)
    )
    apex = np.where(rank_one == rank_two, length_one > length_two, rank_one < rank_two).astype(int)
    equal = (rank_one == rank_two) & (np.abs(length_one - length_two) <= 1e-9 * length_one)
    apex[equal] = _lowest(rings[equal]) % 2
    return _unless_flat(apex, rank_one + rank_two > 0, rings)


def _apexes(rings: np.ndarray) -> np.ndarray:
    """Choose for each ring (m, k, 3) the corner to fan from, -1 where none sees the whole ring.

    Of several it is the one whose smallest triangle is largest; of equals the one with the
    smallest x, then y, then z.
    """
    k = rings.shape[1]
    raw, rings = rings, rings - rings.mean(axis=1, keepdims=True)
    span = np.abs(rings).max(axis=(1, 2))
    rings = rings / np.where(span > 0, span, 1)[:, None, None]
    normal, _ = _newell(rings)
    # Twice the areas, seen along the normal, of the fan's triangles at each corner: (m, k, k - 2).
    around = (np.arange(k)[:, None] + np.arange(1, k)) % k
    spokes = rings[:, around] - rings[:, :, None]
    areas = np.einsum("mkti,mi->mkt", np.cross(spokes[:, :, :-1], spokes[:, :, 1:]), normal)
    smallest = areas.min(axis=2)
    longest = ((rings - np.roll(rings, 1, axis=1)) ** 2).sum(axis=2).max(axis=1)
    score = np.where(smallest > _THIN * longest[:, None], smallest, -np.inf)
    best = score.max(axis=1, keepdims=True)
    seen = np.isfinite(best[:, 0])
    with np.errstate(invalid="ignore"):
        equal = score >= best - 1e-9 * np.abs(best)
    return _unless_flat(_lowest(raw, equal), seen, rings)


def _unless_flat(apex: np.ndarray, seen: np.ndarray, rings: np.ndarray) -> np.ndarray:
    """Keep the apex where one was seen, or where all corners are on a line; -1 elsewhere."""
    rest = np.flatnonzero(~seen)
    arms = rings[rest] - rings[rest, :1]
    farthest = (arms**2).sum(axis=2).argmax(axis=1)
    line = arms[np.arange(len(rest)), farthest]
    off = np.linalg.norm(np.cross(arms, line[:, None]), axis=2).max(axis=1, initial=0)
    apex[rest] = np.where(off <= _THIN * (line**2).sum(axis=1), 0, -1)
    return apex


def _lowest(rings: np.ndarray, among: np.ndarray | None = None) -> np.ndarray:
    """Find the corner with the smallest x, then y, then z, of all or those marked, in each ring."""
    marked = np.ones(rings.shape[:2], bool) if among is None else among
    for axis in range(3):
        values = np.where(marked, rings[..., axis], np.inf)
        marked = marked & (values == values.min(axis=1, keepdims=True))
    return marked.argmax(axis=1)


def _cross(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Take the cross product of vectors (3, m)."""
    return np.stack(
        [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    )


def _newell(rings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Give the unit normal of the plane that fits each ring best, and twice its area there."""
    normal = np.cross(rings, np.roll(rings, -1, axis=1)).sum(axis=1)
    length = np.linalg.norm(normal, axis=1)
    return normal / np.where(length > 0, length, 1)[:, None], length


def _cut(ring: np.ndarray) -> tuple[np.ndarray, bool]:
    """Cut one ring (k, 3) by earcut; tell also whether it crosses over itself."""
    import mapbox_earcut

    k = len(ring)
    start = int(_lowest(ring[None])[0])
    ring = np.roll(ring, -start, axis=0)
    ring = ring - ring.mean(axis=0)
    ring = ring / (np.abs(ring).max() or 1)
    (normal,), (twice_area,) = _newell(ring[None])
    if twice_area <= _EPS:
        fan = np.stack([np.zeros(k - 2, int), np.arange(1, k - 1), np.arange(2, k)], axis=1)
        return (fan + start) % k, True
    across = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    across /= np.linalg.norm(across)
    flat = np.ascontiguousarray(ring @ np.stack([across, np.cross(normal, across)], axis=1))
    found = mapbox_earcut.triangulate_float64(flat, np.array([k], np.uint32))
    triangles = found.reshape(-1, 3).astype(np.int64)
    a, b, c = np.moveaxis(flat[triangles], 1, 0)
    areas = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    triangles = np.where(areas[:, None] < 0, triangles[:, ::-1], triangles)
    crosses = not abs(np.abs(areas).sum() - twice_area) < 1e-6 * twice_area
    sides = flat[np.roll(triangles, 1, axis=1)] - flat[np.roll(triangles, -1, axis=1)]
    lengths = (sides**2).sum(axis=2)
    thin = np.abs(areas) <= _THIN * lengths.max(axis=1)
    # A corner on the longest side of a triangle without area belongs to the triangle behind.
    tips = (lengths[thin].argmax(axis=1)[:, None] + np.arange(3)) % 3
    tips = np.take_along_axis(triangles[thin], tips, axis=1)
    gaps = {(before, after): [tip] for tip, after, before in tips.tolist()}
    return (_with_all_corners(triangles[~thin], flat, gaps) + start) % k, crosses


def _with_all_corners(
    triangles: np.ndarray, flat: np.ndarray, gaps: dict[tuple[int, int], list[int]]
) -> np.ndarray:
    """Put corners on sides of triangles: those of `gaps`, and those that earcut leaves out.

    A neighbor may have them, and would no longer meet this polygon there.
    """
    k = len(flat)
    inside = {tip for (tip,) in gaps.values()}
    used = np.unique([*triangles.ravel(), *inside])
    gaps = gaps | {
        (int(a), int(b)): _on_side(flat, (int(a) + np.arange((b - a) % k + 1)) % k)
        for a, b in zip(used, np.roll(used, -1), strict=True)
        if (b - a) % k > 1
    }
    done, todo = [], triangles.tolist()
    while todo:
        a, b, c = todo.pop()
        for p, q, apex in ((a, b, c), (b, c, a), (c, a, b)):
            if between := gaps.pop((p, q), None):
                chain = [p, *between, q]
                todo += [[p, q, apex] for p, q in itertools.pairwise(chain)]
                break
        else:
            done.append([a, b, c])
    return np.array(done, np.int64).reshape(-1, 3)


def _on_side(flat: np.ndarray, chain: np.ndarray) -> list[int]:
    """Keep those corners of a chain that lead from its first to its last without turning back.

    The others are on a spike: the outline runs out along a line and back, around no area.
    """
    arms = flat[chain[1:-1]] - flat[chain[0]]
    side = flat[chain[-1]] - flat[chain[0]]
    squared = max(side @ side, np.finfo(np.float64).tiny)
    along, off = arms @ side / squared, np.abs(arms @ [side[1], -side[0]]) / squared
    kept, last = [], 0.0
    for corner, share, beside in zip(chain[1:-1].tolist(), along, off, strict=True):
        if last < share < 1 and beside <= _THIN:
            kept.append(corner)
            last = share
    return kept
