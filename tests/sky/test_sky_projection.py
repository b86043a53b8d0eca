"""Exact projection: other quadratures, doubling, symmetries, derivatives, any sky as a model."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from second_derivation import project_by_panels
from suns import sun_at, upper_directions

from jaxsh import harmonics, sky
from jaxsh.sky import _project
from jaxsh.sky._project import sky_grid, tanh_sinh

ELEVATIONS = np.array([90, 89.9, 60, 30, 10, 1, 0.05, 1e-3, 0])
TURBIDITIES = np.array([1.7, 2.5, 6.0, 10.0])


def relative_error(found, expected):
    """Worst over all but the coefficient axis, in units of the norm."""
    found, expected = np.asarray(found), np.asarray(expected)
    norm = np.linalg.norm(expected, axis=-1)
    return (np.linalg.norm(found - expected, axis=-1) / norm).max()


def radiance_on_a_grid(sun, turbidity):
    """sky(θ, φ) -> (3, T, P) for `project_by_panels`."""

    def evaluate(theta, phi):
        theta, phi = np.broadcast_arrays(theta, phi)
        view = np.stack(
            [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
        )
        return np.moveaxis(np.asarray(sky.preetham_radiance(view, sun, turbidity)), -1, 0)

    return evaluate


@pytest.mark.parametrize("elevation", [90, 45, 2, 0.01, 0])
def test_against_graded_panels(elevation):
    """A quadrature of another kind, with SciPy's harmonics; 12 × 12 nodes reach 4e-15."""
    sun = sun_at(elevation)
    for turbidity in (1.7, 4.0):
        expected = project_by_panels(
            radiance_on_a_grid(sun, turbidity), np.arctan2(sun[0], sun[2]), 6
        )
        found = sky.project_preetham(sun, turbidity)
        assert relative_error(found, expected) < 3e-13


def test_a_model_meets_a_sun_of_unit_length():
    """Whatever length was given, to rounding."""

    def glow(view, sun, haze):
        return jnp.exp(haze * (view @ sun))[:, None]

    sun = np.array([0.6, 0.0, 0.8])
    expected = sky.project(glow, sun, 1.5, degree=2)
    for length in (1e-3, 7.0):
        found = sky.project(glow, length * sun, 1.5, degree=2)
        np.testing.assert_allclose(found, expected, rtol=0, atol=2e-15 * abs(expected).max())


@pytest.mark.parametrize("degree", [6, 32])
@pytest.mark.slow
def test_twice_the_nodes_change_nothing(degree):
    suns, turbidities = (a.ravel() for a in np.meshgrid(ELEVATIONS, TURBIDITIES))
    model = functools.partial(sky.preetham_radiance, check="allow")

    @jax.jit
    def refined(sun, turbidity):
        return jax.lax.map(
            lambda row: _project._integrate(
                model, degree, row[0], row[1:], symmetric=True, refine=2
            ),
            (sun, turbidity),
        )

    sun = jnp.asarray(sun_at(suns))
    found = sky.project_preetham(sun, turbidities, degree)
    assert relative_error(found, refined(sun, jnp.asarray(turbidities))) < 3e-13


def test_a_sun_below_the_horizon_is_projected_as_well():
    """The antisolar point is then in the sky."""
    sun = sun_at(-3.0)
    model = functools.partial(sky.preetham_radiance, check="allow")
    refined = _project._integrate(
        model, 6, jnp.asarray(sun), (jnp.asarray(4.0),), symmetric=True, refine=2
    )
    found = sky.project_preetham(sun, 4.0, check="allow")
    assert relative_error(found, refined) < 1e-12


def test_the_grid_is_the_hemisphere():
    for symmetric in (True, False):
        grid = sky_grid(jnp.asarray(1.1), 6, symmetric=symmetric)
        area = grid.theta_weights.sum() * grid.phi_weights.sum()
        assert area == pytest.approx(2 * np.pi, rel=1e-14)


def test_tanh_sinh_does_not_mind_singular_ends():
    node, weight = tanh_sinh(0.06)
    assert weight @ np.sqrt(node) == pytest.approx(2 / 3, rel=1e-14)
    assert weight @ np.log(node) == pytest.approx(-1, rel=1e-14)


def test_a_sun_at_azimuth_zero_leaves_no_sines():
    found = np.asarray(sky.project_preetham(sun_at(np.array([90, 40, 3, 0])), 3.0))
    assert np.all(found[..., harmonics.orders(6) < 0] == 0)


def test_both_halves_agree_with_one_doubled():
    sun = sun_at(np.array([70.0, 1.0]), np.array([20.0, 200.0]))
    whole = sky.project(sky.preetham_radiance, sun, 3.0)
    assert relative_error(whole, sky.project_preetham(sun, 3.0)) < 1e-14


def test_rotation_is_reprojection(rng):
    sun, angle = sun_at(25.0, 10.0), 2.0
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    found = sky.project_preetham(turn @ sun, 3.0)
    still = sky.project_preetham(sun, 3.0)
    assert relative_error(found, harmonics.rotate_z(still, angle)) < 1e-14
    assert relative_error(found, harmonics.rotate(still, turn)) < 1e-13


def test_mirrored_suns_have_mirrored_coefficients():
    one, other = (sky.project_preetham(sun_at(25.0, azimuth), 3.0) for azimuth in (50.0, -50.0))
    mirror = np.where(harmonics.orders(6) < 0, -1.0, 1.0)
    assert relative_error(one, np.asarray(other) * mirror) < 1e-14


def test_against_plain_quadrature_at_any_azimuth():
    """Gauss–Legendre in z over the upper hemisphere: algebraic, yet another code."""
    sun = sun_at(35.0, 123.0)
    z, weight = np.polynomial.legendre.leggauss(200)
    z, weight = (z + 1) / 2, weight / 2
    phi = np.arange(400) * 2 * np.pi / 400
    radius = np.sqrt(1 - z**2)[:, None]
    view = np.stack(
        np.broadcast_arrays(radius * np.cos(phi), radius * np.sin(phi), z[:, None]), axis=-1
    ).reshape(-1, 3)
    weights = np.repeat(weight * 2 * np.pi / 400, 400)
    basis = np.asarray(harmonics.evaluate(view, 6))
    radiance = np.asarray(sky.preetham_radiance(view, sun, 3.0))
    expected = (radiance * weights[:, None]).T @ basis
    assert relative_error(sky.project_preetham(sun, 3.0), expected) < 1e-5


@pytest.mark.parametrize("space", [pytest.param("xyz", marks=pytest.mark.slow), "xyY"])
def test_spaces_and_constants_reach_the_model(space):
    sun = sun_at(20.0)
    found = sky.project_preetham(sun, 3.0, 2, space=space, constants="code")
    model = functools.partial(sky.preetham_radiance, space=space, constants="code")
    assert relative_error(found, sky.project(model, sun, 3.0, degree=2)) < 1e-14


@pytest.mark.slow
def test_derivatives_forward_reverse_and_by_differences(rng):
    """High, on the azimuth 0 where the coefficients with m < 0 are zero, and low."""
    sun = jnp.asarray(sun_at(np.array([50.0, 20.0, 2.0]), np.array([33.0, 0.0, -100.0])))
    turbidity = jnp.asarray([3.0, 2.0, 6.0])
    project = functools.partial(sky.project_preetham, degree=4)
    tangents = np.zeros((4, 3, 3)), np.zeros((4, 3))  # x, y, z and the turbidity
    tangents[0][np.arange(3), :, np.arange(3)] = 1
    tangents[1][3] = 1
    cotangent = rng.normal(size=(3, 3, 25))

    @jax.jit
    def derivatives(sun, turbidity):
        _, push = jax.linearize(project, sun, turbidity)
        pull = jax.linear_transpose(push, sun, turbidity)
        return jax.vmap(push)(*map(jnp.asarray, tangents)), pull(jnp.asarray(cotangent))

    forward, reverse = jax.tree.map(np.asarray, derivatives(sun, turbidity))
    step = 1e-4
    for i, (along, rise, found) in enumerate(zip(*tangents, forward, strict=True)):
        values = [
            np.asarray(project(np.asarray(sun) + k * step * along, turbidity + k * step * rise))
            for k in (-2, -1, 1, 2)
        ]
        numerical = (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * step)
        np.testing.assert_allclose(found, numerical, 0, 2e-8)
        paired = np.sum(cotangent * found, axis=(1, 2))
        np.testing.assert_allclose(reverse[0][:, i] if i < 3 else reverse[1], paired, 1e-9, 1e-12)


@pytest.mark.slow
def test_derivatives_in_the_zenith():
    """A kink of the zenith values in θ, but bands m = ±1 turn with the sun, however little."""
    project = jax.jit(functools.partial(sky.project_preetham, degree=3))
    zenith, step = jnp.array([0.0, 0.0, 1.0]), 1e-4
    found = jax.jit(jax.jacfwd(project))(zenith, jnp.asarray(3.0))
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found[..., 2], 0, 0, 1e-12)  # along the vector itself
    one = np.abs(harmonics.orders(3)) == 1
    for axis in (0, 1):
        offset = jnp.zeros(3).at[axis].set(step)
        central = (project(zenith + offset, 3.0) - project(zenith - offset, 3.0)) / (2 * step)
        np.testing.assert_allclose(found[..., one, axis], central[..., one], 0, 0.01)
        assert np.abs(found[..., one, axis]).max() > 1


def test_batches_jit_vmap_and_single_precision(rng):
    sun, turbidity = upper_directions(rng, 6), rng.uniform(2, 9, 6)
    flat = sky.project_preetham(sun, turbidity, 3)
    assert flat.shape == (6, 3, 16)
    np.testing.assert_allclose(
        sky.project_preetham(sun.reshape(2, 3, 3), turbidity.reshape(2, 3), 3),
        flat.reshape(2, 3, 3, 16),
        1e-12,
        1e-13,
    )
    np.testing.assert_allclose(sky.project_preetham(sun[0], turbidity[0], 3), flat[0], 1e-12, 1e-13)
    mapped = jax.vmap(functools.partial(sky.project_preetham, degree=3))(sun, turbidity)
    np.testing.assert_allclose(mapped, flat, 1e-12, 1e-13)
    table = sky.project_preetham(sun[:3, None], turbidity[None, :2], 3)
    assert table.shape == (3, 2, 3, 16)
    np.testing.assert_allclose(table[[0, 1], [0, 1]], flat[:2], 1e-12, 1e-13)
    single = sky.project_preetham(np.float32(sun), np.float32(turbidity), 3)
    assert single.dtype == np.float32
    assert relative_error(single, flat) < 3e-5
    assert sky.project_preetham(np.zeros((0, 3)), 3.0, 3).shape == (0, 3, 16)


def test_any_sky_is_a_model():
    """A linear one, not symmetric, with parameters: closed form over the hemisphere."""

    def model(view, sun, height, side):
        return jnp.stack([height * view[:, 2], 1 + side * view[:, 1]], axis=-1)

    found = sky.project(
        model, sun_at(np.array([20.0, 70.0]), 40.0), 3.0, np.array([0.5, 2.0]), degree=1
    )
    constant, linear = np.sqrt(1 / (4 * np.pi)), np.sqrt(3 / (4 * np.pi))
    for row, side in zip(found, (0.5, 2.0), strict=True):
        np.testing.assert_allclose(
            row,
            [
                [3 * np.pi * constant, 0, 3 * linear * 2 * np.pi / 3, 0],
                [2 * np.pi * constant, side * linear * 2 * np.pi / 3, np.pi * linear, 0],
            ],
            0,
            1e-13,
        )


def test_a_models_parameters_are_differentiable():
    def model(view, sun, power):
        return jnp.exp(power * view @ sun)[:, None]

    sun = sun_at(40.0, 20.0)
    for symmetric in (True, False):
        found = jax.grad(
            lambda p, symmetric=symmetric: sky.project(
                model, sun, p, degree=0, symmetric=symmetric
            )[0, 0]
        )(0.7)
        step = 1e-4
        up, down = (sky.project(model, sun, 0.7 + h, degree=0)[0, 0] for h in (step, -step))
        assert found == pytest.approx(float(up - down) / (2 * step), rel=1e-7)


def test_bad_input_is_refused(unchecked):
    with pytest.raises(ValueError, match="degree must be an integer >= 0"):
        sky.project_preetham(sun_at(20.0), 3.0, -1)
    with pytest.raises(ValueError, match=r"expected sun \(\.\.\., 3\)"):
        sky.project_preetham(np.ones(4), 3.0)
    with pytest.raises(ValueError, match="must broadcast, got sun"):
        sky.project_preetham(np.ones((2, 3)), np.full(5, 3.0))
    with pytest.raises(ValueError, match=r"a model must return radiance \(n, channels\)"):
        sky.project(lambda view, sun: view[:, 2], sun_at(20.0))


@pytest.mark.parametrize(("suns", "loops"), [(3, [1, 0]), (2000, [1, 1])])
def test_suns_go_many_at_once_off_the_cpu(suns, loops):
    """One after the other on the CPU, on an accelerator a thousand at a time."""
    project = jax.jit(lambda sun, turbidity: sky.project_preetham(sun, turbidity, 1))
    traced = project.trace(jnp.ones((suns, 3)), jnp.ones(suns))
    texts = [traced.lower(lowering_platforms=(p,)).as_text() for p in ("cpu", "cuda")]
    assert [text.count("stablehlo.while") for text in texts] == loops
