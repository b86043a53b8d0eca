"""Valid calls of `jaxsh.adaptive`."""

import functools

from jaxsh import adaptive, sphere, transfer

from .shared import K, eye, floats, of


@functools.cache
def ball():
    """Thirty vertices, as many as the methods of `adaptive` need."""
    points = sphere.fibonacci(30).directions
    return transfer.unshadowed(points, points, 2)


def calls():
    a = adaptive
    made, flags = ball(), {"distant": True, "normalized": True}
    rule = {"components": 9, "exponent": 8.0, "reach": 0.3}
    tiling = {"num_tiles": 2, "block": 8}
    frame = {"light": floats(3, K), "eye": eye(), "material": transfer.Material(0.5, 0.5, 8.0)}
    anchors, tiles = a.make_anchors(made), a.make_tiles(made, eye(), **tiling, **rule)
    atlas = a.make_tile_atlas(made, views=2, **tiling, **rule)
    shared = {
        "threshold": 0.02,
        "exposure": 1.0,
        "base": 2,
        "fallback": "level",
        "rings": 0,
        "smoothing": False,
        "previous": None,
        "hysteresis": 1.0,
        **flags,
    }
    looks = {"finite": "light eye", "host": True}
    return {
        "AnchorSet.__call__": of(
            anchors, **frame, threshold=0.1, exposure=1.0, **flags, **looks, slow=True
        ),
        "Anchors": of(
            a.Anchors,
            anchors=anchors,
            share=0.1,
            base=1,
            quantized=True,
            threshold=0.1,
            exposure=1.0,
            **flags,
        ),
        "Levels": of(a.Levels, **shared, diffuse_threshold=0.1),
        "Masks": of(a.Masks, **shared, diffuse_threshold=0.1),
        "StagedTransfer.sharded": of(a.stage(made).sharded, devices=None, host=True),
        "TileFollower": of(
            a.TileFollower,
            atlas=atlas,
            transfer=made,
            eye=eye(),
            keep=3,
            slices=2,
            finite="eye",
            slow=True,
        ),
        "TileAtlas.nearest": of(
            atlas.nearest, transfer=made, eye=eye(), diffuse=None, finite="eye", slow=True
        ),
        "TileAtlas.tiling": of(atlas.tiling, view=1, host=True),
        "TileSet.__call__": of(tiles, **frame, **flags, finite="light eye"),
        "Tiles": of(a.Tiles, tiles=tiles, **tiling, **rule, quantized=True, **flags),
        "TwoStage": of(a.TwoStage, **shared, middle=2),
        "arrange": of(
            a.arrange,
            transfer=made,
            tiling=tiles.tiling,
            **rule,
            quantized=True,
            diffuse=made,
            slow=True,
        ),
        "make_anchors": of(
            a.make_anchors,
            transfer=made,
            share=0.2,
            base=1,
            quantized=True,
            diffuse=made,
            slow=True,
        ),
        "make_tile_atlas": of(
            a.make_tile_atlas, transfer=made, distance=3.0, views=2, **tiling, **rule, slow=True
        ),
        "make_tiles": of(
            a.make_tiles,
            transfer=made,
            eye=eye(),
            distant=False,
            **tiling,
            **rule,
            quantized=True,
            diffuse=made,
            finite="eye",
            slow=True,
        ),
        "make_tiling": of(
            a.make_tiling,
            transfer=made,
            eye=eye(),
            distant=False,
            **tiling,
            areas=floats(30),
            finite="eye",
            slow=True,
        ),
        "shade": of(
            a.shade,
            light=floats(3, K),
            transfer=made,
            eye=eye(),
            material=frame["material"],
            method="masks",
            finite="light eye",
        ),
        "stage": of(a.stage, transfer=made, degree=2, middle=2, base=1, quantized=True),
    }
