"""Makes the stored fits of Preetham's sky: `JAX_ENABLE_X64=1 python -m jaxsh.sky.make_table`.

Fits, writes, reads back, and prints the worst errors on suns between the fitted ones.
"""

import argparse
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from ._error import fit_error, smallest_luminance
from ._preetham_fit import preetham_fit
from ._project import project_preetham
from ._sky_fit import SkyFit
from ._table import Table, read_tables, write_tables

# Lawson's rounds gain nothing at 12 × 6, where the error is even already, and 40 % elsewhere.
_RECIPES: dict[Table, dict] = {
    "small": {"terms": (12, 6), "turbidity": (2.5, 6.0)},
    "precise": {"terms": (14, 8), "turbidity": (2.5, 6.0), "lawson": 12},
    "wide": {"terms": (14, 10), "turbidity": (2.0, 10.0), "lawson": 12},
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path(__file__).with_name("preetham.npz"))
    output = parser.parse_args().output
    if jnp.result_type(float) != jnp.float64:
        raise SystemExit("the fits are made in float64: set JAX_ENABLE_X64=1")
    tables: dict[Table, SkyFit] = {name: make(name) for name in _RECIPES}
    write_tables(output, tables)
    stored = read_tables(output)
    print(f"{output.name}: {output.stat().st_size:,} bytes")
    for name, recipe in _RECIPES.items():
        for dtype in (jnp.float32, jnp.float64):
            print(f"{name} {recipe['terms']} {dtype.__name__}: {report(stored[name], dtype)}")


def make(name: Table, **options) -> SkyFit:
    recipe = _RECIPES[name]
    return preetham_fit(samples=[3 * count for count in recipe["terms"]], **recipe, **options)


def report(fit, dtype, heights: int = 61, turbidities: int = 23) -> str:
    """Worst E_mean and E_max for 5 and 7 bands, evaluated wholly in one dtype."""
    theta = np.linspace(0, np.pi / 2, heights)[:, None]
    sun = np.stack([np.sin(theta), 0 * theta, np.maximum(np.cos(theta), 0)], axis=-1)
    turbidity = np.linspace(fit.axes[1].low, fit.axes[1].high, turbidities)[None]
    exact = project_preetham(sun, turbidity)
    smallest = smallest_luminance(sun, turbidity)
    fitted = fit(sun.astype(dtype), turbidity.astype(dtype)).astype(exact.dtype)
    said = []
    for bands in (5, 7):
        error = fit_error(fitted[..., : bands**2], exact[..., : bands**2], smallest)
        mean, largest = (100 * float(value.max()) for value in error)
        said.append(f"{bands} bands E_mean {mean:.5f} %, E_max {largest:.5f} %")
    return "; ".join(said)


if __name__ == "__main__":
    main()
