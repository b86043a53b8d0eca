"""Triangles of polygons, convex or not: their area and their side are kept."""

import itertools

import numpy as np
from jaxtyping import Float, Int

# Areas below this share of the longest edge squared are rounding.
_EPS = 1e-12
# Up to here every corner is tried as the apex of a fan.
_FAN = 32
# Numbers that a batch of fans may hold at a time.
_BATCH = 4_000_000


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
            step = max(_BATCH // int(size) ** 2, 1)
            apex = np.concatenate(
                [
                    _apexes(positions[corners[rings[i : i + step]]])
                    for i in range(0, len(rings), step)
                ]
            )
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


def _apexes(rings: np.ndarray) -> np.ndarray:
    """Choose for each ring (m, k, 3) the corner to fan from, -1 where none sees the whole ring.

    Of several it is the one whose smallest triangle is largest, for four corners that of the
    shorter diagonal; of equals the one with the smallest x, then y, then z.
    """
    k = rings.shape[1]
    rings = rings - rings.mean(axis=1, keepdims=True)
    span = np.abs(rings).max(axis=(1, 2))
    rings = rings / np.where(span > 0, span, 1)[:, None, None]
    normal, twice_area = _newell(rings)
    # Twice the areas, seen along the normal, of the fan's triangles at each corner: (m, k, k - 2).
    around = (np.arange(k)[:, None] + np.arange(1, k)) % k
    spokes = rings[:, around] - rings[:, :, None]
    areas = np.einsum("mkti,mi->mkt", np.cross(spokes[:, :, :-1], spokes[:, :, 1:]), normal)
    smallest = areas.min(axis=2)
    longest = ((rings - np.roll(rings, 1, axis=1)) ** 2).sum(axis=2).max(axis=1)
    if k == 4:
        diagonal = ((rings - np.roll(rings, 2, axis=1)) ** 2).sum(axis=2)
        score = np.where(smallest > _EPS * longest[:, None], -diagonal, -np.inf)
    else:
        score = np.where(smallest > _EPS * longest[:, None], smallest, -np.inf)
    best = score.max(axis=1, keepdims=True)
    seen = np.isfinite(best[:, 0])
    with np.errstate(invalid="ignore"):
        equal = score >= best - 1e-9 * np.abs(best)
    apex = _lowest(rings, equal)
    # Without area no cut is better than another.
    return np.where(seen, apex, np.where(twice_area <= _EPS * longest, 0, -1))


def _lowest(rings: np.ndarray, among: np.ndarray) -> np.ndarray:
    """Find the corner with the smallest x, then y, then z among those marked, in each ring."""
    for axis in range(3):
        values = np.where(among, rings[..., axis], np.inf)
        among = among & (values <= values.min(axis=1, keepdims=True) + 1e-9)
    return among.argmax(axis=1)


def _newell(rings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Give the unit normal of the plane that fits each ring best, and twice its area there."""
    normal = np.cross(rings, np.roll(rings, -1, axis=1)).sum(axis=1)
    length = np.linalg.norm(normal, axis=1)
    return normal / np.where(length > 0, length, 1)[:, None], length


def _cut(ring: np.ndarray) -> tuple[np.ndarray, bool]:
    """Cut one ring (k, 3) by earcut; tell also whether it crosses over itself."""
    import mapbox_earcut

    k = len(ring)
    ring = ring - ring.mean(axis=0)
    ring = ring / (np.abs(ring).max() or 1)
    (normal,), (twice_area,) = _newell(ring[None])
    if not np.isfinite(ring).all() or twice_area <= _EPS:
        return np.stack([np.zeros(k - 2, int), np.arange(1, k - 1), np.arange(2, k)], axis=1), False
    start = int(_lowest(ring[None], np.ones((1, k), bool))[0])
    ring = np.roll(ring, -start, axis=0)
    across = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    across /= np.linalg.norm(across)
    flat = np.ascontiguousarray(ring @ np.stack([across, np.cross(normal, across)], axis=1))
    found = mapbox_earcut.triangulate_float64(flat, np.array([k], np.uint32))
    triangles = found.reshape(-1, 3).astype(np.int64)
    a, b, c = np.moveaxis(flat[triangles], 1, 0)
    areas = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    triangles = np.where(areas[:, None] < 0, triangles[:, ::-1], triangles)
    crosses = not abs(np.abs(areas).sum() - twice_area) < 1e-6 * twice_area
    return (_with_all_corners(triangles, k) + start) % k, crosses


def _with_all_corners(triangles: np.ndarray, k: int) -> np.ndarray:
    """Put the corners on straight sides back, which earcut leaves out: a neighbor may have them."""
    used = np.unique(triangles)
    if len(used) == k or len(used) < 3:
        return triangles
    # (from, to) of each gap in the ring -> the corners between.
    gaps = {
        (int(a), int(b)): [(int(a) + i) % k for i in range(1, (int(b) - int(a)) % k)]
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
    return np.array(done, np.int64)
