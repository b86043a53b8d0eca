"""The loops and the calls of the host in a program, read from its StableHLO for one platform."""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import jax


class Program(NamedTuple):
    """What a lowered function would do on an accelerator."""

    # Of each loop the trips of those that it stands in and its own; None for what only values tell.
    nests: list[tuple[int | None, ...]]
    callbacks: list[str]

    @property
    def trips(self) -> int:
        """The most that the body of any loop with a fixed number of trips is run."""
        return max((math.prod(n for n in nest if n) for nest in self.nests), default=0)

    @property
    def open(self) -> int:
        """How many loops run until a value says so."""
        return sum(nest[-1] is None for nest in self.nests)


def lowered(traced: jax.stages.Traced, platform: str) -> Program:
    """Lowers for a platform that need not be here, and reads the result."""
    module = traced.lower(lowering_platforms=(platform,)).compiler_ir("stablehlo")
    functions = {op.attributes["sym_name"].value: op for op in module.body.operations}
    nests = _nests(functions["main"], functions, {})
    operations = [inner for function in functions.values() for inner in _inside(function)]
    callbacks = [name for op in operations if "callback" in (name := _target(op))]
    callbacks += [op.name for op in operations if op.name in _HOST]
    return Program(nests, callbacks)


_HOST = ("stablehlo.send", "stablehlo.recv", "stablehlo.infeed", "stablehlo.outfeed")


def _nests(operation, functions, known) -> list[tuple[int | None, ...]]:
    """The loops in an operation, and in the functions that it calls."""
    found = []
    for region in operation.regions:
        for block in region.blocks:
            for inner in block.operations:
                op = inner.operation
                if op.name == "stablehlo.while":
                    trips = _trips(op)
                    found += [(trips,), *((trips, *nest) for nest in _nests(op, functions, known))]
                    continue
                if op.name == "func.call":
                    name = op.attributes["callee"].value
                    if name not in known:
                        known[name] = _nests(functions[name], functions, known)
                    found += known[name]
                found += _nests(op, functions, known)
    return found


def _trips(loop) -> int | None:
    """How often a loop runs, where it counts from a constant up to another: `scan` and `map`."""
    condition = loop.regions[0].blocks[0]
    *_, end = condition.operations
    compared = end.operands[0].owner
    if getattr(compared, "name", "") != "stablehlo.compare":
        return None
    counter, limit = compared.operands
    places = [i for i, argument in enumerate(condition.arguments) if argument == counter]
    stop = _constant(limit)
    first = _constant(loop.operands[places[0]]) if places else None
    less = "LT" in str(compared.attributes["comparison_direction"])
    return stop - first if less and stop is not None and first is not None else None


def _constant(value) -> int | None:
    made = value.owner
    if getattr(made, "name", "") != "stablehlo.constant" or value.type.shape:
        return None
    return int(made.attributes["value"][0])


def _inside(operation) -> Iterator[Any]:
    for region in operation.regions:
        for block in region.blocks:
            for inner in block.operations:
                yield inner.operation
                yield from _inside(inner.operation)


def _target(op) -> str:
    if op.name != "stablehlo.custom_call":
        return ""
    return op.attributes["call_target_name"].value
