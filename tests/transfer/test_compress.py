"""Clustered principal components: what they leave, and shading from them."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from jaxsh import geometry, sphere
from jaxsh.transfer import (
    Material,
    Transfer,
    bake,
    compress,
    fluence,
    load,
    open,
    quantize,
    save,
    shade_diffuse,
    shade_glossy,
    unshadowed,
)

ARRAYS = "coefficients", "positions", "normals", "neighbors"
V, K, CLUSTERS, COMPONENTS = 60, 9, 3, 2


@pytest.fixture(scope="module")
def made():
    """Points of three planes of two dimensions each, far from each other, in float64."""
    rng = np.random.default_rng(7)
    planes = rng.normal(size=(CLUSTERS, COMPONENTS, K))
    rows = 4 * rng.normal(size=(CLUSTERS, 1, K)) + rng.normal(size=(CLUSTERS, 20, 2)) @ planes
    positions, normals = jnp.asarray(rng.normal(size=(2, V, 3)))
    table = jnp.zeros((V, 1), int)
    return Transfer(jnp.asarray(rows.reshape(V, K)), positions, normals, table)


@pytest.fixture(scope="module")
def small(made):
    return compress(made, clusters=CLUSTERS, components=COMPONENTS)


def coefficients(transfer):
    return np.asarray(transfer.decompressed().coefficients)


def test_clusters_that_are_planes_are_found(made, small):
    # A weight is rounded to 1/254 of the largest of its cluster, a component to 1/65,534.
    assert np.abs(coefficients(small) - made.coefficients).max() < 0.02
    by_default = compress(made, iterations=1)
    assert (by_default.num_clusters, by_default.num_components) == (1, K)
    counts = np.bincount(small.cluster, minlength=CLUSTERS)
    np.testing.assert_array_equal(counts, 20)
    assert (small.num_clusters, small.num_components, small.degree) == (CLUSTERS, COMPONENTS, 2)
    assert small.num_bytes == 3 * V + 3 * 3 * (2 * K + 8)


def test_one_cluster_is_its_principal_components(made):
    rows = np.asarray(made.coefficients)
    left = np.linalg.svd(rows - rows.mean(axis=0), compute_uv=False)
    # What weights in 8 bits add, measured: 0.0034, 0.016 and 0.277.
    for number, most in ((1, 0.004), (4, 0.02), (K, 0.3)):
        got = coefficients(compress(made, clusters=1, components=number))
        error = np.sqrt(np.sum((got - rows) ** 2))
        exact = np.sqrt(np.sum(left[number:] ** 2))
        assert exact <= error < exact + most


def test_the_same_seed_gives_the_same_bits_and_another_other_ones(made, small):
    again = compress(made, clusters=CLUSTERS, components=COMPONENTS)
    assert all(
        np.array_equal(a, b)
        for a, b in zip(jax.tree.leaves(again), jax.tree.leaves(small), strict=True)
    )
    other = compress(made, clusters=CLUSTERS, components=COMPONENTS, seed=3)
    assert not np.array_equal(other.cluster, small.cluster)


def lights(rng, dtype):
    """Of one light for all, a lower one, two, one for each point."""
    light = rng.normal(size=(3, K))
    own = rng.normal(size=(V, 3, K))
    several = light, light[:, :4], np.stack([light, 2 * light])[:, None], own
    return [jnp.asarray(each, dtype) for each in several]


def check_diffuse(small, given, atol):
    got, expected = (shade_diffuse(given, form, 0.5) for form in (small, small.decompressed()))
    assert got.dtype == expected.dtype == small.dtype == given.dtype
    np.testing.assert_allclose(got, expected, rtol=0, atol=atol)


def check_glossy(small, given, atol):
    material = Material(0.3, 0.5, jnp.full(V, 8.0, small.dtype))
    eye = jnp.asarray([3.0, 0.0, 1.0], small.dtype)
    forms = small, small.decompressed()
    got, expected = (shade_glossy(given, form, eye, material) for form in forms)
    assert got.dtype == small.dtype
    np.testing.assert_allclose(got, expected, rtol=0, atol=atol)


def test_shading_is_that_of_the_decompressed(small, rng):
    check_diffuse(small, lights(rng, np.float64)[0], 2e-15)
    volume = dataclasses.replace(small, cosine=False, surface="points")
    light, *_ = lights(rng, np.float64)
    got, expected = fluence(light, volume), np.pi * shade_diffuse(light, small, 1.0)
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-14)
    assert (volume.decompressed().surface, volume.decompressed().cosine) == ("points", False)
    with pytest.raises(ValueError, match=r"transfer\.fluence takes"):
        shade_diffuse(light, volume, 0.5)


def test_values_in_directions_are_those_of_the_decompressed(small, rng):
    """What glossy shading takes; the slow test shades."""
    basis, same = jnp.asarray(rng.normal(size=(2, 4))), small.decompressed()
    np.testing.assert_allclose(
        small.at_nodes(basis, 4), same.at_nodes(basis, 4), rtol=0, atol=2e-14
    )
    np.testing.assert_array_equal(small.normal_rows(), same.normal_rows())
    assert small.glossy_form(1) is small


@pytest.mark.slow
@pytest.mark.parametrize(("dtype", "atol"), [(np.float32, 3e-6), (np.float64, 6e-15)])
def test_all_shading_is_that_of_the_decompressed(made, dtype, atol, rng):
    """Measured: up to 9.5e-7 in float32, 1.8e-15 in float64."""
    small = compress(made.astype(dtype), clusters=CLUSTERS, components=COMPONENTS)
    for given in lights(rng, dtype):
        check_diffuse(small, given, atol)
        check_glossy(small, given, atol)


@pytest.mark.parametrize("glossy", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_is_differentiable_and_maps_over_lights(small, glossy, rng):
    light = jnp.asarray(rng.normal(size=(2, 3, 4)))
    eye, material = jnp.asarray([3.0, 0.0, 1.0]), Material(0.5, 0.5, 4.0)

    def shade(light):
        if glossy:
            return shade_glossy(light, small, eye, material)
        return shade_diffuse(light, small, 0.5)

    check_grads(shade, (light[0],), order=1, modes=["fwd", "rev"])
    mapped = jax.vmap(shade)(light)
    np.testing.assert_allclose(mapped[1], shade(light[1]), rtol=0, atol=1e-12)


def test_more_components_and_clusters_leave_less():
    normals = sphere.fibonacci(300).directions
    made = unshadowed(normals, normals, degree=3)
    rows = np.asarray(made.coefficients)

    def error(clusters, components):
        small = compress(made, clusters=clusters, components=components, iterations=8)
        return np.sqrt(np.sum((coefficients(small) - rows) ** 2) / np.sum(rows**2))

    errors = [error(4, 2), error(4, 4), error(12, 4)]  # measured: 0.256, 0.098, 0.027
    assert errors[0] > 2 * errors[1] > 4 * errors[2]


def test_what_is_degenerate(made):
    alike = dataclasses.replace(made, coefficients=jnp.ones((V, K)))
    np.testing.assert_allclose(
        coefficients(compress(alike, clusters=5, components=3)), 1.0, rtol=0, atol=1e-15
    )
    zeros = dataclasses.replace(made, coefficients=jnp.zeros((V, K)))
    assert not coefficients(compress(zeros, clusters=V, components=K)).any()
    one = dataclasses.replace(made, **{name: getattr(made, name)[:1] for name in ARRAYS})
    np.testing.assert_allclose(
        coefficients(compress(one, iterations=1)), one.coefficients, rtol=0, atol=1e-4
    )
    # Far from 1, and in sixteen bits, which could not hold the sums.
    far = dataclasses.replace(made, coefficients=1e30 * made.coefficients)
    got = coefficients(compress(far, clusters=CLUSTERS, components=COMPONENTS))
    np.testing.assert_allclose(got, far.coefficients, rtol=0, atol=2e28)
    half = compress(made.astype(np.float16), clusters=CLUSTERS, components=COMPONENTS)
    assert half.dtype == np.float32
    np.testing.assert_allclose(coefficients(half), made.coefficients, rtol=0, atol=0.02)


def test_a_part_of_the_points_forms_the_clusters(made, monkeypatch):
    monkeypatch.setattr("jaxsh.transfer._compress._LEARNED_FROM", 1)
    four = {name: jnp.concatenate([getattr(made, name)] * 4) for name in ARRAYS}
    many = dataclasses.replace(made, **four)
    got = compress(many, clusters=CLUSTERS, components=COMPONENTS)  # from 192 of 240
    np.testing.assert_allclose(coefficients(got), many.coefficients, rtol=0, atol=0.02)


def test_a_stored_transfer_is_read_block_by_block(tmp_path):
    mesh = geometry.knot(300)
    baked = bake(mesh, degree=1, shadows=False, store=tmp_path / "knot", progress=False)
    stored = open(tmp_path / "knot")
    got, expected = (compress(one, clusters=4, components=2) for one in (stored, baked))
    for a, b in zip(jax.tree.leaves(got), jax.tree.leaves(expected), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"clusters": V + 1}, "clusters of at most the 60 points, got 61"),
        ({"components": K + 1}, "components of at most the 9 coefficients, got 10"),
        ({"iterations": 0}, "iterations"),
        ({"seed": -1}, "seed must be an integer >= 0, got -1"),
    ],
)
def test_bad_options_are_refused(made, options, message):
    with pytest.raises(ValueError, match=message):
        compress(made, **{"components": 2} | options)


def test_what_cannot_be_compressed_is_refused(made):
    bad = dataclasses.replace(made, coefficients=made.coefficients.at[0, 0].set(jnp.nan))
    with pytest.raises(ValueError, match="coefficients must be finite"):
        compress(bad)
    with pytest.raises(ValueError, match="known values for transfer, got traced ones"):
        jax.jit(compress)(made)
    with pytest.raises(TypeError, match="transfer"):
        compress(quantize(made))  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("dtype", [np.float64, pytest.param(np.float32, marks=pytest.mark.slow)])
def test_a_file_gives_back_every_bit(small, dtype, tmp_path):
    arrays = {name: getattr(small, name).astype(dtype) for name in ("scales", *ARRAYS[1:3])}
    given = dataclasses.replace(small, **arrays, surface="texels")
    assert eqx.tree_equal(load(save(tmp_path / "a.npz", given)), given)


def changed(small, path, **changes):
    path = save(path, small)
    arrays = dict(np.load(path)) | changes
    np.savez(path, **{name: array for name, array in arrays.items() if array is not None})
    return path


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"version": np.array(1)}, "written as version 1, but this jaxsh reads 2"),
        ({"codes": None}, "damaged: it holds no codes"),
        ({"weights": np.zeros((2, V), np.int16)}, "damaged: weights have dtype int16"),
        ({"cluster": np.full(V, 3, np.uint8)}, "damaged: cluster does not name one of 3 for each"),
        ({"cluster": np.zeros(V - 1, np.uint8)}, "damaged: cluster does not name one of 3"),
        ({"weights": np.zeros((3, V), np.int8)}, "damaged: scales and codes are not those of 3"),
        ({"scales": np.full((3, 3), np.inf)}, "damaged: 9 of 9 scales are NaN or infinite"),
        ({"codes": np.zeros((3, 3, 8), np.int16)}, "damaged: .* got 8"),
        ({"normals": np.zeros((3, 3))}, "damaged: positions or normals are not"),
    ],
)
def test_other_archives_are_refused(small, tmp_path, changes, message):
    path = changed(small, tmp_path / "a.npz", **changes)
    with pytest.raises(ValueError, match=rf"a\.npz: {message}"):
        load(path)
