"""Rows that several devices share out: work on each device's own, and sets made of them there."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jax.sharding import AbstractMesh, AxisType, Mesh, NamedSharding, PartitionSpec
from jaxtyping import Array, Int, Shaped

from .._core.xla import on_mesh
from ..transfer import Material


class Shared(NamedTuple):
    """Tells how rows are shared out; hashable, for a static argument of `jit`."""

    mesh: Mesh | AbstractMesh
    names: Any  # those of the axes that share rows out; None where each device has all
    certain: bool  # automatic axes do not tell a trace how they are used

    @property
    def parts(self) -> int:
        """The number of parts that rows are in."""
        if self.names is None:
            return 1
        names = self.names if isinstance(self.names, tuple) else (self.names,)
        return math.prod(self.mesh.shape[name] for name in names)

    def spec(self, axis: int | None) -> PartitionSpec:
        """Return the specification of an array whose rows stand along an axis, None for none."""
        return PartitionSpec() if axis is None else PartitionSpec(*[None] * axis, self.names)


def inside_shard_map(*trees) -> bool:
    """True where each device has its own rows already, and knows of no others."""
    leaves = [leaf for leaf in jax.tree.leaves(trees) if isinstance(leaf, jax.Array)]
    kinds = (jax.typeof(leaf).sharding.mesh.axis_types for leaf in leaves)
    return any(AxisType.Manual in types for types in kinds)


def sharing(rows: Array) -> Shared | None:
    """Tell how devices share out rows along the first axis; None for those of one device.

    None too inside `shard_map`, where each device's own rows are all that there are.
    """
    if not on_mesh(rows) or inside_shard_map(rows):
        return None
    typed = jax.typeof(rows).sharding
    known = not isinstance(rows, Tracer)  # if only that other processes have some
    given = rows.sharding if known else typed
    assert isinstance(given, NamedSharding)  # it is on a mesh
    certain = known or AxisType.Auto not in typed.mesh.axis_types
    names = next(iter(given.spec), None)
    if not certain and len(rows) % math.prod(given.mesh.axis_sizes) == 0:
        names = given.mesh.axis_names  # all of them are used, where that goes
    return Shared(given.mesh, names, certain)


def sharing_of_groups(name: str, rows: Array, group: int) -> Shared | None:
    """`sharing` of a set whose indices stay within groups of so many rows.

    Raises `ValueError` unless each device has whole groups.
    """
    shared = sharing(rows)
    each = len(rows) // (shared.parts if shared else 1)
    if each % group == 0:
        return shared
    if shared and not shared.certain:
        return shared._replace(names=None)
    raise ValueError(
        f"expected {name} made of a transfer that is shared out as this one is, {each} vertices on "
        f"each device, got one whose vertices belong together in groups of {group}"
    )


def on_rows(function: Callable, shared: Shared | None, axes: Any, out: Any, *arguments) -> Any:
    """`function(*arguments)` on each device with its rows.

    `axes` and `out` are prefixes of the arguments and of the result: along which axis the rows of
    an array stand, or None for an array that every device has in full.
    """
    if shared is None:
        return function(*arguments)

    def mapped(function, axes, *trees):
        return jax.tree.map(function, axes, *trees, is_leaf=lambda axis: axis is None)

    def place(axis, tree):  # explicit axes want to be told, where rows are on every device yet
        if axis is None:
            return tree
        sharding = NamedSharding(shared.mesh, shared.spec(axis))
        return jax.tree.map(lambda leaf: jax.sharding.reshard(leaf, sharding), tree)

    if AxisType.Explicit in shared.mesh.axis_types:
        arguments = mapped(place, axes, arguments)
    specs = mapped(shared.spec, axes), mapped(shared.spec, out)
    run = jax.shard_map(function, mesh=shared.mesh, in_specs=specs[0], out_specs=specs[1])
    return run(*arguments)


def axes_of(tree: Any, *axes: int | None) -> Any:
    """Names the axis of the rows of each array of a tree, in their order."""
    return jax.tree.unflatten(jax.tree.structure(tree), axes)


def material_axes(material: Material) -> Any:
    """`axes_of` a material: what each vertex has its own of has rows."""
    return axes_of(material, *(0 if own else None for own in material.per_vertex))


def made_of_rows(
    make: Callable[..., tuple[np.ndarray, ...]], shared: Shared | None, *arrays: Array | np.ndarray
) -> tuple[Array, ...]:
    """Calls `make` in NumPy with each device's rows, and joins what comes along its first axis.

    Its first argument is the number of the part; it returns arrays of the same shapes for each.
    A process looks at the rows of its own devices alone.
    """
    if shared is None or shared.names is None:
        return tuple(jnp.asarray(one) for one in make(0, *map(np.asarray, arrays)))
    assert isinstance(shared.mesh, Mesh)  # values are known
    sharding = NamedSharding(shared.mesh, shared.spec(0))
    placed = [jax.device_put(array, sharding) for array in arrays]
    held = [{shard.device: shard.data for shard in one.addressable_shards} for one in placed]
    each = len(arrays[0]) // shared.parts
    made: dict[int, tuple[np.ndarray, ...]] = {}
    on_devices = []
    for device, index in sharding.addressable_devices_indices_map((len(arrays[0]),)).items():
        assert index is not None
        part = index[0].indices(len(arrays[0]))[0] // each
        if part not in made:
            made[part] = make(part, *(np.asarray(shards[device]) for shards in held))
        on_devices.append([jax.device_put(one, device) for one in made[part]])
    return tuple(
        jax.make_array_from_single_device_arrays(
            (shared.parts * len(some[0]), *some[0].shape[1:]), sharding, list(some)
        )
        for some in zip(*on_devices, strict=True)
    )


def on_each_device(array: Shaped[Any, "..."], shared: Shared | None) -> Shaped[Array, "..."]:
    """Puts a small array on every device that has rows."""
    if shared is None:
        return jnp.asarray(array)
    assert isinstance(shared.mesh, Mesh)  # values are known
    return jax.device_put(np.asarray(array), NamedSharding(shared.mesh, PartitionSpec()))


def own(numbers: Int[Array, "..."], count: int) -> Int[Array, "..."]:
    """Counts from the first of a device's own `count` rows, inside `shard_map`; else as they are.

    The numbers are those of rows of this device alone, counted over all devices.
    """
    if not on_mesh(numbers):
        return numbers
    return numbers - numbers.reshape(-1)[0] // count * count
