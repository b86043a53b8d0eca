"""Unshadowed diffuse light from environment maps (Ramamoorthi & Hanrahan 2001).

Irradiance is the radiance convolved with the clamped cosine, whose coefficients fall off so fast
that nine of the light's carry nearly all of it. Against the integral itself, over every pixel of
the probe for every vertex, this measures how nearly, and what a window costs.
"""

import dataclasses
import functools
from collections.abc import Iterator
from typing import Any, Literal, NamedTuple, get_args

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from jaxsh import harmonics, imaging, sphere

from ..runner import Context, Table, experiment
from ..shared.pixels import direct_irradiance, solid_angles
from ..shared.plots import View, plt, save

ALBEDO = 0.5
Window = Literal["none", "hann", "lanczos", "dering light", "dering irradiance"]
WINDOWS: tuple[Window, ...] = get_args(Window)

# "… to achieve average errors of only 1%" with nine coefficients: the paper's abstract. Of its
# probes these three are among ours.
_PAPER_MEAN_ERROR = {"grace": 1.0, "eucalyptus": 1.0, "stpeters": 1.0}


@dataclasses.dataclass(frozen=True)
class Environment:
    mesh: str | None = None
    """mesh by name; none means the first that the data has"""
    environments: tuple[str, ...] = ()
    """environments by name; none means all that the data has"""
    degrees: tuple[int, ...] = (1, 2, 4, 6, 10)
    """degrees of the light"""
    size: int = 384
    """height and width of the pictures, in pixels"""

    def __post_init__(self):
        if not self.degrees or min(self.degrees) < 0:
            raise ValueError("degrees must be one or more numbers >= 0")
        if self.size < 16:
            raise ValueError(f"size must be at least 16 pixels, got {self.size}")


class Shot(NamedTuple):
    """One light of one degree: its own picture on the sphere and what it makes of the mesh."""

    degree: int
    light: Float[Array, "3 k"]
    image: Float[Array, "h w 3"]


@experiment("environment")
def run(config: Environment, context: Context) -> list[Table]:
    mesh = context.data.mesh(config.mesh or context.data.meshes()[0])
    camera = imaging.Camera.facing(mesh, width=config.size, height=config.size)
    view = View(mesh, imaging.rasterize(mesh, camera))
    shade = jax.jit(sphere.irradiance)
    sheet = []
    names = config.environments or tuple(context.data.environments())
    for name in context.progress(names, "environments"):
        environment = context.data.environment(name)
        with context.time(f"{name}: direct"):
            exact = jax.block_until_ready(direct_irradiance(mesh.normals, environment))
        reference = view.render(ALBEDO / np.pi * exact)
        exposure = imaging.auto_exposure(reference, view.raster.mask)
        rounding = _rounding(mesh.normals, environment, exact)
        shots = []
        for degree in config.degrees:
            project = jax.jit(functools.partial(sphere.project_lat_long, degree=degree))
            light = context.measure(f"{name}: project {degree}", project, environment).value
            context.measure(f"{name}: shade {degree}", shade, light, mesh.normals)
            for window in WINDOWS:
                windowed, strength = _windowed(light, window)
                shaded = shade(windowed, mesh.normals)
                image = view.render(ALBEDO / np.pi * shaded)
                row: dict[str, Any] = {
                    "environment": name,
                    "degree": degree,
                    "window": window,
                    "strength": strength,
                    **_errors(shaded, exact),
                    "psnr": imaging.psnr(
                        _exposed(image, exposure), _exposed(reference, exposure), view.raster.mask
                    ),
                    "negative_light": _negative_light(windowed),
                    "reference_rounding": rounding,
                }
                if degree == 2 and window == "none":
                    row["mean_error_paper"] = _PAPER_MEAN_ERROR.get(name)
                context.record(row)
                if window == "none":
                    shots.append(Shot(degree, light, image))
        caption = f"{name}: the light at each degree, blue where it is negative; render; error"
        _draw(context.path(f"{name}.png", caption), environment, reference, shots, exposure, view)
        sheet.append((name, environment, reference, exposure))
    path = context.path("environments.png", "the reference under each environment")
    _draw_sheet(path, sheet, view)
    return list(_tables(context.rows))


def _windowed(
    light: Float[Array, "3 k"], window: Window
) -> tuple[Float[Array, "3 k"], float | None]:
    """The light under a window, and `dering`'s strength: the largest of the channels', for all."""
    degree = harmonics.degree_of(light.shape[-1])
    if window != "dering light" and window != "dering irradiance":
        return light * harmonics.window(window, degree)[None], None
    of = "light" if window == "dering light" else "irradiance"
    windowed, strength = harmonics.dering(light, of=of, shared=True)
    return windowed, float(strength)


def _errors(shaded: Float[Array, "v 3"], exact: Float[Array, "v 3"]) -> dict[str, float]:
    """Length of the error of the RGB irradiance vector: of its mean length, and of its own."""
    error, length = jnp.linalg.norm(shaded - exact, axis=-1), jnp.linalg.norm(exact, axis=-1)
    return {
        "mean_error": 100 * float(error.mean() / length.mean()),
        "max_error": 100 * float(error.max() / length.mean()),
        "relative_error": 100 * float((error / length).mean()),
    }


def _negative_light(light: Float[Array, "3 k"]) -> float:
    """∫ max(0, -L) / ∫ L of the reconstructed light, in percent, over all channels."""
    degree = harmonics.degree_of(light.shape[-1])
    quadrature = sphere.gauss_legendre(8 * degree + 8)
    radiance = sphere.reconstruct(light, quadrature.directions)
    negative = jnp.sum(jnp.maximum(-radiance, 0) * quadrature.weights[None])
    return 100 * float(negative / jnp.sum(radiance * quadrature.weights[None]))


def _rounding(normals, environment, exact) -> float:
    """Relative error of the reference's float32 sums, against float64 on eight vertices."""
    chosen = np.linspace(0, len(normals) - 1, 8).astype(int)
    height, width, _ = environment.shape
    theta = (np.arange(height) + 0.5) * np.pi / height
    phi = (np.arange(width) + 0.5) * 2 * np.pi / width
    sin_theta = np.sin(theta)[:, None]
    z = np.broadcast_to(np.cos(theta)[:, None], (height, width))
    directions = np.stack([sin_theta * np.cos(phi), sin_theta * np.sin(phi), z], axis=-1)
    cosine = np.maximum(directions @ np.asarray(normals, np.float64)[chosen].T, 0)
    radiance = np.asarray(environment, np.float64) * solid_angles(height, width)[..., None]
    precise = np.einsum("hwv,hwc->vc", cosine, radiance)
    return float(np.max(np.abs(np.asarray(exact)[chosen] - precise) / precise))


def _exposed(image, exposure):
    """Linear, clipped to what a screen can show: what the PSNR is of."""
    return jnp.clip(image * exposure, 0, 1)


def _tables(rows: list[dict[str, Any]]) -> Iterator[Table]:
    plain = [row for row in rows if row["window"] == "none"]
    values = {"rounding": max(row["reference_rounding"] for row in rows)}
    yield Table("Irradiance from spherical harmonics", rows=plain, values=values)
    windowed = [row | {"mean_error_paper": None} for row in rows if row["window"] != "none"]
    yield Table("The same under windows", rows=windowed)


def _draw(path, environment, reference, shots, exposure, view: View) -> None:
    """Columns: the probe, then each degree. Rows: light, render, error of the render."""
    columns = len(shots) + 1
    figure, axes = plt.subplots(
        3, columns, figsize=(2.6 * columns, 6.9), height_ratios=[1, 2, 2], layout="constrained"
    )
    height, width = 128, 256
    glow = 1 / (4 * float(jnp.mean(environment)))  # of the light itself, the mean is a quarter
    axes[0, 0].imshow(imaging.tone_map(environment, glow), extent=(0, 2, 0, 1))
    axes[0, 0].set_title("probe")
    axes[1, 0].imshow(_over_white(reference, exposure, view))
    error = ScalarMappable(Normalize(-10, 10), "RdBu_r")
    for column, shot in enumerate(shots, start=1):
        light = sphere.reconstruct_lat_long(shot.light, height, width)
        # Negative light has no colour of its own: it is shown as pure blue.
        shown = np.array(imaging.tone_map(light, glow))
        shown[np.asarray(light.mean(axis=-1)) < 0] = (0.25, 0.35, 1.0)
        axes[0, column].imshow(shown, extent=(0, 2, 0, 1))
        axes[0, column].set_title(f"degree {shot.degree}")
        axes[1, column].imshow(_over_white(shot.image, exposure, view))
        difference = 100 * jnp.mean(shot.image - reference, axis=-1) * exposure
        difference = np.where(view.raster.mask, difference, np.nan)
        axes[2, column].imshow(difference, cmap=error.cmap, norm=error.norm)
    for axis in axes.flat:
        axis.axis("off")
    scale = axes[2, 0].inset_axes((0.8, 0.1, 0.06, 0.8))
    figure.colorbar(error, cax=scale, label="error, % of white", ticklocation="left")
    save(figure, path, dpi=100)


def _draw_sheet(path, sheet, view: View) -> None:
    """The reference under each environment, with the environment above it."""
    figure, axes = plt.subplots(
        2,
        len(sheet),
        figsize=(3.4 * len(sheet), 5.4),
        height_ratios=[1, 2],
        layout="constrained",
        squeeze=False,
    )
    for (light, render), (name, environment, reference, exposure) in zip(
        axes.T, sheet, strict=True
    ):
        glow = 1 / (4 * float(jnp.mean(environment)))
        light.imshow(imaging.tone_map(environment, glow), extent=(0, 2, 0, 1))
        light.set_title(name)
        render.imshow(_over_white(reference, exposure, view))
        light.axis("off")
        render.axis("off")
    save(figure, path, dpi=110)


def _over_white(image, exposure, view: View):
    return np.where(view.raster.mask[..., None], imaging.tone_map(image, exposure), 1.0)
