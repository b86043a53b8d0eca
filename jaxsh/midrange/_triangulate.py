"""A flat polygon cut into triangles, on the host."""

import numpy as np
from jaxtyping import Float, Int

from ._polygon import area_vector


def triangulate(vertices: Float[np.ndarray, "n 3"]) -> Int[np.ndarray, "t 3"]:
    """Indices of the n-2 triangles of a simple polygon, wound as it is: ears, cut one by one."""
    normal = area_vector(vertices)
    left, triangles = list(range(len(vertices))), []
    while len(left) > 3:
        ear = next((i for i in range(len(left)) if _is_ear(vertices[left], i, normal)), None)
        if ear is None:
            raise ValueError("expected a simple polygon, got one that crosses itself")
        triangles.append([left[ear - 1], left[ear], left[(ear + 1) % len(left)]])
        del left[ear]
    return np.array([*triangles, left], np.int32)


def _is_ear(corners: Float[np.ndarray, "n 3"], i: int, normal: Float[np.ndarray, " 3"]) -> bool:
    """Whether the corner i is convex and its triangle holds no other corner."""
    a, b, c = corners[i - 1], corners[i], corners[(i + 1) % len(corners)]
    others = np.array([p for p in corners if not any(np.array_equal(p, q) for q in (a, b, c))])
    others = others.reshape(-1, 3)
    inside = [np.cross(q - p, others - p) @ normal >= 0 for p, q in ((a, b), (b, c), (c, a))]
    return bool(np.cross(b - a, c - b) @ normal >= 0 and not np.all(inside, axis=0).any())
