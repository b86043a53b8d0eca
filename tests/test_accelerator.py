"""On a GPU or TPU no loop remains that only a CPU's cache wants, and nothing calls the host.

No such device is needed: JAX lowers for one that is not here. The table is `tests/lowered`.
"""

import functools

import jax
import lowered
import lowered.loops
import products
import pytest
import valid_calls
from lowered.derivative import is_float, with_gradient

PLATFORMS = ("cuda", "tpu")


@pytest.fixture(autouse=True)
def _accelerator(monkeypatch):
    """What is traced only where there is an accelerator is traced here."""
    monkeypatch.setattr("jaxsh.inverse._solve.cpu_alone", lambda: False)


@functools.cache
def traced(module: str, name: str) -> jax.stages.Traced:
    """A call of the table, with its derivative in reverse mode, traced for no platform yet."""
    call = lowered.table(module)[name]
    return jax.jit(with_gradient(call)).trace(*call.arguments)


def faults(module: str, name: str, platform: str) -> list[str]:
    """What a call has on a platform and should not."""
    call = lowered.table(module)[name]
    program = lowered.loops.lowered(traced(module, name), platform)
    found = [f"calls the host: {callback}" for callback in program.callbacks]
    if program.trips > call.trips:
        found.append(f"{program.trips} trips instead of {call.trips}: {program.nests}")
    if program.open > call.open:
        found.append(f"{program.open} loops without a number of trips instead of {call.open}")
    # Of derivatives too: `test_precision.py` looks at functions alone.
    if below := set(products.precisions(traced(module, name).jaxpr.jaxpr)) - {products.FULL}:
        found.append(f"multiplies in {below}")
    return [f"{module}.{name} on {platform}: {fault}" for fault in found]


@pytest.mark.parametrize("module", lowered.MODULES)
def test_a_public_function_of_arrays_that_is_not_lowered_fails(module):
    valid = valid_calls.table(module)
    calls, without = ({name.partition(",")[0] for name in names} for names in lists(module))
    traceable = {name for name, call in valid.items() if not call.host or call.slow}
    of_arrays = {name for name in traceable if any(map(has_floats, valid[name].arguments.values()))}
    assert of_arrays - calls - without == set()
    assert calls | without <= valid.keys()
    assert calls.isdisjoint(without)


def lists(module):
    return lowered.table(module), lowered.without(module)


def has_floats(value) -> bool:
    return any(map(is_float, jax.tree.leaves(value)))


@pytest.mark.parametrize("module", lowered.MODULES)
def test_more_loops_than_two_trips_have_a_reason(module):
    for name, call in lowered.table(module).items():
        assert bool(call.why) == (call.trips > 2 or call.open > 0), name


@pytest.mark.slow
@pytest.mark.parametrize("platform", PLATFORMS)
@pytest.mark.parametrize("module", lowered.MODULES)
def test_no_loop_but_those_of_the_table_is_left(module, platform):
    found = [fault for name in lowered.table(module) for fault in faults(module, name, platform)]
    assert not found, "\n" + "\n".join(found)


@pytest.mark.parametrize(("module", "name"), [("harmonics", "evaluate")])
def test_no_loop_is_left_in_some(module, name):
    assert not [fault for p in PLATFORMS for fault in faults(module, name, p)]
