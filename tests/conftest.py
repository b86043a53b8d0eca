"""A strict session: shapes are checked, and rank promotion, dtype promotion and warnings raise."""

import os
import pathlib

# Before JAX starts: tests run in parallel processes, so each keeps to its own thread pool.
os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault("MPLBACKEND", "agg")  # no window on any machine
# Compiling is most of the time: processes, notebooks and later runs share what is compiled.
os.environ.setdefault(
    "JAX_COMPILATION_CACHE_DIR", str(pathlib.Path(__file__).parents[1] / ".cache" / "jax")
)
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "-1")

import hypothesis
import jax
import jaxtyping
import numpy as np
import pytest

jax.config.update("jax_num_cpu_devices", 2)  # for the tests of sharding
jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_numpy_dtype_promotion", "strict")

# Every call into jaxsh is checked against its annotation (jaxtyping with beartype).
jaxtyping.install_import_hook("jaxsh", "beartype.beartype")

hypothesis.settings.register_profile(
    "jaxsh", deadline=None, max_examples=25, derandomize=True, print_blob=True
)
hypothesis.settings.load_profile("jaxsh")


@pytest.fixture
def rng(request) -> np.random.Generator:
    """Seeded by the test's own name: the same everywhere, whatever runs before."""
    return np.random.default_rng(list(request.node.nodeid.encode()))


@pytest.fixture
def unchecked():
    """Shapes unchecked by jaxtyping, as at a user's: our own errors must be the ones met."""
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)
