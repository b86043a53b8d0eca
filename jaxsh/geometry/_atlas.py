"""Texels of a picture whose centers a mesh's UV cover, and the faces that they show."""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from .._core.ranges import ranges
from ._indices import first_of_equals, groups

# In texels. A center this near to an edge is on it: far above rounding in float64.
_ON_EDGE = 1e-6
# A center that is deeper in two faces than this lies in both: above what float32 leaves open in UV.
_INSIDE = 0.01
# Twice the area of the smallest face that has one.
_AREA = 1e-9
# Shorter sums of unit normals have no direction, nor have infinite ones: the face's own stands in.
_SHORT = 1e-6
# Pairs of a face and a texel that are looked at together.
_BLOCK = 1 << 20


class Covered(NamedTuple):
    """Holds which face each texel shows, and what was found on the way."""

    face: Int[np.ndarray, "h w"]  # -1 for none
    small: Int[np.ndarray, " s"]  # faces in no texel's center that got the texel around them
    overlapping: Int[np.ndarray, "h w"]  # true where two faces or more cover a center
    flat: int  # faces without area in the picture
    hidden: int  # charts that no texel shows


def cover(corners: Float[np.ndarray, "f 3 2"], width: int, height: int) -> Covered:
    """Find the face at the center of each texel; `corners` are in texels from the upper left.

    Of two faces that share the edge through a center the first has it. A face that has no center is
    given the texel that its middle lies in, where no other face has that.
    """
    edges = np.roll(corners, -1, axis=1) - corners
    area = np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
    solid = np.flatnonzero(area > _AREA)  # false for NaN, too
    face = np.full(height * width, -1, np.int32)
    deep = np.zeros(height * width, np.int32)  # faces that a center is deep in
    of_span, row, first, count = _spans(corners[solid], width, height)
    for part in _blocks(count):
        span = np.repeat(part, count[part])
        column, line, own = ranges(first[part], count[part]), row[span], solid[of_span[span]]
        texel = line * width + column
        inside = _depth(corners[own], area[own], column + 0.5, line + 0.5) > _INSIDE
        np.add.at(deep, texel[inside], 1)
        # Faces ascend along the pairs: reversed, the first is written last.
        free = face[texel] < 0
        face[texel[free][::-1]] = own[free][::-1]

    owned = np.zeros(len(corners), bool)
    owned[face[face >= 0]] = True
    small = solid[~owned[solid]]
    middle = np.floor(corners[small].mean(axis=1)).astype(np.int64)
    texel = np.clip(middle[:, 1], 0, height - 1) * width + np.clip(middle[:, 0], 0, width - 1)
    free = face[texel] < 0
    face[texel[free][::-1]] = small[free][::-1]
    small = small[free][face[texel[free]] == small[free]]
    owned[small] = True

    # Charts: faces joined where they share a corner in the picture.
    if owned[solid].all():
        hidden = 0
    else:
        points = first_of_equals(corners[solid].astype(np.float32).reshape(-1, 2) + 0)
        start, end = points.reshape(-1, 3)[:, [0, 1]], points.reshape(-1, 3)[:, [1, 2]]
        _, chart = groups(start.ravel(), end.ravel(), number=3 * len(solid))
        chart = chart[points.reshape(-1, 3)[:, 0]]
        hidden = len(np.setdiff1d(chart, chart[owned[solid]]))
    shape = (height, width)
    return Covered(
        face.reshape(shape),
        small,
        (deep > 1).reshape(shape),
        len(corners) - len(solid),
        hidden,
    )


def barycentric(
    corners: Float[np.ndarray, "n 3 2"], points: Float[np.ndarray, "n 2"]
) -> Float[np.ndarray, "n 3"]:
    """Give the weights of a triangle's corners at a point; those of one beside it are clipped."""
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    to = points - corners[:, 0]
    twice = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    second = (to[:, 0] * two[:, 1] - to[:, 1] * two[:, 0]) / twice
    third = (one[:, 0] * to[:, 1] - one[:, 1] * to[:, 0]) / twice
    weights = np.maximum(np.stack([1 - second - third, second, third], axis=1), 0)
    return weights / weights.sum(axis=1, keepdims=True)


def places(
    vertices: Float[np.ndarray, "v 3"],
    normals: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "f 3"],
    face: Int[np.ndarray, " n"],
    weights: Float[np.ndarray, "n 3"],
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Give positions and unit normals in faces, with weights of their corners."""
    at = faces[face]
    corners, around = vertices[at].astype(np.float64), normals[at].astype(np.float64)
    positions = np.einsum("nkc,nk->nc", corners, weights)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    with np.errstate(invalid="ignore"):  # of infinite ones
        mean = np.einsum("nkc,nk->nc", around, weights)
        length = np.linalg.norm(mean, axis=1, keepdims=True)
    mean = np.where((length > _SHORT) & np.isfinite(length), mean, across)
    length = np.linalg.norm(mean, axis=1, keepdims=True)
    return positions, mean / np.maximum(length, np.finfo(np.float64).tiny)


def nearest(
    own: Int[np.ndarray, "h w"], corners: Float[np.ndarray, "f 3 2"], gutter: int
) -> Int[np.ndarray, "h w"]:
    """Fill -1 with the entry of the nearest texel that has one, up to `gutter` texels from a face.

    Not from a center in a face: so one texel serves bilinear look-ups, at a thin chart too.
    """
    if gutter == 0 or (own >= 0).all():
        return own
    from scipy import ndimage  # JAX itself needs SciPy

    away: Any = ndimage.distance_transform_cdt(~_touched(own >= 0, corners), metric="chessboard")
    found: Any = ndimage.distance_transform_edt(
        own < 0, return_distances=False, return_indices=True
    )
    row, column = found
    return np.where(away <= gutter, own[row, column], own)


def _touched(covered: np.ndarray, corners: Float[np.ndarray, "f 3 2"]) -> np.ndarray:
    """Add to the texels that have their centers in a face those that an edge passes through."""
    touched = covered.copy()
    # A trifle inwards: an edge between two rows of texels touches those of its face.
    corners = corners + _ON_EDGE * (corners.mean(axis=1, keepdims=True) - corners)
    start = corners.reshape(-1, 2)
    along = np.roll(corners, -1, axis=1).reshape(-1, 2) - start
    length = np.abs(along).max(axis=1)
    known = np.isfinite(length)
    start, along, length = start[known], along[known], length[known]
    steps = np.ceil(2 * length).astype(np.int64) + 1  # at most half a texel each
    size = np.array(covered.shape)[::-1] - 1
    for part in _blocks(steps):
        edge = np.repeat(part, steps[part])
        share = ranges(0 * part, steps[part]) / np.maximum(steps[edge] - 1, 1)
        at = np.floor(start[edge] + share[:, None] * along[edge]).astype(np.int64)
        column, row = np.clip(at, 0, size).T
        touched[row, column] = True
    return touched


def _spans(corners: Float[np.ndarray, "f 3 2"], width: int, height: int) -> tuple[np.ndarray, ...]:
    """Give the rows of texels that each face crosses: face, row, first column, number of columns.

    In ascending order of faces.
    """
    y = corners[..., 1]
    top = np.clip(np.ceil(y.min(axis=1) - 0.5 - _ON_EDGE), 0, height).astype(np.int64)
    end = np.clip(np.floor(y.max(axis=1) - 0.5 + _ON_EDGE) + 1, 0, height).astype(np.int64)
    rows = np.maximum(end - top, 0)
    face, row = np.repeat(np.arange(len(corners)), rows), ranges(top, rows)
    left, right = np.full(len(face), np.inf), np.full(len(face), -np.inf)
    for k in range(3):
        start, stop = corners[face, k], corners[face, (k + 1) % 3]
        rise, up = stop[:, 1] - start[:, 1], row + 0.5 - start[:, 1]
        # A level edge ends where the two others do.
        along = up / np.where(rise == 0, np.inf, rise)
        slack = _ON_EDGE / np.maximum(np.abs(rise), _ON_EDGE)
        crossed = (rise != 0) & (along >= -slack) & (along <= 1 + slack)
        x = start[:, 0] + np.clip(along, 0, 1) * (stop[:, 0] - start[:, 0])
        left = np.where(crossed, np.minimum(left, x), left)
        right = np.where(crossed, np.maximum(right, x), right)
    some = left <= right
    face, row, left, right = face[some], row[some], left[some], right[some]
    first = np.clip(np.ceil(left - 0.5 - _ON_EDGE), 0, width).astype(np.int64)
    end = np.clip(np.floor(right - 0.5 + _ON_EDGE) + 1, 0, width).astype(np.int64)
    return face, row, first, np.maximum(end - first, 0)


def _blocks(counts: np.ndarray) -> list[np.ndarray]:
    """Give stretches of indices whose counts add up to about a block."""
    ends = np.cumsum(counts)
    total = int(ends[-1]) if len(ends) else 0
    cuts = np.searchsorted(ends, np.arange(_BLOCK, total, _BLOCK), side="right")
    return [part for part in np.split(np.arange(len(counts)), np.unique(cuts)) if len(part)]


def _depth(corners: np.ndarray, area: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Compute how far inside its triangle each point is, in texels; negative outside."""
    edges = np.roll(corners, -1, axis=1) - corners
    across = edges[..., 0] * (y[:, None] - corners[..., 1]) - edges[..., 1] * (
        x[:, None] - corners[..., 0]
    )
    turn = np.sign(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
    lengths = np.maximum(np.linalg.norm(edges, axis=2), np.finfo(np.float64).tiny)
    return (turn[:, None] * across / lengths).min(axis=1)
