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
import sharding

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

# Parts of programs that `test_documents.py` puts together: importing one runs it.
collect_ignore = ["documents"]


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


def pytest_generate_tests(metafunc):
    """Tries what calls `check_sharded` on one kind of mesh a test; two of the three are slow."""
    if "check_sharded" in metafunc.function.__code__.co_names:
        slow = [pytest.param(kind, marks=pytest.mark.slow) for kind in sharding.kinds[1:]]
        metafunc.parametrize("kind_of_mesh", [sharding.kinds[0], *slow], indirect=True)


@pytest.fixture(autouse=True)  # a fixture that a hook asks for is not set up
def kind_of_mesh(request):
    """The one kind of mesh that `check_sharded` tries in this test."""
    sharding.kinds = (request.param,) if hasattr(request, "param") else sharding.KINDS


@pytest.fixture(scope="session")
def browser():
    """One Chromium for all tests that drive one, drawing in software."""
    import viewer_pages  # imports jaxsh, so not above

    playwright = pytest.importorskip("playwright.sync_api", reason="needs the package playwright")
    options = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with playwright.sync_playwright() as started:
        launched = started.chromium.launch(
            executable_path=viewer_pages.chromium(),
            args=[*options, "--no-sandbox", "--disable-dev-shm-usage"],
        )
        yield launched
        launched.close()
