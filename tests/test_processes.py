"""Two processes on one machine, joined by `jax.distributed`: the numbers of one.

In the default run each module's `test_sharding.py` and `transfer/test_sharded.py` do the same on
two devices of one process: programs are those, and what is new here is how devices exchange sums.
"""

import os
import socket
import subprocess
import sys
from pathlib import Path

import jax
import numpy as np
import processes
import pytest

from jaxsh import geometry, transfer


@pytest.mark.slow
def test_two_processes_compute_what_one_does(tmp_path):
    store = tmp_path / "knot.zarr"
    transfer.bake(geometry.knot(300), 2, shadows=False, store=store, progress=False)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    settings = {
        "JAX_CPU_COLLECTIVES_IMPLEMENTATION": "gloo",
        "JAX_ENABLE_X64": "1",
        "JAX_NUM_CPU_DEVICES": "1",
        "JAX_PLATFORMS": "cpu",
        "PYTHONPATH": str(Path(__file__).parents[1]),
    }
    paths = [tmp_path / f"{number}.npz" for number in range(2)]
    children = [
        subprocess.Popen(
            [sys.executable, processes.__file__, address, str(number), str(store), str(path)],
            env=os.environ | settings,
            stderr=subprocess.PIPE,
            text=True,
        )
        for number, path in enumerate(paths)
    ]
    try:
        expected = processes.compute(jax.devices()[:1], str(store))
        said = [child.communicate(timeout=120)[1] for child in children]
    finally:
        for child in children:
            child.kill()
    assert [child.returncode for child in children] == [0, 0], "\n".join(said)
    for path in paths:
        found = np.load(path)
        assert set(found) == set(expected)
        for name in expected:
            # Of numbers up to 3.2, by sums in another order; 1.8e-15 was met.
            np.testing.assert_allclose(
                found[name], expected[name], rtol=0, atol=5e-15, err_msg=name
            )
