import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh import harmonics, sphere, transfer
from jaxsh.adaptive import Anchors, _anchors, make_anchors, shade

COUNT, DEGREE = 300, 3
WIDTH = (DEGREE + 1) ** 2
EYE = np.array([0.5, -3.0, 1.0])
MATERIAL = transfer.Material(jnp.asarray(0.5), jnp.asarray([0.5, 0.3, 0.1]), jnp.asarray(8.0))


@pytest.fixture
def scene(rng):
    """A light, a ball without shadows, and its anchors."""
    normals = sphere.fibonacci(COUNT).directions
    cosine = harmonics.clamped_cosine(DEGREE)[harmonics.degrees(DEGREE)]
    coefficients = harmonics.evaluate(normals, DEGREE) * cosine[None]
    ring = (np.arange(COUNT)[:, None] + np.array([-1, 1])) % COUNT
    ball = transfer.Transfer(coefficients, normals, normals, jnp.asarray(ring, jnp.int32))
    light = jnp.asarray(rng.normal(size=(3, WIDTH)) / (1 + harmonics.degrees(DEGREE)) ** 2)
    return light, ball, make_anchors(ball, share=0.2, base=1, quantized=False)


def test_threshold_0_gives_the_full_result(scene):
    light, ball, anchors = scene
    result = anchors(light, EYE, MATERIAL, threshold=0.0)
    full = transfer.shade_glossy(light, ball, EYE, MATERIAL)
    np.testing.assert_allclose(result.color, full, rtol=0, atol=1e-12)
    assert result.active_fraction["specular"] == 1


def test_anchors_themselves_are_exact_at_any_threshold(scene):
    light, ball, anchors = scene
    result = anchors(light, EYE, MATERIAL, threshold=1e9)
    full = transfer.shade_glossy(light, ball, EYE, MATERIAL)
    assert result.active_fraction["specular"] == 0
    np.testing.assert_allclose(
        result.color[anchors.anchors], full[anchors.anchors], rtol=0, atol=1e-8 * np.abs(full).max()
    )
    base = transfer.shade_glossy(light[:, :4], ball, EYE, MATERIAL)
    assert np.linalg.norm(result.color - full) < 0.32 * np.linalg.norm(base - full)


def test_the_threshold_is_on_exposed_color_and_refines_more_as_it_falls(scene):
    light, ball, anchors = scene
    full = transfer.shade_glossy(light, ball, EYE, MATERIAL)
    errors, shares = [], []
    for threshold in (1.0, 0.02, 0.002):
        result = anchors(light, EYE, MATERIAL, threshold=threshold)
        errors.append(np.linalg.norm(result.color - full))
        shares.append(float(result.active_fraction["specular"]))
    assert shares == sorted(shares)
    assert errors == sorted(errors, reverse=True)
    again = anchors(light, EYE, MATERIAL, threshold=0.2, exposure=10.0)
    assert float(again.active_fraction["specular"]) == shares[1]


def test_number_of_refined_vertices_is_no_new_program(scene):
    light, _, anchors = scene
    anchors(light, EYE, MATERIAL, threshold=0.02)
    before = _anchors._shade_anchors._cache_size()
    for threshold in (0.001, 0.5):
        anchors(2 * light, -EYE, MATERIAL, threshold=threshold)
    assert _anchors._shade_anchors._cache_size() == before


@pytest.mark.slow
def test_anchors_differentiate_as_the_full_computation(scene, rng):
    light, ball, anchors = scene
    weights = jnp.asarray(rng.normal(size=(COUNT, 3)))

    def by_anchors(light, material):
        return jnp.sum(weights * anchors(light, EYE, material, threshold=0.0).color)

    def in_full(light, material):
        return jnp.sum(weights * transfer.shade_glossy(light, ball, EYE, material))

    ours, theirs = (
        jax.grad(loss, argnums=(0, 1))(light, MATERIAL) for loss in (by_anchors, in_full)
    )
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-8, atol=1e-10), ours, theirs)


@pytest.mark.parametrize("share", [0.014, 0.1, 1.0])
def test_anchors_are_distinct_and_weights_sum_to_one(scene, share):
    _, ball, _ = scene
    anchors = make_anchors(ball, share=share)
    assert len(np.unique(anchors.anchors)) == max(round(share * COUNT), 4) == len(anchors.anchors)
    np.testing.assert_allclose(np.sum(anchors.weights, axis=1), 1, rtol=1e-12)
    assert np.asarray(anchors.nearest).max() < len(anchors.anchors)


def test_anchors_refuse_what_does_not_fit(scene, unchecked):
    light, ball, anchors = scene
    with pytest.raises(ValueError, match="share"):
        make_anchors(ball, share=0.0)
    with pytest.raises(ValueError, match="base"):
        make_anchors(ball, base=DEGREE + 1)
    with pytest.raises(ValueError, match="light of the anchors' degree"):
        anchors(light[:, :9], EYE, MATERIAL)
    lobes = transfer.Material(jnp.asarray(0.5), jnp.asarray(0.5), jnp.full((COUNT,), 8.0))
    with pytest.raises(ValueError, match="one exponent"):
        anchors(light, EYE, lobes)
    part = jax.tree.map(lambda x: x[:100], ball)
    with pytest.raises(ValueError, match="expected anchors of 100"):
        shade(light, part, EYE, MATERIAL, Anchors(anchors))


def test_a_method_makes_its_anchors_and_takes_a_diffuse_part(scene, unchecked):
    light, ball, _ = scene
    frame = light, ball, EYE, MATERIAL
    made = make_anchors(ball, share=0.2, diffuse=ball)
    assert made.diffuse is ball
    on_the_way = shade(*frame, Anchors(share=0.2))
    given = shade(*frame, Anchors(make_anchors(ball, share=0.2)))
    np.testing.assert_array_equal(on_the_way.color, given.color)
    # Samples are in eight bits in both, the diffuse part in one.
    np.testing.assert_allclose(given.color, made(light, EYE, MATERIAL).color, rtol=0, atol=5e-3)
    with pytest.raises(ValueError, match="make_anchors looks at the values"):
        jax.jit(make_anchors)(ball)
    with pytest.raises(
        ValueError, match="diffuse part of 300 vertices and degree 3, got 300 and 2"
    ):
        make_anchors(ball, diffuse=ball.truncated(2))
