"""Diffuse shading against one einsum, in every shape and mode."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from jaxsh.transfer import Material, Transfer, quantize, sample, shade_diffuse, shade_glossy
from jaxsh.transfer._glossy_kernels import _as_matrices, _written_out, in_steps

V, K = 6, 9


def transfer(rng, dtype=np.float64, degree=2):
    shapes = {"coefficients": (V, (degree + 1) ** 2), "positions": (V, 3), "normals": (V, 3)}
    arrays = {name: jnp.asarray(rng.normal(size=shape), dtype) for name, shape in shapes.items()}
    return Transfer(**arrays, neighbors=jnp.zeros((V, 1), np.int32))


@pytest.mark.parametrize(("dtype", "rtol"), [(np.float32, 3e-6), (np.float64, 1e-14)])
@pytest.mark.parametrize("lights", [(), (1,), (V,), (5, 1), (5, V), (2, 5, 1), (2, 5, V)])
@pytest.mark.parametrize("albedo", [(), (3,), (V, 1), (V, 3)])
def test_equals_the_definition(rng, dtype, rtol, lights, albedo):
    light = rng.normal(size=(*lights, 3, K))
    albedo = rng.uniform(size=albedo)
    made = transfer(rng, dtype)
    each = np.broadcast_to(light, (*lights[:-1], V, 3, K))
    exact = albedo / np.pi * np.einsum("...vck,vk->...vc", each, np.asarray(made.coefficients))
    got = shade_diffuse(jnp.asarray(light, dtype), made, jnp.asarray(albedo, dtype))
    assert got.shape == (*lights[:-1], V, 3)
    assert got.dtype == dtype
    np.testing.assert_allclose(got, exact, rtol=rtol, atol=rtol * np.abs(exact).max())


def test_has_the_transfer_s_dtype(rng):
    made = transfer(rng, np.float32)
    light = rng.normal(size=(3, K))
    assert shade_diffuse(light, made, 0.5).dtype == np.float32


def test_a_white_surface_under_a_uniform_sky_gives_it_back(rng):
    """Open to radiance 1, irradiance is π and albedo/π of it leaves."""
    made = transfer(rng, degree=0)
    open_sky = jnp.full((V, 1), np.pi * np.sqrt(1 / (4 * np.pi)))
    made = Transfer(open_sky, made.positions, made.normals, made.neighbors)
    light = jnp.full((3, 1), np.sqrt(4 * np.pi))
    np.testing.assert_allclose(shade_diffuse(light, made, 0.25), 0.25, rtol=1e-14)


def test_a_lower_light_is_as_one_filled_up_with_zeros(rng):
    made = transfer(rng, degree=4)
    light = rng.normal(size=(3, K))
    filled = np.concatenate([light, np.zeros((3, 25 - K))], axis=1)
    np.testing.assert_allclose(
        shade_diffuse(light, made, 1.0), shade_diffuse(filled, made, 1.0), rtol=1e-13, atol=1e-13
    )


@pytest.mark.parametrize("lights", [(), (V,), (2, 1)])
def test_derivatives_in_everything(rng, lights):
    made = transfer(rng)

    def shade(light, coefficients, albedo):
        return shade_diffuse(
            light,
            Transfer(jnp.asarray(coefficients), made.positions, made.normals, made.neighbors),
            albedo,
        )

    arguments = rng.normal(size=(*lights, 3, K)), made.coefficients, rng.uniform(size=(V, 3))
    arguments = tuple(map(jnp.asarray, arguments))
    check_grads(shade, arguments, order=2, modes=["fwd", "rev"], rtol=1e-6, atol=1e-6)


def test_jit_and_vmap_agree_with_the_batch(rng):
    made = transfer(rng)
    lights = jnp.asarray(rng.normal(size=(4, 3, K)))
    batch = shade_diffuse(lights[:, None], made, 0.5)
    mapped = jax.jit(jax.vmap(lambda light: shade_diffuse(light, made, 0.5)))(lights)
    np.testing.assert_allclose(mapped, batch, rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize(
    ("light", "albedo", "message"),
    [
        ((K,), (), r"expected light \(3, K\), or \(\.\.\., 6, 3, K\) .* got shape \(9,\)"),
        ((4, K), (), r"got shape \(4, 9\)"),
        ((5, 3, K), (), r"\(\.\.\., 1, 3, K\) for a batch of shared ones, got shape \(5, 3, 9\)"),
        ((3, 8), (), "got 8"),
        (
            (3, 16),
            (),
            r"light's degree 3 is above the transfer's, 2; cut it to light\[\.\.\., :9\]",
        ),
        (
            (3, K),
            (V,),
            r"expected albedo as a number, \(3,\), \(6, 1\) or \(6, 3\), got shape \(6,\)",
        ),
    ],
)
def test_bad_shapes_are_refused(unchecked, rng, light, albedo, message):
    with pytest.raises(ValueError, match=message):
        shade_diffuse(np.ones(light), transfer(rng), np.ones(albedo))


def test_materials_are_arrays_and_trees(rng):
    material = Material(0.5, jnp.ones(3), jnp.full(V, 32.0))
    assert material.diffuse.shape == ()
    assert len(jax.tree.leaves(material)) == 3
    value, slope = jax.jvp(lambda d: Material(d, 0.1, 8.0).diffuse * 2, (0.5,), (1.0,))
    assert (value, slope) == (1, 2)
    jax.jit(lambda d: Material(d, 0.1, 8.0).diffuse)(-1.0)  # not looked at while traced


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((-0.1, 0.5, 8.0), "diffuse must be finite and >= 0"),
        ((0.1, [0.5, np.nan, 0], 8.0), "specular must be finite and >= 0"),
        ((0.1, 0.5, -1.0), "exponent must be finite and above -1"),
        ((0.1, 0.5, np.inf), "exponent must be finite"),
        ((np.ones(4), 0.5, 8.0), r"expected diffuse as a number, .* got shape \(4,\)"),
        ((0.1, np.ones((4, 2)), 8.0), r"expected specular .* got shape \(4, 2\)"),
        ((0.1, np.ones((1, 4, 3)), 8.0), r"expected specular .* got shape \(1, 4, 3\)"),
        ((0.1, 0.5, np.ones((4, 1))), r"expected exponent as a number or \(V,\)"),
        ((np.ones((4, 1)), np.ones((5, 3)), 8.0), "one mesh, .* {'diffuse': 4, 'specular': 5}"),
    ],
)
def test_bad_materials_are_refused(values, message):
    with pytest.raises(ValueError, match=message):
        Material(*(np.asarray(value) if isinstance(value, list) else value for value in values))


@pytest.mark.parametrize(("dtype", "rtol"), [(np.float32, 3e-6), (np.float64, 1e-14)])
@pytest.mark.parametrize("lights", [(), (1,), (5, 1)])
def test_quantized_is_the_definition_of_what_was_rounded(rng, dtype, rtol, lights):
    made = transfer(rng, dtype)
    quantized = quantize(made)
    assert (quantized.num_points, quantized.degree) == (V, 2)
    scales = np.abs(made.coefficients).max(axis=0) / 127
    np.testing.assert_allclose(quantized.scales, scales, rtol=1e-6)
    rounded = np.round(np.asarray(made.coefficients) / np.asarray(quantized.scales))
    np.testing.assert_array_equal(quantized.codes[0, :, :V].T, rounded)
    light = rng.normal(size=(*lights, 3, K))
    each = np.broadcast_to(light, (*lights[:-1], V, 3, K))
    exact = np.einsum("...vck,vk->...vc", each, rounded * np.asarray(quantized.scales)) / np.pi
    got = shade_diffuse(jnp.asarray(light, dtype), quantized, 1.0)
    assert got.dtype == dtype
    np.testing.assert_allclose(got, exact, rtol=rtol, atol=rtol * np.abs(exact).max())
    lower = shade_diffuse(jnp.asarray(light[..., :4], dtype), quantized, 1.0)
    padded = np.pad(light[..., :4], [(0, 0)] * (light.ndim - 1) + [(0, 5)])
    same = shade_diffuse(jnp.asarray(padded, dtype), quantized, 1.0)
    np.testing.assert_allclose(lower, same, rtol=0, atol=rtol * np.abs(exact).max())


def test_quantized_is_differentiable_and_maps_over_lights(rng):
    quantized, light = quantize(transfer(rng)), jnp.asarray(rng.normal(size=(2, 3, K)))
    albedo = jnp.asarray(rng.uniform(size=(V, 1)))

    def shade(light, albedo):
        return shade_diffuse(light, quantized, albedo)

    check_grads(shade, (light[0], albedo), order=1, modes=["fwd", "rev"])
    both = jax.vmap(shade, in_axes=(0, None))(light, albedo)
    np.testing.assert_allclose(both[1], shade(light[1], albedo), rtol=0, atol=1e-14)


def test_quantized_of_more_than_a_block_and_of_zeros(rng):
    rows = np.zeros((130, K))
    rows[129, 3] = 2.0
    made = Transfer(
        jnp.asarray(rows),
        *[jnp.asarray(rng.normal(size=(130, 3)))] * 2,
        neighbors=jnp.zeros((130, 1), np.int32),
    )
    light = jnp.asarray(rng.normal(size=(3, K)))
    got = shade_diffuse(light, quantize(made), 1.0)
    np.testing.assert_allclose(got, rows @ light.T / np.pi, rtol=0, atol=1e-14)


def test_what_is_not_finite_is_not_rounded_away():
    values = jnp.asarray([[1.0, 0.0, 2.0], [jnp.nan, 0.0, -4.0]])
    codes, scales = in_steps(values, 0)
    np.testing.assert_array_equal(np.asarray(codes)[:, 2], [64, -127])  # 63.5 to even
    np.testing.assert_allclose(scales, [np.nan, 1.0, 4 / 127], rtol=1e-15)


def test_quantized_refuses_what_does_not_fit(rng, unchecked):
    made = transfer(rng)
    with pytest.raises(ValueError, match="finite"):
        quantize(
            Transfer(
                made.coefficients.at[0, 0].set(jnp.nan),
                made.positions,
                made.normals,
                made.neighbors,
            )
        )
    with pytest.raises(ValueError, match="lights that all vertices share"):
        shade_diffuse(rng.normal(size=(V, 3, K)), quantize(made), 0.5)
    with pytest.raises(ValueError, match="above the transfer's, 2"):
        shade_diffuse(rng.normal(size=(3, 16)), quantize(made), 0.5)
    with pytest.raises(ValueError, match="not its eight bits"):
        shade_glossy(rng.normal(size=(3, K)), quantize(made), np.ones(3), Material(1.0, 1.0, 2.0))


@pytest.mark.parametrize("dtype", [np.float64, np.int8])
def test_written_out_sums_are_the_matrix_products(rng, dtype):
    weights = jnp.asarray(rng.uniform(-1, 1, size=(3, 4, 9)))
    values = jnp.asarray(rng.integers(-100, 100, size=(3, 9, 8)), dtype)
    expected = np.einsum("bcn,bnv->bcv", weights, np.asarray(values))
    for form in (_written_out, _as_matrices):
        np.testing.assert_allclose(form(weights, values), expected, rtol=0, atol=1e-12)


def test_truncated_and_cast(rng, unchecked):
    made = transfer(rng)
    cut = made.truncated(1)
    np.testing.assert_array_equal(cut.coefficients, made.coefficients[:, :4])
    assert (cut.degree, cut.num_points) == (1, V)
    cast = made.astype(np.float32)
    for array in (cast.coefficients, cast.positions, cast.normals):
        assert array.dtype == np.float32
    assert cast.neighbors is made.neighbors
    assert cast.dtype == np.float32
    with pytest.raises(ValueError, match="at most the transfer's, 2, got 3"):
        made.truncated(3)


def test_every_form_is_shaded_the_same(rng):
    made, light = transfer(rng), jnp.asarray(rng.normal(size=(3, K)))
    plain = shade_diffuse(light, made, 0.5)
    np.testing.assert_allclose(shade_diffuse(light, sample(made), 0.5), plain, rtol=0, atol=1e-14)
    own = rng.normal(size=(V, 3, K))
    np.testing.assert_allclose(
        shade_diffuse(own, sample(made), 0.5), shade_diffuse(own, made, 0.5), rtol=0, atol=1e-14
    )
