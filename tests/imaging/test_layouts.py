"""Every layout and orientation that `read_environment` knows, read from painted pictures."""

import numpy as np
import painters
import pytest
from painters import PAINTERS

from jaxsh.imaging import read_environment
from jaxsh.sphere import cube_map, project_lat_long, reconstruct


def save(path, picture):
    np.save(path, picture.astype(np.float32))
    return path


@pytest.mark.parametrize(("layout", "orientation"), PAINTERS)
def test_each_axis_shows_its_color(tmp_path, layout, orientation):
    """NaN around the circle and in empty cells must not be looked at."""
    directions = PAINTERS[layout, orientation](64)
    path = save(tmp_path / "axes.npy", painters.colored_axes(directions))
    image = read_environment(path, layout=layout, orientation=orientation, height=64)
    assert image.shape == (64, 128, 3)
    assert image.dtype == np.float32
    for (x, y, z), color in painters.AXES.items():
        row, column = int((1 - z) * 63 / 2 + 0.5), int(np.arctan2(y, x) / (2 * np.pi) * 128) % 128
        np.testing.assert_allclose(image[row, column], color, rtol=0, atol=0.02)
    # And between the axes.
    expected = painters.colored_axes(painters.jaxsh_lat_long(64))
    np.testing.assert_allclose(image, expected, rtol=0, atol=0.015)


@pytest.mark.parametrize(("layout", "orientation"), PAINTERS)
def test_a_light_keeps_its_coefficients(tmp_path, rng, layout, orientation):
    light = rng.normal(size=(3, 25)) * 0.1
    light[:, 0] = 4
    directions = PAINTERS[layout, orientation](256 if layout == "angular-map" else 128)
    picture = np.full(directions.shape, np.nan)
    there = ~np.isnan(directions[..., 0])
    unit = directions[there] / np.linalg.norm(directions[there], axis=-1, keepdims=True)
    picture[there] = np.asarray(reconstruct(light, unit)).T
    path = save(tmp_path / "light.npy", picture)
    found = project_lat_long(read_environment(path, layout=layout, orientation=orientation), 4)
    # The blur of a pixel: 3e-4 measured, against coefficients of 4 and 0.1.
    exact = layout == "lat-long" and orientation != "openexr"
    np.testing.assert_allclose(found, light, rtol=0, atol=1e-6 if exact else 5e-4)


def disc_weights(n, parts=16):
    """Solid angles of an angular map's pixels: dω = π sin(πr)/r du dv within the circle."""
    p = (2 * np.arange(n * parts) + 1) / (n * parts) - 1
    r = np.hypot(p, p[:, None])
    density = np.where(r <= 1, np.pi * np.sin(np.pi * r) / r, 0) * (2 / (n * parts)) ** 2
    return density.reshape(n, parts, n, parts).sum(axis=(1, 3))


def solid_angles(layout, n):
    if layout == "angular-map":
        return disc_weights(n)
    faces = np.asarray(cube_map(n).weights).reshape(6, n, n)
    if layout == "cube":
        return faces.reshape(6 * n, n)
    there = ~np.isnan(PAINTERS[layout, "jaxsh"](n)[..., 0])
    weights = np.zeros(there.shape)
    weights[there] = np.sort(faces[0].ravel())[0]  # each cell below
    for row, column in np.argwhere(there[::n, ::n]):
        weights[row * n : row * n + n, column * n : column * n + n] = faces[0]
    return weights


def row_weights(height):
    return -np.diff(np.cos(np.arange(height + 1) * np.pi / height)) * np.pi / height


@pytest.mark.parametrize("layout", ["angular-map", "horizontal-cross", "vertical-cross", "cube"])
def test_energy_is_kept(tmp_path, rng, layout):
    """Of a picture that no look-up likes: noise from pixel to pixel, a thousandfold in range."""
    n = 128
    weights = solid_angles(layout, n)
    np.testing.assert_allclose(weights.sum(), 4 * np.pi, rtol=1e-9)
    picture = np.exp(rng.normal(size=(*weights.shape, 3)) * 1.5)
    expected = np.einsum("hw,hwc->c", weights, picture)
    image = read_environment(save(tmp_path / "noise.npy", picture), layout=layout)
    found = np.einsum("h,hwc->c", row_weights(len(image)), image)
    np.testing.assert_allclose(found, expected, rtol=3e-3)


@pytest.mark.parametrize(
    ("orientation", "sign", "start"),
    [
        ("jaxsh", 1, 0),
        ("debevec", -1, 4),
        ("mitsuba", -1, 1),
        ("blender", -1, 2),
        ("nvdiffrec", -1, 3),
    ],
)
def test_lat_long_is_flipped_and_rolled_exactly(tmp_path, rng, orientation, sign, start):
    """φ = start·π/2 at the left edge, rising or falling to the right: no pixel is touched."""
    picture = rng.uniform(size=(6, 12, 3)).astype(np.float32)
    image = read_environment(save(tmp_path / "a.npy", picture), orientation=orientation)
    for j in range(12):
        phi = start / 4 + sign * (j + 0.5) / 12
        np.testing.assert_array_equal(image[:, int((phi % 1) * 12)], picture[:, j])


@pytest.mark.parametrize("orientation", ["mitsuba", "nvdiffrec"])
def test_a_quarter_turn_of_odd_rows_is_by_half_a_column(tmp_path, rng, orientation):
    picture = rng.uniform(size=(5, 10, 3)).astype(np.float32)
    image = np.asarray(read_environment(save(tmp_path / "a.npy", picture), orientation=orientation))
    np.testing.assert_allclose(image.sum(axis=1), picture.sum(axis=1), rtol=1e-6)
    # Each pixel has half of each of the two that it overlaps: the finer picture's columns say.
    finer = np.repeat(np.repeat(picture, 2, axis=0), 2, axis=1)
    path = save(tmp_path / "finer.npy", finer)
    exact = np.asarray(read_environment(path, orientation=orientation))
    np.testing.assert_allclose(image, exact[::2].reshape(5, 10, 2, 3).mean(axis=2), rtol=1e-6)


def test_a_column_more_or_less_is_no_harm(tmp_path, rng):
    """Pixels are then not square; a quarter turn is by a quarter of a column more."""
    picture = rng.uniform(size=(64, 129, 3)).astype(np.float32)
    path = save(tmp_path / "a.npy", picture)
    np.testing.assert_array_equal(read_environment(path), picture)
    image = np.asarray(read_environment(path, orientation="mitsuba"))
    # Each of our pixels is the mean over the four quarters that it covers of the file's.
    quarters = np.repeat(picture[:, ::-1], 4, axis=1)  # φ falls to the right
    quarters = np.roll(quarters, 129, axis=1)  # the left edge's φ, ½ π
    np.testing.assert_allclose(
        image, quarters.reshape(64, 129, 4, 3).mean(axis=2), rtol=0, atol=1e-6
    )


def test_height_is_the_readers_choice(tmp_path, rng):
    picture = rng.uniform(1, 2, size=(32, 64, 3))
    path = save(tmp_path / "a.npy", picture)
    expected = np.einsum("h,hwc->c", row_weights(32), picture)
    for height in (1, 8, 16, 32, 50):
        image = read_environment(path, height=height)
        assert image.shape == (height, 2 * height, 3)
        found = np.einsum("h,hwc->c", row_weights(height), image)
        np.testing.assert_allclose(found, expected, rtol=3e-4)  # 2.0e-4 measured
    np.testing.assert_array_equal(read_environment(path, height=32), picture.astype(np.float32))


@pytest.mark.parametrize(
    ("layout", "size", "rows"),
    [
        ("angular-map", 30, 15),
        ("angular-map", 1, 1),
        ("vertical-cross", 8, 16),
        ("cube", 1, 2),
    ],
)
def test_default_height_follows_the_sources_great_circle(tmp_path, layout, size, rows):
    picture = np.where(np.isnan(PAINTERS[layout, "jaxsh"](size)), np.nan, 0.25)
    image = read_environment(save(tmp_path / "a.npy", picture), layout=layout)
    assert image.shape == (rows, 2 * rows, 3)
    np.testing.assert_array_equal(image, 0.25)


@pytest.mark.parametrize("layout", ["lat-long", "angular-map", "vertical-cross", "cube"])
@pytest.mark.parametrize("value", [np.finfo(np.float32).max, 1e-36])
def test_the_range_of_float32_is_kept(tmp_path, rng, layout, value):
    there = ~np.isnan(PAINTERS[layout, "jaxsh"](10))
    picture = np.where(there, rng.uniform(0.5, 1, size=there.shape), np.nan) * value
    image = read_environment(save(tmp_path / "a.npy", picture), layout=layout, height=8)
    assert np.isfinite(image).all()
    assert 0.4 * value < image.min() <= image.max() <= np.float32(value)


def test_a_face_goes_on_where_its_neighbor_begins(tmp_path):
    """One bright face: what bilinear look-up spreads over an edge is half a texel, not a seam."""
    faces = np.zeros((6, 16, 16, 3))
    faces[0] = 1
    image = read_environment(save(tmp_path / "a.npy", faces.reshape(96, 16, 3)), layout="cube")
    found = np.einsum("h,hwc->c", row_weights(len(image)), image)
    np.testing.assert_allclose(found, 4 * np.pi / 6, rtol=4e-4)  # 2.9e-4 measured
