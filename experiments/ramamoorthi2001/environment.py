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
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from jaxsh import harmonics, imaging, plot, sphere

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
    size: int = 400
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
    view = View.by(mesh, camera, samples=2)
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
        caption = f"{name}: the light at each degree, hatched where negative; render; error"
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
        3, columns, figsize=(4 * columns, 11), height_ratios=[1.35, 2, 2], layout="constrained"
    )
    glow = 1 / (4 * float(jnp.mean(environment)))  # of the light itself, the mean is a quarter
    plot.light(environment, exposure=glow, ax=axes[0, 0])
    axes[0, 0].set_title("probe")
    _show(axes[1, 0], reference, exposure, view, "all pixels of the probe, summed")
    axes[2, 0].axis("off")
    error = ScalarMappable(Normalize(-10, 10), "RdBu_r")
    for column, shot in enumerate(shots, start=1):
        plot.light(shot.light, height=256, exposure=glow, ax=axes[0, column])
        axes[0, column].set(title=f"degree {shot.degree}", ylabel="", yticklabels=[])
        _show(axes[1, column], shot.image, exposure, view, f"by degree {shot.degree}")
        alpha = np.asarray(view.raster.alpha)
        difference = 100 * np.asarray(jnp.mean(shot.image - reference, axis=-1) * exposure)
        colors = error.to_rgba(difference / np.maximum(alpha, 1e-6))
        axes[2, column].imshow(np.dstack([colors[..., :3], alpha]))
        axes[2, column].set_title("its error")
        axes[2, column].axis("off")
    scale = axes[2, 0].inset_axes((0.8, 0.1, 0.06, 0.8))
    figure.colorbar(error, cax=scale, label="error, % of white", ticklocation="left")
    save(figure, path)


def _draw_sheet(path, sheet, view: View) -> None:
    """The reference under each environment, with the environment above it."""
    figure, axes = plt.subplots(
        2,
        len(sheet),
        figsize=(4.4 * len(sheet), 6.8),
        height_ratios=[1.2, 2],
        layout="constrained",
        squeeze=False,
    )
    for (light, render), (name, environment, reference, exposure) in zip(
        axes.T, sheet, strict=True
    ):
        plot.light(environment, exposure=1 / (4 * float(jnp.mean(environment))), ax=light)
        light.set_title(name)
        _show(render, reference, exposure, view, f"lit by {name}")
    save(figure, path)


def _show(axis: Axes, image, exposure, view: View, title: str) -> None:
    """Before white, with smooth edges."""
    white = (1 - view.raster.alpha)[..., None]
    axis.imshow(imaging.tone_map(exposure * image + white))
    axis.set_title(title)
    axis.axis("off")
