"""Fixed views against glossy shading in full, which is checked elsewhere."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from test_glossy import DEGREE, EYE, MATERIAL, K, V, surface

from jaxsh.transfer import FixedView, Material, fixed_view, shade_glossy


def materials(rng, kind, count):
    exponents = rng.uniform(1, 60, size=count)
    return {
        "numbers": MATERIAL,
        "a number for each vertex": Material(rng.uniform(size=(count, 1)), 0.7, exponents),
        "one color": Material(rng.uniform(size=3), 0.7, 12.0),
        "colors": Material(0.4, rng.uniform(size=(count, 3)), exponents),
    }[kind]


@pytest.mark.parametrize(
    ("kind", "dtype", "rtol", "count", "degree", "options"),
    [
        ("numbers", np.float32, 5e-7, V, DEGREE, {}),
        ("a number for each vertex", np.float64, 2e-15, 1030, 1, {"normalized": False}),
        ("one color", np.float64, 2e-15, V, 0, {}),
        ("colors", np.float64, 2e-15, V, DEGREE, {"distant": True}),
    ],
)
def test_a_light_s_product_is_glossy_shading(rng, kind, dtype, rtol, count, degree, options):
    made, material = surface(rng, dtype, count), materials(rng, kind, count)
    product = fixed_view(made, EYE, material, degree=degree, **options)
    assert product.degree == degree
    assert product.coefficients.ndim == (3 if "color" in kind else 2)
    lights = rng.normal(size=(2, 1, 3, (degree + 1) ** 2))
    exact = shade_glossy(lights[..., None, :, :], made, EYE, material, **options)
    for light, whole in ((lights, exact), (lights[1], exact[1]), (lights[0, 0], exact[0, 0])):
        got = product(light)
        assert got.dtype == dtype
        assert got.shape == whole.shape
        np.testing.assert_allclose(got, whole, rtol=0, atol=rtol * np.abs(whole).max())


def test_fixed_views_have_the_transfer_s_degree_where_none_is_said(rng):
    made = surface(rng)
    all_of_it, said = (fixed_view(made, EYE, MATERIAL, degree=d) for d in (None, DEGREE))
    assert all_of_it.degree == DEGREE
    np.testing.assert_array_equal(all_of_it.coefficients, said.coefficients)


def test_a_channel_that_is_no_number_stays_apart(rng):
    product = eqx.filter_jit(fixed_view(surface(rng), EYE, materials(rng, "colors", V)))
    light = rng.normal(size=(3, K))
    broken = np.stack([light[0], np.full(K, np.nan), light[2]])
    np.testing.assert_array_equal(product(broken)[:, [0, 2]], product(light)[:, [0, 2]])


@pytest.mark.slow
def test_fixed_views_differentiate_as_glossy_shading(rng):
    """In light, transfer, eye and material, forward and reverse, by one program."""
    made, material = surface(rng), materials(rng, "colors", V)
    parts, neighbors = eqx.partition(made, eqx.is_inexact_array)
    at = jnp.asarray(rng.normal(size=(3, K))), parts, jnp.asarray(EYE), material
    along = jax.tree.map(lambda x: jnp.asarray(rng.normal(size=x.shape)), at)
    weights = jnp.asarray(rng.normal(size=(V, 3)))

    def by_product(light, parts, eye, material):
        return fixed_view(eqx.combine(parts, neighbors), eye, material)(light)

    def in_full(light, parts, eye, material):
        return shade_glossy(light, eqx.combine(parts, neighbors), eye, material)

    def derivatives(shade):
        return jax.jvp(shade, at, along)[1], jax.vjp(shade, *at)[1](weights)

    both = jax.jit(lambda: (derivatives(by_product), derivatives(in_full)))()
    got, exact = map(jax.tree.leaves, both)
    for one, whole in zip(got, exact, strict=True):
        assert np.abs(whole).max() > 0
        np.testing.assert_allclose(one, whole, rtol=0, atol=5e-15 * np.abs(whole).max())


def test_fixed_views_map_over_eyes(rng):
    made, eyes = surface(rng), jnp.asarray(EYE + rng.normal(size=(2, 3)))
    lights = jnp.asarray(rng.normal(size=(2, 3, K)))
    products = jax.vmap(lambda eye: fixed_view(made, eye, MATERIAL))(eyes)
    mapped = jax.jit(jax.vmap(FixedView.__call__))(products, lights)
    for got, eye, light in zip(mapped, eyes, lights, strict=True):
        exact = fixed_view(made, eye, MATERIAL)(light)
        np.testing.assert_allclose(got, exact, rtol=0, atol=5e-15)


@pytest.mark.parametrize("light", [(K,), (2, K), (3, 9), (2, 3, 25)])
def test_lights_that_are_not_the_product_s_are_refused(unchecked, rng, light):
    product = fixed_view(surface(rng), EYE, MATERIAL)
    with pytest.raises(ValueError, match=r"light \(\.\.\., 3, 16\), of the view's degree 3"):
        product(np.ones(light))


def test_bad_fixed_view_arguments_are_refused(unchecked, rng):
    made = surface(rng)
    with pytest.raises(ValueError, match=r"expected eye \(3,\), got shape \(2, 3\)"):
        fixed_view(made, np.ones((2, 3)), MATERIAL)
    with pytest.raises(ValueError, match="a material of 7 vertices, but its exponent is of 4"):
        fixed_view(made, EYE, Material(0.4, 0.7, np.ones(4)))
    with pytest.raises(ValueError, match="at most the transfer's, 3, got 4"):
        fixed_view(made, EYE, MATERIAL, degree=4)
