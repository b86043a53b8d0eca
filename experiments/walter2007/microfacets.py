"""The true reflection of GGX: sums over incoming directions, independent of any lobe."""

import numpy as np
from jaxtyping import Float


def incoming(
    eyes: Float[np.ndarray, "v 3"],
    normals: Float[np.ndarray, "v 3"],
    roughness: float,
    specular: float,
    counts: tuple[int, int],
) -> tuple[Float[np.ndarray, "v n 3"], Float[np.ndarray, "v n"]]:
    """Directions that light comes from, and weights whose sum with it is what goes to the eye.

    Mirrored about halfway vectors, drawn by heights and azimuths as D (n·h) has them: equations 33
    and 35. With the Jacobian 1/(4 o·h), D F G / (4 n·i n·o) n·i leaves F G (o·h) / (n·o n·h).
    """
    square = roughness**4
    u, weights = np.polynomial.legendre.leggauss(counts[0])
    u = (u + 1) / 2
    phi = (np.arange(counts[1]) + 0.5) * 2 * np.pi / counts[1]
    theta = np.arctan(np.sqrt(square * u / (1 - u)))[:, None]
    local = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], -1
    ).reshape(-1, 3)
    halfway = np.einsum("nk,vki->vni", local, frames(eyes, normals))
    along = np.einsum("vni,vi->vn", halfway, eyes)
    directions = 2 * along[..., None] * halfway - eyes[:, None]
    to_eye = np.einsum("vi,vi->v", normals, eyes)[:, None]
    cosine = np.einsum("vni,vi->vn", directions, normals)
    lit = (along > 0) & (cosine > 0) & (to_eye > 0)

    def hidden(z):
        z = np.where(lit, z, 1.0)
        return (np.sqrt(1 + square * (1 / z**2 - 1)) - 1) / 2

    fresnel = specular + (1 - specular) * (1 - np.clip(along, 0, 1)) ** 5
    shadowing = 1 / (1 + hidden(to_eye + 0 * cosine) + hidden(cosine))
    share = np.repeat(weights / 2, counts[1]) / counts[1]
    bottom = np.where(lit, to_eye * local[:, 2], 1.0)
    return directions, np.where(lit, share * fresnel * shadowing * along / bottom, 0.0)


def frames(
    eyes: Float[np.ndarray, "v 3"], normals: Float[np.ndarray, "v 3"]
) -> Float[np.ndarray, "v 3 3"]:
    """Tangents and normal of each, the first tangent towards the eye."""
    aside = np.cross(normals, eyes)
    other = np.cross(normals, np.where(np.abs(normals[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]]))
    length = np.linalg.norm(aside, axis=1, keepdims=True)
    second = np.where(length > 1e-6, aside, other)
    second /= np.linalg.norm(second, axis=1, keepdims=True)
    return np.stack([np.cross(second, normals), second, normals], axis=1)
