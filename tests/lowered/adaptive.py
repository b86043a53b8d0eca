"""`jaxsh.adaptive` at full size."""

import jax.numpy as jnp

from jaxsh import adaptive
from jaxsh.adaptive import _tile_samples

from .shared import DEGREE, K, V, baked, floats, integers, made_by, material, of

# Tiles as `make_tiling` makes them of V vertices: 400 of 782 blocks of 64.
BLOCKS, BLOCK, TILES, COMPONENTS, LIGHTS = -(-V // 64), 64, 400, 24, 30

WITHOUT = {
    "AnchorSet.__call__": "lowered as `shade`, Anchors",
    "Anchors": "holds options",
    "Levels": "holds options",
    "Masks": "holds options",
    "TileAtlas.nearest": "looks at the eye; what it arranges is lowered as `arrange`",
    "TileFollower": "looks at the eye; what it arranges is lowered as `arrange`",
    "Tiles": "holds options",
    "TileSet.__call__": "lowered as `shade`, Tiles",
    "TwoStage": "holds options",
    "make_anchors": "chooses vertices in NumPy",
    "make_tile_atlas": "splits vertices in NumPy",
    "make_tiles": "splits vertices in NumPy",
    "make_tiling": "splits vertices in NumPy",
}


def anchor_set(made):
    count = V // 10
    return adaptive.AnchorSet(
        jnp.zeros(count, jnp.int32),
        jnp.zeros((V, 4), jnp.int32),
        jnp.zeros((V, 4), jnp.float32),
        adaptive._staged.sample_rows(made.coefficients, DEGREE),
        adaptive._anchors.sample(made, 1),
        adaptive._staged.diffuse_part(made, None, True),
        V,
    )


def arranged(made, tiling, lights, rows):
    return _tile_samples.arrange_all(made, tiling, lights, rows, True)


def tile_set(made, tiling, lights, rows):
    samples, scales, lights, positions, normals = arranged(made, tiling, lights, rows)
    return adaptive.TileSet(
        tiling,
        place=jnp.zeros(V, jnp.int32),
        samples=samples,
        scales=scales,
        lights=lights,
        core=jnp.zeros((DEGREE + 1, LIGHTS, 15, COMPONENTS), jnp.float32),
        functions=jnp.zeros((15, 28), jnp.float32),
        reach=jnp.ones((), jnp.float32),
        positions=positions,
        normals=normals,
        diffuse=adaptive._staged.diffuse_part(made, None, True),
        group=V,
    )


def calls():
    made, light, eye = baked(), floats(3, K), floats(3)
    tiling = made_by(adaptive.Tiling, integers(BLOCKS, BLOCK), integers(BLOCKS), floats(TILES, 3))
    rule = floats(LIGHTS, K), floats(COMPONENTS, K)
    anchors, tiles = made_by(anchor_set, made), made_by(tile_set, made, tiling, *rule)
    staged = made_by(adaptive.stage, made)
    rings = "a search through the mesh, ring by ring, until nobody joins"

    def shade(method):
        def color(light, made, eye, material):
            return adaptive.shade(light, made, eye, material, method).color

        return color

    def again(light, made, eye, material):
        first = adaptive.shade(light, made, eye, material, adaptive.Levels())
        method = adaptive.Levels(hysteresis=0.5, previous=first)
        return adaptive.shade(light, made, eye, material, method).color

    def by_set(light, made, eye, material):
        return made(light, eye, material).color

    frame = light, made, eye, material()
    return {
        "arrange": of(arranged, made, tiling, *rule, reverse=False),
        "shade": of(shade(adaptive.Masks()), *frame),
        "shade, Masks, rings": of(
            shade(adaptive.Masks(rings=2, smoothing=True)), *frame, open=4, why=rings
        ),
        "shade, Levels": of(shade(adaptive.Levels()), *frame),
        "shade, Levels, rings": of(shade(adaptive.Levels(rings=2)), *frame, open=4, why=rings),
        "shade, Levels, previous": of(again, *frame),
        "shade, TwoStage": of(shade(adaptive.TwoStage()), light, staged, eye, material()),
        "shade, TwoStage, rings": of(
            shade(adaptive.TwoStage(rings=2)), light, staged, eye, material(), open=2, why=rings
        ),
        "shade, Anchors": of(by_set, light, anchors, eye, material()),
        "shade, Tiles": of(by_set, light, tiles, eye, material()),
        "stage": of(adaptive.stage, made),
    }
