"""Vertices that several devices share out: each filters its own."""

import jax
from jaxtyping import Array

from ..transfer import Material, Transfer
from ._filter import Filter, filtered
from ._result import AdaptiveResult
from ._sharing import material_axes, on_rows, sharing


def filtered_by_device(
    light: Array,
    transfer: Transfer,
    eye: Array,
    material: Material,
    options: Filter,
    previous: dict[str, Array] | None,
    compact: bool,
) -> AdaptiveResult:
    """Does what `filtered` does on each device with its vertices, compacted there.

    Shares and cost are means over the devices. Rings and smoothing look at neighbors, which other
    devices may have: these give each other who is inside, and for smoothing the colors. Nothing
    else goes from one to another.
    """
    shared = sharing(transfer.coefficients)
    if shared is None:
        return filtered(light, transfer, eye, material, options, previous, compact=compact)

    names, lobes = shared.names, material_axes(material)

    def one(*arguments):
        result = filtered(*arguments, compact=compact, names=names)
        shares = result.active_fraction, result.relative_cost
        if names is not None:
            shares = jax.tree.map(lambda share: jax.lax.pmean(share, names), shares)
        return result.color, *shares, result.shown_degree

    axes, out = (None, 0, None, lobes, None, 0), (0, None, None, 0)
    arguments = light, transfer, eye, material, options, previous
    color, fractions, cost, degrees = on_rows(one, shared, axes, out, *arguments)
    return AdaptiveResult(color, fractions, cost, degrees)
