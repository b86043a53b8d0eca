"""What `first_light` is measured against: irradiance by quadrature and by paths, for few vertices.

Nothing here is shared with the bake but the rays' offset: all pixels of a probe for the direct
light, random paths for what bounces. Both are unbiased for a probe of constant pixels, and come
as two independent halves whose difference tells their own error.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from jaxsh import geometry, sphere

from ..runner import Context
from ..shared.pixels import solid_angles
from ..shared.receivers import Receivers, parts, seen_cosines

VARIANTS: tuple[str, ...] = ("unshadowed", "shadowed", "one bounce")


class Estimate(NamedTuple):
    """The mean of two independent halves, and the relative RMS error that their difference says."""

    value: np.ndarray
    error: float

    @classmethod
    def of(cls, one: np.ndarray, other: np.ndarray) -> "Estimate":
        mean = (one + other) / 2
        return cls(mean, float(np.linalg.norm(one - other) / 2 / np.linalg.norm(mean)))


class Pixels(NamedTuple):
    """Probes of one size: which radiance comes from which part of the sphere."""

    shape: tuple[int, int]
    flux: Float[np.ndarray, "n c"]  # radiance times solid angle, the probes' channels side by side
    solid_angles: Float[np.ndarray, " n"]

    @classmethod
    def of(cls, probes: list[Float[np.ndarray, "h w 3"]]) -> "Pixels":
        height, width, _ = probes[0].shape
        weights = np.repeat(solid_angles(height, width), width)
        radiance = np.concatenate([probe.reshape(-1, 3) for probe in probes], axis=1)
        return cls((height, width), (radiance * weights[:, None]).astype("f4"), weights)

    def directions(
        self, pixels: Int[np.ndarray, " n"], rng: np.random.Generator
    ) -> Float[np.ndarray, "n 3"]:
        """One direction in each of the pixels, uniform over its solid angle."""
        height, width = self.shape
        edges = np.cos(np.arange(height + 1) * np.pi / height)
        row, column = np.divmod(pixels, width)
        z = edges[row] + (edges[row + 1] - edges[row]) * rng.random(len(pixels))
        phi = (column + rng.random(len(pixels))) * 2 * np.pi / width
        radius = np.sqrt(np.maximum(0, 1 - z * z))
        return np.stack([radius * np.cos(phi), radius * np.sin(phi), z], axis=-1).astype("f4")


def irradiance(
    mesh: geometry.Mesh,
    chosen: Int[np.ndarray, " v"],
    environments: dict[str, Float[np.ndarray, "h w 3"]],
    *,
    albedo: float,
    paths: int,
    ray_bias: float,
    context: Context,
) -> dict[str, dict[str, Estimate]]:
    """RGB irradiance of the chosen vertices, by environment and variant.

    Environments of one size share their rays.
    """
    scene, receivers = geometry.ray_scene(mesh), Receivers.of(mesh, chosen, ray_bias)
    sizes: dict[tuple[int, ...], list[str]] = {}
    for name, environment in environments.items():
        sizes.setdefault(environment.shape, []).append(name)
    found: dict[str, dict[str, Estimate]] = {}
    for names in sizes.values():
        pixels = Pixels.of([environments[name] for name in names])
        halves = []
        for half in range(2):
            rng = np.random.default_rng([context.seed, 2, half])
            directions = pixels.directions(np.arange(len(pixels.flux)), rng)
            open_sky, shadowed = direct(scene, receivers, directions, pixels.flux, context)
            reflected = one_bounce(
                mesh, scene, receivers, pixels, albedo, ray_bias, paths, rng, context
            )
            halves.append((open_sky, shadowed, shadowed + reflected))
        for i, name in enumerate(names):
            rgb = slice(3 * i, 3 * i + 3)
            found[name] = {
                variant: Estimate.of(one[:, rgb], other[:, rgb])
                for variant, one, other in zip(VARIANTS, *halves, strict=True)
            }
    return found


def turned(count: int, rng: np.random.Generator) -> Float[np.ndarray, "count 3"]:
    """An even set of directions, turned (or mirrored) at random."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return (np.asarray(sphere.fibonacci(count).directions) @ turn.T).astype("f4")


def direct(
    scene: geometry.RayScene,
    receivers: Receivers,
    directions: Float[np.ndarray, "n 3"],
    values: Float[np.ndarray, "n c"],
    context: Context,
) -> tuple[Float[np.ndarray, "v c"], Float[np.ndarray, "v c"]]:
    """Σ max(0, n·ω) values(ω) over all directions, and over those that are not blocked."""
    unshadowed = np.empty((len(receivers.normals), values.shape[1]), np.float32)
    shadowed = np.empty_like(unshadowed)
    for part, cosines, seen in seen_cosines(scene, receivers, directions, context):
        unshadowed[part] = cosines @ values
        shadowed[part] = seen @ values
    return unshadowed, shadowed


def one_bounce(
    mesh: geometry.Mesh,
    scene: geometry.RayScene,
    receivers: Receivers,
    pixels: Pixels,
    albedo: float,
    ray_bias: float,
    paths: int,
    rng: np.random.Generator,
    context: Context,
) -> Float[np.ndarray, "v c"]:
    """Irradiance that comes by way of one diffuse reflection off the front of a face.

    From each vertex `paths` rays by the cosine's distribution. Where one meets the mesh, one
    pixel per probe is drawn by its flux, and asked whether it is seen from there. The normal
    there is the vertices', interpolated: the surface is as smooth as shading takes it to be.
    """
    probes = [pixels.flux[:, i : i + 3] for i in range(0, pixels.flux.shape[1], 3)]
    cumulative = [np.cumsum(probe.sum(axis=1), dtype=np.float64) for probe in probes]
    lift = ray_bias * np.ptp(np.asarray(mesh.vertices), axis=0).max() / 2
    total = np.zeros((len(receivers.normals), pixels.flux.shape[1]))
    for part in context.progress(parts(len(total), 16 * paths), "paths"):
        normals = receivers.normals[part]
        towards = _cosine_distributed(normals, paths, rng)
        vertex = np.repeat(np.arange(len(normals)), paths)
        hit = scene.closest_hit(np.take(receivers.origins[part], vertex, axis=0), towards)
        point, normal, front = _met(mesh, hit, towards)
        met = np.flatnonzero(hit.face >= 0)[front]
        origins = (point + lift * normal)[front]
        for i, (probe, upto) in enumerate(zip(probes, cumulative, strict=True)):
            # Of the draws, one falls into each of equal shares of the flux.
            share = (rng.permutation(len(met)) + rng.random(len(met))) / max(len(met), 1)
            drawn = np.minimum(np.searchsorted(upto, share * upto[-1]), len(upto) - 1)
            light = pixels.directions(drawn, rng)
            cosine = np.maximum(np.einsum("ij,ij->i", normal[front], light), 0)
            seen = cosine * ~scene.occluded(origins, light)
            color = probe[drawn] / probe[drawn].sum(axis=1, keepdims=True)
            arriving = seen[:, None] * color * upto[-1]  # irradiance where the ray met the mesh
            for channel in range(3):
                sums = np.bincount(vertex[met], arriving[:, channel], len(normals))
                # π/paths for the cosine's distribution, albedo/π for the reflection.
                total[part, 3 * i + channel] = albedo / paths * sums
    return total


def _met(
    mesh: geometry.Mesh, hit: geometry.Hit, towards: Float[np.ndarray, "n 3"]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Point and smooth normal of each hit, and whether it is on the front of the face."""
    found = hit.face >= 0
    corners = np.asarray(mesh.faces)[hit.face[found]]
    weights = hit.barycentric[found][..., None]
    triangles = np.asarray(mesh.vertices)[corners]
    normal = (np.asarray(mesh.normals)[corners] * weights).sum(axis=1)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    outward = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    front = np.einsum("ij,ij->i", outward, towards[found]) < 0
    return (triangles * weights).sum(axis=1), normal, front


def _cosine_distributed(
    normals: Float[np.ndarray, "v 3"], count: int, rng: np.random.Generator
) -> Float[np.ndarray, "v*count 3"]:
    """`count` directions about each normal, with a density of cosine/π, stratified in both ways."""
    shape = (len(normals), count)
    squared = (
        rng.permuted(np.tile(np.arange(count), (len(normals), 1)), axis=1) + rng.random(shape)
    ) / count
    phi = 2 * np.pi * (np.arange(count) + rng.random(shape)) / count
    x, y, z = np.sqrt(squared) * np.cos(phi), np.sqrt(squared) * np.sin(phi), np.sqrt(1 - squared)
    least = np.eye(3)[np.abs(normals).argmin(axis=1)]
    side = np.cross(normals, least)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(normals, side)
    frame = (side[:, None], up[:, None], normals[:, None])
    mixed = sum(a[..., None] * axis for a, axis in zip((x, y, z), frame, strict=True))
    return np.asarray(mixed, np.float32).reshape(-1, 3)
