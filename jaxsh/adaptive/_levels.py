"""The paper's filter, compacted: a dropped vertex costs nothing."""

from typing import Unpack

from jaxtyping import ArrayLike, Float

from ..transfer import Material, Transfer
from ._filter import filtered
from ._options import FilterOptions, checked
from ._result import AdaptiveResult


def shade_levels(
    light: Float[ArrayLike, "3 k"],
    transfer: Transfer,
    eye: Float[ArrayLike, " 3"],
    material: Material,
    **options: Unpack[FilterOptions],
) -> AdaptiveResult:
    """`shade_masks`, with the same arguments and result, at the cost of the vertices inside alone.

    Each level gathers the vertices that are left into blocks. Their number may change from frame
    to frame without another compilation. The diffuse part is decided on, but computed for all,
    which costs less than to gather. Agrees with `shade_masks` to rounding.

    It pays against an einsum of light product, transfer and lobe; not against the same product in
    tiles of vertices, nor against `transfer.shade_glossy` of a sampled transfer. Experiment
    `leekim2014.table1` prints all three.
    """
    return filtered(*checked(light, transfer, eye, material, **options), compact=True)
