"""Glossy shading against a quadrature of equation 5 that knows nothing of products or nodes."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from derivatives import check_derivatives

from jaxsh import harmonics
from jaxsh.transfer import (
    Material,
    Transfer,
    fixed_light,
    reflected_direction,
    sample,
    shade_diffuse,
    shade_glossy,
    unshadowed,
)

V, DEGREE, K = 7, 3, 16
leggauss = functools.lru_cache(np.polynomial.legendre.leggauss)
EYE = np.array([0.3, -2.0, 1.5])
MATERIAL = Material(0.4, 0.7, 12.0)


def surface(rng, dtype=np.float64, count=V, degree=DEGREE):
    normals = rng.normal(size=(count, 3))
    return Transfer(
        coefficients=jnp.asarray(rng.normal(size=(count, (degree + 1) ** 2)), dtype),
        positions=jnp.asarray(rng.normal(size=(count, 3)), dtype),
        normals=jnp.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True), dtype),
        neighbors=jnp.zeros((count, 1), np.int32),
    )


def by_quadrature(light, transfer, axes, material, *, normalized=True):
    """Equations 4 and 5, every function cut to the light's degree and summed over a fine grid.

    The lobe's own harmonics, too, come from an integral over the sphere, of the power itself.
    """
    degree = harmonics.degree_of(light.shape[-1])
    z, ring = leggauss(24)
    steps = 30
    phi = 2 * np.pi * np.arange(steps) / steps
    r = np.sqrt(1 - z**2)[:, None]
    grid = np.stack(np.broadcast_arrays(r * np.cos(phi), r * np.sin(phi), z[:, None]), -1)
    grid, weights = grid.reshape(-1, 3), np.repeat(ring * 2 * np.pi / steps, steps)
    basis = np.asarray(harmonics.evaluate(grid, degree))
    coefficients = np.asarray(transfer.coefficients)[:, : light.shape[-1]]
    received = (light @ basis.T)[:, None] * (coefficients @ basis.T)
    x, inner = leggauss(400)
    x, inner = (x + 1) / 2, inner / 2
    exponents = np.broadcast_to(np.asarray(material.exponent), len(axes))
    glossy = []
    for axis, exponent, row in zip(axes, exponents, np.moveaxis(received, 1, 0), strict=True):
        cosine, shape = grid @ axis, 0
        for l in range(degree + 1):
            legendre = np.polynomial.Legendre.basis(l)
            weight = 2 * np.pi * np.sum(inner * x**exponent * legendre(x))
            if normalized:
                weight *= (exponent + 1) / (2 * np.pi)
            shape = shape + (2 * l + 1) / (4 * np.pi) * weight * legendre(cosine)
        glossy.append(row @ (weights * shape))
    diffuse = np.moveaxis(received @ weights, 0, -1) / np.pi
    return np.asarray(material.diffuse) * diffuse + np.asarray(material.specular) * np.stack(glossy)


def mirrored(eye, transfer):
    towards = eye - np.asarray(transfer.positions)
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    normal = np.asarray(transfer.normals)
    return 2 * np.sum(towards * normal, axis=1, keepdims=True) * normal - towards


@pytest.mark.parametrize(
    ("dtype", "rtol", "normalized"), [(np.float32, 3e-6, True), (np.float64, 1e-12, False)]
)
def test_glossy_equals_quadrature(rng, dtype, rtol, normalized):
    made, light = surface(rng, dtype), rng.normal(size=(3, K))
    material = Material(rng.uniform(size=3), rng.uniform(size=(V, 3)), rng.uniform(1, 60, size=V))
    exact = by_quadrature(light, made, mirrored(EYE, made), material, normalized=normalized)
    still = fixed_light(jnp.asarray(light, dtype), made)
    for got in (
        shade_glossy(light, made, EYE, material, normalized=normalized),
        shade_glossy(light, sample(made), EYE, material, normalized=normalized),
        still(EYE, material, normalized=normalized),
    ):
        assert got.dtype == dtype
        np.testing.assert_allclose(got, exact, rtol=0, atol=rtol * np.abs(exact).max())


@pytest.mark.parametrize("light_degree", [0, 2])
def test_everything_is_cut_to_the_light_s_degree(rng, light_degree):
    made, light = surface(rng), rng.normal(size=(3, (light_degree + 1) ** 2))
    exact = by_quadrature(light, made, mirrored(EYE, made), MATERIAL)
    got = [
        shade_glossy(light, made, EYE, MATERIAL),
        shade_glossy(light, sample(made, light_degree), EYE, MATERIAL),
        fixed_light(light, made)(EYE, MATERIAL),
    ]
    for one in got:
        np.testing.assert_allclose(one, exact, rtol=0, atol=1e-12 * np.abs(exact).max())


def test_glossy_is_a_product_matrix(rng):
    """Equations 2, 3 and 6 as they are printed, with Lee and Kim's degree of 10."""
    made = surface(rng, degree=10)
    light = rng.normal(size=(3, 121))
    matrix = np.asarray(harmonics.product_matrix(light))
    alpha = np.asarray(harmonics.phong(32.0, 10, normalized=True))
    alpha = np.repeat(alpha * np.sqrt(4 * np.pi / (2 * np.arange(11) + 1)), 2 * np.arange(11) + 1)
    kernel = alpha * np.asarray(harmonics.evaluate(mirrored(EYE, made), 10))
    exact = np.einsum("vi,cij,vj->vc", kernel, matrix, made.coefficients, optimize=True)
    got = shade_glossy(light, made, EYE, Material(0.0, 1.0, 32.0))
    np.testing.assert_allclose(got, exact, rtol=0, atol=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize("lights", [(1,), (2, V)])
def test_lights_in_batches_and_of_their_own(rng, lights):
    made, light = surface(rng), rng.normal(size=(*lights, 3, K))
    each = np.broadcast_to(light, (*lights[:-1], V, 3, K)).reshape(-1, V, 3, K)
    axes = mirrored(EYE, made)
    exact = np.stack(
        [
            [
                by_quadrature(one, eqx.tree_at(lambda t: t.coefficients, made, row), axis, MATERIAL)
                for one, row, axis in zip(
                    batch, made.coefficients[:, None], axes[:, None], strict=True
                )
            ]
            for batch in each
        ]
    ).reshape(*lights[:-1], V, 3)
    got = shade_glossy(light, made, EYE, MATERIAL)
    np.testing.assert_allclose(got, exact, rtol=0, atol=1e-12 * np.abs(exact).max())


def test_a_mesh_of_more_than_a_tile(rng):
    made, light = surface(rng, count=1030, degree=1), rng.normal(size=(3, 4))
    exact = by_quadrature(light, made, mirrored(EYE, made), MATERIAL)
    for got in (shade_glossy(light, made, EYE, MATERIAL), fixed_light(light, made)(EYE, MATERIAL)):
        np.testing.assert_allclose(got, exact, rtol=0, atol=1e-12 * np.abs(exact).max())


def test_a_furnace_keeps_a_glossy_surface_s_albedo(rng):
    """Light times transfer one everywhere: the lobe integrates to one."""
    made = surface(rng)
    one = np.zeros((1, K))
    one[0, 0] = np.sqrt(4 * np.pi)
    made = eqx.tree_at(lambda t: t.coefficients, made, jnp.repeat(jnp.asarray(one), V, axis=0))
    light = np.repeat(one, 3, axis=0)
    albedo, exponent = rng.uniform(size=(V, 3)), np.geomspace(1, 1000, V)
    got = shade_glossy(light, made, EYE, Material(0.0, albedo, exponent))
    np.testing.assert_allclose(got, albedo, rtol=1e-13)
    bare = shade_glossy(light, made, EYE, Material(0.0, albedo, exponent), normalized=False)
    np.testing.assert_allclose(bare, albedo * 2 * np.pi / (exponent[:, None] + 1), rtol=1e-12)


def test_without_gloss_it_is_diffuse_shading(rng):
    made, light = surface(rng), rng.normal(size=(3, K))
    matt = Material(rng.uniform(size=(V, 3)), 0.0, 8.0)
    np.testing.assert_allclose(
        shade_glossy(light, made, EYE, matt),
        shade_diffuse(light, made, matt.diffuse),
        rtol=1e-12,
        atol=1e-13,
    )


def test_a_distant_eye_is_the_limit_of_a_far_one(rng):
    made, light = surface(rng), rng.normal(size=(3, K))
    distant = shade_glossy(light, made, 3 * EYE, MATERIAL, distant=True)
    far = shade_glossy(light, made, 1e9 * EYE, MATERIAL)
    np.testing.assert_allclose(distant, far, rtol=1e-6, atol=1e-7)


def test_where_there_is_no_direction_the_value_is_finite(rng):
    made, light = surface(rng), rng.normal(size=(3, K))
    normals = made.normals.at[0].set(0).at[1].set(jnp.nan).at[2].set([0, 0, 1.0])
    made = eqx.tree_at(lambda t: t.normals, made, normals)

    def total(eye):
        return jnp.sum(shade_glossy(light, made, eye, MATERIAL))

    assert np.isfinite(jax.grad(total)(jnp.asarray(EYE))).all()
    on_it = jnp.asarray(made.positions[2])
    above = on_it + jnp.array([0, 0, 1e-6])
    value, beside = (shade_glossy(light, made, eye, MATERIAL)[2] for eye in (on_it, above))
    np.testing.assert_allclose(value, beside, rtol=1e-12)
    behind = shade_glossy(light, made, EYE, MATERIAL)[:2]
    turned = eqx.tree_at(lambda t: t.normals, made, normals.at[:2].set(0))
    np.testing.assert_array_equal(behind, shade_glossy(light, turned, EYE, MATERIAL)[:2])


@pytest.mark.parametrize("form", ["sampled", "fixed light"])
def test_glossy_derivatives(rng, form):
    made, light = surface(rng, degree=2, count=3), jnp.asarray(rng.normal(size=(3, 9)))

    def shade(light, coefficients, normals, eye, specular, exponent):
        arrays = coefficients, made.positions, normals, made.neighbors
        transfer = Transfer(*map(jnp.asarray, arrays))
        material = Material(0.3, specular, exponent)
        if form == "fixed light":
            return fixed_light(light, transfer)(eye, material)
        return shade_glossy(light, sample(transfer), eye, material)

    arguments = (
        light,
        made.coefficients,
        made.normals,
        jnp.asarray(EYE),
        jnp.asarray(rng.uniform(size=(3, 3))),
        jnp.asarray([3.0, 20.0, 60.0]),
    )
    check_derivatives(shade, arguments, rng)


def test_glossy_maps_over_lights_and_eyes(rng):
    made, lights = sample(surface(rng)), jnp.asarray(rng.normal(size=(4, 3, K)))
    batch = shade_glossy(lights[:, None], made, EYE, MATERIAL)

    def shade(light, eye):
        return shade_glossy(light, made, eye, MATERIAL)

    mapped = jax.jit(jax.vmap(shade, (0, None)))(lights, jnp.asarray(EYE))
    np.testing.assert_allclose(mapped, batch, rtol=1e-12, atol=1e-13)
    eyes = jnp.asarray(EYE + rng.normal(size=(3, 3)))
    mapped = jax.vmap(shade, (None, 0))(lights[0], eyes)
    one_by_one = jnp.stack([shade(lights[0], eye) for eye in eyes])
    np.testing.assert_allclose(mapped, one_by_one, rtol=1e-12, atol=1e-13)


def test_frames_share_one_program(rng):
    made = sample(surface(rng))
    traces = 0

    @jax.jit
    def frame(light, eye):
        nonlocal traces
        traces += 1
        return shade_glossy(light, made, eye, MATERIAL)

    for _ in range(3):
        frame(jnp.asarray(rng.normal(size=(3, K))), jnp.asarray(rng.normal(size=3)))
    assert traces == 1


@pytest.mark.parametrize(
    ("light", "eye", "material", "message"),
    [
        ((9,), (3,), MATERIAL, r"expected light \(3, K\), or .* got shape \(9,\)"),
        ((5, 3, 9), (3,), MATERIAL, r"\(\.\.\., 1, 3, K\) for a batch of shared ones"),
        ((3, 8), (3,), MATERIAL, "got 8"),
        ((3, 25), (3,), MATERIAL, r"light's degree 4 is above the transfer's, 3; .*\.\.\., :16\]"),
        ((3, 16), (2, 3), MATERIAL, r"expected eye \(3,\), got shape \(2, 3\)"),
        (
            (3, 16),
            (3,),
            Material(np.ones((4, 3)), 0.5, 8.0),
            "a material of 7 vertices, but its diffuse is of 4",
        ),
    ],
)
def test_bad_glossy_arguments_are_refused(unchecked, rng, light, eye, material, message):
    with pytest.raises(ValueError, match=message):
        shade_glossy(np.ones(light), surface(rng), np.ones(eye), material)


def test_other_degrees_and_lights_of_their_own_are_refused(unchecked, rng):
    made = surface(rng)
    with pytest.raises(ValueError, match="sampled transfer's degree, 3, got 2; sample the transf"):
        shade_glossy(np.ones((3, 9)), sample(made), EYE, MATERIAL)
    with pytest.raises(ValueError, match="at most the transfer's, 3, got 4"):
        sample(made, 4)
    with pytest.raises(ValueError, match=r"one light \(3, K\) for all vertices"):
        fixed_light(np.ones((1, 3, 9)), made)
    with pytest.raises(ValueError, match=r"expected eye \(3,\), got shape \(2, 3\)"):
        fixed_light(np.ones((3, 9)), made)(np.ones((2, 3)), MATERIAL)
    with pytest.raises(ValueError, match=r"positions and normals \(V, 3\), got shapes \(7, 3\)"):
        reflected_direction(EYE, made.positions, made.normals[:2])


def test_reflected_directions_are_those_of_a_mirror(rng):
    made = surface(rng)
    got = reflected_direction(EYE, made.positions, 3 * made.normals)
    np.testing.assert_allclose(got, mirrored(EYE, made), rtol=0, atol=1e-14)
    far = reflected_direction(EYE, made.positions, made.normals, distant=True)
    at_origin = eqx.tree_at(lambda t: t.positions, made, 0 * made.positions)
    np.testing.assert_allclose(far, mirrored(EYE, at_origin), rtol=0, atol=1e-14)


def test_the_cosine_of_the_transfer_stays_in_the_glossy_part():
    """Light 1 from everywhere, in nothing's way: what the docstring says is left of the mean."""
    exponent, degree = 32.0, 24
    angles = np.radians([0.0, 30.0, 60.0])
    normals = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=1)
    light = jnp.zeros((3, (degree + 1) ** 2)).at[:, 0].set(np.sqrt(4 * np.pi))
    up = np.array([0, 0, 1.0])
    made, mirror = unshadowed(0 * normals, normals, degree), Material(0.0, 1.0, exponent)
    left = shade_glossy(light, made, up, mirror, distant=True)[:, 0]
    np.testing.assert_allclose(left[0], (exponent + 1) / (exponent + 2), rtol=0, atol=1e-4)
    np.testing.assert_allclose(left, np.cos(angles), rtol=0, atol=0.035)


@pytest.mark.parametrize("exponent", [1.0, 4.0, np.array([3.0, 9.0])])
def test_modified_phong_reflects_its_share_along_the_normal(exponent):
    normals = jnp.asarray([[0.0, 0, 1], [0, 0, 1]])
    transfer = unshadowed(jnp.zeros((2, 3)), normals, 16)
    light = jnp.zeros((3, 17**2)).at[:, 0].set(np.sqrt(4 * np.pi))  # radiance 1
    material = Material.modified_phong(0.0, jnp.asarray([0.3, 0.5, 1.0]), exponent)
    seen = shade_glossy(light, transfer, jnp.asarray([0.0, 0, 1]), material, distant=True)
    # Bands above 16 of the clamped lobe are cut: at exponent 1 that is 6e-5.
    np.testing.assert_allclose(seen, [[0.3, 0.5, 1.0]] * 2, rtol=7e-5)
    np.testing.assert_allclose(material.exponent, exponent)
