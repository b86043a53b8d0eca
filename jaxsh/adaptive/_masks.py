"""The paper's filter as it is written: every vertex through every level, under a mask."""

from typing import Unpack

from jaxtyping import ArrayLike, Float

from ..transfer import Material, Transfer
from ._filter import filtered
from ._options import FilterOptions, checked
from ._result import AdaptiveResult


def shade_masks(
    light: Float[ArrayLike, "3 k"],
    transfer: Transfer,
    eye: Float[ArrayLike, " 3"],
    material: Material,
    **options: Unpack[FilterOptions],
) -> AdaptiveResult:
    """Multi-level filtering, Lee & Kim 2014, algorithms 1 to 3, with static shapes.

    Diffuse and specular light are accumulated from degree `base` to the light's, each with a
    region of interest of its own, which all vertices are in at first. A vertex leaves where the
    change since the base falls below a threshold, and comes back only by refinement. Everything
    is computed for everyone, so this is the reference and never pays: see `shade_levels`.

    **Arguments**

    - `light`, `transfer`, `eye`, `material`, `distant`, `normalized`: as for
      `transfer.shade_glossy`, with one light (3, K) for all vertices.
    - `threshold` (0.02), `diffuse_threshold` (0.01): of the largest change over red, green and
      blue, after the albedo and times `exposure` (1). At 0 everyone stays.
    - `base` (2): degree that everyone is computed at.
    - `outside` ("level"): what a vertex shows that left. "level": all it was computed to, the
      level at which it left included, as in algorithm 1, where the change is added before the
      test. "base": up to the last level at which it stayed, so that only those inside differ from
      the base, as in the text. The paper does not say which.
    - `rings` (0): of breadth-first refinement (§4.4) around the region. Neighbours are computed in
      full and join where their change reaches the threshold. The number of vertices means to
      convergence.
    - `smoothing` (off): the paper's, of two rings around the region.
    - `previous` (none), `leave` (1): hysteresis, not in the paper. For a vertex that the previous
      result showed at a level, that level's threshold is `leave` times as high.

    **Returns** an `AdaptiveResult`. `kept` counts who stays after each level, before refinement;
    the paper's filtering ratio is one less it. Differentiable in light, material and transfer,
    forward and reverse, where nobody enters or leaves; thresholds and exposure have no gradient.

    Deviations: |change|, the largest over the channels, where the paper writes change; the second
    loop of algorithm 3 adds the increment alone. Raises `ValueError` for shapes and options that
    do not fit.
    """
    return filtered(*checked(light, transfer, eye, material, **options), compact=False)
