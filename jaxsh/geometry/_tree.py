"""A tree of boxes around triangles, built in NumPy and laid out to be walked without a stack."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ._frame import Frame


class RayTree(NamedTuple):
    """Holds a complete binary tree of boxes over triangles, as arrays that may pass into `jit`.

    Node 1 is the root, nodes 2i and 2i + 1 are the children of node i, and the last s nodes, s to
    2s − 1, are leaves of one triangle each; s is a power of two, so some triangles fill two leaves.
    `JaxRayScene(meshes).tree` is one, and `trace` walks it.

    **Example**

    >>> from jaxsh import geometry
    >>> geometry.JaxRayScene(geometry.knot(300)).tree.triangle.shape  # of 600 faces
    (1024,)
    """

    boxes: Float[Array, "s 12"]  # row i: lowest and highest corner of nodes 2i and 2i + 1
    corners: Float[Array, "s 9"]  # the triangle of leaf s + j
    triangle: Int[Array, " s"]  # its number: through the faces of all meshes, in order
    center: Float[Array, " 3"]  # boxes and corners hold (position - center)·scale
    scale: Float[Array, ""]


def ray_tree(corners: Float[np.ndarray, "f 3 3"], frame: Frame) -> RayTree:
    """Split the triangles again and again in two halves along the longest extent of their centers.

    `corners` are in the frame.

    Triangles with a NaN or infinite corner are left out, as in Embree; raises `ValueError` where
    none is left. Splits by surface area would spare a ray some boxes, but give a tree of uneven
    depth, which needs links and a stack or two; halves need neither.
    """
    usable = np.flatnonzero(np.isfinite(corners).all(axis=(1, 2)))
    if len(usable) == 0:
        raise ValueError("there is no face with finite corners to cast rays at")
    depth = (len(usable) - 1).bit_length()
    leaves = 2**depth
    order = usable[np.arange(leaves) * len(usable) // leaves]
    centers = corners.mean(axis=1)
    for level in range(depth):
        order = order.reshape(2**level, -1)
        points = centers[order]
        longest = np.ptp(points, axis=1).argmax(axis=1)
        along = np.take_along_axis(points, longest[:, None, None], axis=2)[:, :, 0]
        halves = np.argpartition(along, along.shape[1] // 2 - 1, axis=1)
        order = np.take_along_axis(order, halves, axis=1)
    order = order.reshape(-1)

    boxes = np.zeros((leaves, 12), np.float32)
    low, high = corners[order].min(axis=1), corners[order].max(axis=1)
    for level in reversed(range(depth)):
        both = np.concatenate([low, high], axis=1).reshape(-1, 12)
        boxes[2**level : 2 ** (level + 1)] = both
        low, high = np.minimum(low[::2], low[1::2]), np.maximum(high[::2], high[1::2])
    with np.errstate(over="ignore"):  # of doubles beyond float32, which `trace` does not take
        center, scale = frame.center.astype(np.float32), np.float64(frame.scale).astype(np.float32)
    return RayTree(
        jnp.asarray(boxes),
        jnp.asarray(corners[order].reshape(-1, 9)),
        jnp.asarray(order.astype(np.int32)),
        jnp.asarray(center),
        jnp.asarray(scale),
    )
