"""Light probes from files: whole, odd, faulty; and the one built in."""

import numpy as np
import pytest
from picture_writers import save

from jaxsh.imaging import read_environment, studio, write_image


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
def test_gray_gives_three_equal_channels(tmp_path, rng, names):
    pixels = rng.uniform(0.1, 1, size=(4, 8, len(names))).astype(np.float32)
    image = read_environment(save(tmp_path / "a.exr", pixels, names=names))
    np.testing.assert_array_equal(image, np.repeat(pixels[..., :1], 3, axis=-1))


def test_unknown_channels_are_named(tmp_path, picture):
    path = save(tmp_path / "a.exr", picture, names=("U", "V", "W"))
    with pytest.raises(ValueError, match=r"a\.exr: needs channels R, G, B .* 'V'"):
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


def test_bad_options_and_names(tmp_path):
    with pytest.raises(ValueError, match=r"layout must be one of \('lat-long', .*, got 'cross'"):
        read_environment("a.exr", layout="cross")
    with pytest.raises(ValueError, match=r"orientation must be one of .*'jaxsh'.*, got 'up'"):
        read_environment("a.exr", orientation="up")
    with pytest.raises(
        ValueError, match=r"orientation must be .* for layout 'cube', got 'blender'"
    ):
        read_environment("a.exr", layout="cube", orientation="blender")
    for height in (0, 8193):
        with pytest.raises(ValueError, match=f"height must be between 1 and 8192, got {height}"):
            read_environment("a.exr", height=height)
    with pytest.raises(ValueError, match="layout 'lat-long' does not come in 6 files"):
        read_environment(["a.exr"] * 6)
    with pytest.raises(ValueError, match="layout 'cube' does not come in 5 files"):
        read_environment(["a.exr"] * 5, layout="cube")
    with pytest.raises(ValueError, match=r"encoding must be one of \('srgb', 'linear'\) .*'sRGB'"):
        read_environment("a.png", encoding="sRGB")
    with pytest.raises(ValueError, match=r"a\.gif: cannot read \.gif, only"):
        read_environment(tmp_path / "a.gif")
    with pytest.raises(FileNotFoundError, match=r"a\.exr: there is no such picture"):
        read_environment(tmp_path / "a.exr")


@pytest.mark.parametrize("shape", [(24, 32), (32, 24), (16, 16), (24, 4), (8, 16)])
def test_the_layout_that_a_shape_could_be_is_named(tmp_path, shape):
    like = {
        (24, 32): "horizontal-cross",
        (32, 24): "vertical-cross",
        (16, 16): "angular-map",
        (24, 4): "cube",
        (8, 16): "lat-long",
    }[shape]
    path = save(tmp_path / "a.exr", np.ones((*shape, 3)))
    for layout in ("lat-long", "angular-map", "horizontal-cross", "vertical-cross", "cube"):
        if layout != like:
            with pytest.raises(ValueError, match=rf"a\.exr: .*{layout} .* layout '{like}'"):
                read_environment(path, layout=layout)


@pytest.mark.parametrize("shape", [(9, 16), (25, 32), (31, 31)])
def test_no_layout_is_named_for_an_odd_shape(tmp_path, shape):
    path = save(tmp_path / "a.exr", np.ones((*shape, 3)))
    layout = "horizontal-cross" if shape[0] == shape[1] else "lat-long"
    with pytest.raises(ValueError, match=f"not {shape[1]} × {shape[0]}"):
        read_environment(path, layout=layout)


def test_six_files_are_one_cube(tmp_path, rng):
    faces = rng.uniform(1, 2, size=(6, 8, 8, 3)).astype(np.float32)
    together = save(tmp_path / "cube.exr", faces.reshape(48, 8, 3))
    paths = [save(tmp_path / f"{i}.exr", face) for i, face in enumerate(faces)]
    image = read_environment(paths, layout="cube")
    assert image.shape == (16, 32, 3)
    np.testing.assert_array_equal(image, read_environment(together, layout="cube"))
    save(paths[2], faces[2, :4, :4])
    with pytest.raises(ValueError, match=r"six faces must have one size.*2\.exr: 4 × 4"):
        read_environment(paths, layout="cube")


def test_only_pixels_in_use_are_faults(tmp_path):
    """A corner of the angular map or the cross may hold anything; a face may not."""
    pixels = np.ones((24, 24, 3))
    pixels[0, 0], pixels[-1, -1] = np.nan, -1
    path = save(tmp_path / "a.exr", pixels)
    np.testing.assert_allclose(read_environment(path, layout="angular-map"), 1, rtol=1e-6)
    pixels[12, 12] = np.nan
    with pytest.raises(ValueError, match=r"a\.exr: 3 NaN values"):
        read_environment(save(path, pixels), layout="angular-map")
    with pytest.warns(UserWarning, match=r"a\.exr: replaced 3 NaN values"):
        image = read_environment(path, layout="angular-map", repair=True)
    assert 0.8 < image.mean() < 1
    cross = np.full((24, 32, 3), np.inf)
    cross[8:16], cross[:, 8:16] = 1, 1
    image = read_environment(save(path, cross), layout="horizontal-cross")
    np.testing.assert_allclose(image, 1, rtol=1e-6)
    cross[8:16], cross[:, 8:16] = 0, 0
    cross[0, 0] = 1
    with pytest.raises(ValueError, match="all black"):
        read_environment(save(path, cross), layout="horizontal-cross")


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

    most = total(512)
    # 256 rows differ by 6.2e-6, 128 by 3.1e-5.
    np.testing.assert_allclose(total(256), most, rtol=1e-5)
    np.testing.assert_allclose(total(128), most, rtol=5e-5)


def test_studio_needs_pixels():
    with pytest.raises(ValueError, match="needs pixels, got 0 × 4"):
        studio(4, 0)
