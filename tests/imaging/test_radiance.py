"""Radiance pictures of every age and order, written byte by byte from the format's description."""

import numpy as np
import OpenImageIO as oiio
import pytest

from jaxsh.imaging import read_environment, write_image
from jaxsh.imaging._files import _radiance, _runs

HEADER = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"


def rgbe(rng, height=8, width=16):
    """Mantissas and exponents that flat rows may have: no pixel is 1, 1, 1 or looks like a mark."""
    pixels = rng.integers(128, 256, size=(height, width, 4), dtype=np.uint8)
    pixels[..., 3] = rng.integers(120, 134, size=(height, width))
    # Runs, for what codes them.
    pixels[:, width // 4 : width // 2] = pixels[:, width // 4, None]
    return pixels


def values(pixels):
    """The format's own words: mantissa / 256 times two to the power of exponent - 128."""
    exponent = pixels[..., 3:].astype(float) - 128
    return np.where(pixels[..., 3:] == 0, 0, pixels[..., :3] / 256 * 2.0**exponent)


def flat(pixels) -> bytes:
    return pixels.tobytes()


def old_runs(pixels) -> bytes:
    out = bytearray()
    for row in pixels.tolist():
        at = 0
        while at < len(row):
            end = at + 1
            while end < len(row) and row[end] == row[at]:
                end += 1
            out += bytes(row[at])
            repeats = end - at - 1
            while repeats:  # its digits to the base of 256, the lowest first
                out += bytes([1, 1, 1, repeats & 255])
                repeats >>= 8
            at = end
    return bytes(out)


def new_runs(pixels) -> bytes:
    out = bytearray()
    for row in pixels:
        out += b"\2\2" + len(row).to_bytes(2, "big")
        for channel in row.T.tolist():
            at = 0
            while at < len(channel):
                run = at + 1
                while run < min(len(channel), at + 127) and channel[run] == channel[at]:
                    run += 1
                if run - at > 1:
                    out += bytes([128 + run - at, channel[at]])
                else:
                    run = min(len(channel), at + 3)
                    out += bytes([run - at, *channel[at:run]])
                at = run
    return bytes(out)


CODINGS = {"flat": flat, "old runs": old_runs, "new runs": new_runs}


def save(path, body, header=HEADER, size=b"-Y 8 +X 16\n"):
    path.write_bytes(header + size + body)
    return path


@pytest.mark.parametrize("coding", CODINGS)
def test_each_coding_is_read_exactly(tmp_path, rng, coding):
    pixels = rgbe(rng)
    path = save(tmp_path / "a.hdr", CODINGS[coding](pixels))
    np.testing.assert_array_equal(read_environment(path), values(pixels))


@pytest.mark.parametrize("width", [1, 2, 7, 8, 300, 514, 32767, 70000])
@pytest.mark.parametrize("coding", CODINGS)
def test_rows_of_any_width(rng, width, coding):
    """Runs of more than 256 pixels have two digits or more, and marks end at 32767."""
    pixels = np.repeat(rgbe(rng, 3, -(-width // 600)), 600, axis=1)[:, :width]
    if coding == "new runs" and not 8 <= width <= 32767:
        return
    data = b"begin" + CODINGS[coding](pixels) + b"end"
    found, end = _runs.decode_rows(data, 5, 3, width)
    np.testing.assert_array_equal(found.swapaxes(1, 2), pixels)
    assert end == len(data) - 3


def test_rows_may_be_coded_each_in_its_own_way(tmp_path, rng):
    pixels = rgbe(rng, 24, 48)
    kinds = list(CODINGS.values())
    body = b"".join(kinds[i % 7 % 3](row[None]) for i, row in enumerate(pixels))
    path = save(tmp_path / "a.hdr", body, size=b"-Y 24 +X 48\n")
    np.testing.assert_array_equal(read_environment(path), values(pixels))


def test_bytes_that_look_like_a_row_are_none(tmp_path):
    """A picture of marks: every fourth byte begins what could be a row."""
    pixels = np.zeros((8, 16, 4), np.uint8)
    pixels[..., :] = [2, 2, 0, 16]
    pixels[..., 3] = 130
    pixels[:, ::2, 0], pixels[:, 1::2, 0] = 2, 16  # 2 16 2 16 in a literal
    body = b"".join(
        b"\2\2\0\x10" + b"".join(b"\x10" + bytes(c) for c in row.T.tolist()) for row in pixels
    )
    path = save(tmp_path / "a.hdr", body)
    np.testing.assert_array_equal(read_environment(path), values(pixels))


ORDERS = {
    "-Y 8 +X 16": lambda p: p,
    "+Y 8 +X 16": lambda p: p[::-1],
    "-Y 8 -X 16": lambda p: p[:, ::-1],
    "+Y 8 -X 16": lambda p: p[::-1, ::-1],
    "+X 16 -Y 8": lambda p: p.swapaxes(0, 1),
    "+X 16 +Y 8": lambda p: p[::-1].swapaxes(0, 1),
    "-X 16 -Y 8": lambda p: p[:, ::-1].swapaxes(0, 1),
    "-X 16 +Y 8": lambda p: p[::-1, ::-1].swapaxes(0, 1),
}


@pytest.mark.parametrize("order", ORDERS)
def test_all_orders_are_turned_upright(tmp_path, rng, order):
    pixels = rgbe(rng)
    path = save(tmp_path / "a.hdr", new_runs(ORDERS[order](pixels)), size=order.encode() + b"\n")
    np.testing.assert_array_equal(read_environment(path), values(pixels))


@pytest.mark.parametrize(
    "header",
    [
        b"#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n",
        b"#?RADIANCE\n\n",
        b"#?AUTOPANO\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n",
        b"#?RADIANCE\n# 100% = hand\nFORMAT= 32-bit_rle_rgbe \nPRIMARIES=0 0 0 0 0 0 0 0\n\n",
        b"oconv a.rad\nrpict -vf x=1\nFORMAT=32-bit_rle_rgbe\n\n",
        b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2.5\nCOLORCORR=1 2 3\n\n",
        b"#?RADIANCE\nPRIMARIES=0.640 0.330 0.290 0.600 0.150 0.060 0.333 0.333\n\n",
        b"#?RADIANCE\nSOFTWARE=caf\xe9\nFORMAT=32-bit_rle_rgbe\n\n",
    ],
)
@pytest.mark.parametrize("name", ["a.hdr", "a.pic"])
def test_headers_of_other_programs(tmp_path, rng, header, name):
    """Their exposure, color correction and standard primaries leave the numbers as they are."""
    pixels = rgbe(rng)
    size = b"-Y 8 +X 16\r\n" if b"\r" in header else b"-Y 8 +X 16\n"
    path = save(tmp_path / name, new_runs(pixels), header, size)
    np.testing.assert_array_equal(read_environment(path), values(pixels))


def test_xyz_is_converted(tmp_path, rng):
    """Colors of Rec. 709 by IEC 61966-2-1's matrix, whose inverse it prints to four digits."""
    linear = rng.uniform(0.2, 1, size=(8, 16, 3))
    matrix = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    xyz = linear @ np.transpose(matrix)
    # Written as R, G, B by another writer, then said to be X, Y, Z.
    path = write_image(tmp_path / "a.hdr", xyz.astype(np.float32))
    path.write_bytes(path.read_bytes().replace(b"_rgbe", b"_xyze"))
    # Eight bits of the largest, times up to 3.2: 0.011 measured.
    np.testing.assert_allclose(read_environment(path), linear, rtol=0, atol=0.012)
    assert np.abs(np.asarray(read_environment(path)) - linear).mean() < 0.005


def test_other_primaries_are_converted(tmp_path):
    """White of any primaries with D65 stays white; P3's green is none of Rec. 709."""
    p3 = b"PRIMARIES=0.680 0.320 0.265 0.690 0.150 0.060 0.3127 0.3290\n"
    header = HEADER.replace(b"FORMAT", p3 + b"FORMAT")
    white = np.full((8, 16, 4), 128, np.uint8)
    path = save(tmp_path / "a.hdr", flat(white), header)
    np.testing.assert_allclose(read_environment(path), 0.5, rtol=1e-6)
    green = white.copy()
    green[..., [0, 2]] = 0
    path = save(tmp_path / "a.hdr", flat(green), header)
    with pytest.raises(ValueError, match=r"a\.hdr: 256 negative values"):
        read_environment(path)
    with pytest.warns(UserWarning, match="256 negative"):
        image = read_environment(path, repair=True)
    # ITU-R BT.2087's way with P3's numbers: G' = 1.0421 G, 4 digits.
    np.testing.assert_allclose(image[..., 1], 0.5 * 1.0421, rtol=1e-4)


@pytest.mark.parametrize("coding", CODINGS)
def test_bytes_after_the_end_are_no_harm(tmp_path, rng, coding):
    pixels = rgbe(rng)
    for tail in (b"\0", b"\n", b"made by hand", bytes(1000)):
        path = save(tmp_path / "a.hdr", CODINGS[coding](pixels) + tail)
        np.testing.assert_array_equal(read_environment(path), values(pixels))


@pytest.mark.parametrize("coding", ["flat", "new runs"])
def test_rows_after_the_last_say_that_the_height_is_wrong(tmp_path, rng, coding):
    path = save(tmp_path / "a.hdr", CODINGS[coding](rgbe(rng, 16)))
    with pytest.raises(
        ValueError, match=r"a\.hdr: damaged: 16 × 8 pixels end at byte .* rows foll"
    ):
        read_environment(path)


@pytest.mark.parametrize("coding", CODINGS)
def test_no_truncated_picture_is_taken_for_a_whole(tmp_path, rng, coding):
    body = CODINGS[coding](rgbe(rng))
    for length in range(0, len(body), 7):
        path = save(tmp_path / "a.hdr", body[:length])
        with pytest.raises(ValueError, match=r"a\.hdr: damaged or truncated: row \d of 8 cannot"):
            read_environment(path)


@pytest.mark.parametrize(
    ("row", "problem"),
    [
        (bytes([1, 1, 1, 3]) + bytes([200, 200, 200, 128]) * 13, "a repeat of no pixel"),
        (bytes([200, 200, 200, 128, 1, 1, 1, 40]), "a repeat beyond the row"),
        (b"\2\2\0\x10" + bytes([128 + 17, 9]) * 4, "a run beyond the row"),
        (b"\2\2\0\x10" + bytes([0]) * 100, "a literal of nothing"),
    ],
)
def test_damaged_rows_are_refused(tmp_path, row, problem):
    path = save(tmp_path / "a.hdr", row * 8)
    with pytest.raises(ValueError, match="damaged or truncated: row 1 of 8"):
        read_environment(path)


@pytest.mark.parametrize(
    ("header", "size", "message"),
    [
        (b"hello\n\n", b"-Y 8 +X 16\n", "not a Radiance picture"),
        (b"#?RADIANCE\n", b"-Y 8 +X 16\n", "not a Radiance picture"),
        (HEADER, b"-Y 8 +Y 16\n", "not a Radiance picture"),
        (HEADER, b"8 16\n", "not a Radiance picture"),
        (HEADER, b"-Y 0 +X 16\n", "needs pixels"),
        (HEADER, b"-Y 400000 +X 800000\n", "cannot be in a file"),
        (HEADER.replace(b"rgbe", b"luv"), b"-Y 8 +X 16\n", "got '32-bit_rle_luv'"),
    ],
)
def test_other_headers_are_refused(tmp_path, rng, header, size, message):
    path = save(tmp_path / "a.hdr", new_runs(rgbe(rng)), header, size)
    with pytest.raises(ValueError, match=rf"a\.hdr: .*{message}"):
        read_environment(path)


@pytest.mark.parametrize("order", ["-Y 8 +X 16", "+Y 8 -X 16"])
def test_large_pictures_are_read_by_openimageio_to_the_same(tmp_path, rng, monkeypatch, order):
    pixels = rgbe(rng)
    path = save(tmp_path / "a.hdr", new_runs(ORDERS[order](pixels)), size=order.encode() + b"\n")
    more = save(tmp_path / "more.hdr", new_runs(rgbe(rng, 9)))
    cut = tmp_path / "cut.hdr"
    cut.write_bytes(path.read_bytes()[:-1])
    calls = []
    opened = oiio.ImageInput.open
    monkeypatch.setattr(oiio.ImageInput, "open", lambda p: calls.append(p) or opened(p))
    read_environment(path)
    assert not calls
    monkeypatch.setattr(_radiance, "_LARGE", 0)
    np.testing.assert_array_equal(read_environment(path), values(pixels))
    assert calls == [str(path)]
    with pytest.raises(ValueError, match="more rows follow"):
        read_environment(more)
    with pytest.raises(ValueError, match="row 8 of 8 cannot be read"):
        read_environment(cut)


def by_openimageio(path):
    """Give pixels as they lie in the file, or None for what it cannot read."""
    source = oiio.ImageInput.open(str(path))
    if source is None:
        oiio.geterror()
        return None
    pixels = source.read_image(0, 0, 0, 3, oiio.FLOAT)
    return None if source.geterror() else pixels


@pytest.mark.parametrize(
    ("header", "code"),
    [
        (HEADER, old_runs),
        (HEADER, lambda p: flat(p[:2]) + old_runs(p[2:4]) + new_runs(p[4:])),
        (b"#?RADIANCE\n\n", new_runs),
        (HEADER.replace(b"rgbe", b"xyze"), new_runs),
    ],
    ids=["old runs", "rows of all codings", "no FORMAT", "XYZ"],
)
def test_what_openimageio_cannot_read(tmp_path, rng, monkeypatch, header, code):
    """It is why there is a decoder of our own: once all of this is read there, that may go."""
    monkeypatch.setattr(_radiance, "_LARGE", 0)
    pixels = rgbe(rng)
    if b"xyze" in header:
        pixels[..., :3] = 200  # white, which is a color of Rec. 709
    path = save(tmp_path / "a.hdr", code(pixels), header)
    image, expected = np.asarray(read_environment(path)), values(pixels)
    theirs = by_openimageio(path)
    assert theirs is None or not np.array_equal(theirs, expected)
    if b"xyze" not in header:
        np.testing.assert_array_equal(image, expected)
    else:  # Y of Rec. 709's weights, which IEC 61966-2-1 prints to four digits
        luminance = image @ np.float32([0.2126, 0.7152, 0.0722])
        np.testing.assert_allclose(luminance, expected[..., 1], rtol=2e-5)


def test_without_openimageio(tmp_path, rng, monkeypatch):
    pixels = rgbe(rng)
    monkeypatch.setitem(__import__("sys").modules, "OpenImageIO", None)
    monkeypatch.setattr(_radiance, "_LARGE", 0)
    path = save(tmp_path / "a.hdr", new_runs(pixels))
    np.testing.assert_array_equal(read_environment(path), values(pixels))
    with pytest.raises(ImportError, match=r"a\.exr: reading \.exr needs the package OpenImageIO"):
        read_environment(path.rename(tmp_path / "a.exr"))
