"""Bodies, scenes and integrals whose transfer is known, for the tests of transfer."""

import jax.numpy as jnp
import numpy as np

from jaxsh.geometry import Mesh, Texels, make_mesh
from jaxsh.harmonics import clamped_cosine, convolve, evaluate


def sphere(rows: int, columns: int, lowest: float = np.pi) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and outward faces of a unit sphere from its pole at +z down to θ = `lowest`."""
    theta = np.arange(1, rows + 1)[:, None] * lowest / rows
    phi = np.arange(columns) * 2 * np.pi / columns
    ring = np.stack(
        np.broadcast_arrays(
            np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
        ),
        axis=-1,
    )
    vertices = np.concatenate([[[0, 0, 1]], ring.reshape(-1, 3)])
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij")
    a, b = 1 + i * columns + j, 1 + i * columns + (j + 1) % columns
    j = np.arange(columns)
    faces = [
        (a, a + columns, b + columns),
        (a, b + columns, b),
        (0 * j, 1 + j, 1 + (j + 1) % columns),
    ]
    return vertices, np.concatenate([np.stack(f, axis=-1).reshape(-1, 3) for f in faces])


def ball() -> Mesh:
    """A convex body: make_mesh drops the faces without area at the lower pole."""
    vertices, faces = sphere(8, 12, 0.999 * np.pi)
    return make_mesh(vertices, faces)


def cube() -> Mesh:
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return make_mesh(
        corners, np.array([[q[i] for i in f] for q in quads for f in ([0, 1, 2], [0, 2, 3])])
    )


def by_hand(vertices, faces, normals) -> Mesh:
    """A mesh taken as it is."""
    vertices, normals = jnp.asarray(vertices, jnp.float32), jnp.asarray(normals, jnp.float32)
    return Mesh(vertices, jnp.asarray(faces, jnp.int32), normals)


def points(positions, normals) -> Mesh:
    """Receivers without a surface of their own, for a scene that shadows them."""
    return by_hand(positions, np.zeros((0, 3)), normals)


def rectangle(corner, u, v) -> Mesh:
    corner, u, v = (np.asarray(x, np.float32) for x in (corner, u, v))
    return make_mesh(
        np.stack([corner, corner + u, corner + u + v, corner + v]), np.array([[0, 1, 2], [0, 2, 3]])
    )


def rotation(seed: int) -> np.ndarray:
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return turn * np.linalg.det(turn)


def joined(*meshes) -> Mesh:
    """One mesh of several, with the normals that each has: hard edges between them."""
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    return by_hand(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + int(k) for mesh, k in zip(meshes, first, strict=False)]),
        np.concatenate([mesh.normals for mesh in meshes]),
    )


def moved(mesh, by, turn=None) -> Mesh:
    turn = np.eye(3) if turn is None else turn
    vertices = np.asarray(mesh.vertices, float) @ turn.T + by
    return by_hand(vertices, mesh.faces, np.asarray(mesh.normals) @ turn.T)


def box(low, high) -> Mesh:
    """Six rectangles, each with its own corners and normals."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    sides = np.diag(high - low)
    return joined(
        *(
            rectangle(*where)
            for u, v in (sides[[0, 1]], sides[[1, 2]], sides[[2, 0]])
            for where in ((high - u - v, u, v), (low, v, u))
        )
    )


def bowl(opening: float, rows: int, columns: int) -> Mesh:
    """A spherical cap seen from within, open where θ < `opening`, with the sphere's own normals."""
    vertices, faces = sphere(rows, columns, np.pi - opening)
    vertices = vertices * [1, 1, -1]
    return by_hand(vertices, faces, -vertices)


def texels_at(mesh: Mesh, face, barycentric) -> Texels:
    """Texels anywhere on a mesh, in a picture of one row."""
    corners, count = np.asarray(mesh.faces)[face], len(face)
    places, normals = (
        np.einsum("nkc,nk->nc", np.asarray(array)[corners], barycentric)
        for array in (mesh.vertices, mesh.normals)
    )
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Texels(
        positions=jnp.asarray(places, jnp.float32),
        normals=jnp.asarray(normals, jnp.float32),
        uv=jnp.zeros((count, 2), jnp.float32),
        face=jnp.asarray(face, jnp.int32),
        barycentric=jnp.asarray(barycentric, jnp.float32),
        source=jnp.arange(count, dtype=jnp.int32)[None],
        mesh=mesh,
        vertex=jnp.arange(len(mesh.vertices), dtype=jnp.int32),
    )


def texels_at_vertices(mesh: Mesh) -> Texels:
    """One texel a vertex, in a corner of one of its faces."""
    _, first = np.unique(np.asarray(mesh.faces), return_index=True)
    return texels_at(mesh, first // 3, np.eye(3)[first % 3])


def unshadowed(mesh, degree: int) -> np.ndarray:
    """λ_l y_lm(n), in blocks of one size: one program for all."""
    normals = np.asarray(mesh.normals, np.float32)
    padded = np.zeros((-(-len(normals) // 1024), 1024, 3), np.float32)
    padded.reshape(-1, 3)[: len(normals)] = normals
    rows = [convolve(evaluate(block, degree), clamped_cosine(degree)) for block in padded]
    return np.concatenate(rows)[: len(normals)]


def lune(start: float, end: float, degree: int) -> np.ndarray:
    """∫ max(0, z) y_i over directions (cos a cos b, sin b, sin a cos b), start < a < end in [0, π].

    By Gauss–Legendre in a and b, exact to rounding at 64 nodes each.
    """
    nodes, weights = np.polynomial.legendre.leggauss(64)
    a = (start + end) / 2 + (end - start) / 2 * nodes[:, None]
    b = np.pi / 2 * nodes
    directions = np.stack(
        np.broadcast_arrays(np.cos(a) * np.cos(b), np.sin(b), np.sin(a) * np.cos(b)), -1
    )
    measure = np.multiply.outer((end - start) / 2 * weights, np.pi / 2 * weights * np.cos(b))
    basis = np.asarray(evaluate(directions, degree))
    return np.einsum("ab,abk->k", measure * directions[..., 2], basis)


def relative(value, reference):
    """RMS error of all coefficients, as a share of their RMS."""
    value, reference = np.asarray(value), np.asarray(reference)
    return np.linalg.norm(value - reference) / np.linalg.norm(reference)
