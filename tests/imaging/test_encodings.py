"""Panoramas of 8 and 16 bits, written by Pillow, read with the encoding that the caller names."""

import io
import struct
import zlib

import numpy as np
import pytest
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from jaxsh.imaging import read_environment, write_image


def light(signal):
    """IEC 61966-2-1."""
    return np.where(signal <= 0.04045, signal / 12.92, ((signal + 0.055) / 1.055) ** 2.4)


@pytest.fixture
def pixels(rng):
    return rng.integers(0, 256, size=(8, 16, 4), dtype=np.uint8)


def check(path, expected):
    expected = np.broadcast_to(np.atleast_3d(expected), (*np.shape(expected)[:2], 3))
    image = read_environment(path, encoding="srgb")
    assert image.dtype == np.float32
    np.testing.assert_allclose(image, light(expected), rtol=0, atol=4e-8)
    linear = read_environment(path, encoding="linear")
    np.testing.assert_allclose(linear, expected, rtol=0, atol=4e-8)


@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_eight_and_sixteen_bits(tmp_path, pixels, rng, suffix):
    path = tmp_path / f"a{suffix}"
    Image.fromarray(pixels[..., :3]).save(path)
    check(path, pixels[..., :3] / 255)
    Image.fromarray(pixels).save(path)  # colors behind alpha stay
    check(path, pixels[..., :3] / 255)
    Image.fromarray(pixels[..., 0]).save(path)
    check(path, pixels[..., 0] / 255)
    deep = rng.integers(0, 65536, size=(8, 16)).astype(np.uint16)
    Image.fromarray(deep).save(path)
    check(path, deep / 65535)


def test_palettes_bits_and_what_the_file_says_of_its_colors(tmp_path, pixels):
    """A gamma or a profile in the file is not looked at: the caller's word counts."""
    path = tmp_path / "a.png"
    few = Image.fromarray(pixels[..., :3]).quantize(16)
    few.save(path, bits=4, transparency=3)
    check(path, np.asarray(few.convert("RGB")) / 255)
    Image.fromarray(pixels[..., 0] > 128).save(path)
    check(path, (pixels[..., 0] > 128) * 1.0)
    info = PngInfo()
    info.add(b"gAMA", (100000).to_bytes(4, "big"))
    Image.fromarray(pixels[..., :3]).save(path, pnginfo=info)
    check(path, pixels[..., :3] / 255)


def test_an_interlaced_picture(tmp_path, pixels):
    """Adam7's seven passes, by hand: the first row and column of each, and their steps."""
    colors = pixels[..., :3]
    passes = [(0, 0, 8, 8), (0, 4, 8, 8), (4, 0, 8, 4), (0, 2, 4, 4), (2, 0, 4, 2), (0, 1, 2, 2)]
    rows = [
        b"\0" + row.tobytes()
        for y, x, down, right in [*passes, (1, 0, 2, 1)]
        for row in colors[y::down, x::right]
    ]
    header = struct.pack(">IIBBBBB", 16, 8, 8, 2, 0, 0, 1)
    data = b"\x89PNG\r\n\x1a\n"
    for chunk in (b"IHDR" + header, b"IDAT" + zlib.compress(b"".join(rows)), b"IEND"):
        data += struct.pack(">I", len(chunk) - 4) + chunk + struct.pack(">I", zlib.crc32(chunk))
    (tmp_path / "a.png").write_bytes(data)
    check(tmp_path / "a.png", colors / 255)


def test_a_picture_of_one_value_takes_few_bytes(tmp_path):
    path = tmp_path / "a.png"
    white = Image.new("RGB", (2048, 1024), "white").quantize(2)
    white.save(path, bits=1, optimize=True)
    assert path.stat().st_size < 3 * 2048 * 1024 / 2048
    np.testing.assert_array_equal(read_environment(path, encoding="srgb"), 1)


TURNED = {
    1: lambda p: p,
    2: lambda p: p[:, ::-1],
    3: lambda p: p[::-1, ::-1],
    4: lambda p: p[::-1],
    5: lambda p: p.swapaxes(0, 1),
    6: lambda p: p.swapaxes(0, 1)[:, ::-1],
    7: lambda p: p[::-1, ::-1].swapaxes(0, 1),
    8: lambda p: p.swapaxes(0, 1)[::-1],
}


@pytest.mark.parametrize("orientation", TURNED)
def test_exif_orientation_is_applied(tmp_path, rng, orientation):
    """A phone's picture is upright as its viewers show it."""
    shape = (8, 16) if orientation < 5 else (16, 8)
    stored = rng.integers(0, 256, size=(*shape, 3), dtype=np.uint8)
    exif = Image.Exif()
    exif[0x0112] = orientation
    Image.fromarray(stored).save(tmp_path / "a.png", exif=exif)
    check(tmp_path / "a.png", TURNED[orientation](stored) / 255)
    # As JPEG, in blocks of one value, which its cosines keep.
    blocks = np.kron(np.linspace(20, 230, 128).reshape(shape), np.ones((8, 8))).astype(np.uint8)
    Image.fromarray(blocks).save(tmp_path / "a.jpg", exif=exif, quality=100)
    image = read_environment(tmp_path / "a.jpg", encoding="linear")
    expected = np.repeat(TURNED[orientation](blocks)[..., None] / 255, 3, axis=-1)
    np.testing.assert_allclose(image, expected, rtol=0, atol=4e-8)


def test_floats_are_linear_and_want_no_encoding(tmp_path, pixels):
    radiance = pixels[..., 0].astype(np.float32) * 3
    Image.fromarray(radiance).save(tmp_path / "a.tif")
    image = read_environment(tmp_path / "a.tif")
    np.testing.assert_array_equal(image, np.repeat(radiance[..., None], 3, axis=-1))
    np.save(tmp_path / "a.npy", radiance)
    for name in ("a.tif", "a.npy"):
        with pytest.raises(
            ValueError, match=rf"{name}: it holds floats, .*encoding='srgb' is for 8"
        ):
            read_environment(tmp_path / name, encoding="srgb")


def test_arrays_of_integers_want_an_encoding(tmp_path, pixels):
    path = tmp_path / "a.npy"
    np.save(path, pixels[..., :3])
    check(path, pixels[..., :3] / 255)
    np.save(path, pixels[..., 0].astype(np.uint16) * 257)
    check(path, pixels[..., 0] / 255)


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.tif", "a.npy"])
def test_without_an_encoding_the_way_is_named(tmp_path, pixels, name):
    if name == "a.npy":
        np.save(tmp_path / name, pixels[..., :3])
    else:
        Image.fromarray(pixels[..., :3]).save(tmp_path / name)
    with pytest.raises(ValueError, match=rf'{name}: the picture holds integers.*encoding="srgb"'):
        read_environment(tmp_path / name)


def test_a_file_is_read_as_what_it_is_or_not_at_all(tmp_path, pixels):
    """Codes named .exr would pass for light, and an .hdr is turned by its own reader only."""
    Image.fromarray(pixels[..., :3]).save(tmp_path / "a.png")
    data = (tmp_path / "a.png").read_bytes()
    (tmp_path / "a.jpg").write_bytes(data)
    check(tmp_path / "a.jpg", pixels[..., :3] / 255)
    (tmp_path / "a.exr").write_bytes(data)
    with pytest.raises(ValueError, match=r"a\.exr: not a \.exr file: its bytes are png"):
        read_environment(tmp_path / "a.exr")
    for suffix, name in ((".exr", "openexr"), (".hdr", "hdr")):
        path = write_image(tmp_path / f"b{suffix}", pixels[..., :3] / np.float32(255))
        with pytest.raises(ValueError, match=rf"b\.tif: not a \.tif file: its bytes are {name}"):
            read_environment(path.rename(tmp_path / "b.tif"))


def test_colors_of_which_no_rgb_is_made_are_refused(tmp_path, pixels):
    path = tmp_path / "a.tif"
    Image.fromarray(pixels[..., :3]).convert("CMYK").save(path)
    check(path, pixels[..., :3] / 255)
    Image.merge("LAB", Image.fromarray(pixels[..., :3]).split()).save(path)
    with pytest.raises(ValueError, match=r"a\.tif: its colors are CIELAB, which is not read"):
        read_environment(path, encoding="srgb")


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tif"])
def test_no_truncated_picture_is_taken_for_a_whole(tmp_path, pixels, suffix):
    """Nor by a thumbnail's end inside of a JPEG."""
    path, options = tmp_path / f"a{suffix}", {}
    if suffix == ".jpg":
        small = io.BytesIO()
        Image.fromarray(pixels[:2, :4, :3]).save(small, "JPEG")
        options = {"comment": small.getvalue()}
    Image.fromarray(pixels[..., :3]).save(path, **options)
    data = path.read_bytes()
    for length in (0, 2, 20, len(data) // 2, len(data) - 40, len(data) - 1):
        if suffix == ".tif" and length == len(data) - 1:
            continue  # its last byte is of an entry that is not used
        path.write_bytes(data[:length])
        with pytest.raises(ValueError, match=rf"a\{suffix}: damaged"):
            read_environment(path, encoding="srgb")
    path.write_bytes(data + b"more")
    assert read_environment(path, encoding="srgb").shape == (8, 16, 3)
