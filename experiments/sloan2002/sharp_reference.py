"""What `sharp` shades, and what it is measured against: sums over all pixels of whole probes."""

import math
import warnings
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from jaxsh import geometry, harmonics, imaging, sphere, transfer

from ..runner import Context
from ..shared.receivers import Receivers, seen_cosines
from .bake import OFFSET
from .reference import Estimate, Pixels

VARIANTS = "unshadowed", "shadowed"
BY_COEFFICIENTS = -1.0  # in the place of an exponent

Key = tuple[str, int, str, float]  # probe, count, variant, exponent


class Subject(NamedTuple):
    """A mesh, its transfers, and those of the vertices that have a reference."""

    name: str
    mesh: geometry.Mesh
    scene: geometry.RayScene
    camera: imaging.Camera
    whole: transfer.Transfer
    chosen: dict[str, transfer.Transfer]
    receivers: Receivers


class Light(NamedTuple):
    """A probe whole, or what is left of it beside its suns."""

    rest: Float[np.ndarray, "h w 3"]
    harmonics: Float[np.ndarray, "3 k"]
    suns: sphere.Suns | None


def bake(
    context: Context, name: str, degree: int, *, directions: int, vertices: int, size: int
) -> Subject:
    """Bake without and with shadows, and draw the vertices that have a reference."""
    made = name == "knot" and name not in context.data.meshes()
    mesh = geometry.knot() if made else context.data.mesh(name)
    scene = geometry.ray_scene(mesh)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # `first_light` tells of them
        whole = {
            variant: transfer.bake(
                mesh,
                degree,
                directions=directions,
                ray_bias=OFFSET,
                shadows=variant == "shadowed",
                seed=context.seed,
                progress=False,
            )
            for variant in VARIANTS
        }
    rng = np.random.default_rng(context.seed)
    defined = np.flatnonzero(np.asarray(whole["unshadowed"].coefficients).any(axis=1))
    some = np.sort(rng.choice(defined, min(vertices, len(defined)), replace=False))
    alone = jnp.arange(len(some))[:, None]
    chosen = {
        variant: transfer.Transfer(
            baked.coefficients[some], baked.positions[some], baked.normals[some], alone
        )
        for variant, baked in whole.items()
    }
    camera = imaging.Camera.facing(mesh, width=size, height=size)
    receivers = Receivers.of(mesh, some, OFFSET)
    return Subject(name, mesh, scene, camera, whole["shadowed"], chosen, receivers)


def references(
    context: Context,
    subject: Subject,
    lights: dict[tuple[str, int], Light],
    exponents: tuple[float, ...],
) -> dict[Key, Estimate]:
    """What reaches the vertices by probe, count, variant and exponent (0: irradiance), RGB.

    Also the irradiance by the light's coefficients, of transfer that is exact to the pixel.
    """
    degree = harmonics.degree_of(next(iter(lights.values())).harmonics.shape[-1])
    mirrored = mirrored_directions(subject, subject.chosen["shadowed"])
    pixels = {key: Pixels.of([light.rest]) for key, light in lights.items()}
    found: dict[Key, Estimate] = {}
    for shape in {p.shape for p in pixels.values()}:
        keys = [key for key in pixels if pixels[key].shape == shape]
        flux = np.concatenate([pixels[key].flux for key in keys], axis=1)
        halves = []
        for half in range(2):
            rng = np.random.default_rng([context.seed, 2, half])
            towards = pixels[keys[0]].directions(np.arange(len(flux)), rng)
            basis = np.asarray(harmonics.evaluate(jnp.asarray(towards), degree))
            basis = basis * pixels[keys[0]].solid_angles[:, None].astype(np.float32)
            sums = {
                (variant, exponent): np.empty((len(mirrored), flux.shape[1]), np.float32)
                for variant in VARIANTS
                for exponent in (*exponents, BY_COEFFICIENTS)
            }
            light = np.concatenate([lights[key].harmonics for key in keys]).T
            for part, *cosines in seen_cosines(subject.scene, subject.receivers, towards, context):
                along = np.maximum(mirrored[part] @ towards.T, 0)
                for exponent in exponents:
                    lobe = along**exponent * ((exponent + 1) / (2 * math.pi)) if exponent else 1.0
                    for variant, cosine in zip(VARIANTS, cosines, strict=True):
                        sums[variant, exponent][part] = (cosine * lobe) @ flux
                for variant, cosine in zip(VARIANTS, cosines, strict=True):
                    sums[variant, BY_COEFFICIENTS][part] = (cosine @ basis) @ light
            halves.append(sums)
        for i, key in enumerate(keys):
            rgb = slice(3 * i, 3 * i + 3)
            for about in halves[0]:
                one, other = (half[about][:, rgb] for half in halves)
                found[(*key, *about)] = Estimate.of(one, other)
    return found


def mirrored_directions(subject: Subject, points: transfer.Transfer) -> Float[np.ndarray, "v 3"]:
    eye = subject.camera.position
    return np.asarray(transfer.reflected_direction(eye, points.positions, points.normals))


def facing(subject: Subject) -> Bool[np.ndarray, " v"]:
    """Which of the chosen vertices turn their front to the eye."""
    points = subject.chosen["shadowed"]
    towards = np.asarray(subject.camera.position) - np.asarray(points.positions)
    return np.einsum("vi,vi->v", towards, np.asarray(points.normals)) > 0


def by_drawn_directions(
    context: Context,
    subject: Subject,
    image: Float[np.ndarray, "h w 3"],
    exponent: float,
    count: int,
) -> list[Float[np.ndarray, "v 3"]]:
    """Shadowed irradiance and glossy light of all vertices, from directions drawn by the light.

    For pictures: one direction falls into each of `count` equal shares of a probe's light, and
    all vertices have the same ones. What faces away from the eye stays dark.
    """
    pixels = Pixels.of([image])
    rng = np.random.default_rng([context.seed, 3])
    brightness = pixels.flux.sum(axis=1, dtype=np.float64)
    upto = np.cumsum(brightness)
    drawn = np.searchsorted(upto, (np.arange(count) + rng.random(count)) / count * upto[-1])
    drawn = np.minimum(drawn, len(upto) - 1)
    towards = pixels.directions(drawn, rng)
    values = pixels.flux[drawn] * (upto[-1] / count / brightness[drawn])[:, None]
    whole = subject.whole
    towards_eye = np.asarray(subject.camera.position) - np.asarray(whole.positions)
    seen_by_eye = np.einsum("vi,vi->v", towards_eye, np.asarray(whole.normals)) > 0
    some = np.flatnonzero(seen_by_eye)
    mirrored = mirrored_directions(subject, whole)[some]
    receivers = Receivers.of(subject.mesh, some, OFFSET)
    found = [np.zeros((whole.num_points, 3), np.float32) for _ in range(2)]
    values = values.astype(np.float32)
    for part, _, seen in seen_cosines(subject.scene, receivers, towards, context):
        lobe = np.maximum(mirrored[part] @ towards.T, 0) ** np.float32(exponent)
        found[0][some[part]] = seen @ values
        found[1][some[part]] = (seen * lobe) @ (values * ((exponent + 1) / (2 * math.pi)))
    return found
