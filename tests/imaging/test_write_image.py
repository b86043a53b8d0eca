"""Pictures to files and back."""

import jax.numpy as jnp
import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from jaxsh.imaging import read_environment, srgb_decode, studio, tone_map, write_image


def load(path, kind="uint8"):
    # PNG holds colors that are not multiplied by alpha: read them as they are held.
    hint = oiio.ImageSpec()
    hint.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(path), hint)
    spec = source.spec()
    pixels = source.read_image(0, 0, 0, spec.nchannels, kind)
    assert not source.geterror()
    source.close()
    return pixels


@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 1), (5, 7, 3), (5, 7, 4)])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_png_rounds_to_the_nearest_of_256(tmp_path, rng, shape, dtype):
    image = rng.uniform(0, 1, size=shape).astype(dtype)
    path = write_image(tmp_path / "new" / "folder" / "a.png", jnp.asarray(image))
    assert path == tmp_path / "new" / "folder" / "a.png"
    assert np.abs(load(path).reshape(shape) / 255 - image).max() <= 0.5 / 255 + 1e-7


def test_png_clips(tmp_path):
    image = np.array([[[-1e9, 0.0, 0.5]], [[1.0, 1.2, 1e9]]])
    assert load(write_image(tmp_path / "a.png", image)).ravel().tolist() == [0, 0, 128, *[255] * 3]


def test_png_leaves_colors_behind_alpha_alone(tmp_path):
    image = np.full((2, 2, 4), 0.8)
    image[..., 3] = [[0, 0.2], [0.6, 1]]
    pixels = load(write_image(tmp_path / "a.png", image))
    np.testing.assert_array_equal(pixels, np.rint(image * 255))


@pytest.mark.parametrize("suffix", [".jpg", ".jpeg", ".JPG"])
def test_jpg_is_close(tmp_path, suffix):
    ramp = np.linspace(0, 1, 64)
    image = np.stack(np.broadcast_arrays(ramp, ramp[:, None], 0.5), axis=-1)
    pixels = load(write_image(tmp_path / f"a{suffix}", image))
    assert np.abs(pixels / 255 - image).max() < 0.025  # 0.0197 measured


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    image=st.sampled_from([np.float16, np.float32]).flatmap(
        lambda dtype: hnp.arrays(
            dtype,
            st.sampled_from([(5, 9), (1, 1, 1), (7, 2, 3), (3, 4, 4)]),
            elements=hnp.from_dtype(np.dtype(dtype), allow_nan=False, allow_infinity=False),
        )
    )
)
def test_exr_is_exact(tmp_path, image):
    pixels = load(write_image(tmp_path / "a.exr", image), "float")
    np.testing.assert_array_equal(pixels.reshape(image.shape), image)


@pytest.mark.parametrize("suffix", [".png", ".exr"])
def test_the_same_picture_gives_the_same_bytes(tmp_path, suffix):
    one, other = (write_image(tmp_path / f"{i}{suffix}", np.eye(3)) for i in range(2))
    content = one.read_bytes()
    assert content == other.read_bytes()
    assert b"Date" not in content  # the clock need not have moved on


def test_exr_keeps_small_and_large_float32(tmp_path):
    image = np.array([[1e-38, 1e-45, 3.4e38, -3.4e38]], np.float32)
    np.testing.assert_array_equal(
        load(write_image(tmp_path / "a.exr", image), "float")[..., 0], image
    )


def test_gray_hdr_has_three_channels(tmp_path):
    pixels = load(write_image(tmp_path / "a.hdr", np.array([[0.25, 4.0]])), "float")
    np.testing.assert_array_equal(pixels, [[[0.25] * 3, [4.0] * 3]])


@pytest.mark.parametrize(
    ("name", "image", "message"),
    [
        ("a.tif", np.ones((2, 2)), r"a\.tif: cannot write \.tif, only \('\.png'"),
        ("a.png", np.ones(4), r"got shape \(4,\)"),
        ("a.png", np.ones((2, 2, 2)), r"channels one of \(1, 3, 4\), got shape \(2, 2, 2\)"),
        ("a.jpg", np.ones((2, 2, 4)), r"channels one of \(1, 3\), got shape \(2, 2, 4\)"),
        ("a.hdr", np.ones((2, 2, 4)), r"channels one of \(1, 3\), got shape \(2, 2, 4\)"),
        ("a.png", np.ones((0, 2, 3)), r"got shape \(0, 2, 3\)"),
        ("a.png", np.array([[0, np.nan, np.inf]]), r"a\.png: 2 of 3 values are NaN or infinite"),
        ("a.exr", np.array([[0, np.nan]]), "1 of 2 values are NaN or infinite"),
        ("a.hdr", np.array([[0, -1.0]]), "cannot hold negative values"),
        ("a.hdr", np.array([[0, 3e38]], np.float32), r"up to 1\.69e\+38, got 3e\+38"),
        ("a.exr", np.array([[0, 1e39]]), r"1 of 2 values are beyond float32's range"),
        ("a.png", np.ones((3, 6, 12)), r"got shape \(3, 6, 12\): channels come last"),
        ("a.png", np.full((2, 2), 200, np.uint8), r'a\.png: integers \(uint8\).* encoding="srgb"'),
        ("a.exr", np.full((2, 2), 200, np.uint16), r"a\.exr: integers \(uint16\).*image / 65535\)"),
        ("a.exr", np.ones((2, 2), int), "of floats, uint8 or uint16, got int64"),
        ("a.png", np.ones((2, 2), bool), "of floats, uint8 or uint16, got bool"),
        ("a.png", np.ones((2, 2), complex), "of floats, uint8 or uint16, got complex128"),
    ],
)
def test_bad_pictures_are_refused(unchecked, tmp_path, name, image, message):
    with pytest.raises(ValueError, match=message):
        write_image(tmp_path / "new" / name, image)
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_integers_are_what_their_encoding_says(tmp_path, rng, dtype):
    most = np.iinfo(dtype).max
    image = rng.integers(0, most + 1, size=(8, 16, 3)).astype(dtype)
    path = write_image(tmp_path / "a.png", image, encoding="srgb")
    np.testing.assert_array_equal(load(path, dtype.__name__), image)
    signal = image / most
    light = np.where(signal <= 0.04045, signal / 12.92, ((signal + 0.055) / 1.055) ** 2.4)
    path = write_image(tmp_path / "a.exr", image, encoding="srgb")
    np.testing.assert_allclose(load(path, "float"), light, rtol=0, atol=4e-8)
    smooth = np.broadcast_to((np.arange(16) * (most // 16)).astype(dtype), (8, 16))
    pixels = load(write_image(tmp_path / "a.jpg", smooth, encoding="srgb"))[..., 0]
    np.testing.assert_allclose(pixels, smooth / (most / 255), rtol=0, atol=1)  # 0.47 measured
    # An encoding on its own says nothing of floats.
    with pytest.raises(ValueError, match='encoding="srgb" is for uint8 and uint16, got float64'):
        write_image(path, signal, encoding="srgb")


@pytest.mark.parametrize(
    ("name", "tolerance"), [("a.exr", 0), ("a.hdr", 2e-3), ("a.png", 0), ("a.jpg", 0.05)]
)
def test_what_is_written_is_read(tmp_path, name, tolerance):
    """A display format in 8 bits, by sRGB's curve."""
    linear = np.asarray(studio(32, 64)) / 1000
    if name in ("a.exr", "a.hdr"):
        image = read_environment(write_image(tmp_path / name, linear))
        np.testing.assert_allclose(image, linear, atol=tolerance, rtol=0)
        return
    signal = np.rint(np.asarray(tone_map(jnp.asarray(linear), 100.0)) * 255) / 255
    path = write_image(tmp_path / name, signal)
    image = read_environment(path, encoding="srgb")
    np.testing.assert_allclose(
        image, srgb_decode(jnp.asarray(signal)), rtol=0, atol=tolerance or 2e-7
    )


def test_bfloat16_is_written(tmp_path):
    image = jnp.full((2, 2), 0.5, jnp.bfloat16)
    np.testing.assert_array_equal(load(write_image(tmp_path / "a.exr", image), "float"), 0.5)


def test_a_place_that_cannot_be_written(tmp_path):
    (tmp_path / "a.png").mkdir()
    with pytest.raises(OSError, match=r"a\.png: cannot be written"):
        write_image(tmp_path / "a.png", np.ones((2, 2)))
