"""All methods by name."""

from typing import Any

from jaxtyping import ArrayLike, Float

from ..transfer import Material, QuantizedTransfer, Transfer
from ._levels import shade_levels
from ._masks import shade_masks
from ._probe_sets import ProbeSet
from ._probes import shade_probes
from ._result import AdaptiveResult
from ._staged import StagedTransfer
from ._tile_sets import TileSet
from ._tiles import shade_tiles
from ._two_stage import shade_two_stage

METHODS = {
    "masks": shade_masks,
    "levels": shade_levels,
    "two_stage": shade_two_stage,
    "probes": shade_probes,
    "tiles": shade_tiles,
}
# What a method cannot do without, as the option of its own name.
SETS = {"probes": ProbeSet, "tiles": TileSet}


def shade(
    light: Float[ArrayLike, "3 k"],
    transfer: Transfer | QuantizedTransfer | StagedTransfer,
    eye: Float[ArrayLike, " 3"],
    material: Material,
    *,
    method: str,
    **options: Any,
) -> AdaptiveResult:
    """Diffuse and glossy radiance of V vertices, with less work than `transfer.shade_glossy`.

    - "masks": Lee & Kim 2014 as printed, everyone through every level under a mask. The
      reference; never pays.
    - "levels": the same, at the cost of those alone that are left. Pays against an einsum of
      three operands, and no more.
    - "two_stage": one decision at a middle degree, then all or nothing. Of what `stage` makes.
      Pays against products with the light's matrix, not against `shade_glossy`.
    - "probes": glossy light at `probes`, a `ProbeSet`, interpolated where it is smooth. Somewhat
      faster than `shade_glossy`.
    - "tiles": sums over few directions about the reflected one, those of `tiles`, a `TileSet`.
      Pays against all of them.

    The last two need of `transfer` the diffuse part alone, and are faster where it is what
    `transfer.quantize` makes.

    `shade_glossy` is that of a sampled transfer, on the CPU. Where only the light turns, none of
    these is as fast as `transfer.fixed_view`, which is exact; where only the eye moves, a
    `transfer.fixed_light` is at hand.
    `options` are those of the function `shade_<method>`, which says what it takes and returns.
    Experiment `leekim2014.table1` prints what each method gains, and what it costs in quality.

    Raises `ValueError` for an unknown method or a missing set, `TypeError` for an option that the
    method does not have.
    """
    if method not in METHODS:
        raise ValueError(f"expected method to be one of {', '.join(METHODS)}, got {method!r}")
    if method in SETS and not isinstance(options.get(method), SETS[method]):
        kind = SETS[method].__name__
        raise ValueError(
            f"method {method!r} needs {method}=, a {kind} made by make_{method}, got "
            f"{type(options.get(method)).__name__}"
        )
    if isinstance(transfer, StagedTransfer) and method != "two_stage":
        transfer = transfer.transfer
    if isinstance(transfer, QuantizedTransfer) and method not in SETS:
        raise ValueError(
            f"method {method!r} needs the transfer's coefficients, got what quantize made of them"
        )
    return METHODS[method](light, transfer, eye, material, **options)
