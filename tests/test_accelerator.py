"""On a GPU or TPU no loop remains that only a CPU's cache wants, and nothing calls the host.

No such device is needed: JAX lowers for one that is not here. The table is `tests/lowered`.
"""

import accelerators
import jax
import lowered
import pytest
import valid_calls
from lowered.derivative import is_float

# Apart, in files of their own, so that two processes share them.
LARGE = {"adaptive", "inverse", "midrange"}


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
@pytest.mark.parametrize("module", sorted(set(lowered.MODULES) - LARGE))
def test_no_loop_but_those_of_the_table_is_left(module):
    accelerators.check(module)


def test_no_loop_is_left_in_evaluate():
    assert accelerators.faults("harmonics", "evaluate") == []
