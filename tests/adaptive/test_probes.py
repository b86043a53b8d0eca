import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh import harmonics, sphere, transfer
from jaxsh.adaptive import _probes
from jaxsh.adaptive._probe_sets import make_probes
from jaxsh.adaptive._probes import shade_probes

COUNT, DEGREE = 300, 3
WIDTH = (DEGREE + 1) ** 2
EYE = np.array([0.5, -3.0, 1.0])
MATERIAL = transfer.Material(jnp.asarray(0.5), jnp.asarray([0.5, 0.3, 0.1]), jnp.asarray(8.0))


@pytest.fixture
def scene(rng):
    """A light, a ball without shadows, and its probes."""
    normals = sphere.fibonacci(COUNT).directions
    cosine = harmonics.clamped_cosine(DEGREE)[harmonics.degrees(DEGREE)]
    coefficients = harmonics.evaluate(normals, DEGREE) * cosine[None]
    ring = (np.arange(COUNT)[:, None] + np.array([-1, 1])) % COUNT
    ball = transfer.Transfer(coefficients, normals, normals, jnp.asarray(ring, jnp.int32))
    light = jnp.asarray(rng.normal(size=(3, WIDTH)) / (1 + harmonics.degrees(DEGREE)) ** 2)
    return light, ball, make_probes(ball, share=0.2, base=1, quantized=False)


def test_threshold_0_gives_the_full_result(scene):
    light, ball, probes = scene
    result = shade_probes(light, ball, EYE, MATERIAL, probes, threshold=0.0)
    full = transfer.shade_glossy(light, ball, EYE, MATERIAL)
    np.testing.assert_allclose(result.color, full, atol=1e-12)
    assert result.kept["specular"] == 1


def test_probes_themselves_are_exact_at_any_threshold(scene):
    light, ball, probes = scene
    result = shade_probes(light, ball, EYE, MATERIAL, probes, threshold=1e9)
    full = transfer.shade_glossy(light, ball, EYE, MATERIAL)
    assert result.kept["specular"] == 0
    np.testing.assert_allclose(
        result.color[probes.probes], full[probes.probes], atol=1e-8 * np.abs(full).max()
    )
    base = transfer.shade_glossy(light[:, :4], ball, EYE, MATERIAL)
    assert np.linalg.norm(result.color - full) < 0.32 * np.linalg.norm(base - full)


def test_the_threshold_is_on_exposed_colour_and_refines_more_as_it_falls(scene):
    light, ball, probes = scene
    full = transfer.shade_glossy(light, ball, EYE, MATERIAL)
    errors, shares = [], []
    for threshold in (1.0, 0.02, 0.002):
        result = shade_probes(light, ball, EYE, MATERIAL, probes, threshold=threshold)
        errors.append(np.linalg.norm(result.color - full))
        shares.append(float(result.kept["specular"]))
    assert shares == sorted(shares)
    assert errors == sorted(errors, reverse=True)
    again = shade_probes(light, ball, EYE, MATERIAL, probes, threshold=0.2, exposure=10.0)
    assert float(again.kept["specular"]) == shares[1]


def test_number_of_refined_vertices_is_no_new_program(scene):
    light, ball, probes = scene
    shade_probes(light, ball, EYE, MATERIAL, probes, threshold=0.02)
    before = _probes._shade_probes._cache_size()
    for threshold in (0.001, 0.5):
        shade_probes(2 * light, ball, -EYE, MATERIAL, probes, threshold=threshold)
    assert _probes._shade_probes._cache_size() == before


@pytest.mark.slow
def test_probes_differentiate_as_the_full_computation(scene, rng):
    light, ball, probes = scene
    weights = jnp.asarray(rng.normal(size=(COUNT, 3)))

    def by_probes(light, material):
        return jnp.sum(
            weights * shade_probes(light, ball, EYE, material, probes, threshold=0.0).color
        )

    def in_full(light, material):
        return jnp.sum(weights * transfer.shade_glossy(light, ball, EYE, material))

    ours, theirs = (
        jax.grad(loss, argnums=(0, 1))(light, MATERIAL) for loss in (by_probes, in_full)
    )
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-8, atol=1e-10), ours, theirs)


@pytest.mark.parametrize("share", [0.014, 0.1, 1.0])
def test_probes_are_distinct_and_weights_sum_to_one(scene, share):
    _, ball, _ = scene
    probes = make_probes(ball, share=share)
    assert len(np.unique(probes.probes)) == max(round(share * COUNT), 4) == len(probes.probes)
    np.testing.assert_allclose(np.sum(probes.weights, axis=1), 1, rtol=1e-12)
    assert np.asarray(probes.nearest).max() < len(probes.probes)


def test_probes_refuse_what_does_not_fit(scene, unchecked):
    light, ball, probes = scene
    with pytest.raises(ValueError, match="share"):
        make_probes(ball, share=0.0)
    with pytest.raises(ValueError, match="base"):
        make_probes(ball, base=DEGREE + 1)
    with pytest.raises(ValueError, match="light of the probes' degree"):
        shade_probes(light[:, :9], ball, EYE, MATERIAL, probes)
    lobes = transfer.Material(jnp.asarray(0.5), jnp.asarray(0.5), jnp.full((COUNT,), 8.0))
    with pytest.raises(ValueError, match="one exponent"):
        shade_probes(light, ball, EYE, lobes, probes)
    part = jax.tree.map(lambda x: x[:100], ball)
    with pytest.raises(ValueError, match="expected probes of 100"):
        shade_probes(light, part, EYE, MATERIAL, probes)
