"""Truncated, changed and made-up picture files: a picture that is one, or refused by name."""

import warnings

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from picture_writers import encoded

from jaxsh.imaging import read_environment

FORMATS = (".exr", ".hdr", ".pfm", ".npy")


@pytest.mark.parametrize("suffix", FORMATS)
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


@pytest.mark.parametrize("suffix", FORMATS)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(max_size=400))
def test_random_bytes_never_crash(tmp_path, suffix, data):
    read_or_refuse(tmp_path / f"random{suffix}", data)


EDITS = st.lists(
    st.tuples(st.floats(0, 1, exclude_max=True), st.binary(max_size=8), st.integers(0, 8)),
    max_size=4,
)
# A header's numbers, and other digits in their place: files that are whole but for their sizes.
DIGITS = st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.sampled_from(b"0123456789")))


def changed(data: bytes, edits, digits) -> bytes:
    out = bytearray(data)
    numbers = [i for i, byte in enumerate(data[:128]) if chr(byte).isdigit()]
    for where, digit in digits if numbers else ():
        out[numbers[int(where * len(numbers))]] = digit
    for where, new, removed in edits:
        at = int(where * len(out))
        out[at : at + removed] = new
    return bytes(out)


@pytest.mark.parametrize("suffix", FORMATS)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=100)
@given(edits=EDITS, digits=DIGITS)
def test_changed_bytes_never_crash(tmp_path, suffix, edits, digits):
    data = changed(encoded(tmp_path, suffix), edits, digits)
    read_or_refuse(tmp_path / f"changed{suffix}", data)


@pytest.mark.parametrize("suffix", [".hdr", ".pfm", ".npy"])
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=100)
@given(digits=DIGITS)
def test_no_other_size_is_believed(tmp_path, suffix, digits):
    """Another size in the header is no other picture: it is refused, or it is the same size."""
    path = tmp_path / f"sized{suffix}"
    path.write_bytes(changed(encoded(tmp_path, suffix), [], digits))
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", category=UserWarning, message=".*replaced")
        try:
            image = read_environment(path, repair=True)
        except ValueError:
            return
    assert image.shape == (8, 16, 3)


def test_a_huge_announcement_does_not_allocate(tmp_path):
    path = tmp_path / "huge.hdr"
    data = encoded(tmp_path, ".hdr").replace(b"-Y 8 +X 16", b"-Y 40000 +X 80000")
    path.write_bytes(data)
    with pytest.raises(ValueError, match=r"huge\.hdr: damaged"):
        read_environment(path)


def test_a_huge_tile_does_not_allocate(tmp_path, rng):
    picture = rng.uniform(0, 4, size=(8, 16, 3)).astype(np.float32)
    spec = oiio.ImageSpec(16, 8, 3, "float")
    spec.tile_width = spec.tile_height = 16
    out = oiio.ImageOutput.create("a.exr")
    path = tmp_path / "a.exr"
    assert out.open(str(path), spec)
    assert out.write_image(picture)
    out.close()
    np.testing.assert_array_equal(read_environment(path), picture)
    # The attribute's name, type, length and width.
    at = path.read_bytes().index(b"tiledesc\0") + len(b"tiledesc\0") + 4
    data = bytearray(path.read_bytes())
    data[at : at + 8] = (8976).to_bytes(4, "little") + (4096).to_bytes(4, "little")
    path.write_bytes(data)
    with pytest.raises(ValueError, match=r"a\.exr: damaged: 16 × 8 pixels cannot be in a file"):
        read_environment(path)
