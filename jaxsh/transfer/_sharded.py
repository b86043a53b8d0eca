"""Arrays beside a transfer that is shared out over devices."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Shaped

from .._core.checks import check_known, described
from .._core.devices import Devices, mesh_of, share


def shard_rows(
    values: Shaped[ArrayLike, "v ..."], devices: Devices = None
) -> Shaped[Array, "w ..."]:
    """Share rows out over devices: W rows, V filled up with zeros to a multiple of the devices.

    For what stands beside a transfer that `Transfer.sharded` has shared out over the same devices,
    one row for each of its points: an albedo, lights of their own, what a fit has observed and its
    weights. JAX divides an axis in equal parts alone, so that V becomes W, the next multiple of
    the number of devices, for the transfer as for these rows and for the colors that follow; the
    last W - V of them belong to no point. Cut them off where the colors leave JAX:
    `np.asarray(colors)[..., :V, :]`. On a mesh of automatic axes `colors[..., :V, :]` does it too,
    but collects all colors on each device.

    **Arguments**

    - `values`: of V points, (V, ...), in NumPy or JAX. Each device gets its own rows alone.
    - `devices`: a list of `jax.Device`, by default all of `jax.devices()`, those of other processes
      included: each process then gives the same values, and places its part of them. Or a
      `jax.sharding.Mesh`, over all of whose axes the rows are shared out, whether its axes are
      automatic or explicit.

    **Returns** (W, ...), with a `NamedSharding` over the first axis. Raises `ValueError` for
    devices that are none, or are named twice, for values without an axis, and under `jit`: place
    arrays before it.

    **Example**

    >>> import jax
    >>> import numpy as np
    >>> from jaxsh import sphere, transfer
    >>> points, devices = sphere.fibonacci(5).directions, jax.devices()[:1]
    >>> shared = transfer.unshadowed(points, points, degree=1).sharded(devices)
    >>> albedo = transfer.shard_rows(np.full((5, 3), 0.5, np.float32), devices)
    >>> transfer.shade_diffuse(np.ones((3, 4), np.float32), shared, albedo).shape
    (5, 3)
    """
    check_known("values", values)
    try:
        array = values if isinstance(values, jax.Array) else np.asarray(values)
    except ValueError:  # lists of several lengths
        array = np.empty((), object)
    numbers = jnp.issubdtype(array.dtype, jnp.number) or array.dtype == bool
    if not array.ndim or not numbers:
        raise ValueError(f"expected values (V, ...), a row for each point, got {described(values)}")
    return share(array, mesh_of(devices))
