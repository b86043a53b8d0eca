"""Rows shared out over devices: filled up to a multiple of their number, and placed."""

import math
from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jax.sharding import AxisType, Mesh, NamedSharding, PartitionSpec
from jaxtyping import Array, Shaped

from .checks import described

Devices = Sequence[jax.Device] | Mesh | None
# What rows `first` to `last` beyond the end hold, in an array (rows, ...).
Filling = Callable[[int, int], Shaped[Array, "rows ..."]]


def mesh_of(devices: Devices) -> Mesh:
    """Makes a mesh of one automatic axis of the devices; raises `ValueError` for what is none."""
    if isinstance(devices, Mesh):
        return devices
    if devices is None:
        devices = jax.devices()
    listed = isinstance(devices, list | tuple) and all(isinstance(d, jax.Device) for d in devices)
    if not listed or not devices:
        raise ValueError(
            f"expected devices as a list of jax.Device or a jax.sharding.Mesh, got "
            f"{described(devices)}"
        )
    if len(set(devices)) < len(devices):
        raise ValueError(f"expected devices that are all different, got {list(devices)}")
    return Mesh(np.array(devices), ("rows",), axis_types=(AxisType.Auto,))


def automatic(mesh: Mesh) -> Mesh:
    """The same mesh with automatic axes, on which every operation runs."""
    return Mesh(mesh.devices, mesh.axis_names, axis_types=(AxisType.Auto,) * mesh.devices.ndim)


def share(
    array: Shaped[Array | np.ndarray, "..."],
    mesh: Mesh,
    axis: int = 0,
    filling: Filling | None = None,
) -> Shaped[Array, "..."]:
    """Shares an axis out over all devices of the mesh; `filling` is zeros by default."""
    count = array.shape[axis]
    if isinstance(array, jax.Array) and len(array.sharding.device_set) > 1:
        if count % mesh.size == 0:
            return jax.device_put(array, _sharding(mesh, axis))
        array = np.asarray(array)  # shared out otherwise, in parts of another size

    def cut(first: int, last: int):
        return array[(slice(None),) * axis + (slice(first, last),)]

    return place(cut, array.shape, mesh, axis, filling)


def place(
    cut: Callable[[int, int], Shaped[Array | np.ndarray, "..."]],
    shape: tuple[int, ...],
    mesh: Mesh,
    axis: int = 0,
    filling: Filling | None = None,
) -> Shaped[Array, "..."]:
    """Shares out what is cut for each device of this process: its rows, from one to another."""
    count = shape[axis]
    total = math.ceil(count / mesh.size) * mesh.size

    def rows(first: int, last: int):
        inside = cut(min(first, count), min(last, count))
        if last <= count:
            return inside
        first = max(first, count)
        numpy = jnp if isinstance(inside, jax.Array) else np
        if filling is None:
            added = numpy.zeros((*shape[:axis], last - first, *shape[axis + 1 :]), inside.dtype)
        else:
            added = jnp.moveaxis(jnp.asarray(filling(first, last), inside.dtype), 0, axis)
        return numpy.concatenate([inside, added], axis)

    sharding, whole = _sharding(mesh, axis), (*shape[:axis], total, *shape[axis + 1 :])
    parts = [
        jax.device_put(rows(*index[axis].indices(total)[:2]), device)
        for device, index in sharding.addressable_devices_indices_map(whole).items()
        if index is not None
    ]
    if any(isinstance(part, Tracer) for part in parts):  # of known values too
        raise ValueError("arrays are placed on devices before jit, not inside")
    return jax.make_array_from_single_device_arrays(whole, sharding, parts)


def _sharding(mesh: Mesh, axis: int) -> NamedSharding:
    name, *others = mesh.axis_names
    names = (name, *others) if others else name
    return NamedSharding(mesh, PartitionSpec(*[None] * axis, names))


def whole(array: Shaped[Array | np.ndarray, "..."], mesh: Mesh) -> Shaped[Array, "..."]:
    """Puts the array on each device of the mesh."""
    sharding = NamedSharding(mesh, PartitionSpec())
    if isinstance(array, jax.Array) and len(array.sharding.device_set) > 1:
        return jax.device_put(array, sharding)
    parts = [jax.device_put(array, device) for device in sharding.addressable_devices]
    return jax.make_array_from_single_device_arrays(array.shape, sharding, parts)


def last_of(array: Shaped[Array | np.ndarray, "v ..."]) -> Filling:
    """Fills with what the last row has, so that a box around all points stays what it is."""

    def rows(first: int, last: int):
        return jnp.broadcast_to(array[-1:], (last - first, *array.shape[1:]))

    return rows


def own_numbers(width: int) -> Filling:
    """Fills rows of neighbors with the number of the row itself."""

    def rows(first: int, last: int):
        return jnp.broadcast_to(jnp.arange(first, last)[:, None], (last - first, width))

    return rows
