"""Pictures to files and back."""

import jax.numpy as jnp
import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from jaxsh.imaging import write_image


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
    ],
)
def test_bad_pictures_are_refused(unchecked, tmp_path, name, image, message):
    with pytest.raises(ValueError, match=message):
        write_image(tmp_path / "new" / name, image)
    assert not (tmp_path / "new").exists()


def test_a_place_that_cannot_be_written(tmp_path):
    (tmp_path / "a.png").mkdir()
    with pytest.raises(OSError, match=r"a\.png: cannot be written"):
        write_image(tmp_path / "a.png", np.ones((2, 2)))
