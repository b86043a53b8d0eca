"""Tile sets of many views, and the follower that arranges the nearest one while an eye moves."""

import jax
import numpy as np
import pytest
from balls import shadowed_ball

from jaxsh import transfer
from jaxsh.adaptive import TileFollower, arrange, make_tile_atlas, make_tiling


@pytest.fixture
def ball(rng) -> transfer.Transfer:
    return shadowed_ball(rng)


def test_atlas_takes_the_nearest_view(ball):
    atlas = make_tile_atlas(
        ball, distance=3.0, views=5, num_tiles=4, block=32, components=7, exponent=9.0
    )
    for view in (0, 3):
        eye = atlas.center + 2.5 * atlas.eyes[view]
        assert atlas.view(eye) == view
    eye = atlas.center + 3.0 * atlas.eyes[3]
    expected = make_tiling(ball, eye, num_tiles=4, block=32)
    expected = arrange(ball, expected, components=7, exponent=9.0, reach=atlas.reach)
    assert atlas.reach == 0.5  # of few views
    jax.tree.map(np.testing.assert_array_equal, atlas.nearest(ball, eye), expected)


def test_follower_arrives_at_the_nearest_view(ball):
    atlas = make_tile_atlas(ball, views=6, num_tiles=4, block=32)
    follow = TileFollower(atlas, ball, atlas.eyes[0])
    for eye in atlas.eyes:
        jax.block_until_ready(follow(eye))
    for _ in range(2):  # the set under way may still be one before
        jax.block_until_ready(follow._sets)
        arrived = follow(atlas.eyes[-1])
    np.testing.assert_array_equal(arrived.tiling.permutation, atlas.permutation[-1])
    assert len(follow._sets) <= 4


def test_follower_in_slices_arranges_one_a_call(ball):
    atlas = make_tile_atlas(ball, views=2, num_tiles=4, block=32)
    follow = TileFollower(atlas, ball, atlas.eyes[0], slices=4)  # 10 blocks: 3, 3, 3 and the last
    views = []
    for _ in range(5):
        views.append(follow(atlas.eyes[1]))
        jax.block_until_ready(follow._sets)
    moved = [bool((v.tiling.permutation == atlas.permutation[1]).all()) for v in views]
    assert moved == [False, False, False, True, True]
    whole = atlas.arranged(ball, 1)
    for one, other in zip(jax.tree.leaves(views[-1]), jax.tree.leaves(whole), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-14, atol=1e-14)


def test_follower_has_at_once_what_was_prepared_or_kept(ball):
    atlas = make_tile_atlas(ball, views=6, num_tiles=4, block=32)
    follow = TileFollower(atlas, ball, atlas.eyes[0], keep=2)
    assert follow.prepare(np.asarray(atlas.eyes)[[1, 1, 4, 5]]) == 3
    sets = [follow(atlas.eyes[view]) for view in (1, 4, 5, 1)]
    for tiles, view in zip(sets, (1, 4, 5, 1), strict=True):
        np.testing.assert_array_equal(tiles.tiling.permutation, atlas.permutation[view])
    assert sets[3] is sets[0]
