"""Spectra for sunlight through the atmosphere, every 10 nm from 380 to 750 nm, on the host."""

import numpy as np
from jaxtyping import Float

from .._core.host import read_only_cache

WAVELENGTHS = np.arange(380.0, 751.0, 10.0)  # nm
STEP = 10.0

# Preetham et al. 1999, table 2. Radiance of the sun's disc above the atmosphere, in
# W/(cm² µm sr); ten times that is W/(m² nm sr).
SOLAR_RADIANCE = 10 * np.array([
    1655.9, 1623.37, 2112.75, 2588.82, 2582.91, 2423.23, 2676.05, 2965.83, 3054.54,
    3005.75, 3066.37, 2883.04, 2871.21, 2782.5, 2710.06, 2723.36, 2636.13, 2550.38,
    2506.02, 2531.16, 2535.59, 2513.42, 2463.15, 2417.32, 2368.53, 2321.21, 2282.77,
    2233.98, 2197.02, 2152.67, 2109.79, 2072.83, 2024.04, 1987.08, 1942.72, 1907.24,
    1862.89, 1825.92,
])  # fmt: skip


def _absorption(first: float, *values: float) -> Float[np.ndarray, " wavelengths"]:
    """One value every 10 nm from `first` on, zero elsewhere."""
    table = np.zeros_like(WAVELENGTHS)
    start = int((first - WAVELENGTHS[0]) / STEP)
    table[start : start + len(values)] = values[: len(table) - start]
    return table


# The same table: ozone and water vapour in 1/cm. Of the mixed gases' two values only the first,
# oxygen's band at 760 nm, is listed there, and it lies beyond the spectrum.
OZONE = _absorption(
    450.0, 0.003, 0.006, 0.009, 0.014, 0.021, 0.030, 0.040, 0.048,
    0.063, 0.075, 0.085, 0.103, 0.120, 0.120, 0.115, 0.125, 0.120,
    0.105, 0.090, 0.079, 0.067, 0.057, 0.048, 0.036, 0.028, 0.023,
    0.018, 0.014, 0.011, 0.010, 0.009,
)  # fmt: skip
WATER = _absorption(690.0, 0.016, 0.024, 0.0125, 1.0, 0.87, 0.061, 0.001)


@read_only_cache(maxsize=None)
def colour_matching() -> Float[np.ndarray, "3 wavelengths"]:
    """x̄, ȳ, z̄ of the CIE 1931 observer by the lobes of Wyman, Sloan and Shirley (2013), eq. 4."""

    def lobe(height, centre, below, above):
        width = np.where(centre > WAVELENGTHS, below, above)
        return height * np.exp(-(((WAVELENGTHS - centre) / width) ** 2) / 2)

    return np.stack(
        [
            lobe(1.056, 599.8, 37.9, 31.0)
            + lobe(0.362, 442.0, 16.0, 26.7)
            - lobe(0.065, 501.1, 20.4, 26.2),
            lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
            lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
        ]
    )
