"""Sample placement: clusters, coverage, error targets, and samples that come and go."""

import itertools

import numpy as np
import pytest
from near_light import expand

from jaxsh.midrange import (
    interpolate,
    inverse_distance_weights,
    place_samples,
    update_samples,
)
from jaxsh.midrange._placement import Prediction, drawn_positions


def _light(points):
    return expand(points, 2)


def test_one_cluster_is_the_centroid(rng):
    x = rng.normal(size=(50, 3))
    np.testing.assert_allclose(place_samples(x, 1)[0], x.mean(axis=0), rtol=0, atol=1e-14)


def test_each_mean_is_that_of_its_cluster(rng):
    x = rng.normal(size=(300, 3)).astype(np.float32)
    points = place_samples(x, 5)
    assert points.dtype == np.float32
    nearest = np.argmin(np.linalg.norm(x[:, None] - points[None], axis=-1), axis=1)
    spread = sum(np.sum((x[nearest == i] - points[i]) ** 2) for i in range(5))
    moved = sum(np.sum((x[nearest == i] - x[nearest == i].mean(axis=0)) ** 2) for i in range(5))
    assert spread <= moved * 1.01  # Lloyd's iteration has all but settled
    np.testing.assert_array_equal(place_samples(x, 5), points)


def test_separate_clusters_have_a_sample_each(rng):
    centres = 10 * np.eye(3)
    x = (centres[:, None] + rng.normal(size=(3, 40, 3))).reshape(-1, 3)
    points = place_samples(x, 3)
    distance = np.linalg.norm(points[:, None] - centres[None], axis=-1)
    assert sorted(np.argmin(distance, axis=1)) == [0, 1, 2]
    assert distance.min(axis=1).max() < 1


def test_farthest_covers_within_twice_the_best(rng):
    x = rng.normal(size=(14, 3))
    points = place_samples(x, 3, method="farthest")

    def radius(samples):
        return np.linalg.norm(x[:, None] - samples[None], axis=-1).min(axis=1).max()

    best = min(radius(x[list(chosen)]) for chosen in itertools.combinations(range(14), 3))
    assert radius(points) <= 2 * best
    assert all((x == point).all(axis=1).any() for point in points)
    np.testing.assert_array_equal(place_samples(x, 2, method="farthest"), points[:2])


@pytest.mark.slow
def test_predicted_error_is_that_of_the_blend(rng):
    checks, points = rng.uniform(-0.5, 0.5, (20, 3)), rng.uniform(-0.5, 0.5, (3, 3))
    found = Prediction.of(_light, points, checks, 4.0).error([0, 1, 2])[0]
    weights = inverse_distance_weights(checks, points, exponent=4.0)
    # λ_l of the clamped cosine, by hand.
    lambdas = np.repeat([np.pi, 2 * np.pi / 3, np.pi / 4], [1, 3, 5])
    blend = np.asarray(interpolate(_light(points), weights, checks)) * lambdas
    exact = np.asarray(_light(checks).coefficients) * lambdas
    expected = np.linalg.norm(blend - exact) / np.linalg.norm(exact)
    assert found == pytest.approx(expected, rel=1e-3)  # the core around samples


def _error(points, x):
    prediction = Prediction.of(_light, points, x, 6.0)
    return prediction.error(list(range(len(points))))[0]


@pytest.mark.slow
def test_greedy_meets_its_target_with_few(rng):
    x = rng.uniform(-0.5, 0.5, (400, 3))
    options = {"method": "greedy", "evaluate": _light, "candidates": 30, "checks": 100}
    alone = _error(place_samples(x, 1), x)
    points = place_samples(x, 12, target=alone / 4, **options)
    assert 1 < len(points) < 12
    assert _error(points, x) < alone / 4 * 1.15  # checks are a part of the positions
    fewer = place_samples(x, len(points) - 1, target=alone / 4, **options)
    assert _error(fewer, drawn_positions(x, 100, 0)) > alone / 4
    # As many samples as clusters, no worse where it was looked.
    greedy, looked = place_samples(x, 6, **options), drawn_positions(x, 100, 0)
    assert len(greedy) == 6
    assert _error(greedy, looked) <= _error(place_samples(x, 6), looked)


@pytest.mark.slow
def test_samples_come_and_go(rng):
    x = rng.uniform(-0.5, 0.5, (300, 3))
    start, pool = place_samples(x, 1), place_samples(x, 24)
    error = _error(start, x)
    more = update_samples(start, pool, x, _light, target=error / 3)
    assert more.error <= error / 3
    assert len(more.points) == 1 + len(more.added) > 1
    assert not more.removed.any()
    np.testing.assert_array_equal(more.points[:1], start)

    # The object moves away from the lights: the error falls, but samples stay until half of it.
    away = np.array([0.0, 0.0, 6.0])
    far = update_samples(more.points + away, pool + away, x + away, _light, target=error / 3)
    assert len(far.points) < len(more.points)
    assert far.removed.sum() == len(more.points) - len(far.points)
    assert far.error <= error / 6
    same = update_samples(
        more.points, pool, x, _light, target=more.error * 1.01, release=more.error * 0.99
    )
    np.testing.assert_array_equal(same.points, more.points)
    capped = update_samples(start, pool, x, _light, target=error / 100, limit=3)
    assert len(capped.points) == 3


@pytest.mark.usefixtures("unchecked")
def test_placement_errors():
    x = np.eye(3)
    with pytest.raises(ValueError, match="1 to 3 samples"):
        place_samples(x, 4)
    with pytest.raises(ValueError, match="1 to 1 samples"):
        place_samples(np.zeros((5, 3)), 2)
    with pytest.raises(ValueError, match=r"expected positions \(V, 3\)"):
        place_samples(np.zeros(3), 1)
    with pytest.raises(ValueError, match="finite"):
        place_samples(np.full((2, 3), np.nan), 1)
    with pytest.raises(ValueError, match="method must be one of"):
        place_samples(x, 1, method="best")  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="expected evaluate"):
        place_samples(x, 1, method="greedy")
    with pytest.raises(ValueError, match="expected expansions"):
        place_samples(x, 1, method="greedy", evaluate=lambda points: _light(points[:1]))
    with pytest.raises(ValueError, match="release < target"):
        update_samples(x, x, x, _light, target=0.1, release=0.2)
