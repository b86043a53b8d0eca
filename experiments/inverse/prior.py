"""How fast the bands of real light fall off: the numbers of the prior of `inverse.fit_light`."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.optimize
from jaxtyping import Array, Float

from jaxsh import harmonics, inverse, sphere

from ..runner import Context, Table, experiment
from ..shared.plots import plt, save


@dataclasses.dataclass(frozen=True)
class LightPrior:
    environments: tuple[str, ...] = ()
    """environments by name; none means all that the data has"""
    degree: int = 12
    """the last band that counts"""

    def __post_init__(self):
        if self.degree < 2:
            raise ValueError(f"degree must be at least 2, got {self.degree}")


@experiment("inverse.prior", x64=True)
def run(config: LightPrior, context: Context) -> Table:
    names = config.environments or tuple(context.data.environments())
    powers = {
        name: band_powers(context.data.environment(name), config.degree)
        for name in context.progress(names, "environments")
    }
    for left_out in (None, *(names if len(names) > 1 else ())):
        level, fall = power_law([power for name, power in powers.items() if name != left_out])
        row: dict[str, Any] = {"left_out": left_out or "none", "level": level, "fall": fall}
        row |= {"own": None, "ratio": None}
        if left_out is not None:
            law = level * np.arange(1.0, config.degree + 1) ** -fall
            ratio = np.exp(np.mean(np.log(powers[left_out] / law)))
            row |= {"own": float(powers[left_out][0]), "ratio": float(ratio)}
        context.record(row)
    _draw(context.path("bands.png", "bands of the probes, and the law that is shipped"), powers)
    return Table("Bands of real light")


def band_powers(environment: Float[Array, "h w 3"], degree: int) -> Float[np.ndarray, " degree"]:
    """Mean square of the coefficients of bands 1 to degree, in that of the constant one."""
    light = np.asarray(sphere.project_lat_long(environment, degree), float)
    squared = (light / light[:, :1]) ** 2
    of = np.asarray(harmonics.degrees(degree))
    return np.array([squared[:, of == l].mean() for l in range(1, degree + 1)])


def power_law(powers: Sequence[Float[np.ndarray, " degree"]]) -> tuple[float, float]:
    """Level and fall of the power law under which Gaussian coefficients are most probable."""
    seen = np.stack(powers)
    l = np.arange(1.0, seen.shape[1] + 1)

    def improbability(p):
        logs = p[0] - p[1] * np.log(l)
        return np.sum((2 * l + 1) * (logs + seen / np.exp(logs)))

    found = scipy.optimize.minimize(
        improbability, np.array([-1.0, 1.0]), method="Nelder-Mead", options={"xatol": 1e-6}
    )
    return float(np.exp(found.x[0])), float(found.x[1])


def _draw(path: Path, powers: dict[str, Float[np.ndarray, " degree"]]) -> None:
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    l = np.arange(1, len(next(iter(powers.values()))) + 1)
    for name, power in powers.items():
        axis.plot(l, power, "o-", markersize=3, linewidth=0.8, label=name)
    law = np.asarray(inverse.light_variances(int(l[-1])))
    axis.plot(l, law, "k", linewidth=2, label="light_variances")
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_xticks(l[:4], [str(n) for n in l[:4]])
    axis.set_xlabel("band l")
    axis.set_ylabel("variance, in the square of the mean")
    axis.grid(alpha=0.3)
    axis.legend(frameon=False, fontsize=8)
    save(figure, path, dpi=110)
