"""Preetham's radiance against a second derivation, its symmetries, its kinks and its range."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from second_derivation import XYZ_TO_SRGB, preetham_xyy, xyy_to_xyz
from suns import sun_at, upper_directions

from jaxsh import sky
from jaxsh.sky._angles import angles
from jaxsh.sky._color import from_xyy

ZENITH = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("constants", ["paper", "code"])
def test_against_the_second_derivation(rng, constants):
    count = 200
    theta, phi = rng.uniform(0, np.pi / 2, count), rng.uniform(-np.pi, np.pi, count)
    theta_sun, azimuth = rng.uniform(0, np.pi / 2, count), rng.uniform(-np.pi, np.pi, count)
    turbidity = rng.uniform(1.7, 10, count)
    view = sun_at(90 - np.degrees(theta), np.degrees(azimuth + phi))
    sun = sun_at(90 - np.degrees(theta_sun), np.degrees(azimuth))
    expected = np.array(
        [
            preetham_xyy(*row, constants)
            for row in zip(theta, phi, theta_sun, turbidity, strict=True)
        ]
    )
    xyz = np.array([xyy_to_xyz(row) for row in expected])
    for space, wanted, tolerance in [
        ("xyY", expected, 1e-13),
        ("xyz", xyz, 1e-13),
        ("srgb", xyz @ XYZ_TO_SRGB.T, 1e-8),  # a matrix printed to nine figures
    ]:
        found = sky.preetham_radiance(view, sun, turbidity, constants=constants, space=space)
        scale = np.abs(wanted).max(axis=-1, keepdims=True)
        np.testing.assert_allclose(found / scale, wanted / scale, 0, tolerance, err_msg=space)


def test_the_matrix_sends_white_to_ones_and_primaries_to_the_axes():
    white = xyy_to_xyz([0.3127, 0.3290, 1.0])
    np.testing.assert_allclose(sky.xyz_to_srgb() @ white, np.ones(3), 1e-15)
    for i, (x, y) in enumerate([(0.64, 0.33), (0.30, 0.60), (0.15, 0.06)]):
        seen = sky.xyz_to_srgb() @ xyy_to_xyz([x, y, 1.0])
        np.testing.assert_allclose(seen / seen[i], np.eye(3)[i], 0, 1e-14)
    np.testing.assert_allclose(sky.xyz_to_srgb(), XYZ_TO_SRGB, 0, 5e-9)


def test_grey_is_grey():
    gray = from_xyy(jnp.array(0.3127), jnp.array(0.3290), jnp.array(0.18), "srgb")
    np.testing.assert_allclose(gray, 0.18, 1e-14)


def test_the_two_sets_of_constants_differ_by_what_the_notes_say():
    view = upper_directions(np.random.default_rng(1), 4000)
    worst = 0.0
    for elevation, turbidity in itertools.product([0, 5, 30, 90], [2.0, 2.5, 6.0]):
        paper, code = (
            sky.preetham_radiance(view, sun_at(elevation), turbidity, constants=name)
            for name in ("paper", "code")
        )
        worst = max(worst, np.abs(paper - code).max() / np.abs(paper).max())
    assert 0.003 < worst < 0.008


def test_zenith_is_the_zenith_value(rng):
    """At θ = 0 the quotient of F is one."""
    sun, turbidity = upper_directions(rng, 20), rng.uniform(1.7, 10, 20)
    found = sky.preetham_radiance(ZENITH, sun, turbidity, space="xyY")
    chi = (4 / 9 - turbidity / 120) * (np.pi - 2 * np.arccos(sun[:, 2]))
    expected = (4.0453 * turbidity - 4.9710) * np.tan(chi) - 0.2155 * turbidity + 2.4192
    np.testing.assert_allclose(found[:, 2], expected, 1e-12)


def test_mirrored_in_the_suns_meridian(rng):
    view, sun = upper_directions(rng, 50), sun_at(20.0)
    mirrored = view * [1, -1, 1]
    np.testing.assert_array_equal(
        sky.preetham_radiance(view, sun, 3.0), sky.preetham_radiance(mirrored, sun, 3.0)
    )


def test_turned_about_the_zenith(rng):
    view, sun, angle = upper_directions(rng, 50), upper_directions(rng, 1)[0], 1.234
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    np.testing.assert_allclose(
        sky.preetham_radiance(view @ turn.T, turn @ sun, 3.0),
        sky.preetham_radiance(view, sun, 3.0),
        1e-12,
    )


def test_lengths_do_not_matter(rng):
    view, sun = upper_directions(rng, 50), sun_at(20.0, 30.0)
    np.testing.assert_allclose(
        sky.preetham_radiance(1e-6 * view, 1e6 * sun, 3.0),
        sky.preetham_radiance(view, sun, 3.0),
        1e-13,
    )


def test_dark_below_the_horizon_and_the_sky_on_it(rng):
    below = upper_directions(rng, 50) * [1, 1, -1]
    found = sky.preetham_radiance(np.vstack([below, [[1, 0, -1e-300]]]), sun_at(20.0), 3.0)
    np.testing.assert_array_equal(found, 0.0)
    on = sky.preetham_radiance(np.array([0.6, 0.8, 0.0]), sun_at(20.0), 3.0)
    above = sky.preetham_radiance(np.array([0.6, 0.8, 1e-9]), sun_at(20.0), 3.0)
    np.testing.assert_allclose(on, above, 1e-8)


def test_blue_is_negative_at_sunset_and_stays_so():
    sun = sun_at(0.0)
    assert sky.preetham_radiance(sun, sun, 2.5)[2] == pytest.approx(-0.7131, abs=1e-4)


def test_luminance_is_positive_wherever_the_model_is_valid(rng):
    view = np.vstack([upper_directions(rng, 300), sun_at(0.0, np.linspace(0, 180, 30))])
    sun, turbidity = sun_at(np.linspace(0, 90, 31)), np.linspace(1.7, 10, 21)
    found = sky.preetham_radiance(
        view[:, None, None], sun[None, :, None], turbidity[None, None, :], space="xyY"
    )
    assert found[..., 2].min() > 0


@pytest.mark.parametrize("angle", [1e-12, 1e-8, 1e-4, 1.0, np.pi - 1e-4, np.pi - 1e-8])
def test_the_angle_to_the_sun_keeps_its_digits(angle):
    sun = jnp.array([0.0, 0.0, 1.0])
    view = jnp.array([np.sin(angle), 0.0, np.cos(angle)])
    near = min(angle, np.pi - angle)
    gamma = angles(view, sun).gamma
    assert abs(gamma - angle) < 1e-15 + 1e-15 * near + 5e-16 * angle


POINTS = {
    "zenith": (ZENITH, sun_at(40.0, 10.0)),
    "horizon": (np.array([0.6, 0.8, 0.0]), sun_at(40.0, 10.0)),
    "just above the horizon": (np.array([0.6, 0.8, 1e-8]), sun_at(40.0, 10.0)),
    "just below the horizon": (np.array([0.6, 0.8, -1e-8]), sun_at(40.0, 10.0)),
    "the sun": (sun_at(40.0, 10.0), sun_at(40.0, 10.0)),
    "beside the sun": (sun_at(40.0 + 1e-9, 10.0), sun_at(40.0, 10.0)),
    "sun in the zenith": (ZENITH, ZENITH),
    "away from a sun in the zenith": (sun_at(40.0, 10.0), ZENITH),
    "the antisolar point": (np.array([-1.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0])),
    "the nadir": (-ZENITH, ZENITH),
}


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.slow
def test_derivatives_are_finite_everywhere(dtype):
    view, sun = (jnp.asarray(v, dtype) for v in map(np.stack, zip(*POINTS.values(), strict=True)))
    turbidity = jnp.asarray(2.0, dtype)
    for mode in (jax.jacfwd, jax.jacrev) if dtype == np.float64 else (jax.jacrev,):
        derivative = mode(sky.preetham_radiance, argnums=(0, 1, 2))
        found = jax.jit(jax.vmap(derivative, in_axes=(0, 0, None)))(view, sun, turbidity)
        for d in found:
            assert d.dtype == dtype
            for name, values in zip(POINTS, d, strict=True):
                assert np.isfinite(values).all(), name
            np.testing.assert_array_equal(d[list(POINTS).index("the nadir")], 0.0)


def slope(f, h):
    """f'(0) by five points."""
    f = [np.asarray(f(k * h)) for k in (-2, -1, 1, 2)]
    return (f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * h)


def test_derivatives_forward_reverse_and_by_differences(rng):
    view, sun = upper_directions(rng, 6), upper_directions(rng, 6)
    turbidity = jnp.asarray(rng.uniform(2, 9, 6))

    radiance = jax.jit(sky.preetham_radiance)
    primals = tuple(jnp.asarray(a) for a in (view, sun, turbidity))
    tangents = tuple(jnp.asarray(rng.normal(size=a.shape)) for a in primals)
    cotangent = rng.normal(size=(6, 3))

    @jax.jit
    def derivatives(*primals):
        _, push = jax.linearize(sky.preetham_radiance, *primals)
        return push(*tangents), jax.linear_transpose(push, *primals)(jnp.asarray(cotangent))

    forward, reverse = jax.tree.map(np.asarray, derivatives(*primals))
    numerical = slope(
        lambda h: radiance(*(p + h * t for p, t in zip(primals, tangents, strict=True))), 1e-4
    )
    np.testing.assert_allclose(forward, numerical, 1e-6, 1e-7)
    pairing = sum(np.sum(r * np.asarray(t)) for r, t in zip(reverse, tangents, strict=True))
    assert pairing == pytest.approx(np.sum(cotangent * forward), rel=1e-11)


@pytest.mark.parametrize(
    ("views", "suns", "turbidities"),
    [((), (), ()), ((5,), (), ()), ((), (4,), (4,)), ((2, 5), (5,), ()), ((5,), (2, 1), (2, 5))],
)
def test_batches_broadcast(rng, views, suns, turbidities):
    view = upper_directions(rng, 10)[: int(np.prod(views))].reshape(*views, 3)
    sun = upper_directions(rng, 10)[: int(np.prod(suns))].reshape(*suns, 3)
    turbidity = rng.uniform(2, 9, turbidities)
    found = sky.preetham_radiance(view, sun, turbidity)
    batch = np.broadcast_shapes(views, suns, turbidities)
    assert found.shape == (*batch, 3)
    each = [
        sky.preetham_radiance(v, s, t)
        for v, s, t in zip(
            np.broadcast_to(view, (*batch, 3)).reshape(-1, 3),
            np.broadcast_to(sun, (*batch, 3)).reshape(-1, 3),
            np.broadcast_to(turbidity, batch).ravel(),
            strict=True,
        )
    ]
    np.testing.assert_allclose(found.reshape(-1, 3), each, 1e-13)


def test_jit_vmap_and_single_precision(rng):
    view, sun = upper_directions(rng, 30), sun_at(35.0)
    expected = sky.preetham_radiance(view, sun, 3.0)
    np.testing.assert_allclose(jax.jit(sky.preetham_radiance)(view, sun, 3.0), expected, 1e-13)
    mapped = jax.vmap(sky.preetham_radiance, in_axes=(0, None, None))(view, sun, 3.0)
    np.testing.assert_allclose(mapped, expected, 1e-13)
    single = sky.preetham_radiance(np.float32(view), np.float32(sun), 3.0)
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, expected, 2e-5)


OUT_OF_RANGE = [
    (sun_at(30.0), 1.5, r"turbidity must be in \[1\.7, 10\], got 1\.5"),
    (sun_at(30.0), 10.5, r"turbidity must be in \[1\.7, 10\], got 10\.5"),
    (sun_at(30.0), np.nan, r"turbidity must be in \[1\.7, 10\], got nan"),
    (sun_at(-3.0), 3.0, r"sun must be at 0 to 90 degrees above the horizon, got -3"),
]


@pytest.mark.parametrize(("sun", "turbidity", "message"), OUT_OF_RANGE)
def test_out_of_range_is_refused_warned_about_or_allowed(sun, turbidity, message):
    view = np.array([[0.0, 0.6, 0.8], [0.6, 0.0, 0.8]])
    for call in (
        lambda **options: sky.preetham_radiance(view, sun, turbidity, **options),
        lambda **options: sky.project_preetham(sun, turbidity, 2, **options),
    ):
        with pytest.raises(ValueError, match=message):
            call()
        with pytest.warns(sky.SkyWarning, match=message):
            warned = call(check="warn")
        np.testing.assert_array_equal(warned, call(check="allow"))


def test_negative_luminance_is_refused():
    """Below a turbidity of 1.65 the quotient of F changes sign: nothing is clamped silently."""
    with (
        pytest.warns(sky.SkyWarning, match="turbidity"),
        pytest.warns(sky.SkyWarning, match="luminance must be at least 0"),
    ):
        found = sky.preetham_radiance(
            np.array([1.0, 0.0, 0.05]), sun_at(30.0), 1.5, space="xyY", check="warn"
        )
    assert found[2] < 0


def test_the_ends_of_the_range_are_in_it():
    for dtype in (np.float32, np.float64):
        for turbidity in (1.7, 10.0):
            for sun in ([0, 0, 1], [1, 0, -1e-8]):
                found = sky.preetham_radiance(
                    np.array([0.6, 0, 0.8], dtype), np.array(sun, dtype), np.array(turbidity, dtype)
                )
                assert np.isfinite(found).all()


def test_values_inside_jit_are_not_looked_at():
    found = jax.jit(sky.preetham_radiance)(ZENITH, sun_at(-3.0), 1.0)
    assert np.isfinite(found).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"space": "lab"}, "space must be one of srgb, xyz, xyY, got 'lab'"),
        ({"constants": "mine"}, "constants must be one of paper, code, got 'mine'"),
        ({"check": "maybe"}, "check must be one of raise, warn, allow, got 'maybe'"),
    ],
)
def test_unknown_options_are_refused(options, message, unchecked):
    with pytest.raises(ValueError, match=message):
        sky.preetham_radiance(ZENITH, ZENITH, 3.0, **options)
    with pytest.raises(ValueError, match=message):
        sky.project_preetham(ZENITH, 3.0, **options)


def test_wrong_shapes_are_refused(unchecked):
    with pytest.raises(ValueError, match=r"expected view \(\.\.\., 3\).*got shape \(2,\)"):
        sky.preetham_radiance(np.ones(2), ZENITH, 3.0)
    with pytest.raises(ValueError, match=r"expected sun \(\.\.\., 3\).*got shape \(\)"):
        sky.preetham_radiance(ZENITH, 1.0, 3.0)
    with pytest.raises(ValueError, match="must broadcast, got view"):
        sky.preetham_radiance(np.ones((4, 3)), ZENITH, np.full(3, 3.0))
