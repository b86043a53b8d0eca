"""One switch of precision: shading obeys JAX's own, everything else multiplies in full."""

import contextlib

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import valid_calls
from jax.extend import core
from products import FULL, precisions

from jaxsh import sky, sphere, transfer

CHOSEN = jax.lax.Precision.HIGH

# Whose products obey. `FixedLight` has none left, and `Levels` is called as `Masks`, by `shade`.
SHADING = {
    "adaptive": {"AnchorSet.__call__", "TileSet.__call__", "shade"},
    "midrange": {"shade"},
    "transfer": {"FixedView.__call__", "fluence", "shade_diffuse", "shade_glossy"},
}
# What multiplies on the way, but looks at values and so cannot be traced: called instead.
CALLED = {
    "adaptive": {"make_tiles", "make_anchors"},
    "inverse": {"fit_light"},
    "sky": {"fit"},
}

SLOW = ("adaptive", "harmonics", "imaging", "inverse", "midrange", "sky", "transfer")


def single(tree):
    """The tree with its numbers in 32 bits, for which the switch is."""

    def cast(leaf):
        wide = eqx.is_array(leaf) and leaf.dtype == np.float64
        return jnp.asarray(leaf, jnp.float32) if wide else leaf

    return jax.tree.map(cast, tree)


def traced(call: valid_calls.Call) -> set[object]:
    """The precisions in what a call traces to."""
    function, arguments = single((call.function, call.arguments))
    arrays, static = eqx.partition(arguments, eqx.is_array)

    def run(arrays):
        return eqx.filter(function(**eqx.combine(arrays, static)), eqx.is_array)

    return set(precisions(jax.make_jaxpr(run)(arrays).jaxpr))


def seen(call: valid_calls.Call, monkeypatch) -> set[object]:
    """The precisions of what a call multiplies or traces anew while it runs."""
    product, found = core.primitives.dot_general_p, set()
    bind = product.bind

    def noted(*operands, **options):
        precision = options["precision"]
        if jnp.issubdtype(operands[0].dtype, jnp.inexact):
            found.add(precision[0] if isinstance(precision, tuple) else precision)
        return bind(*operands, **options)

    function, arguments = single((call.function, call.arguments))
    with monkeypatch.context() as patch, contextlib.suppress(RuntimeError):  # too few steps
        patch.setattr(product, "bind", noted)
        function(**arguments)
    return found


@pytest.mark.parametrize(
    "module",
    ["sphere", *(pytest.param(module, marks=pytest.mark.slow) for module in SLOW)],
)
def test_shading_obeys_and_nothing_else(module, monkeypatch):
    obeys = set()
    for name, call in valid_calls.table(module).items():
        if name.endswith(".sharded"):
            continue  # places arrays, which is not for tracing
        with jax.default_matmul_precision("high"):
            try:
                found = traced(call)
            except (TypeError, ValueError, ImportError, OSError):  # not to be traced
                found = seen(call, monkeypatch) if name in CALLED.get(module, ()) else set()
                assert found or name not in CALLED.get(module, ())
        assert found <= {FULL, CHOSEN}, name
        if CHOSEN in found:
            obeys.add(name)
            assert traced(call) == {FULL}, name  # without the switch
    assert obeys == SHADING.get(module, set())


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_switch_reaches_shading_and_its_gradient(dtype):
    points = sphere.fibonacci(20).directions.astype(dtype)
    made = transfer.unshadowed(points, points, 1)

    def brightness(light):
        return jnp.sum(transfer.shade_diffuse(light, made, 0.5) ** 2)

    def used(switch):
        with jax.default_matmul_precision(switch):
            program = jax.make_jaxpr(jax.grad(brightness))(jnp.ones((3, 4), dtype))
        return set(precisions(program.jaxpr))

    # In this order: what is traced without the switch does not serve with it, nor the other way.
    assert used(None) == {FULL}
    # 64 bits are not in the switch's reach.
    assert used("high") == ({CHOSEN} if dtype == np.float32 else {FULL})
    assert used("bfloat16") == ({jax.lax.Precision.DEFAULT} if dtype == np.float32 else {FULL})
    assert used("highest") == used(None) == {FULL}


def test_a_model_of_the_users_is_in_full():
    # A bare product, as users write it.
    def model(view, sun):
        return 1 + (view @ sun)[:, None]

    def projected(sun):
        return sky.project(model, sun, degree=1)

    with jax.default_matmul_precision("high"):
        program = jax.make_jaxpr(projected)(jnp.asarray([0.6, 0.0, 0.8], jnp.float32))
    assert set(precisions(program.jaxpr)) == {FULL}
