"""Makes the stored fits of Preetham's sky, `jaxsh/sky/preetham.npz`.

`JAX_ENABLE_X64=1 python tools/make_sky_table.py` in the checkout fits, writes, and prints the worst
errors of what was written on suns between the fitted ones.
"""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from jaxsh import sky

OUTPUT = Path(__file__).parents[1] / "jaxsh" / "sky" / "preetham.npz"

Name = Literal["small", "precise", "wide"]

# Lawson's rounds gain nothing at 12 × 6, where the error is even already, and 40 % elsewhere.
_RECIPES: dict[Name, dict] = {
    "small": {"terms": (12, 6), "turbidity": (2.5, 6.0)},
    "precise": {"terms": (14, 8), "turbidity": (2.5, 6.0), "lawson": 12},
    "wide": {"terms": (14, 10), "turbidity": (2.0, 10.0), "lawson": 12},
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=OUTPUT)
    output = parser.parse_args().output
    if jnp.result_type(float) != jnp.float64:
        raise SystemExit("the fits are made in float64: set JAX_ENABLE_X64=1")
    fits: dict[Name, sky.SkyFit] = {name: make(name) for name in _RECIPES}
    write(output, fits)
    print(f"{output.name}: {output.stat().st_size:,} bytes")
    with np.load(output) as stored:
        for name, fit in fits.items():
            fit = eqx.tree_at(lambda f: f.coefficients, fit, jnp.asarray(stored[name]))
            for dtype in (jnp.float32, jnp.float64):
                terms = _RECIPES[name]["terms"]
                print(f"{name} {terms} {dtype.__name__}: {report(fit, dtype)}")


def make(name: Name, **options) -> sky.SkyFit:
    recipe = _RECIPES[name]
    return sky.preetham_fit(samples=[3 * count for count in recipe["terms"]], **recipe, **options)


def write(path: Path, fits: Mapping[Name, sky.SkyFit]) -> None:
    """Coefficients and the range of turbidity of each: all that is not in the code."""
    arrays = {}
    for name, fit in fits.items():
        arrays[name] = np.asarray(fit.coefficients, np.float64 if name == "precise" else np.float32)
        arrays[f"{name}_turbidity"] = np.array([fit.axes[1].low, fit.axes[1].high])
    np.savez(path, **arrays)


def report(fit: sky.SkyFit, dtype, heights: int = 61, turbidities: int = 23) -> str:
    """Worst E_mean and E_max for 5 and 7 bands, evaluated wholly in one dtype."""
    theta = np.linspace(0, np.pi / 2, heights)[:, None]
    sun = np.stack([np.sin(theta), 0 * theta, np.maximum(np.cos(theta), 0)], axis=-1)
    turbidity = np.linspace(fit.axes[1].low, fit.axes[1].high, turbidities)[None]
    exact = sky.project_preetham(sun, turbidity)
    smallest = sky.smallest_luminance(sun, turbidity)
    fitted = fit(sun.astype(dtype), turbidity.astype(dtype)).astype(exact.dtype)
    said = []
    for bands in (5, 7):
        error = sky.fit_error(fitted[..., : bands**2], exact[..., : bands**2], smallest)
        mean, largest = (100 * float(value.max()) for value in error)
        said.append(f"{bands} bands E_mean {mean:.5f} %, E_max {largest:.5f} %")
    return "; ".join(said)


if __name__ == "__main__":
    main()
