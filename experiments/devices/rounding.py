"""A device's matrix products on any device: the operands rounded, and the sums in full.

A function is traced, and what it traces to is computed step by step, with the operands of each
product rounded to as many bits as the device keeps. Where a function has one way for the CPU and
another for all else, the other is taken.
"""

import functools
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
from jax.extend import core

# Bits of the mantissa that are stored: of TF32 on NVIDIA's tensor cores, of bfloat16 on TPUs.
BITS = {"tf32": 10, "bfloat16": 7}
# By which JAX's switch asks for them: of these the first is a GPU's, the second a TPU's.
SWITCH = {"full": "highest", "tf32": "tensorfloat32", "bfloat16": "bfloat16"}

# What only calls a program of its own.
_INLINED = {"jit", "pjit", "closed_call", "core_call", "remat2", "checkpoint"} | {
    f"custom_{mode}_call" for mode in ("jvp", "vjp")
}


def rounded(
    function: Callable[..., Any], precision: str, *, everything: bool = False
) -> Callable[..., Any]:
    """The function with its products in a precision of `BITS`, where it obeys JAX's switch.

    With `everything` all products are rounded, also those that do not obey.
    """

    def run(*arguments):
        with jax.default_matmul_precision(SWITCH[precision]):
            program, shapes = jax.make_jaxpr(function, return_shape=True)(*arguments)
        found = _Rounding(BITS[precision], everything).of(program, jax.tree.leaves(arguments))
        return jax.tree.unflatten(jax.tree.structure(shapes), found)

    return jax.jit(run)


class _Rounding:
    """Computes a program, an equation after the other."""

    def __init__(self, bits: int, everything: bool):
        self._round = functools.partial(
            jax.lax.reduce_precision, exponent_bits=8, mantissa_bits=bits
        )
        self._everything = everything

    def of(self, program: core.ClosedJaxpr | core.Jaxpr, arguments: Sequence[Any]) -> list[Any]:
        closed = isinstance(program, core.ClosedJaxpr)
        jaxpr, constants = (program.jaxpr, program.consts) if closed else (program, [])
        known = dict(zip(jaxpr.constvars, constants, strict=True))
        known |= zip(jaxpr.invars, arguments, strict=True)

        def value(variable):
            return variable.val if isinstance(variable, core.Literal) else known[variable]

        for equation in jaxpr.eqns:
            results = self._step(equation, [value(v) for v in equation.invars])
            known |= zip(equation.outvars, results, strict=True)
        return [value(v) for v in jaxpr.outvars]

    def _step(self, equation, values: list[Any]) -> Sequence[Any]:
        name, options = equation.primitive.name, equation.params
        if name == "platform_index":
            return [options["platforms"].index(None)]
        if name == "cond":
            return self._cond(options, *values)
        if name == "scan":
            return self._scan(options, values)
        if name == "while":
            return self._while(options, values)
        if name in _INLINED:
            return self.of(options.get("jaxpr", options.get("call_jaxpr")), values)
        if name == "dot_general" and self._is_rounded(equation):
            values = [self._round(value) for value in values]
        results = equation.primitive.bind(*values, **options)
        return results if equation.primitive.multiple_results else [results]

    def _is_rounded(self, equation) -> bool:
        precision = equation.params["precision"]
        asked = precision[0] if isinstance(precision, tuple) else precision
        single = equation.outvars[0].aval.dtype == jnp.float32
        return single and (self._everything or asked != jax.lax.Precision.HIGHEST)

    def _cond(self, options, index, *values) -> Sequence[Any]:
        branches = [functools.partial(self._branch, one) for one in options["branches"]]
        if isinstance(index, int):  # the platform's
            return branches[index](*values)
        return jax.lax.switch(index, branches, *values)

    def _branch(self, program, *values) -> Sequence[Any]:
        return self.of(program, values)

    def _scan(self, options, values: list[Any]) -> Sequence[Any]:
        fixed, carried = options["num_consts"], options["num_carry"]
        constants, start = values[:fixed], values[fixed : fixed + carried]

        def step(state, row):
            results = self.of(options["jaxpr"], [*constants, *state, *row])
            return results[:carried], results[carried:]

        how = {name: options[name] for name in ("length", "reverse", "unroll")}
        state, rows = jax.lax.scan(step, start, values[fixed + carried :], **how)
        return [*state, *rows]

    def _while(self, options, values: list[Any]) -> Sequence[Any]:
        first = options["cond_nconsts"]
        second = first + options["body_nconsts"]

        def goes_on(state):
            return self.of(options["cond_jaxpr"], [*values[:first], *state])[0]

        def step(state):
            return self.of(options["body_jaxpr"], [*values[first:second], *state])

        return jax.lax.while_loop(goes_on, step, values[second:])
