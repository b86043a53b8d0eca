"""Time reading and writing splats: `python tools/measure_splats.py`, seconds of one core.

A million splats of degree 3, 248 MB, in memory where there is /dev/shm.
"""

import os
import tempfile
import time
from pathlib import Path

import numpy as np

from jaxsh import imaging

COUNT, DEGREE = 1_000_000, 3


def main() -> None:
    rng = np.random.default_rng(0)
    shapes = [(COUNT, 3), (COUNT, 3, (DEGREE + 1) ** 2), (COUNT,), (COUNT, 3), (COUNT, 4)]
    splats = imaging.Splats(*(rng.standard_normal(shape, np.float32) for shape in shapes))
    memory = "/dev/shm"
    with tempfile.TemporaryDirectory(dir=memory if os.path.isdir(memory) else None) as folder:
        path = Path(folder) / "splats.ply"
        for up in ("z", "-y"):
            started = time.process_time()
            imaging.write_splats(path, splats, up=up)
            written = time.process_time()
            imaging.read_splats(path, up=up)
            read = time.process_time()
            print(
                f"up={up!r}: written in {written - started:.1f} s, read in {read - written:.1f} s"
            )


if __name__ == "__main__":
    main()
