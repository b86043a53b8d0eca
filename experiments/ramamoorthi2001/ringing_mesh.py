"""Ringing on a mesh: with the cosine, which cuts lobes, and with shadows, against all pixels."""

from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Array, Float, Int

from jaxsh import geometry, imaging, sphere, transfer

from ..runner import Context, UserError
from ..shared.pixels import solid_angles
from ..shared.receivers import Receivers, seen_cosines
from ..shared.subjects import load
from .ringing_lights import Need, Probe

_KINDS = ("none", "hann", "positive", "Sloan 2017", "dering", "dering light")
_SPLIT = "sources split off"
_SHOWN = {
    (False, "none"): "as it is",
    (False, "dering"): "dering",
    (False, "dering light"): "dering of the light",
    (True, "none"): _SPLIT,
}
_ROWS = 128  # of the picture that is summed over
_OFFSET = 1e-3  # of rays, in half-extents


class Shaded(NamedTuple):
    """Rows of the table, and vertex colors of the last environment: diffuse, then glossy."""

    mesh: geometry.Mesh
    exponent: float
    rows: list[dict[str, Any]]
    colors: dict[str, list[Float[np.ndarray, "v 3"]]]


class Seen(NamedTuple):
    """Weights of the pixels at the vertices that are looked at, for one need."""

    need: Need
    open: Float[np.ndarray, "v n"]
    shadowed: Float[np.ndarray, "v n"]


def shade(
    context: Context,
    name: str,
    degree: int,
    probes: list[Probe],
    needs: list[Need],
    *,
    directions: int,
    vertices: int,
) -> Shaded:
    """Shade the mesh under each probe, by window, and measure it at some vertices."""
    if len({probe.image.shape for probe in probes}) > 1:
        raise UserError("on a mesh all environments must be of one size")
    subject = load(context, name, degree, directions=directions)
    mesh, glossy = subject.mesh, needs[1 + (len(needs) - 1) // 2]
    eye = np.asarray(imaging.Camera.facing(mesh).position)
    rng, count = np.random.default_rng(context.seed), len(mesh.vertices)
    chosen = np.sort(rng.choice(count, min(vertices, count), replace=False))
    with context.time(f"{name}: reference"):
        seen = _seen(context, mesh, chosen, _pixels(probes[0].image)[1], eye, (needs[0], glossy))
    makers = _makers(subject.baked, mesh, degree, eye, glossy)
    rows: list[dict[str, Any]] = []
    colors: dict[str, list[np.ndarray]] = {}
    for probe in probes:
        whole, rest = (_pixels(image)[0] for image in (probe.image, probe.rest))
        for of in seen:
            for shadows, weights in ((False, of.open), (True, of.shadowed)):
                exact = weights @ whole
                for split, image in ((False, probe.image), (True, probe.rest)):
                    light = sphere.project_lat_long(image, degree)
                    beside = weights @ (whole - rest) if split else 0 * exact
                    for kind in _KINDS:
                        window = of.need.window(light, kind)
                        made = np.asarray(makers[of.need.name, shadows](light * window[None]))
                        rows.append(
                            {
                                "environment": probe.name,
                                "need": of.need.name,
                                "shadows": _said(shadows),
                                "split": _said(split),
                                "window": kind,
                                **_measures(made[chosen] + beside, exact),
                            }
                        )
                        title = _SHOWN.get((split, kind))
                        if title and shadows and probe is probes[-1]:
                            colors.setdefault(title, []).append(made)
    colors[_SPLIT] = _with_suns(mesh, probes[-1].suns, eye, glossy, colors[_SPLIT])
    return Shaded(mesh, glossy.exponent or 0.0, rows, colors)


def _said(yes: bool) -> str:
    return "yes" if yes else "no"


def _makers(baked, mesh, degree, eye, glossy):
    """Irradiance, and what the lobe makes of the light, of all vertices."""
    plain = transfer.unshadowed(mesh.vertices, mesh.normals, degree)
    material = transfer.Material(0.0, 1.0, glossy.exponent)

    def diffuse(which):
        return jax.jit(lambda light: transfer.shade_diffuse(light, which, np.pi))

    def over_lobe(which):
        return transfer.fixed_view(which, eye, material)

    return {
        ("irradiance", False): diffuse(plain),
        ("irradiance", True): diffuse(baked),
        (glossy.name, False): over_lobe(plain),
        (glossy.name, True): over_lobe(baked),
    }


def _pixels(
    image: Float[Array, "h w 3"],
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Radiance times solid angle of blocks of pixels, and their directions."""
    radiance = np.asarray(image, np.float64)
    height, width, _ = radiance.shape
    flux = radiance * solid_angles(height, width)[..., None]
    block = max(1, height // _ROWS)
    rows, columns = height // block, width // block
    flux = flux[: rows * block, : columns * block]
    flux = flux.reshape(rows, block, columns, block, 3).sum(axis=(1, 3))
    return flux.reshape(-1, 3), np.asarray(sphere.lat_long(rows, columns).directions)


def _seen(
    context: Context,
    mesh: geometry.Mesh,
    chosen: Int[np.ndarray, " v"],
    directions: Float[np.ndarray, "n 3"],
    eye: Float[np.ndarray, " 3"],
    needs: tuple[Need, Need],
) -> list[Seen]:
    mirrored = np.asarray(
        transfer.reflected_direction(eye, mesh.vertices[chosen], mesh.normals[chosen])
    )
    exponent = needs[1].exponent or 0.0
    lobes = np.maximum(mirrored @ directions.T, 0) ** exponent * (exponent + 1) / (2 * np.pi)
    receivers, scene = Receivers.of(mesh, chosen, _OFFSET), geometry.ray_scene(mesh)
    some = [pair for _, *pair in seen_cosines(scene, receivers, directions, context)]
    cosines, free = (np.concatenate(each) for each in zip(*some, strict=True))
    return [Seen(needs[0], cosines, free), Seen(needs[1], cosines * lobes, free * lobes)]


def _with_suns(mesh, suns, eye, glossy, colors):
    """Add what the sources themselves give, by rays to each."""
    material = transfer.Material(0.0, 1.0, glossy.exponent)
    diffuse = transfer.shade_sun(suns, mesh, albedo=np.pi)
    over_lobe = transfer.shade_sun(suns, mesh, material=material, eye=eye)
    return [colors[0] + np.asarray(diffuse), colors[1] + np.asarray(over_lobe)]


def _measures(made: Float[np.ndarray, "v 3"], exact: Float[np.ndarray, "v 3"]) -> dict[str, float]:
    """In percent: error of the mean; vertices with a channel that is negative by more than 0.1 %
    of its mean; the lowest value of its mean."""
    error, length = np.linalg.norm(made - exact, axis=-1), np.linalg.norm(exact, axis=-1)
    made = made / exact.mean(axis=0)
    return {
        "error": 100 * float(error.mean() / length.mean()),
        "negative": 100 * float((made < -1e-3).any(axis=-1).mean()),
        "lowest": 100 * float(made.min()),
    }
