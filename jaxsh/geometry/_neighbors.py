"""Which vertices an edge joins: the table that walks over a mesh follow."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int

from ._mesh import Mesh


def neighbors(mesh: Mesh) -> Int[Array, "v n"]:
    """For each vertex the vertices that an edge joins to it, ascending; n is the largest valence.

    A row with fewer than n neighbors is filled up with the vertex itself. So a gather needs no
    mask, and `active | active[neighbors(mesh)].any(axis=1)` is one step of a breadth-first search
    (Lee & Kim 2014). Real neighbors are where the entry differs from its row's number.

    int32. Takes any mesh: open, non-manifold, in pieces; `topology` says what it is. The faces
    must be concrete, since n depends on them: call it outside `jit`.
    """
    faces, count = np.asarray(mesh.faces, np.int64), len(mesh.vertices)
    ahead = faces[:, [1, 2, 0]]
    # Both ways along each edge, as one number that sorts by vertex first.
    keys = np.concatenate([(faces * count + ahead).ravel(), (ahead * count + faces).ravel()])
    keys = np.sort(keys)
    keys = keys[np.diff(keys, prepend=-1) > 0]
    vertex, other = np.divmod(keys, max(count, 1))
    vertex, other = vertex[vertex != other], other[vertex != other]
    valence = np.bincount(vertex, minlength=count)
    first = np.cumsum(valence) - valence
    table = np.repeat(np.arange(count, dtype=np.int32)[:, None], valence.max(initial=0), axis=1)
    table[vertex, np.arange(len(vertex)) - first[vertex]] = other
    return jnp.asarray(table)
