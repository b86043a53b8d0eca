"""Mean square of a transfer's coefficients by band: ``python tools/measure_bands.py [folder]``.

Of bakes of the meshes of a folder (JAXSH_DATA/meshes unless named), and the numbers that tiles
expect of any transfer (`docs/adaptive_tiles.md`).
"""

import os
import sys
from pathlib import Path

import numpy as np

from jaxsh import geometry, harmonics, transfer
from jaxsh.adaptive import _local_rule

_DEGREE, _DIRECTIONS = 10, 256


def main(folder: Path) -> None:
    meshes = {path.stem: geometry.read_mesh(path) for path in sorted(folder.glob("*.ply"))}
    bands = np.arange(_DEGREE + 1)
    print("band".ljust(20), *(f"{band:8d}" for band in bands))
    rows = [mean_squares(mesh) for mesh in meshes.values()]
    for name, row in zip(meshes, rows, strict=True):
        say(name, row)
    mean = np.mean(rows, axis=0)
    say("mean", mean)
    slope, offset = np.polyfit(np.log1p(bands[3:]), np.log(mean[3:]), 1)
    print(f"mean from band 3 on: {np.exp(offset):.2f} (1 + l)^{slope:.1f}")
    factor, power = _local_rule._LATER
    expected = factor * (1.0 + bands) ** power
    expected[:3] = _local_rule._FIRST
    say("expected by tiles", expected)


def mean_squares(mesh: geometry.Mesh) -> np.ndarray:
    """The mean over vertices and over the coefficients of a band."""
    baked = transfer.bake(mesh, _DEGREE, directions=_DIRECTIONS, progress=False)
    squares = np.mean(np.asarray(baked.coefficients, np.float64) ** 2, axis=0)
    of = harmonics.degrees(_DEGREE)
    return np.array([squares[of == band].mean() for band in range(_DEGREE + 1)])


def say(name: str, row: np.ndarray) -> None:
    print(name.ljust(20), *(f"{value:8.2g}" for value in row))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(os.environ["JAXSH_DATA"]) / "meshes")
