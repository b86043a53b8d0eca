"""Pictures that are numbers behind a header: .pfm and .npy."""

import numpy as np
import pytest
from picture_writers import encoded, pfm

from jaxsh.imaging import read_environment


@pytest.fixture
def picture(rng):
    return rng.uniform(0, 4, size=(8, 16, 3)).astype(np.float32)


@pytest.mark.parametrize(("scale", "order"), [(b"-1.0", "<f4"), (b"1", ">f4"), (b"+2e0\r", ">f4")])
def test_pfm_is_read_exactly(tmp_path, picture, scale, order):
    path = tmp_path / "a.pfm"
    path.write_bytes(pfm(picture, scale=scale, order=order))
    np.testing.assert_array_equal(read_environment(path), picture)
    path.write_bytes(pfm(picture[..., :1], b"Pf", scale, order))
    np.testing.assert_array_equal(read_environment(path), np.repeat(picture[..., :1], 3, axis=-1))


def test_pfm_with_comments_and_alpha(tmp_path, picture):
    path = tmp_path / "a.pfm"
    path.write_bytes(pfm(picture).replace(b"PF\n", b"PF\n# made by hand\n", 1))
    np.testing.assert_array_equal(read_environment(path), picture)
    path.write_bytes(pfm(np.concatenate([picture, picture[..., :1]], axis=-1), b"PF4"))
    np.testing.assert_array_equal(read_environment(path), picture)


@pytest.mark.parametrize(
    ("header", "message"),
    [
        (b"P6\n16 8\n-1.0\n", "not a .pfm file"),
        (b"PF\n16 -8\n-1.0\n", "not a .pfm file"),
        (b"PF\n16 8\n0.0\n", "its scale is 0.0"),
        (b"PF\n16 8\n1e999\n", "its scale is 1e999"),
        (b"PF\n16 8\n1-1\n", "its scale is 1-1"),
        (b"PF\n16 0\n-1.0\n", "a picture needs pixels"),
        (b"PF\n14 7\n-1.0\n", "takes 1176 bytes, but 1536 are there"),
        (b"PF\n999999999 499999999\n-1.0\n", "but 1536 are there"),
    ],
)
def test_a_wrong_pfm_header_is_refused(tmp_path, picture, header, message):
    path = tmp_path / "a.pfm"
    path.write_bytes(header + pfm(picture)[len(b"PF\n16 8\n-1.0\n") :])
    with pytest.raises(ValueError, match=rf"a\.pfm: .*{message}"):
        read_environment(path)


@pytest.mark.parametrize("dtype", ["<f2", "<f4", ">f4", "<f8"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_npy_is_read_exactly(tmp_path, picture, dtype, order):
    pixels = np.asarray(picture.astype(dtype), order=order)
    np.save(tmp_path / "a.npy", pixels)
    image = read_environment(tmp_path / "a.npy")
    assert image.dtype == np.float32
    np.testing.assert_array_equal(image, pixels.astype(np.float32))
    np.save(tmp_path / "a.npy", pixels[..., 1])
    np.testing.assert_array_equal(
        read_environment(tmp_path / "a.npy"), np.repeat(image[..., 1:2], 3, axis=-1)
    )


def test_a_number_beyond_float32_is_infinite(tmp_path, picture):
    pixels = picture.astype(np.float64)
    pixels[0, 0, 0] = 1e39
    np.save(tmp_path / "a.npy", pixels)
    with pytest.raises(ValueError, match="1 infinite values"):
        read_environment(tmp_path / "a.npy")


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.ones((4, 8, 3), int), "needs float16, .* or uint16, got int64"),
        (np.ones((4, 8, 4)), r"needs shape \(h, w, 3\) or \(h, w\), got \(4, 8, 4\)"),
        (np.ones((3, 4, 8)), r"needs shape .* got \(3, 4, 8\): channels come last"),
        (np.ones((4, 8), bool), "needs float16, .* or uint16, got bool"),
        (np.ones(8), "needs shape .* got \\(8,\\)"),
        (np.ones((0, 0, 3)), "a picture needs pixels"),
        (np.array([[None]]), "needs float16, .* or uint16, got object"),
    ],
)
def test_other_arrays_are_refused(tmp_path, array, message):
    np.save(tmp_path / "a.npy", array)
    with pytest.raises(ValueError, match=rf"a\.npy: {message}"):
        read_environment(tmp_path / "a.npy")


@pytest.mark.parametrize("suffix", [".pfm", ".npy"])
def test_padding_is_no_harm(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(encoded(tmp_path, suffix))
    image = read_environment(path)
    whole = path.read_bytes()
    for padding in (b"\n", b"\r\n", bytes(16), bytes(4000)):
        path.write_bytes(whole + padding)
        np.testing.assert_array_equal(read_environment(path), image)
    # A byte too many among numbers that end in zeros shifts them; it is no padding.
    shifted = whole[:-301] + b"\0" + whole[-301:-12] + bytes(12)
    for data in (shifted, whole + bytes(7), whole + b" " * 20):
        path.write_bytes(data)
        with pytest.raises(ValueError, match=r"damaged: shape .* takes"):
            read_environment(path)
    path.write_bytes(whole + b"more")
    with pytest.raises(ValueError, match="takes 1536 bytes, but 1540 are there"):
        read_environment(path)
