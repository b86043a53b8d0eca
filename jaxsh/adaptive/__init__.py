"""Lee and Kim 2014: products of high degree only where they matter, and what beats that.

`shade` takes a frame and a method. `Masks` and `Levels` are the paper's; `TwoStage`, `Anchors` and
`Tiles` start from the fastest full computation, `transfer.shade_glossy` of a sampled transfer, and
are measured against it. What one of them keeps from frame to frame is made beforehand: by `stage`,
`make_anchors`, `make_tiles`, and for a camera that moves `make_tile_atlas`.
"""

from ._anchors import Anchors, AnchorSet, make_anchors
from ._levels import Levels, Masks
from ._method import AbstractMethod
from ._result import AdaptiveResult
from ._shade import shade
from ._staged import StagedTransfer, stage
from ._tile_atlas import TileAtlas, TileFollower, make_tile_atlas
from ._tile_set import TileSet
from ._tiles import Tiles, arrange, make_tiles
from ._tiling import Tiling, make_tiling
from ._two_stage import TwoStage

__all__ = [
    "AbstractMethod",
    "AdaptiveResult",
    "AnchorSet",
    "Anchors",
    "Levels",
    "Masks",
    "StagedTransfer",
    "TileAtlas",
    "TileFollower",
    "TileSet",
    "Tiles",
    "Tiling",
    "TwoStage",
    "arrange",
    "make_anchors",
    "make_tile_atlas",
    "make_tiles",
    "make_tiling",
    "shade",
    "stage",
]
