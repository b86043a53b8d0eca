"""Vertices that several devices share out: each filters its own, and none gathers another's."""

import math

import jax
from jax.sharding import AxisType, PartitionSpec
from jaxtyping import Array

from .._core.checks import is_concrete
from ..transfer import Material, Transfer
from ._filter import Filter, filtered
from ._result import AdaptiveResult


def filtered_by_device(
    light: Array,
    transfer: Transfer,
    eye: Array,
    material: Material,
    options: Filter,
    previous: dict[str, Array] | None,
) -> AdaptiveResult:
    """Does what `filtered` does on each device with its vertices, compacted there.

    Shares and cost are means over the devices; nothing else goes from one to another.
    """
    sharding = jax.typeof(transfer.coefficients).sharding
    mesh, types = sharding.mesh, sharding.mesh.axis_types
    arguments = light, transfer, eye, material, options, previous
    if all(kind == AxisType.Manual for kind in types):  # inside `shard_map`
        return filtered(*arguments, compact=True)
    given = transfer.coefficients.sharding if is_concrete(transfer.coefficients) else sharding
    assert isinstance(given, jax.sharding.NamedSharding)  # it is on a mesh
    mesh = given.mesh
    names = next(iter(given.spec), None)
    # Automatic axes do not tell a trace how they are used: all of them are, where that goes.
    unknown = AxisType.Auto in types and not is_concrete(transfer.coefficients)
    if unknown and transfer.num_points % math.prod(mesh.axis_sizes) == 0:
        names = mesh.axis_names
    rows, whole = PartitionSpec(names), PartitionSpec()

    lobes = [rows if own else whole for own in material.per_vertex]
    lobes = jax.tree.unflatten(jax.tree.structure(material), lobes)

    def one(*arguments):
        result = filtered(*arguments, compact=True)
        shares = result.active_fraction, result.relative_cost
        if names is not None:
            shares = jax.tree.map(lambda share: jax.lax.pmean(share, names), shares)
        return result.color, *shares, result.shown_degree

    specs, out = (whole, rows, whole, lobes, whole, rows), (rows, whole, whole, rows)
    run = jax.shard_map(one, mesh=mesh, in_specs=specs, out_specs=out)
    color, fractions, cost, degrees = run(*arguments)
    return AdaptiveResult(color, fractions, cost, degrees)
