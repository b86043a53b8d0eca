"""CIE's standard skies, Hosek and Wilkie's, and the ground below any of them."""

import functools
import itertools
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from second_derivation import (
    cie_ratio,
    hosek_spectrum,
    hosek_sun_spectrum,
    observers_luminance,
)
from suns import sun_at, upper_directions

from jaxsh import harmonics, sky
from jaxsh.sky import _hosek
from jaxsh.sky._hosek import read_tensors


@pytest.mark.parametrize("kind", range(1, 16))
def test_cie_against_the_standards_formula(rng, kind):
    view, sun = upper_directions(rng, 30), sun_at(37.0, 20.0)
    found = sky.cie_radiance(view, sun, 2.5, kind=kind)
    expected = [2.5 * cie_ratio(v, sun, kind) for v in view]
    for channel in range(3):
        np.testing.assert_allclose(found[:, channel], expected, 1e-12)


def test_cie_by_hand(rng):
    """Type 1 is near Moon and Spencer's overcast sky (1 + 2 cos Z)/3; type 5 is uniform."""
    view, sun = upper_directions(rng, 20), sun_at(50.0)
    np.testing.assert_allclose(sky.cie_radiance(view, sun, 3.0, kind=5), 3.0, 1e-14)
    overcast = sky.cie_radiance(view, sun, kind=1)[:, 0]
    np.testing.assert_allclose(overcast, (1 + 2 * view[:, 2]) / 3, 0, 0.09)
    zenith = np.array([0.0, 0.0, 1.0])
    for kind in range(1, 16):
        np.testing.assert_allclose(sky.cie_radiance(zenith, sun, 7.0, kind=kind), 7.0, 1e-13)
        assert np.all(sky.cie_radiance(-view, sun, kind=kind) == 0)


@pytest.mark.slow
def test_cie_is_a_model():
    model = functools.partial(sky.cie_radiance, kind=12)
    sun = sun_at(np.array([60.0, 5.0]))
    found = sky.project(model, sun, 2.0, degree=4, symmetric=True)
    assert np.all(found[..., harmonics.orders(4) < 0] == 0)
    whole = sky.project(model, sun, 2.0, degree=4)
    np.testing.assert_allclose(found, whole, 0, 1e-13 * float(jnp.abs(whole).max()))
    constant = sky.project(functools.partial(sky.cie_radiance, kind=5), sun, 2.0, degree=1)
    np.testing.assert_allclose(sky.horizontal_irradiance(constant), 2 * math.pi, 1e-13)


def test_cie_derivatives_are_finite():
    places = [sun_at(40.0), np.array([0.0, 0, 1]), np.array([1.0, 0, 0]), np.array([-1.0, 0, 0])]
    for kind in (1, 15):
        radiance = functools.partial(sky.cie_radiance, kind=kind)
        derivative = jax.jit(jax.vmap(jax.jacrev(radiance, argnums=(0, 1, 2)), (0, 0, None)))
        view, sun = (jnp.stack(t) for t in zip(*itertools.product(places, places), strict=True))
        assert all(np.isfinite(d).all() for d in derivative(view, sun, jnp.asarray(1.0)))


@pytest.mark.parametrize("kind", [0, 16, 2.5, "clear"])
def test_cie_kinds_are_one_to_fifteen(kind, unchecked):
    with pytest.raises(ValueError, match="kind must be an integer from 1 to 15, got"):
        sky.cie_radiance(sun_at(90.0), sun_at(40.0), kind=kind)


def test_cie_looks_at_the_sun():
    with pytest.raises(ValueError, match="sun must be at 0 to 90 degrees"):
        sky.cie_radiance(sun_at(90.0), sun_at(-40.0), kind=12)


def test_ground_under_an_even_sky():
    """E = π L, so white ground below it completes the sphere to a constant light."""
    even = sky.project(lambda view, sun: jnp.ones((len(view), 3)), sun_at(40.0), degree=5)
    whole = sky.with_ground(even, 1.0)
    expected = np.zeros((3, 36))
    expected[:, 0] = math.sqrt(4 * math.pi)
    np.testing.assert_allclose(whole, expected, 0, 1e-13)


@pytest.mark.slow
def test_irradiance_is_exact_at_every_degree():
    """Against the integral of radiance · cos θ, the sun's disc and the sky together."""
    sun = sun_at(30.0, 70.0)
    light = sky.project_preetham(sun, 3.0, 1) + sky.sun_harmonics(sun, 3.0, 1)

    def lit(view, sun, turbidity):
        return sky.preetham_radiance(view, sun, turbidity) * view[:, 2:]

    expected = math.sqrt(4 * math.pi) * sky.project(lit, sun, 3.0, degree=0)[:, 0]
    radiance = sky.sun_radiance(sun, 3.0)
    expected += radiance * math.pi * math.sin(sky.SUN_RADIUS) ** 2 * sun[2]
    np.testing.assert_allclose(sky.horizontal_irradiance(light), expected, 1e-12)


def test_ground_against_projection():
    albedo, sun = np.array([0.1, 0.3, 0.5]), sun_at(30.0)
    light = sky.project_preetham(sun, 3.0, 6)
    found = sky.with_ground(light, albedo) - light
    node, weight = np.polynomial.legendre.leggauss(8)
    z = (node - 1) / 2
    meridian = harmonics.evaluate(np.stack([np.sqrt(1 - z**2), 0 * z, z], axis=-1), 6)
    step = np.where(harmonics.orders(6) == 0, weight * np.pi @ np.asarray(meridian), 0.0)
    irradiance = np.asarray(sky.horizontal_irradiance(light))
    radiance = (albedo * irradiance)[:, None] / math.pi
    np.testing.assert_allclose(found, radiance * step, 0, 1e-13 * radiance.max())
    # What the ground sends down: an upside-down level surface sees it with E = π · radiance.
    down = -math.sqrt(4 * math.pi / 3) * found[:, harmonics.index(1, 0)]
    np.testing.assert_allclose(down, math.pi * radiance[:, 0], 1e-13)


@pytest.mark.slow
def test_ground_broadcasts_and_differentiates():
    light = sky.project_preetham(sun_at(np.array([20.0, 50.0])), 3.0, 2)
    many = sky.with_ground(light, np.array([[[0.1]], [[0.2]], [[0.3]]]))
    assert many.shape == (3, 2, 3, 9)
    np.testing.assert_allclose(many[1], sky.with_ground(light, 0.2), 1e-14)
    slope = jax.grad(lambda a: sky.with_ground(light, a)[0, 0, 0])(0.2)
    expected = sky.with_ground(light, 1.0) - light
    assert slope == pytest.approx(float(expected[0, 0, 0]), rel=1e-12)
    single = sky.with_ground(np.float32(light), np.float32(0.2))
    assert single.dtype == np.float32


def test_bad_grounds_are_refused(unchecked):
    light = np.ones((3, 4))
    for albedo in (-0.1, 1.1, np.nan):
        with pytest.raises(ValueError, match=r"albedo must be in \[0, 1\]"):
            sky.with_ground(light, albedo)
    with pytest.raises(ValueError, match="degree 1 or more"):
        sky.with_ground(np.ones((3, 1)), 0.1)
    with pytest.raises(ValueError, match="must broadcast"):
        sky.with_ground(light, np.full(2, 0.1))
    with pytest.raises(ValueError, match=r"light \(\.\.\., channels, K\)"):
        sky.with_ground(np.ones(4), 0.1)


class TestHosek:
    @pytest.fixture(autouse=True)
    def installed(self):
        self.mitsuba = pytest.importorskip("mitsuba")

    @pytest.mark.parametrize(
        ("turbidity", "albedo", "elevation"),
        [(1.0, 0.0, 40.0), (2.3, 0.3, 10.0), (3.0, 0.3, 1.0), (6.7, 1.0, 80.0), (10.0, 0.5, 3.0)],
    )
    def test_against_mitsubas_own_evaluation(self, rng, turbidity, albedo, elevation):
        mi = self.mitsuba
        mi.set_variant("scalar_rgb")
        view, sun = upper_directions(rng, 20), sun_at(elevation, 30.0)
        emitter = mi.load_dict(
            {
                "type": "sunsky",
                "turbidity": turbidity,
                "albedo": {"type": "rgb", "value": [albedo] * 3},
                "sun_direction": sun.tolist(),
                "sun_scale": 0.0,
            }
        )
        expected = []
        for direction in view:
            interaction = mi.SurfaceInteraction3f()
            interaction.wi = -mi.Vector3f(*direction)
            expected.append(np.array(emitter.eval(interaction)))
        # Mitsuba divides by the sum of ȳ, and works in single precision.
        scale = 0.683 * 106.7502593994140625
        found = sky.hosek_radiance(view, sun, turbidity, albedo)
        np.testing.assert_allclose(found, scale * np.array(expected), 5e-6)

    def test_the_unit_is_that_of_the_spectral_tables(self):
        """Those are in W/(m² sr nm), known every 40 nm: 683 lm/W of their integral."""
        tensors = read_tensors(_hosek._table_path())
        view, sun = sun_at(40.0, 50.0), sun_at(60.0)
        wavelengths, spectrum = hosek_spectrum(tensors, view, sun, 3)
        expected = 0.683 * observers_luminance(wavelengths, spectrum)
        found = sky.hosek_radiance(view, sun, 3.0, 0.0) @ np.array([0.2126, 0.7152, 0.0722])
        assert found == pytest.approx(expected, rel=0.02)

    def test_it_is_a_model_with_finite_derivatives(self):
        sun = sun_at(np.array([40.0, 3.0]))
        found = sky.project(sky.hosek_radiance, sun, 3.0, 0.2, degree=3, symmetric=True)
        assert found.shape == (2, 3, 16)
        assert np.all(sky.horizontal_irradiance(found) > 0)
        derivative = jax.vmap(
            jax.jacrev(sky.hosek_radiance, argnums=(0, 1, 2, 3)), (0, 0, None, None)
        )
        view = sun = jnp.asarray(sun_at(np.array([0.0, 90.0, 30.0])))
        found = jax.jit(derivative)(view, sun, jnp.asarray(3.0), jnp.asarray(0.2))
        assert all(np.isfinite(d).all() for d in found)

    def test_ranges(self):
        with pytest.raises(ValueError, match=r"turbidity must be in \[1, 10\]"):
            sky.hosek_radiance(sun_at(90.0), sun_at(40.0), 11.0)
        with pytest.raises(ValueError, match=r"albedo must be in \[0, 1\]"):
            sky.hosek_radiance(sun_at(90.0), sun_at(40.0), 3.0, 1.5)


@pytest.mark.parametrize(
    ("turbidity", "elevation", "ratio"), [(6, 5.0, 0.026), (3, 30.0, 0.87), (2, 60.0, 1.11)]
)
def test_preethams_sun_beside_hoseks(turbidity, elevation, ratio):
    """What the docstrings of `sun_radiance` and `hosek_radiance` say of their suns."""
    try:
        tensors = read_tensors(_hosek._table_path())
    except ImportError:
        pytest.skip("mitsuba is not installed")
    spectrum = hosek_sun_spectrum(tensors, np.radians(elevation), turbidity)
    theirs = 0.683 * observers_luminance(np.arange(320, 721, 40), spectrum)
    ours = sky.sun_radiance(sun_at(elevation), float(turbidity), space="xyz")[1]
    assert ours / theirs == pytest.approx(ratio, rel=0.02)


def test_hosek_says_what_it_needs(monkeypatch):
    monkeypatch.setattr(_hosek.importlib.util, "find_spec", lambda name: None)
    _hosek._tables.cache_clear()
    with pytest.raises(ImportError, match="pip install mitsuba"):
        sky.hosek_radiance(sun_at(90.0), sun_at(40.0), 3.0)


def test_damaged_tensor_files_are_named(tmp_path):
    path = tmp_path / "tables.bin"
    path.write_bytes(b"something else")
    with pytest.raises(ValueError, match=r"tables\.bin: not a tensor file"):
        read_tensors(path)
    path.write_bytes(b"tensor_file\x00\x01\x00\x07\x00\x00\x00\x0f\x00sky")
    with pytest.raises(ValueError, match=r"tables\.bin: damaged tensor file"):
        read_tensors(path)
