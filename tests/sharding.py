"""What every public function of arrays promises on a mesh of devices."""

import itertools
import re
from collections.abc import Callable, Mapping
from typing import Any, Literal

import jax
import numpy as np
from jax.sharding import AxisType, NamedSharding
from jax.sharding import PartitionSpec as P

ROWS = P("rows")  # for an array whose leading axis is shared out; P(None, "rows") for the second
WHOLE = P()  # for one that each device holds in full

Kind = Literal["explicit", "auto", "shard_map"]
KINDS: tuple[Kind, ...] = ("explicit", "auto", "shard_map")
kinds = KINDS  # those that `check_sharded` tries; one a test, by the fixture `kind_of_mesh`

_COLLECTIVE = re.compile(
    r" ((?:ragged-)?all-(?:gather|reduce|to-all)|reduce-scatter|collective-[a-z]+)(?:-start)?\("
)


def collectives(compiled: jax.stages.Compiled) -> dict[str, list[str]]:
    """The kinds of what devices exchange in a compiled program, each with its lines there."""
    found: dict[str, list[str]] = {}
    for line in (compiled.as_text() or "").splitlines():
        if kind := _COLLECTIVE.search(line):
            found.setdefault(kind[1], []).append(line.strip())
    return found


def longest_exchange(compiled: jax.stages.Compiled) -> int:
    """The longest axis of the arrays that devices exchange."""
    longest = 0
    for line in itertools.chain.from_iterable(collectives(compiled).values()):
        results = line[: _COLLECTIVE.search(line).start()]  # pyright: ignore[reportOptionalMemberAccess]
        shapes = ",".join(re.findall(r"\[([\d,]*)\]", results))
        longest = max([longest, *map(int, re.findall(r"\d+", shapes))])
    return longest


def check_sharded(
    function: Callable[..., Any],
    arguments: tuple,
    specs: tuple,
    out: Any,
    *,
    rtol: float = 1e-5,
    mapped: Callable[..., Any] | bool = True,
    exchange: Mapping[str, str] | None = None,
) -> None:
    """Runs `function` on two devices: the same numbers, sharded as `out` says, nothing exchanged.

    `specs` and `out` are prefix pytrees of PartitionSpecs, one for each argument and for the
    result. Arguments that are not arrays (Python numbers, strings, None) belong into `function`.
    It is tried with explicit axes, with automatic ones and inside `shard_map` (the last two in the
    slow tests). Inside, each device has its own rows only, so that a sum over them needs its
    `psum`: `mapped` is the function with it, True for the function itself, or False for what makes
    no sense there. `exchange` names the collectives that the algorithm needs, and why.
    """
    plain = jax.jit(function)(*arguments)
    for kind in kinds:
        axes = AxisType.Auto if kind == "auto" else AxisType.Explicit
        mesh = jax.make_mesh((2,), ("rows",), axis_types=(axes,))
        placed = tuple(
            jax.device_put(argument, _shardings(mesh, spec, argument))
            for argument, spec in zip(arguments, specs, strict=True)
        )
        if kind == "shard_map":
            if mapped is not False:
                body = function if mapped is True else mapped
                inside = jax.shard_map(body, mesh=mesh, in_specs=specs, out_specs=out)
                _check_close(jax.jit(inside)(*placed), plain, rtol, kind)
            continue
        compiled = jax.jit(function).lower(*placed).compile()
        result = compiled(*placed)
        _check_placed(result, _shardings(mesh, out, result), kind)
        _check_close(result, plain, rtol, kind)
        found = collectives(compiled)
        assert found.keys() == set(exchange or ()), f"{kind} axes: {list(found.values())}"


def _shardings(mesh, spec, tree):
    """The prefix `spec`, broadcast to the leaves of `tree`."""
    return jax.tree.map(
        lambda one, part: jax.tree.map(lambda _: NamedSharding(mesh, one), part),
        spec,
        tree,
        is_leaf=lambda node: isinstance(node, P),
    )


def _check_placed(result, wanted, kind) -> None:
    for array, sharding in zip(jax.tree.leaves(result), jax.tree.leaves(wanted), strict=True):
        assert array.sharding.is_equivalent_to(sharding, array.ndim), (
            f"{kind} axes: expected {sharding.spec}, got {array.sharding}"
        )


def _check_close(result, plain, rtol, kind) -> None:
    for array, expected in zip(jax.tree.leaves(result), jax.tree.leaves(plain), strict=True):
        expected = np.asarray(expected)
        scale = np.abs(expected).max(initial=0)
        np.testing.assert_allclose(
            np.asarray(array), expected, rtol=rtol, atol=rtol * scale, err_msg=str(kind)
        )
