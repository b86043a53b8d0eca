"""Fits of any sky: exactness, solvers, symmetries, ranges, derivatives, refusals."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest
from suns import sun_at, upper_directions

from jaxsh import harmonics, sky
from jaxsh.sky import _fit, _polynomials, _sky_fit

DEGREE = 3
OPTIONS = {"degree": DEGREE, "terms": (7, 3), "log": ["haze"]}
HAZE = {"haze": (1.0, 3.0)}


def haze_sky(view, sun, haze):
    """Smooth in the sun, a polynomial in log haze, two channels."""
    across = view @ (sun / jnp.linalg.norm(sun))
    glow = jnp.exp(0.5 * across) * (1 + jnp.log(haze)) + view[:, 2]
    return jnp.stack([glow, across**2 * jnp.log(haze) ** 2], axis=-1)


@pytest.fixture(scope="module")
def fitted():
    return sky.fit(haze_sky, HAZE, **OPTIONS)


def relative_error(found, expected):
    found, expected = np.asarray(found), np.asarray(expected)
    return np.linalg.norm(found - expected) / np.linalg.norm(expected)


def exact(sun, haze):
    return sky.project(haze_sky, sun, haze, degree=DEGREE, symmetric=True)


@pytest.mark.slow
def test_between_the_samples(fitted, rng):
    sun, haze = upper_directions(rng, 20), rng.uniform(1, 3, 20)
    assert relative_error(fitted(sun, haze), exact(sun, haze)) < 1e-7
    assert fitted.solution.converged
    assert fitted.solution.steps <= 4
    assert fitted.solution.residual < 1e-7


@pytest.mark.slow
def test_edges_of_the_range(fitted):
    for elevation in (90, 0):
        for haze in (1.0, 3.0):
            sun = sun_at(elevation, 20)
            assert relative_error(fitted(sun, haze), exact(sun, haze)) < 1e-6


@pytest.mark.slow
def test_plain_series_too(rng):
    options = OPTIONS | {"terms": (12, 3), "solver": "qr"}
    plain = sky.fit(haze_sky, HAZE, **options, parity=False)
    sun, haze = upper_directions(rng, 20), rng.uniform(1, 3, 20)
    assert relative_error(plain(sun, haze), exact(sun, haze)) < 1e-6
    at_zenith = plain(np.array([0.0, 0, 1]), 2.0)
    assert np.isfinite(at_zenith).all()


@pytest.mark.slow
def test_solvers_agree(rng):
    design = rng.normal(size=(40, 5))
    targets, scales = rng.normal(size=(3, 40)), rng.uniform(0.5, 1, size=(3, 40))
    expected = [
        np.linalg.lstsq(s[:, None] * design, t)[0] for s, t in zip(scales, targets, strict=True)
    ]
    arrays = [jnp.asarray(a) for a in (design, targets, scales)]
    for solver in ("gauss-newton", "qr", optx.LevenbergMarquardt(1e-9, 1e-9)):
        values, solution = sky.least_squares(*arrays, solver=solver)
        np.testing.assert_allclose(values, expected, 1e-6, 1e-9)
        assert solution.converged
        assert solution.message == "successful"
    residual = np.linalg.norm(scales * (np.asarray(values) @ design.T) - targets)
    np.testing.assert_allclose(solution.residual, residual / np.linalg.norm(targets))


def test_no_convergence_is_said():
    with pytest.raises(RuntimeError, match=r"did not converge in 1 steps.*maximum number"):
        sky.fit(haze_sky, HAZE, **OPTIONS, max_steps=1)
    quiet = sky.fit(haze_sky, HAZE, **OPTIONS, max_steps=1, throw=False)
    assert not quiet.solution.converged
    assert quiet.solution.result == optx.RESULTS.nonlinear_max_steps_reached


@pytest.mark.slow
def test_lawson_lowers_the_worst(rng):
    def glow(view, sun):
        return jnp.exp(2 * (view @ sun))[:, None]

    sun = sun_at(np.linspace(0, 90, 24))
    truth = np.asarray(sky.project(glow, sun, degree=DEGREE, symmetric=True))
    worst = []
    for rounds in (0, 10):
        options = {"degree": DEGREE, "terms": [3], "samples": [24], "solver": "qr"}
        value = sky.fit(glow, {}, **options, lawson=rounds)(sun)
        worst.append(np.linalg.norm(np.asarray(value) - truth, axis=-1).max())
    assert worst[1] < 0.95 * worst[0]


@pytest.mark.slow
def test_prefactor_mix_and_weight(rng):
    """What a prefactor takes out need not be fitted."""

    def bright(view, sun, haze):
        return haze_sky(view, sun, haze) * (1 + jnp.abs(haze - 2)) * jnp.array([[2.0, 1.0]])

    mixed = sky.fit(
        bright,
        HAZE,
        **OPTIONS,
        solver="qr",
        mix=np.array([[2.0, 0], [0, 1.0]]),
        prefactor=lambda sun, haze: jnp.tile((1 + jnp.abs(haze - 2))[:, None], (1, 2)),
        weight=lambda sun, haze: 1 / haze,
    )
    sun, haze = upper_directions(rng, 10), rng.uniform(1, 3, 10)
    expected = sky.project(bright, sun, haze, degree=DEGREE, symmetric=True)
    assert relative_error(mixed(sun, haze), expected) < 1e-7


@pytest.mark.slow
def test_any_number_of_parameters(rng):
    def tinted(view, sun, low, high):
        return low + high * (view @ sun)[:, None] ** 2

    ranges = {"low": (0.0, 1.0), "high": (1.0, 2.0)}
    two = sky.fit(tinted, ranges, degree=2, terms=(8, 2, 2), solver="qr")
    sun, low, high = upper_directions(rng, 5), rng.uniform(0, 1, 5), rng.uniform(1, 2, 5)
    expected = sky.project(tinted, sun, low, high, degree=2, symmetric=True)
    assert relative_error(two(sun, low, high), expected) < 1e-8


def test_a_sky_with_a_ground(rng):
    def project(model, sun, haze, *, degree, symmetric):
        return sky.with_ground(
            sky.project(model, sun, haze, degree=degree, symmetric=symmetric), 0.3
        )

    ground = sky.fit(haze_sky, HAZE, **OPTIONS, project=project, solver="qr")
    sun, haze = upper_directions(rng, 5), rng.uniform(1, 3, 5)
    assert relative_error(ground(sun, haze), sky.with_ground(exact(sun, haze), 0.3)) < 1e-7


def test_batches_dtypes_and_jit(fitted, rng):
    sun, haze = upper_directions(rng, 6).reshape(2, 3, 3), np.array([1.2, 2.0, 2.8])
    whole = np.asarray(fitted(sun, haze))
    assert whole.shape == (2, 3, 2, 16)
    one = fitted(sun[1, 2], haze[2])
    assert one.shape == (2, 16)
    np.testing.assert_allclose(whole[1, 2], one, 0, 1e-14)
    np.testing.assert_allclose(fitted(2.5 * sun, haze), whole, 0, 1e-14)
    np.testing.assert_allclose(eqx.filter_jit(fitted)(sun, haze), whole, 0, 1e-14)
    vmapped = jax.vmap(jax.vmap(fitted), (0, None))(jnp.asarray(sun), jnp.asarray(haze))
    np.testing.assert_allclose(vmapped, whole, 0, 1e-14)
    assert fitted(np.zeros((0, 3)), 2.0).shape == (0, 2, 16)
    single = fitted(sun.astype("f4"), haze.astype("f4"))
    assert single.dtype == jnp.float32
    assert relative_error(single, whole) < 2e-6


def test_rotation_to_the_suns_azimuth(fitted):
    """Eq. 4, against re-projection and rotate_z."""
    at_zero = fitted(sun_at(35), 2.0)
    for azimuth in (-170, -90, 20, 135, 180):
        turned = fitted(sun_at(35, azimuth), 2.0)
        assert relative_error(turned, exact(sun_at(35, azimuth), 2.0)) < 1e-7
        by_angle = harmonics.rotate_z(at_zero, np.radians(azimuth))
        np.testing.assert_allclose(turned, by_angle, 0, 1e-14)
    m = harmonics.orders(DEGREE)
    assert (np.asarray(at_zero)[:, m < 0] == 0).all()


@pytest.mark.slow
def test_derivatives_are_those_of_the_projection(fitted):
    """At the zenith and beside it too, forward and reverse."""
    suns = jnp.asarray([(0, 0, 1.0), (1e-3, -1e-3, 1), (0.3, 0.4, 0.5), (1, 0, 0.01)])
    haze = jnp.full(4, 1.7)
    steps = 1e-5 * jnp.concatenate([jnp.eye(4), -jnp.eye(4)])  # x, y, z, haze
    moved = exact(suns[:, None] + steps[None, :, :3], (1.7 + steps[:, 3])[None])
    slopes = np.moveaxis(np.asarray(moved[:, :4] - moved[:, 4:]), 1, -1) / 2e-5
    for jacobian in (jax.jacfwd, jax.jacrev):
        found = jax.jit(jax.vmap(jacobian(fitted, (0, 1))))(suns, haze)
        np.testing.assert_allclose(found[0], slopes[..., :3], 0, 1e-5)
        np.testing.assert_allclose(found[1], slopes[..., 3], 0, 1e-5)


@pytest.mark.slow
def test_second_derivatives(fitted):
    """Across the zenith, where the height's square changes from a series to an arctangent."""
    slope = jax.jit(jax.vmap(jax.grad(lambda sun: fitted(sun, 1.7).sum())))
    suns = jnp.asarray([(0, 0, 1.0), (0.0031, 0, 1), (0.0033, 0, 1), (0.3, 0.4, 0.5)])
    second = jax.vmap(jax.jacfwd(lambda sun: slope(sun[None])[0]))(suns)
    for i in range(3):
        step = 1e-5 * np.eye(3)[i][None]
        numeric = (slope(suns + step) - slope(suns - step)) / 2e-5
        np.testing.assert_allclose(second[..., i], numeric, 0, 1e-4)


def test_outside_of_the_range(fitted):
    with pytest.raises(ValueError, match=r"up to 90 degrees from the zenith, got 91"):
        fitted(sun_at(-1), 2.0)
    with pytest.raises(ValueError, match=r"haze in \[1, 3\], got 3.5"):
        fitted(sun_at(10), np.array([2.0, 3.5]))
    suns = sun_at(np.array([10.0, -1.0, 10.0]))
    inside = np.isfinite(eqx.filter_jit(fitted)(suns, np.array([2.0, 2.0, 0.5]))).all(axis=(1, 2))
    assert inside.tolist() == [True, False, False]
    assert np.isfinite(fitted(sun_at(0).astype("f4"), np.float32(3))).all()
    assert np.isfinite(fitted(np.array([1, 0, -1e-8], "f4"), 1.0)).all()


def test_truncation(fitted):
    low = fitted.truncated(1)
    assert low.degree == 1
    np.testing.assert_allclose(
        low(sun_at(35, 10), 2.0), fitted(sun_at(35, 10), 2.0)[:, :4], 0, 1e-15
    )
    with pytest.raises(ValueError, match="of degree 3, got degree 4"):
        fitted.truncated(4)


def test_skies_that_are_refused():
    def leans(view, sun, haze):
        return (1 + view[:, :1]) * haze

    with pytest.raises(ValueError, match="must turn with the sun"):
        sky.fit(leans, HAZE, **OPTIONS)
    with pytest.raises(ValueError, match="mirror image"):
        sky.fit(lambda v, s, h: 1 + jnp.cross(v, s[None])[:, 2:] + 0 * h, HAZE, **OPTIONS)
    with pytest.raises(ValueError, match=r"not finite at .* degrees"):
        sky.fit(lambda v, s, h: v[:, 2:] / jnp.where(h > 2.5, 0.0, h), HAZE, **OPTIONS)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"parameters": {"haze": (3.0, 1.0)}}, r"range of haze must be .*low < high, got \(3.0"),
        ({"parameters": {"haze": (0.0, 1.0)}}, r"0 < low < high"),
        ({"log": ["smoke"]}, "no parameter: smoke"),
        ({"terms": (4,)}, "expected 2 positive terms"),
        ({"samples": (4, 0)}, "samples must be an integer >= 1, got 0"),
        ({"samples": (4, 9)}, "at least as many samples as terms"),
        ({"zenith": 4.0}, r"angle in \(0, π\)"),
        ({"degree": -1}, "degree must be"),
        ({"solver": "newton"}, "solver must be one of gauss-newton"),
    ],
)
def test_bad_options(options, message, unchecked):
    options = {"parameters": HAZE} | OPTIONS | options
    with pytest.raises(ValueError, match=message):
        sky.fit(haze_sky, **options)


def test_bad_calls(fitted, unchecked):
    with pytest.raises(ValueError, match="expected as parameters haze, got 0"):
        fitted(sun_at(10))
    with pytest.raises(ValueError, match=r"sun \(..., 3\)"):
        fitted(np.zeros(4), 2.0)
    with pytest.raises(ValueError, match=r"leading axes must broadcast, got sun"):
        fitted(sun_at(np.array([10.0, 20])), np.array([1.5, 2, 2.5]))


def test_the_basis():
    x = np.linspace(-1, 1, 9)
    exact = np.polynomial.chebyshev.chebvander(x, 5).T
    for times in (1, 10):  # as products, and by recursion: 1.1e-15 and 4e-16 off
        rows = _polynomials.chebyshev(jnp.tile(x, times), 6)
        np.testing.assert_allclose(rows, np.tile(exact, times), 0, 2e-15)
    assert _polynomials.chebyshev(jnp.asarray(x), 1).shape == (1, 9)
    np.testing.assert_allclose(_sky_fit.monomials(jnp.asarray(x), 4), np.vander(x, 4).T[::-1])
    axis = sky.Axis("haze", 1.0, 3.0, log=True)
    nodes = axis.nodes(5)
    np.testing.assert_allclose(
        _polynomials.chebyshev(axis.scaled(jnp.asarray(nodes)), 6)[5], 0, 0, 1e-14
    )
    assert (np.diff(nodes) > 0).all()


def test_why_chebyshev():
    """The condition of the paper's basis at degree (13, 7), and ours."""
    height, turbidity = (
        sky.Axis("θ", 0.0, np.pi / 2),
        sky.Axis("turbidity", 2.5, 6.0),
    )
    nodes = np.meshgrid(height.nodes(28), turbidity.nodes(16), indexing="ij")
    theta, tau = (jnp.asarray(a.ravel()) for a in nodes)
    raw = _sky_fit.tensor([_sky_fit.monomials(theta, 14), _sky_fit.monomials(tau, 8)])
    good = _fit.design((height, turbidity), (theta, tau), (14, 8))
    assert np.linalg.cond(raw.T) > 1e15
    assert np.linalg.cond(good.T) < 2.1


@pytest.mark.parametrize("count", [3, 40])  # as products, and by recursion
def test_circular_rows_are_powers_of_a_complex_number(count):
    random = np.random.default_rng(0)
    x, y = random.uniform(-1, 1, (2, count))
    powers = (x + 1j * y) ** np.arange(7)[:, None]
    exact = np.concatenate([powers.imag[:0:-1], powers.real])
    rows = _polynomials.circular(jnp.asarray(x), jnp.asarray(y), 6)
    np.testing.assert_allclose(rows, exact, 0, 1e-14)
