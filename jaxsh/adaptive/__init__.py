"""Lee and Kim 2014: products of high degree only where they matter, and what beats that.

`shade` takes all methods by name. "masks" and "levels" are the paper's; "two_stage", "probes" and
"tiles" start from the fastest full computation, `transfer.shade_glossy` of a sampled transfer, and
are measured against it. What one of them keeps from frame to frame is made beforehand: by `stage`,
`make_probes`, `make_tiles`, and for a camera that moves `make_tile_atlas`.
"""

from ._levels import shade_levels
from ._masks import shade_masks
from ._probe_sets import ProbeSet, make_probes
from ._probes import shade_probes
from ._result import AdaptiveResult
from ._shade import shade
from ._staged import StagedTransfer, stage
from ._tile_atlas import TileAtlas, TileFollower, make_tile_atlas
from ._tile_sets import TileSet, Tiling, arrange, make_tiles, make_tiling
from ._tiles import shade_tiles
from ._two_stage import shade_two_stage

__all__ = [
    "AdaptiveResult",
    "ProbeSet",
    "StagedTransfer",
    "TileAtlas",
    "TileFollower",
    "TileSet",
    "Tiling",
    "arrange",
    "make_probes",
    "make_tile_atlas",
    "make_tiles",
    "make_tiling",
    "shade",
    "shade_levels",
    "shade_masks",
    "shade_probes",
    "shade_tiles",
    "shade_two_stage",
    "stage",
]
