"""Tone curve, exposure, and the measure of difference."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from jaxsh.imaging import auto_exposure, psnr, srgb_decode, srgb_encode, tone_map

DTYPES = pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])


def test_known_values_of_the_curve():
    # Middle gray of 18 % is 117.6 of 255, half the signal is 21.4 % of the light (IEC 61966-2-1).
    linear = jnp.array([0.0, 0.0031308, 0.18, 0.21404114048223255, 0.5, 1.0])
    signal = [0.0, 0.040449936, 0.46135612950044164, 0.5, 0.7353569830524495, 1.0]
    np.testing.assert_allclose(srgb_encode(linear), signal, rtol=0, atol=1e-14)
    np.testing.assert_allclose(srgb_decode(jnp.asarray(signal)), linear, rtol=0, atol=1e-14)


@DTYPES
def test_decode_inverts_encode(dtype):
    linear = jnp.linspace(-0.5, 4, 10_001, dtype=dtype)
    back = srgb_decode(srgb_encode(linear))
    assert back.dtype == dtype
    # At 0.0031308 the standard's two parts miss each other by 3e-8 of signal.
    tolerance = 1e-6 if dtype == jnp.float32 else 3e-9
    np.testing.assert_allclose(back, linear, atol=tolerance, rtol=tolerance)


@pytest.mark.parametrize("f", [srgb_encode, srgb_decode])
def test_curve_rises_and_its_gradient_is_finite(f):
    x = jnp.concatenate([jnp.linspace(-10, 10, 2001), jnp.array([0.0031308, 0.04045, 1e-300])])
    forward = jax.jvp(f, (x,), (jnp.ones_like(x),))[1]
    reverse = jax.vjp(f, x)[1](jnp.ones_like(x))[0]
    np.testing.assert_allclose(forward, reverse, rtol=1e-14)
    assert np.isfinite(forward).all()
    assert (forward > 0).all()


@pytest.mark.parametrize("x", [-1.0, 0.0, 1e-30, 0.0031308, 0.5, 1.0, 5.0, 1e30])
def test_tone_map_has_a_finite_gradient(x):
    for dtype in (jnp.float32, jnp.float64):
        value, slope = jax.value_and_grad(tone_map)(jnp.asarray(x, dtype), jnp.asarray(1, dtype))
        assert value.dtype == slope.dtype == dtype
        assert 0 <= value <= 1
        assert np.isfinite(slope)


def test_tone_map_exposes_then_clips_then_encodes(rng):
    image = jnp.asarray(rng.uniform(-0.2, 2, size=(4, 5, 3)))
    expected = srgb_encode(jnp.clip(image * 0.7, 0, 1))
    np.testing.assert_array_equal(tone_map(image, 0.7), expected)
    compiled = jax.jit(jax.vmap(tone_map, (0, None)))(image, jnp.asarray(0.7, jnp.float32))
    np.testing.assert_allclose(compiled, expected, rtol=0, atol=1e-7)  # 0.7 came as float32
    inside = jnp.asarray(rng.uniform(0.1, 0.9, size=(2, 2, 3)))
    check_grads(
        jax.jit(tone_map),
        (inside, jnp.asarray(0.7)),
        1,
        ("fwd", "rev"),
        atol=1e-7,
        rtol=1e-7,
    )


def test_reinhard_is_the_papers_curve_on_luminance(rng):
    image = jnp.asarray(rng.uniform(0, 20, size=(5, 6, 3)))
    luminance = np.asarray(image) @ np.array([0.2126, 0.7152, 0.0722]) * 0.3
    for white in (2.0, 5.0, np.inf):
        mapped = luminance * (1 + luminance / white**2) / (1 + luminance)
        color = np.asarray(image) * 0.3 * (mapped / luminance)[..., None]
        found = tone_map(image, 0.3, curve="reinhard", white=white)
        np.testing.assert_allclose(found, srgb_encode(jnp.clip(color, 0, 1)), rtol=0, atol=1e-14)
    # Gray: white is the least that becomes 1, and without one nothing does.
    gray = jnp.broadcast_to(jnp.array([0.0, 0.5, 4.0, 1e30])[:, None], (4, 3))
    found = srgb_decode(tone_map(gray, curve="reinhard", white=4.0))[:, 0]
    np.testing.assert_allclose(found, [0, 0.5 * (1 + 0.5 / 16) / 1.5, 1, 1], rtol=1e-12)
    found = srgb_decode(tone_map(gray, curve="reinhard"))[:, 0]
    np.testing.assert_allclose(found, [0, 1 / 3, 0.8, 1], rtol=1e-12)


def test_reinhard_differentiates_and_compiles(rng):
    image = jnp.asarray(rng.uniform(0.05, 2, size=(2, 3, 3)))

    def draw(image, exposure, white):
        return tone_map(image, exposure, curve="reinhard", white=white)

    arguments = (image, jnp.asarray(0.4), jnp.asarray(3.0))
    check_grads(jax.jit(draw), arguments, 1, ("fwd", "rev"), atol=1e-6, rtol=1e-6)
    draw = jax.jit(jax.value_and_grad(lambda i: tone_map(i, curve="reinhard").sum()))
    for dtype in (jnp.float32, jnp.float64):
        for x in (-1.0, 0.0, 1e-30, 1.0, 1e30):
            value, slope = draw(jnp.full(3, x, dtype))
            assert value.dtype == slope.dtype == dtype
            assert 0 <= value <= 3
            assert np.isfinite(slope).all()


def test_bad_curves_are_refused(unchecked):
    with pytest.raises(ValueError, match="curve must be one of clip, reinhard, got 'aces'"):
        tone_map(jnp.ones(3), curve="aces")  # pyright: ignore[reportArgumentType]
    with pytest.raises(
        ValueError, match=r"expected image with R, G, B in the last axis, got shape \(4, 1\)"
    ):
        tone_map(jnp.ones((4, 1)), curve="reinhard")
    for white in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match=f"white must be above 0, got {white}"):
            tone_map(jnp.ones(3), curve="reinhard", white=white)


@DTYPES
def test_auto_exposure_takes_the_percentile_of_the_object_to_one(rng, dtype):
    image = jnp.asarray(rng.uniform(0, 3, size=(30, 40, 3)), dtype)
    mask = jnp.asarray(rng.uniform(size=(30, 40)) < 0.3)
    scale = jax.jit(auto_exposure)(image, mask)
    assert scale.dtype == dtype
    brightest = np.asarray(image).max(axis=-1)[np.asarray(mask)]
    np.testing.assert_allclose(scale, 1 / np.percentile(brightest, 99), rtol=1e-6)
    np.testing.assert_allclose(auto_exposure(image, percentile=100.0), 1 / image.max(), rtol=1e-6)
    assert np.isfinite(jax.grad(auto_exposure)(image, mask)).all()


def test_auto_exposure_of_infinite_pixels_is_the_same_without_a_program():
    image = jnp.ones((2, 2, 3)).at[0].set(jnp.inf)
    program = jax.jit(auto_exposure, static_argnames="percentile")
    for percentile, expected in ((99.0, 0), (20.0, 1)):
        assert auto_exposure(image, percentile=percentile) == expected
        assert program(image, percentile=percentile) == expected


def test_auto_exposure_of_nothing_is_one():
    black = jnp.zeros((3, 3, 3))
    assert auto_exposure(black) == 1
    assert auto_exposure(black + 5, jnp.zeros((3, 3), bool)) == 1
    assert np.isfinite(jax.grad(auto_exposure)(black)).all()
    with pytest.raises(ValueError, match="percentile must be a number >= 0 and <= 100, got 101"):
        auto_exposure(black, percentile=101.0)


def test_pictures_of_integers_and_other_shapes_are_refused(unchecked):
    codes, light = jnp.full((4, 8, 3), 200, jnp.uint8), jnp.ones((4, 8, 3))
    for call in (srgb_encode, srgb_decode, tone_map, auto_exposure, lambda x: psnr(x, light)):
        with pytest.raises(ValueError, match=r"in floats, got uint8.*srgb_decode\(image / 255\)"):
            call(codes)
    for call in (auto_exposure, lambda x: psnr(x, x)):
        with pytest.raises(ValueError, match=r"got shape \(3, 8, 16\); channels come last"):
            call(jnp.ones((3, 8, 16)))
        with pytest.raises(ValueError, match=r"\(height, width, channels\), got shape \(8, 16\)"):
            call(jnp.ones((8, 16)))
    with pytest.raises(ValueError, match=r"of one shape, got \(4, 8, 3\) and \(4, 8, 1\)"):
        psnr(light, light[..., :1])
    for mask in (jnp.ones((8, 4), bool), jnp.ones((4, 8))):
        for call in (auto_exposure, lambda x, m: psnr(x, x, m)):
            with pytest.raises(ValueError, match=r"mask as booleans of shape \(4, 8\)"):
                call(light, mask)
    with pytest.raises(ValueError, match="peak must be a number > 0, got 0"):
        psnr(light, light, peak=0.0)


@DTYPES
def test_psnr_of_known_errors(dtype):
    reference = jnp.full((4, 6, 3), 0.5, dtype)
    assert psnr(reference, reference).dtype == dtype
    assert psnr(reference, reference) == jnp.inf
    np.testing.assert_allclose(psnr(reference + 0.1, reference), 20, rtol=1e-6)
    np.testing.assert_allclose(psnr(reference + 0.1, reference, peak=10.0), 40, rtol=1e-6)
    # One channel of one pixel in eight: a twenty-fourth of the square.
    spot = reference.at[1, 1, 0].add(0.1)
    mask = jnp.zeros((4, 6), bool).at[1, :].set(True).at[2, :2].set(True)
    np.testing.assert_allclose(psnr(spot, reference, mask), 20 + 10 * np.log10(24), rtol=1e-6)
    assert psnr(spot, reference, ~mask) == jnp.inf
    assert jnp.isnan(psnr(spot, reference, mask & False))


def test_psnr_differentiates_compiles_and_batches(rng):
    image, reference = jnp.asarray(rng.uniform(size=(2, 4, 5, 3)))
    mask = jnp.asarray(rng.uniform(size=(4, 5)) < 0.5)
    check_grads(
        jax.jit(lambda a, b: psnr(a, b, mask)),
        (image, reference),
        1,
        ("fwd", "rev"),
        atol=1e-5,
        rtol=1e-5,
    )
    batch = jax.jit(jax.vmap(psnr, (0, None, None)))(jnp.stack([image, reference]), reference, mask)
    np.testing.assert_allclose(batch, [float(psnr(image, reference, mask)), np.inf], rtol=1e-14)
    np.testing.assert_array_equal(jax.grad(psnr)(image, image, mask), 0)
    assert (jax.grad(psnr)(image, reference, mask)[~mask] == 0).all()
