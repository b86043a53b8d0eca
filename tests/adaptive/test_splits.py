"""Splitting all tiles of a level at once, against one tile after the other."""

import numpy as np
import pytest

from jaxsh.adaptive._splits import split


def cost(axis, weights):
    offsets = axis - np.average(axis, axis=1, weights=weights)[:, None]
    return np.sum(weights * np.sum(offsets**2, axis=0) ** 3)


def one_by_one(axis, weights, count, block):
    """As the words have it: the costliest tile of all, at the middle of its extent."""
    tiles = [np.arange(len(weights))]
    while len(tiles) < count:
        able = [tile for tile in tiles if len(tile) > block]
        tile = max(able, key=lambda tile: cost(axis[:, tile], weights[tile]))
        [at] = [i for i, other in enumerate(tiles) if other is tile]
        covariance = np.cov(axis[:, tile], aweights=weights[tile])
        along = np.linalg.eigh(covariance)[1][:, -1] @ axis[:, tile]
        below = np.sum(along < (along.min() + along.max()) / 2)
        cut = block * np.clip(round(below / block), 1, len(tile) // block - 1)
        ranked = tile[np.argsort(along)]
        tiles[at : at + 1] = ranked[:cut], ranked[cut:]
    return tiles


@pytest.mark.parametrize(("count", "block"), [(1, 4), (20, 4), (60, 4), (40, 8)])
def test_tiles_are_those_of_one_split_after_the_other(rng, count, block):
    axis = rng.normal(size=(3, 320)) * [[1.0], [0.5], [2.0]]
    axis, weights = axis / np.linalg.norm(axis, axis=0), rng.uniform(0.05, 2, size=320)
    order, sizes, means = split(axis, weights, count, block)
    ours = np.split(order, np.cumsum(sizes)[:-1] * block)
    theirs = one_by_one(axis, weights, count, block)
    assert {frozenset(tile) for tile in ours} == {frozenset(tile) for tile in theirs}
    expected = [np.average(axis[:, tile], axis=1, weights=weights[tile]) for tile in ours]
    np.testing.assert_allclose(means, expected, rtol=0, atol=4e-7)


def test_tiles_without_extent_are_split_by_blocks():
    order, sizes, _ = split(np.ones((3, 24)), np.ones(24), 5, 4)
    np.testing.assert_array_equal(np.sort(order), np.arange(24))
    assert sizes.min() >= 1
    assert (len(sizes), sizes.sum()) == (5, 6)
