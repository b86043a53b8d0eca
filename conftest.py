"""Examples of docstrings run as at a user's: single precision, nothing strict, no type checks."""

import os

os.environ.setdefault("MPLBACKEND", "agg")  # no window on any machine

import jax
import jaxtyping
import pytest

USERS = {
    "jax_enable_x64": False,
    "jax_numpy_rank_promotion": "allow",
    "jax_numpy_dtype_promotion": "standard",
}


@pytest.fixture(autouse=True)
def examples_run_as_at_a_users(request):
    if not isinstance(request.node, pytest.DoctestItem):
        yield
        return
    before = {name: getattr(jax.config, name) for name in USERS}
    for name, value in USERS.items():
        jax.config.update(name, value)
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)
    for name, value in before.items():
        jax.config.update(name, value)
