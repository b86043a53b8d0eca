"""Every public function against wrong arguments: one sentence of ours that names what is wrong."""

import importlib
import inspect
import itertools
import math
import traceback
from collections.abc import Iterator
from typing import Any

import equinox as eqx
import faces
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import valid_calls


class Other(eqx.Module):
    """A class that no function takes."""


def is_array(value) -> bool:
    return isinstance(value, np.ndarray)


def of_wrong_kind(value: Any) -> Iterator[tuple[str, Any]]:
    """What must be refused in the place of a value."""
    yield "another class", Other()
    if not isinstance(value, dict):
        yield "a dict", {"a": 1}
    if is_array(value):
        yield "complex", value.astype(complex)
        if value.dtype != bool:
            yield "bool", np.ones(value.shape, bool)
        yield "text", "abc"
        yield "None", None
        yield "ragged", [[1.0, 2.0], [3.0]]
        if np.issubdtype(value.dtype, np.floating):
            yield "bytes", value.astype(np.uint8)
        else:
            yield "floats", value.astype(float)
    elif isinstance(value, bool):
        yield from [("text", "yes"), ("None", None), ("a number", 2), ("array", jnp.ones(2))]
    elif isinstance(value, str):
        yield from [("misspelt", value[:-1]), ("a number", 3), ("an array", jnp.ones(2))]
        yield from [("None", None), ("a list", [value])]
    elif isinstance(value, int):
        yield from [("text", "2"), ("half", 2.5), ("array", jnp.ones(3)), ("a list", [2])]
    elif isinstance(value, float):
        yield from [("text", "abc"), ("complex", 1j), ("a long array", np.ones(7))]
        yield "more than any float", 10**400
    else:
        yield from [("None", None), ("text", "abc"), ("an array", jnp.ones(3))]
        if isinstance(value, eqx.Module):
            yield "a tuple", tuple(jax.tree.leaves(value))
            yield "its class", type(value)


def of_wrong_value(value: Any) -> Iterator[tuple[str, Any]]:
    """What must be refused where a value must be finite."""
    for name, wrong in (("NaN", math.nan), ("infinite", math.inf)):
        if is_array(value):
            spoilt = np.array(value)
            spoilt.flat[-1] = wrong
            yield name, jnp.asarray(spoilt)
            yield f"{name}, in a list", spoilt.tolist()
        elif isinstance(value, float):
            yield name, wrong


def of_wrong_shape(value: Any) -> Iterator[tuple[str, Any]]:
    """What is refused, or is taken for something sensible: a batch, a list, a lower degree."""
    if not is_array(value):
        return
    yield "integers", value.astype(int)
    yield "a number", 0.5
    yield "transposed", value.T
    yield "one axis more", value[None]
    for axis, length in enumerate(value.shape):
        for kind, count in (("empty", 0), ("one shorter", length - 1), ("one longer", length + 1)):
            yield f"{kind} along axis {axis}", np.take(value, np.arange(count) % length, axis)
    if value.ndim and value.shape[-1] == valid_calls.K:
        yield "another degree", value[..., :4]
        yield "a higher degree", np.concatenate([value, value], -1)[..., :16]


def on_device(call, arguments) -> dict[str, Any]:
    """JAX arrays for NumPy's, where the function does not run on the host."""
    if call.host:
        return arguments
    return {k: jnp.asarray(v) if is_array(v) else v for k, v in arguments.items()}


def refusal(call, arguments, name: str, *, traced: bool = True) -> str | None:
    """What is wrong with a refusal; None where nothing is, and "taken" where there is none."""
    try:
        if call.host or not traced:
            call.function(**on_device(call, arguments))
        else:  # so that what is taken costs no compilation
            jax.eval_shape(lambda: call.function(**on_device(call, arguments)))
    except (ValueError, TypeError) as error:
        message = str(error)
        last = traceback.extract_tb(error.__traceback__)[-1]
        said = f"{type(error).__name__} at {last.filename}:{last.lineno}: {message[:300]!r}"
        if "/jaxsh/" not in last.filename.replace("\\", "/"):
            return f"not ours: {said}"
        if "\n" in message or len(message) > 300:
            return f"not one sentence: {said}"
        words = ["expected", *name.split(), *(["cannot"] if name == "path" else [])]
        if not any(word in message for word in words):
            return f"names neither the argument nor what was expected: {said}"
        return None
    except (OSError, ImportError):  # there is no such file, or no such package here
        return "taken"
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} at {last.filename}:{last.lineno}: {str(error)[:300]!r}"
    return "taken"


MODULES = pytest.mark.parametrize("module", faces.PACKAGES)


@MODULES
def test_a_public_function_without_a_valid_call_fails(module):
    package = importlib.import_module(f"jaxsh.{module}")
    public = {name for name in package.__all__ if callable(getattr(package, name))}
    listed = {name.partition(".")[0] for name in valid_calls.table(module)}
    assert public - listed - valid_calls.MADE.get(module, set()) == set()
    assert valid_calls.MADE.get(module, set()) <= public


@MODULES
def test_all_arguments_are_in_the_table(module):
    for name, call in valid_calls.table(module).items():
        parameters = inspect.signature(call.function).parameters.values()
        named = {p.name for p in parameters if p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)}
        assert named - {"progress"} == set(call.arguments), name
        assert call.finite <= named, name


@pytest.mark.slow
@MODULES
def test_lists_are_as_good_as_arrays(module, unchecked):
    for call in valid_calls.table(module).values():
        lists = {k: v.tolist() if is_array(v) else v for k, v in call.arguments.items()}
        lists |= {k: v for k, v in call.arguments.items() if k == "mask"}
        if call.host or not any(map(is_array, call.arguments.values())):
            continue
        try:
            expected, found = (
                jax.eval_shape(
                    lambda given=given, call=call: call.function(**on_device(call, given))
                )
                for given in (call.arguments, lists)
            )
        except ImportError:  # of the tables of Hosek's sky
            continue
        for array, other in zip(jax.tree.leaves(found), jax.tree.leaves(expected), strict=True):
            assert (array.shape, array.dtype.kind) == (other.shape, other.dtype.kind)


@pytest.mark.filterwarnings("ignore:A JAX array is being set as static")  # by Equinox, before us
@pytest.mark.parametrize("shapes", [False, pytest.param(True, marks=pytest.mark.slow)])
@MODULES
def test_wrong_arguments_are_refused_in_one_sentence(module, shapes, unchecked):
    found = []
    for name, call in valid_calls.table(module).items():
        found += [f"{name}: {fault}" for fault in faults(call, shapes)]
    assert not found, "\n" + "\n".join(found)


def faults(call, shapes: bool) -> list[str]:
    """Each wrong argument of a call that passes, or is not refused as it ought to be.

    Of another shape, which takes a while where that is taken, or else of another kind or value, and
    in another order.
    """
    found = []

    def check(kind, argument, value, *, may_pass, traced=True):
        result = refusal(call, {**call.arguments, argument: value}, argument, traced=traced)
        if result is not None and not (may_pass and result == "taken"):
            found.append(f"{argument} as {kind}: {result}")

    if shapes:
        for argument, value in () if call.slow else call.arguments.items():
            for kind, wrong in of_wrong_shape(value):
                check(kind, argument, wrong, may_pass=True)
        return found
    for argument, value in call.arguments.items():
        default = inspect.signature(call.function).parameters[argument].default
        for kind, wrong in of_wrong_kind(value):
            if wrong is not default:
                check(kind, argument, wrong, may_pass=argument in call.free)
        if argument in call.finite:
            for kind, wrong in of_wrong_value(value):
                check(kind, argument, wrong, may_pass=False, traced=False)
    names = list(call.arguments)
    for first, second in itertools.pairwise(names):
        a, b = call.arguments[first], call.arguments[second]
        if call.slow and type(a) is type(b):
            continue
        swapped = refusal(call, {**call.arguments, first: b, second: a}, f"{first} {second}")
        if swapped not in (None, "taken"):
            found.append(f"{first} and {second} swapped: {swapped}")
    return found
