"""Sun and turbidity recovered from the shaded vertices of a mesh.

A mesh is shaded by the exact projection of the sky, through transfer with shadows; noise is added;
and `inverse.fit_sky`, which knows only the shipped fit of the sky, has to say what it was.
"""

import dataclasses
import functools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import inverse, sky, transfer

from ..runner import Context, Table, experiment
from ..shared.subjects import double, load
from ..shared.timing import timed
from .pictures import Case, draw_errors, draw_sky


@dataclasses.dataclass(frozen=True)
class InverseSky:
    mesh: str | None = None
    """mesh by name; none means the first that the data has"""
    noise: tuple[float, ...] = (0.0, 0.003, 0.01, 0.03, 0.1)
    """standard deviations of the noise, in the mean observed radiance"""
    settings: int = 12
    """suns and turbidities, drawn at random"""
    degree: int = 6
    """of the sky's light and of the transfer, up to 6"""
    directions: int = 256
    """directions of the bake"""
    albedo: float = 0.5
    exposure: bool = False
    """recover the exposure too"""
    height: int = 400
    """of the picture, in pixels"""

    def __post_init__(self):
        if not self.noise or min(self.noise) < 0:
            raise ValueError("noise must be one or more numbers >= 0")
        if not 1 <= self.degree <= 6 or self.settings < 1 or self.height < 16:
            raise ValueError("degree from 1 to 6, settings at least 1, height at least 16")
        if not 0 < self.albedo <= 1:
            raise ValueError(f"albedo must be above 0 and at most 1, got {self.albedo}")


class Truth(NamedTuple):
    sun: Float[np.ndarray, " 3"]
    turbidity: float
    observed: Float[Array, "v 3"]


@experiment("inverse.sky", x64=True)
def run(config: InverseSky, context: Context) -> Table:
    loaded = load(context, config.mesh, config.degree, directions=config.directions)
    name, mesh, baked = double(loaded)
    truths = _truths(config, context, baked)
    fit = jax.jit(
        functools.partial(inverse.fit_sky, exposure=None if config.exposure else 1.0, throw=False)
    )
    cases = []
    for level in config.noise:
        for number, truth in enumerate(context.progress(truths, f"noise {level:g}")):
            key = jax.random.fold_in(jax.random.fold_in(context.key, number), int(1e6 * level))
            error = jax.random.normal(key, truth.observed.shape, truth.observed.dtype)
            observed = truth.observed + level * truth.observed.mean() * error
            found, seconds = timed(fit, observed, baked, config.albedo)
            context.record(_row(number, level, truth, found, seconds))
            if number == 0:
                cases.append(Case(level, observed, found))
    caption = "errors, a dot for each sun and turbidity, and what the fit itself expects (line)"
    draw_errors(context.path("errors.png", caption), context.rows)
    caption = f"{name}, shaded and with noise, and below each the sky that was recovered from it"
    draw_sky(context.path("recovered.png", caption), mesh, truths[0].sun, cases, config.height)
    return _table(config, context, name, len(mesh.vertices))


def _truths(config: InverseSky, context: Context, baked: transfer.Transfer) -> list[Truth]:
    """Suns evenly over the hemisphere's solid angle, shaded by the exact projection."""
    draws = np.random.default_rng(context.seed).uniform(size=(config.settings, 3))
    truths = []
    for height, turn, haze in draws:
        aside, angle = np.sqrt(1 - height**2), 2 * np.pi * turn
        sun = np.array([aside * np.cos(angle), aside * np.sin(angle), height])
        turbidity = 2.5 + 3.5 * haze
        light = sky.project_preetham(jnp.asarray(sun), turbidity, config.degree)
        truths.append(Truth(sun, turbidity, transfer.shade_diffuse(light, baked, config.albedo)))
    return truths


def _row(number: int, level: float, truth: Truth, found, seconds: float) -> dict[str, Any]:
    value, deviation = found.value, found.confidence.deviation
    distance = np.linalg.norm(np.asarray(value.sun) - truth.sun)
    return {
        "setting": number,
        "noise": level,
        "zenith": float(np.degrees(np.arccos(truth.sun[2]))),
        "turbidity": truth.turbidity,
        "sun_error": float(np.degrees(2 * np.arcsin(distance / 2))),
        "sun_deviation": float(np.degrees(np.linalg.norm(deviation.sun))),
        "turbidity_error": abs(float(value.turbidity) - truth.turbidity),
        "turbidity_deviation": float(deviation.turbidity),
        "exposure_error": abs(float(value.exposure) - 1),
        "residual": float(found.statistics.residual),
        "steps": int(found.statistics.steps),
        "agreeing": int(found.statistics.agreeing) / found.statistics.starts,
        "converged": found.converged,
        "at_bound": bool(found.statistics.at_bound),
        "seconds": seconds,
    }


def _table(config: InverseSky, context: Context, name: str, vertices: int) -> Table:
    rows = []
    for level in config.noise:
        of = [row for row in context.rows if row["noise"] == level]

        def rms(key, of=of):
            return float(np.sqrt(np.mean([row[key] ** 2 for row in of])))

        rows.append(
            {
                "noise": 100 * level,
                "sun": rms("sun_error"),
                "sun_worst": max(row["sun_error"] for row in of),
                "sun_said": rms("sun_deviation"),
                "turbidity": rms("turbidity_error"),
                "turbidity_worst": max(row["turbidity_error"] for row in of),
                "turbidity_said": rms("turbidity_deviation"),
                "failed": sum(not row["converged"] for row in of),
                "agreeing": 100 * float(np.mean([row["agreeing"] for row in of])),
                "ms": 1e3 * float(np.median([row["seconds"] for row in of])),
            }
        )

    return Table(
        "Sun and turbidity from a shaded mesh",
        rows=rows,
        values={"name": name, "vertices": vertices},
    )
