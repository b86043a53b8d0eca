"""The picture for the README: a glossy knot on a photographer's sweep, shadows and a bounce."""

import warnings
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from jaxsh import geometry, imaging, sphere, transfer

from ..shared.plots import plt
from .bake import bounces_alone

_DEGREE = 10
_SUNS, _RAYS = 2, 64  # split off the probe, and rays to each of them from a vertex
_GAP = 0.012  # between knot and ground, so that the ground below still sees out
_COPPER = {"diffuse": (0.30, 0.055, 0.03), "specular": (0.22, 0.20, 0.18), "exponent": 24.0}
_PAPER = {"diffuse": (0.42, 0.42, 0.44), "specular": (0.0, 0.0, 0.0), "exponent": 4.0}
_BOUNCED = 0.3, 0.5  # albedo of knot and sweep, where light bounces


def draw_still(path: Path, *, height: int, vertices: int = 40_000, directions: int = 768) -> None:
    """Bake the scene, shade it, and write the picture, 1.5 times as wide as high.

    What the sun sends is sharp, and shaded by rays; what is left of the light, and what the sun's
    light does after a bounce, is soft, and shaded by coefficients.
    """
    knot = geometry.knot(vertices)
    mesh = _on_a_sweep(knot, rows=max(12, round(150 * (vertices / 40_000) ** 0.5)))
    is_knot = np.arange(len(mesh.vertices)) < len(knot.vertices)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a vertex that the knot covers sees nothing
        direct, bounced = (
            transfer.bake(
                mesh,
                _DEGREE,
                directions=directions,
                bounces=bounces,
                albedo=np.where(is_knot, *_BOUNCED).astype(np.float32),
                progress=False,
            )
            for bounces in (0, 1)
        )
    suns, rest = sphere.split_sun(imaging.studio(), _SUNS, rays=_RAYS)
    light = sphere.project_lat_long(rest, _DEGREE)
    camera = imaging.Camera(
        position=(0.35, -4.6, 1.15),
        target=(0.0, 0.0, -0.08),
        fov_y=30.0,
        width=round(1.5 * height),
        height=height,
    )
    material = transfer.Material(
        diffuse=_each(is_knot, "diffuse"),
        specular=_each(is_knot, "specular"),
        exponent=_each(is_knot, "exponent")[:, 0],
    )
    seen = transfer.sun_visibility(suns, mesh, rays=_RAYS)
    radiance = (
        transfer.shade_glossy(light, bounced, camera.position, material)
        + transfer.shade_sun(suns, mesh, seen, material=material, eye=camera.position)
        + transfer.shade_glossy(
            suns.harmonics(_DEGREE), bounces_alone(bounced, direct), camera.position, material
        )
    )
    raster = imaging.rasterize(mesh, camera, samples=4)
    image = imaging.interpolate(raster, radiance)
    exposure = 1.35 * imaging.auto_exposure(image)
    plt.imsave(path, np.asarray(imaging.tone_map(image, exposure, curve="reinhard", white=2.2)))


def _each(is_knot: Bool[np.ndarray, " v"], name: str) -> Float[Array, "v c"]:
    return jnp.asarray(np.where(is_knot[:, None], _COPPER[name], _PAPER[name]), jnp.float32)


def _on_a_sweep(knot: geometry.Mesh, rows: int) -> geometry.Mesh:
    """Put the knot on a ground that bends up into a wall behind it, finer near the knot."""
    columns = round(1.25 * rows)
    across = np.linspace(-1, 1, columns)
    x = 3.8 * across * (0.35 + 0.65 * abs(across) ** 1.2)
    along, bend, radius = np.linspace(-2.6, 5.0, rows), 1.2, 1.6
    angle = np.clip((along - bend) / radius, 0, np.pi / 2)
    beyond = np.maximum(along - bend - radius * np.pi / 2, 0)
    y = np.minimum(along, bend) + radius * np.sin(angle)
    z = radius * (1 - np.cos(angle)) + beyond
    ground = np.asarray(knot.vertices)[:, 2].min() - _GAP
    points = np.stack(
        [np.tile(x, rows), np.repeat(y, columns), np.repeat(z + ground, columns)], axis=-1
    )
    vertices = np.concatenate([np.asarray(knot.vertices), points.astype(np.float32)])
    faces = np.concatenate([np.asarray(knot.faces), _grid(rows, columns) + len(knot.vertices)])
    return geometry.make_mesh(vertices, faces)


def _grid(rows: int, columns: int) -> Int[np.ndarray, "f 3"]:
    corner = np.arange((rows - 1) * columns).reshape(rows - 1, columns)[:, :-1].ravel()
    right, above, across = corner + 1, corner + columns, corner + columns + 1
    halves = [corner, right, across], [corner, across, above]
    return np.concatenate([np.stack(half, axis=-1) for half in halves])
