"""Compile functions at full size for a GPU that is not here; print the memory that they need.

    pip install "jax[cuda12]"
    python tools/gpu_programs.py --rows 50000 1000000

No GPU and no driver is needed: XLA compiles for the one described below. Memory is what XLA
allocates for what is computed on the way, beside arguments and results, for values and for the
gradient in reverse mode, in float32. The functions are those of `tests/lowered`.
"""

import argparse
import importlib
import os
import sys
from pathlib import Path

# Kernels are taken as they come, where a GPU would try which is fastest.
os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} --xla_gpu_autotune_level=0"
os.environ["JAX_PLATFORMS"] = "cpu"

import jax
import numpy as np
from jax.experimental import topologies
from jax.sharding import Mesh, NamedSharding, PartitionSpec

# NVIDIA H200, as its data sheet has it.
DEVICE = """
gpu_device_info {
  cuda_compute_capability { major: 9 }
  core_count: 132
  fpus_per_core: 128
  clock_rate_ghz: 1.98
  memory_bandwidth: 4800000000000
  device_memory_size: 150000000000
  l2_cache_size: 52428800
  threads_per_warp: 32
  threads_per_block_limit: 1024
  threads_per_core_limit: 2048
  registers_per_block_limit: 65536
  registers_per_core_limit: 65536
  shared_memory_per_block: 49152
  shared_memory_per_block_optin: 232448
  shared_memory_per_core: 233472
  block_dim_limit_x: 2147483647
  block_dim_limit_y: 65535
  block_dim_limit_z: 65535
}
platform_name: "CUDA"
dnn_version_info { major: 9 }
device_description_str: "NVIDIA H200"
"""

CALLS = [
    "harmonics.evaluate",
    "harmonics.evaluate_with_gradient",
    "harmonics.product",
    "sphere.irradiance",
    "transfer.shade_diffuse",
    "transfer.shade_glossy",
    "transfer.shade_glossy, sampled",
    "transfer.fixed_view",
    "transfer.fixed_light",
    "transfer.shade_sun.glossy",
]


def sized(arguments, full: int, rows: int):
    """The arguments of a call with `rows` vertices where it has `full`."""

    def of_rows(shape):
        lengths = tuple(rows if length == full else length for length in shape.shape)
        return jax.ShapeDtypeStruct(lengths, shape.dtype)

    return jax.tree.map(of_rows, arguments)


def gigabytes(function, arguments, placed) -> tuple[float, float, float]:
    """Of arguments, of results and on the way, of a compiled function."""
    program = jax.jit(function, in_shardings=placed, out_shardings=placed).trace(*arguments)
    used = program.lower(lowering_platforms=("cuda",)).compile().memory_analysis()
    assert used is not None
    sizes = used.argument_size_in_bytes, used.output_size_in_bytes, used.temp_size_in_bytes
    return tuple(size / 1e9 for size in sizes)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("calls", nargs="*", default=CALLS, help="as module.name, of tests/lowered")
    parser.add_argument("--rows", nargs="+", type=int, default=[50_000, 1_000_000])
    options = parser.parse_args()
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    lowered = importlib.import_module("lowered")
    with_gradient = importlib.import_module("lowered.derivative").with_gradient
    devices = topologies.get_topology_desc(
        "one", "cuda", topology="1x1x1", target_config=DEVICE
    ).devices
    placed = NamedSharding(Mesh(np.array(devices[:1]), ("one",)), PartitionSpec())
    print("| GB | vertices | arguments | results | on the way | gradient, on the way |")
    print("|---|---:|---:|---:|---:|---:|")
    for call in options.calls:
        module, _, name = call.partition(".")
        made = lowered.table(module)[name]
        both = with_gradient(made)

        def derivative(*arguments, both=both):
            return both(*arguments)[1]

        for rows in options.rows:
            arguments = sized(made.arguments, lowered.V, rows)
            given, result, values = gigabytes(made.function, arguments, placed)
            _, _, gradient = gigabytes(derivative, arguments, placed)
            sizes = " | ".join(f"{size:.2f}" for size in (given, result, values, gradient))
            print(f"| `{call}` | {rows:,} | {sizes} |", flush=True)


if __name__ == "__main__":
    main()
