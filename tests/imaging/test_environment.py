"""Light probes from files: whole, odd, damaged."""

import warnings

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from jaxsh.imaging import read_environment, studio, write_image


def save(path, pixels, names=None, kind="float", **attributes):
    """Write any channels, as our own writer would not."""
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, kind)
    if names:
        spec.channelnames = names
    for key, value in attributes.items():
        spec.attribute(key, value)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec)
    assert out.write_image(np.ascontiguousarray(pixels, np.float32))
    assert out.close()
    return path


@pytest.fixture
def picture(rng):
    return rng.uniform(0, 4, size=(8, 16, 3)).astype(np.float32)


@pytest.mark.parametrize("compression", ["none", "zip", "zips", "piz", "rle"])
def test_exr_is_read_exactly(tmp_path, picture, compression):
    path = save(tmp_path / "a.exr", picture, compression=compression)
    image = read_environment(path)
    assert image.dtype == np.float32
    np.testing.assert_array_equal(image, picture)


def test_half_exr_is_read_exactly(tmp_path, picture):
    half = picture.astype(np.float16)
    np.testing.assert_array_equal(read_environment(write_image(tmp_path / "a.exr", half)), half)


def test_hdr_is_read_to_its_precision(tmp_path, picture):
    image = read_environment(write_image(tmp_path / "a.hdr", picture))
    # Eight bits of the largest channel: a step of up to 1/128 of it, 0.78 % measured.
    largest = picture.max(axis=-1, keepdims=True)
    assert (np.abs(image - picture) <= largest / 128).all()
    # What it can hold comes back exactly.
    np.testing.assert_array_equal(
        read_environment(write_image(tmp_path / "b.hdr", np.asarray(image))), image
    )


def test_channels_are_found_by_name(tmp_path, rng):
    pixels = rng.uniform(0, 1, size=(4, 8, 5)).astype(np.float32)
    path = save(tmp_path / "a.exr", pixels, names=("Z", "B", "A", "R", "G"))
    np.testing.assert_array_equal(read_environment(path), pixels[..., [3, 4, 1]])


@pytest.mark.parametrize("names", [("Y",), ("Y", "A")])
def test_grey_gives_three_equal_channels(tmp_path, rng, names):
    pixels = rng.uniform(0.1, 1, size=(4, 8, len(names))).astype(np.float32)
    image = read_environment(save(tmp_path / "a.exr", pixels, names=names))
    np.testing.assert_array_equal(image, np.repeat(pixels[..., :1], 3, axis=-1))


def test_unknown_channels_are_named(tmp_path, picture):
    path = save(tmp_path / "a.exr", picture, names=("Y", "RY", "BY"))
    with pytest.raises(ValueError, match=r"a\.exr: needs channels R, G, B .* 'RY'"):
        read_environment(path)


FAULTY = {
    (0, 0, 0): np.nan,
    (0, 1, 1): np.nan,
    (1, 2, 0): -3,
    (2, 2, 2): np.inf,
    (3, 3, 1): -np.inf,
}


def test_faults_are_refused_or_repaired_with_their_numbers(tmp_path, picture):
    expected = picture.copy()
    for index, value in FAULTY.items():
        picture[index], expected[index] = value, 0
    expected[2, 2, 2] = expected.max()
    path = save(tmp_path / "a.exr", picture)
    counts = "2 NaN, 2 negative, 1 infinite values"
    with pytest.raises(ValueError, match=rf"a\.exr: {counts}; read it with repair=True"):
        read_environment(path)
    with pytest.warns(UserWarning, match=rf"a\.exr: replaced {counts}") as record:
        image = read_environment(path, repair=True)
    assert len(record) == 1
    np.testing.assert_array_equal(image, expected)


def test_a_whole_picture_needs_no_repair(tmp_path, picture):
    path = save(tmp_path / "a.exr", picture)
    np.testing.assert_array_equal(read_environment(path, repair=True), picture)


@pytest.mark.filterwarnings("ignore:.*replaced")
@pytest.mark.parametrize("value", [0, np.nan, -1, np.inf])
def test_a_picture_without_light_is_refused(tmp_path, value):
    path = save(tmp_path / "a.exr", np.full((4, 8, 3), value))
    with pytest.raises(ValueError, match=r"a\.exr: the picture is all black"):
        read_environment(path, repair=True)


@pytest.mark.parametrize("shape", [(8, 8), (16, 8), (8, 15), (1, 1)])
def test_other_shapes_are_refused(tmp_path, shape):
    path = save(tmp_path / "a.exr", np.ones((*shape, 3)))
    with pytest.raises(ValueError, match=f"twice as wide as high, not {shape[1]} × {shape[0]}"):
        read_environment(path)


def test_a_crop_is_refused(tmp_path):
    spec = oiio.ImageSpec(8, 4, 3, "float")
    spec.full_width, spec.full_height = 16, 8
    out = oiio.ImageOutput.create("a.exr")
    assert out.open(str(tmp_path / "a.exr"), spec)
    assert out.write_image(np.ones((4, 8, 3), np.float32))
    out.close()
    with pytest.raises(ValueError, match="only a part of the picture is stored"):
        read_environment(tmp_path / "a.exr")


def test_an_hdr_from_the_bottom_up_is_refused(tmp_path, picture):
    path = write_image(tmp_path / "a.hdr", picture)
    path.write_bytes(path.read_bytes().replace(b"-Y 8 +X 16", b"+Y 8 +X 16"))
    with pytest.raises(ValueError, match="rows must run downwards"):
        read_environment(path)


def test_bad_options_and_names(tmp_path):
    with pytest.raises(ValueError, match=r"layout must be one of \('lat-long',\), got 'cross'"):
        read_environment("a.exr", layout="cross")
    with pytest.raises(ValueError, match=r"orientation must be one of .*'jaxsh'.*, got 'up'"):
        read_environment("a.exr", orientation="up")
    with pytest.raises(ValueError, match=r"a\.png: cannot read \.png, only"):
        read_environment(tmp_path / "a.png")
    with pytest.raises(FileNotFoundError, match=r"a\.exr: there is no such picture"):
        read_environment(tmp_path / "a.exr")


def encoded(folder, suffix: str) -> bytes:
    pixels = np.random.default_rng(5).uniform(0, 4, size=(8, 16, 3))
    return write_image(folder / f"whole{suffix}", pixels).read_bytes()


@pytest.mark.parametrize("suffix", [".exr", ".hdr"])
def test_no_truncated_file_is_taken_for_a_whole(tmp_path, suffix):
    data, path = encoded(tmp_path, suffix), tmp_path / f"cut{suffix}"
    for length in range(0, len(data), max(1, len(data) // 100)):
        path.write_bytes(data[:length])
        with pytest.raises(ValueError, match=rf"cut\{suffix}: damaged"):
            read_environment(path)


def read_or_refuse(path, data):
    """Any bytes end in a picture that is one, or in a ValueError that names the file."""
    path.write_bytes(data)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", category=UserWarning, message=".*replaced")
        try:
            image = read_environment(path, repair=True)
        except ValueError as error:
            message, image = str(error), None
    if image is None:
        assert str(path) in message
        return
    assert np.isfinite(image).all()
    assert (image >= 0).all()
    assert image.any()


@pytest.mark.parametrize("suffix", [".exr", ".hdr"])
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(max_size=400))
def test_random_bytes_never_crash(tmp_path, suffix, data):
    read_or_refuse(tmp_path / f"random{suffix}", data)


@pytest.mark.parametrize("suffix", [".exr", ".hdr"])
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=100)
@given(
    edits=st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.binary(max_size=8)), max_size=4)
)
def test_changed_bytes_never_crash(tmp_path, suffix, edits):
    data = bytearray(encoded(tmp_path, suffix))
    for where, new in edits:
        at = int(where * len(data))
        data[at : at + len(new)] = new
    read_or_refuse(tmp_path / f"changed{suffix}", bytes(data))


def test_a_huge_announcement_does_not_allocate(tmp_path):
    path = tmp_path / "huge.hdr"
    data = encoded(tmp_path, ".hdr").replace(b"-Y 8 +X 16", b"-Y 40000 +X 80000")
    path.write_bytes(data)
    with pytest.raises(ValueError, match=r"huge\.hdr: damaged"):
        read_environment(path)


def test_studio_is_a_light_probe():
    image = studio()
    assert image.shape == (256, 512, 3)
    assert image.dtype == np.float32
    assert np.isfinite(image).all()
    assert float(image.min()) > 0.05
    assert 800 < float(image.max()) < 1000
    # The sun is where it is said to be: upper left front for a viewer at -y.
    row, column = np.unravel_index(int(image.sum(axis=-1).argmax()), (256, 512))
    theta, phi = (row + 0.5) * np.pi / 256, (column + 0.5) * 2 * np.pi / 512
    assert np.sin(theta) * np.cos(phi) < -0.3
    assert np.sin(theta) * np.sin(phi) < -0.3
    assert np.cos(theta) > 0.3


def test_studio_is_the_same_light_at_every_resolution():
    def total(height):
        rows = np.cos(np.arange(height + 1) * np.pi / height)
        weights = (rows[:-1] - rows[1:]) * np.pi / height
        return np.einsum("h,hwc->c", weights, np.asarray(studio(height, 2 * height), np.float64))

    # 256 rows differ by 3.2e-5, 128 by 1.3e-4.
    np.testing.assert_allclose(total(256), total(1024), rtol=1e-4)
    np.testing.assert_allclose(total(128), total(1024), rtol=5e-4)


def test_studio_needs_pixels():
    with pytest.raises(ValueError, match="needs pixels, got 0 × 4"):
        studio(4, 0)
