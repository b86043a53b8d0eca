"""Counts the loops of the calls in `tests/lowered`, and what else a GPU or TPU should not meet."""

import functools

import jax
import lowered
import lowered.loops
import products
import pytest
from lowered.derivative import with_gradient

PLATFORMS = ("cuda", "tpu")


@functools.cache
def traced(module: str, name: str) -> jax.stages.Traced:
    """A call of the table, with its derivative in reverse mode, traced for no platform yet."""
    call = lowered.table(module)[name]
    return jax.jit(with_gradient(call)).trace(*call.arguments)


@pytest.fixture(autouse=True)
def accelerator(monkeypatch):
    """What is traced only where there is an accelerator is traced here."""
    monkeypatch.setattr("jaxsh.inverse._solve.cpu_alone", lambda: False)


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


def check(module: str, platform: str) -> None:
    """Asserts that a module's calls have no loop but those of its table."""
    found = [fault for name in lowered.table(module) for fault in faults(module, name, platform)]
    assert not found, "\n" + "\n".join(found)
