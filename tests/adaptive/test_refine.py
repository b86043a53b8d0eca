"""Growing and smoothing of regions, and work on some vertices alone."""

import appendix
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh.adaptive._regions import BLOCK, compacted, everywhere, grow, smooth


def table(edges, count):
    """Neighbours of each vertex, padded with the vertex itself."""
    near = [
        sorted({b for a, b in (*edges, *((b, a) for a, b in edges)) if a == v})
        for v in range(count)
    ]
    width = max(map(len, near))
    return near, jnp.asarray(
        [row + [v] * (width - len(row)) for v, row in enumerate(near)], jnp.int32
    )


@pytest.mark.parametrize("rings", [0, 1, 2, 60])
def test_growth_is_a_queue_s(rng, rings):
    near, padded = table(rng.integers(60, size=(90, 2)).tolist(), 60)
    region, joins = rng.uniform(size=60) < 0.05, rng.uniform(size=60) < 0.6
    grown = grow(jnp.asarray(region), padded, lambda fringe: jnp.asarray(joins), rings)
    expected = appendix.refine_roi(np.flatnonzero(region), near, lambda v: joins[v], rings)
    assert set(np.flatnonzero(grown)) == {int(v) for v in expected}


def test_smoothing_fades_along_a_path():
    """Region {0}: vertex 1 takes (6 + 0)/2, then vertex 2 takes (3 + 0)/2; the rest stays."""
    _, padded = table([(i, i + 1) for i in range(5)], 6)
    added = jnp.zeros((3, 6)).at[:, 0].set(6.0)
    got = smooth(added, jnp.arange(6) == 0, padded)
    np.testing.assert_allclose(got, [[6, 3, 1.5, 0, 0, 0]] * 3)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_compacted_work_is_that_of_the_active(rng, share):
    count = BLOCK + 100
    values = jnp.asarray(rng.normal(size=(2, count)))
    active = jnp.asarray(rng.uniform(size=count) < share)
    got = compacted(lambda rows: values[:, rows] ** 2, active)
    np.testing.assert_array_equal(got, np.where(active, values**2, 0))
    np.testing.assert_array_equal(everywhere(lambda rows: values[:, rows] ** 2, count), values**2)


def test_compacted_work_differentiates_in_reverse(rng):
    values, active = jnp.asarray(rng.normal(size=(2, 8))), jnp.arange(8) % 3 == 0
    slope = jax.grad(lambda v: compacted(lambda rows: v[:, rows] ** 2, active).sum())(values)
    np.testing.assert_allclose(slope, np.where(active, 2 * values, 0))
