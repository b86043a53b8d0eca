"""The sky on a mesh of devices: suns, views and lights keep their sharding."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.sharding import AxisType
from sharding import ROWS, WHOLE, P, check_sharded, longest_exchange
from suns import upper_directions

from jaxsh import sky
from jaxsh.sky import _hosek, _solve

COUNT = 6
SECOND = P(None, "rows")


@pytest.fixture
def sky_of(rng):
    """Views, suns and turbidities, one of each for a row."""
    turbidity = rng.uniform(2.6, 5.9, COUNT)
    return upper_directions(rng, COUNT), upper_directions(rng, COUNT), turbidity


@pytest.fixture
def hosek_tables(rng, monkeypatch):
    """Numbers of the size of the model's own, whose file is in the wheel of another package."""
    tables = rng.uniform(0.1, 0.5, size=(10, 2, 6, 3, 10))
    monkeypatch.setattr(_hosek, "_tables", lambda: tables)


@pytest.mark.slow
def test_radiance(sky_of, hosek_tables):
    view, sun, turbidity = sky_of
    for model in (
        sky.preetham_radiance,
        sky.hosek_radiance,
        lambda v, s, t: sky.cie_radiance(v, s, t, kind=12),
    ):
        check_sharded(lambda *a, model=model: model(*a), (view, sun, turbidity), (ROWS,) * 3, ROWS)
    check_sharded(lambda s, t: sky.sun_radiance(s, t), (sun, turbidity), (ROWS,) * 2, ROWS)
    check_sharded(lambda s, t: sky.sun_harmonics(s, t, 2), (sun, turbidity), (ROWS,) * 2, ROWS)


@pytest.mark.slow
def test_many_views_of_one_sky(sky_of):
    view, sun, turbidity = sky_of
    gradient = jax.grad(lambda v, s, t: sky.preetham_radiance(v, s, t).sum())
    specs = ROWS, WHOLE, WHOLE
    check_sharded(gradient, (view, sun[0], turbidity[0]), specs, ROWS)


@pytest.mark.slow
def test_stored_fits(sky_of):
    _, *suns = sky_of
    window = functools.partial(sky.preetham_harmonics, degree=2, window="hann")
    gradient = jax.grad(lambda s, t: sky.preetham_harmonics(s, t, 1).sum())
    fit = sky.preetham_table("small", 2)
    for function in (window, gradient, lambda s, t: fit.truncated(1)(s, t)):
        check_sharded(function, suns, (ROWS,) * 2, ROWS)


@pytest.mark.slow
def test_projection(sky_of):
    _, *suns = sky_of
    exact = functools.partial(sky.project_preetham, degree=1)
    check_sharded(exact, suns, (ROWS,) * 2, ROWS)

    def slopes(sun, haze):  # of a sky that compiles faster
        def value(s, h):
            return sky.project(glow, s, h, degree=1, symmetric=True)[..., 2].sum()

        return jax.grad(value, (0, 1))(sun, haze)

    check_sharded(slopes, suns, (ROWS,) * 2, (ROWS, ROWS))


@pytest.mark.slow
def test_batches_of_two_axes(sky_of):
    """Suns by turbidities: one axis is shared out, and never made one with the other."""
    _, sun, turbidity = sky_of
    for function in (functools.partial(sky.preetham_harmonics, degree=1), sky.smallest_luminance):
        check_sharded(
            lambda s, t, function=function: function(s[:, None], t),
            (sun, turbidity[:3]),
            (ROWS, WHOLE),
            ROWS,
        )


@pytest.mark.parametrize(
    "reading",
    ["luminance", *(pytest.param(r, marks=pytest.mark.slow) for r in ("channel", "harmonics"))],
)
def test_smallest_luminance(sky_of, reading):
    _, *suns = sky_of
    smallest = functools.partial(sky.smallest_luminance, reading=reading, degree=1)
    check_sharded(smallest, suns, (ROWS,) * 2, ROWS)


def test_smallest_of_a_range_that_is_shared_out(sky_of):
    _, *suns = sky_of
    mesh = jax.make_mesh((2,), ("rows",), axis_types=(jax.sharding.AxisType.Explicit,))
    placed = jax.device_put(suns, jax.NamedSharding(mesh, ROWS))
    found, expected = (sky.smallest_luminance(*at, reading="range") for at in (placed, suns))
    assert jax.typeof(found).sharding.spec[0] == "rows"
    np.testing.assert_allclose(found, expected, 1e-12)


def test_ground_and_errors(rng):
    light, exact = rng.normal(size=(2, COUNT, 3, 9))
    low = rng.uniform(1, 2, size=(COUNT, 3))
    check_sharded(lambda c: sky.with_ground(c, 0.3), (light,), (ROWS,), ROWS)
    check_sharded(lambda c: sky.horizontal_irradiance(c), (light,), (ROWS,), ROWS)
    check_sharded(
        lambda *a: tuple(sky.fit_error(*a)), (light, exact, low), (ROWS,) * 3, (ROWS, ROWS)
    )


def glow(view, sun, haze):
    return jnp.exp(haze * (view @ sun))[:, None]


@pytest.mark.parametrize("solver", ["qr", pytest.param("gauss-newton", marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", [AxisType.Auto, AxisType.Explicit])
@pytest.mark.slow
def test_fits_share_their_samples_out(solver, kind):
    """35 samples, so that one fills up, and two rounds of Lawson's."""
    options = {"degree": 1, "terms": (4, 2), "samples": (7, 5), "solver": solver, "lawson": 1}
    mesh = jax.make_mesh((2,), ("rows",), axis_types=(kind,))
    found, expected = (
        sky.fit(glow, {"haze": (1.0, 2.0)}, **options, devices=devices) for devices in (mesh, None)
    )
    # Of coefficients up to 3.4.
    np.testing.assert_allclose(found.coefficients, expected.coefficients, rtol=0, atol=1e-13)
    np.testing.assert_allclose(found.solution.residual, expected.solution.residual, rtol=1e-12)
    assert found.solution.steps == expected.solution.steps
    assert len(found.coefficients.sharding.device_set) == 1


@pytest.mark.slow
@pytest.mark.parametrize("kind", [AxisType.Auto, AxisType.Explicit])
@pytest.mark.parametrize("solver", ["qr", "gauss-newton"])
def test_no_device_gets_the_samples_of_another(solver, kind, rng):
    samples = rng.normal(size=(64, 3)), rng.normal(size=(5, 64)), rng.uniform(1, 2, size=(5, 64))
    mesh = jax.make_mesh((2,), ("rows",), axis_types=(kind,))
    placed = [
        jax.device_put(array, jax.NamedSharding(mesh, spec))
        for array, spec in zip(samples, (ROWS, SECOND, SECOND), strict=True)
    ]
    values, solution = sky.least_squares(*placed, solver=solver)
    expected, alone = sky.least_squares(*map(jnp.asarray, samples), solver=solver)
    np.testing.assert_allclose(values, expected, rtol=0, atol=1e-14)
    np.testing.assert_allclose(solution.residual, alone.residual, rtol=1e-14)
    arguments = *placed, _solve._named(solver, placed[0].dtype), 9
    compiled = _solve._solve.lower(*arguments).compile().compiled
    assert 0 < longest_exchange(compiled) < 64


def test_another_device_than_the_first(sky_of):
    """Nothing that is kept is tied to the device that it was first used on."""
    _, sun, turbidity = sky_of
    first, second = jax.devices()[:2]
    expected = np.asarray(sky.preetham_harmonics(sun, turbidity, 1))
    found = sky.preetham_harmonics(*jax.device_put((sun, turbidity), second), 1)
    assert found.devices() == {second}
    np.testing.assert_array_equal(found, expected)
    with jax.default_device(second):
        assert sky.preetham_table("small", 1).coefficients.devices() == {second}
    assert sky.preetham_table("small", 1).coefficients.devices() == {first}
