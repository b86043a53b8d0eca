"""Stands in for a GPU or TPU: lowers for one that is not here, or runs its branches on the CPU."""

import contextlib
from collections.abc import Iterator

import jax
import lowered
import lowered.loops
import products
import pytest
from lowered.derivative import with_gradient

from jaxsh._core import xla

PLATFORMS = ("cuda", "tpu")


def check(module: str) -> None:
    """Asserts that a module's calls have no loop but those of its table, and call no host."""
    found = [fault for name in lowered.table(module) for fault in faults(module, name)]
    assert not found, "\n" + "\n".join(found)


def faults(module: str, name: str) -> list[str]:
    """What a call, with its derivative in reverse mode, has on a platform and should not."""
    call = lowered.table(module)[name]
    with pytest.MonkeyPatch.context() as patch:
        # What is traced only where there is an accelerator is traced here.
        patch.setattr("jaxsh.inverse._solve.cpu_alone", lambda: False)
        patch.setattr("jaxsh._core.xla.cpu_alone", lambda: False)
        traced = jax.jit(with_gradient(call)).trace(*call.arguments)
    found = []
    # Of derivatives too: `test_precision.py` looks at functions alone.
    if below := set(products.precisions(traced.jaxpr.jaxpr)) - {products.FULL}:
        found.append(f"multiplies in {below}")
    for platform in PLATFORMS:
        program = lowered.loops.lowered(traced, platform)
        said = [f"calls the host: {callback}" for callback in program.callbacks]
        if program.trips > call.trips:
            said.append(f"{program.trips} trips instead of {call.trips}: {program.nests}")
        if program.open > call.open:
            said.append(f"{program.open} loops without a number of trips instead of {call.open}")
        found += [f"on {platform} {fault}" for fault in said]
    return [f"{module}.{name} {fault}" for fault in found]


@contextlib.contextmanager
def branches(room: int) -> Iterator[None]:
    """Takes the other branch of each `platform_dependent` on a CPU, with `room` bytes a call."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jax.lax, "platform_dependent", lambda *a, default, **_: default(*a))
        patch.setattr(xla, "_ROOM", room)
        # A precision that no CPU heeds: what is compiled in here is kept apart from all else.
        with jax.default_matmul_precision("tensorfloat32"):
            yield
