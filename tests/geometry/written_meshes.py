"""A mesh with all that a mesh can hold, written, and what its file should hold."""

import warnings

import jax.numpy as jnp
import numpy as np

from jaxsh.geometry import BaseColor, Mesh, write_mesh

FORMATS = [".ply", ".obj", ".glb", ".stl", ".off"]
COUNT = 12  # vertices; 7 faces


def full_mesh(rng):
    """A mesh with all that a mesh can hold, in float32, and two vertices at one position."""
    normals = rng.normal(size=(COUNT, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    vertices = rng.normal(size=(COUNT, 3)) * 10.0 ** rng.integers(-3, 4, (COUNT, 1))
    vertices[7] = vertices[2]
    order = np.arange(COUNT)
    faces = np.concatenate([order, order[:9] - 1]).reshape(-1, 3) % COUNT  # none has both 2 and 7
    faces = rng.permutation(faces)

    def array(values, dtype=jnp.float32):
        return jnp.asarray(values, dtype)

    return Mesh(
        array(vertices),
        array(faces, jnp.int32),
        array(normals),
        array(rng.random((COUNT, 2))),
        array(rng.random((COUNT, 4))),
        array([1, 1, -1, 0, 0, 1, -1], jnp.int32),
        (
            BaseColor("red brick", (0.5, 0.25, 0.125, 1.0), rng.integers(0, 256, (5, 7, 4), "u1")),
            BaseColor("red brick", (1.0, 0.1, 0.0, 0.5), double_sided=True),
        ),
    )


def written(path, mesh, **options):
    """Write, and give the one warning's text, or none."""
    with warnings.catch_warnings(record=True) as met:
        warnings.simplefilter("always")
        assert write_mesh(path, mesh, **options) == path
    assert len(met) <= 1
    return str(met[0].message) if met else ""


def to_y_up(vectors):
    return np.stack([vectors[:, 0], vectors[:, 2], -vectors[:, 1]], axis=1)


def by_material(mesh, ranks):
    """The faces with those of the materials `ranks` first, in that order."""
    chosen = np.asarray(mesh.face_material).tolist()
    keys = [ranks.index(one) if one in ranks else len(ranks) for one in chosen]
    return np.asarray(mesh.faces)[np.argsort(keys, kind="stable")]
