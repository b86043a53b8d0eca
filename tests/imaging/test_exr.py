"""What OpenEXR files hold: environment maps, layers, parts, windows, primaries, counts."""

import struct

import numpy as np
import OpenImageIO as oiio
import painters
import pytest
from picture_writers import save, spec_of

from jaxsh.imaging import read_environment
from jaxsh.sphere import project_lat_long


def save_parts(path, parts):
    out = oiio.ImageOutput.create(path)
    assert out.open(path, tuple(spec for _, spec in parts))
    for i, (pixels, spec) in enumerate(parts):
        assert i == 0 or out.open(path, spec, "AppendSubimage")
        assert out.write_image(np.ascontiguousarray(pixels))
    assert out.close()


@pytest.fixture
def picture(rng):
    return rng.uniform(0.1, 4, size=(8, 16, 3)).astype(np.float32)


@pytest.mark.parametrize(
    ("layout", "name", "full"),
    [("lat-long", "LatLong Environment", (128, 64)), ("cube", "CubeFace Environment", (64, 64))],
)
def test_an_environment_map_says_how_it_is_read(tmp_path, layout, name, full):
    """Its display window may be a face: the data window is the map."""
    directions = painters.PAINTERS[layout, "openexr"](64)
    pixels = painters.colored_axes(directions).astype(np.float32)
    path = tmp_path / "a.exr"
    save(path, pixels, textureformat=name, full_width=full[0], full_height=full[1])
    image = read_environment(path, height=64)
    expected = painters.colored_axes(painters.jaxsh_lat_long(64))
    np.testing.assert_allclose(image, expected, rtol=0, atol=5e-3)  # 4.8e-3 measured
    np.testing.assert_array_equal(
        image, read_environment(path, height=64, layout=layout, orientation="openexr")
    )
    # Another orientation is the caller's word against the file's.
    other = read_environment(path, height=64, orientation="jaxsh")
    assert np.abs(np.asarray(image) - other).max() > 0.5


def test_the_two_environment_maps_of_a_light_agree(tmp_path, rng):
    light = rng.uniform(0.5, 1, size=6)
    found = []
    for layout, name in (("lat-long", "LatLong"), ("cube", "CubeFace")):
        directions = painters.PAINTERS[layout, "openexr"](48)
        unit = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
        lobes = [np.exp(4 * (unit @ axis - 1)) for axis in np.concatenate([np.eye(3), -np.eye(3)])]
        pixels = (np.stack(lobes, axis=-1) @ light)[..., None].astype(np.float32)
        path = save(tmp_path / f"{name}.exr", pixels, "Y", textureformat=f"{name} Environment")
        found.append(project_lat_long(read_environment(path, height=48), 3))
    np.testing.assert_allclose(found[0], found[1], rtol=0, atol=1e-3)  # 9.2e-4 measured, of 2.6


def test_options_that_the_files_layout_lacks(tmp_path, picture):
    path = save(tmp_path / "a.exr", picture, textureformat="LatLong Environment")
    with pytest.raises(ValueError, match=r"a\.exr: orientation must be .* 'lat-long', got 'opengl"):
        read_environment(path, orientation="opengl")
    with pytest.raises(ValueError, match=r"a\.exr: a cube picture is six square faces"):
        read_environment(path, layout="cube")


def test_the_display_window_is_the_picture(tmp_path, rng):
    """What is beyond it is cut off; what is not stored is asked for."""
    beyond = rng.uniform(1, 2, size=(12, 20, 3)).astype(np.float32)
    window = dict(full_x=0, full_y=0, full_width=16, full_height=8)
    path = save(tmp_path / "a.exr", beyond, x=-3, y=-2, **window)
    np.testing.assert_array_equal(read_environment(path), beyond[2:10, 3:19])
    save(path, beyond, x=7, y=5, full_x=7, full_y=5, full_width=20, full_height=12)
    with pytest.raises(ValueError, match="twice as wide as high, not 20 × 12"):
        read_environment(path)
    part = beyond[:5, :16]
    save(path, part, x=-3, y=2, **window)
    with pytest.raises(
        ValueError, match=r"a\.exr: only a part .*: rows 2 to 7 of 8, columns 0 to 13"
    ):
        read_environment(path)
    expected = np.zeros((8, 16, 3))
    expected[2:7, :13] = part[:, 3:]
    np.testing.assert_array_equal(read_environment(path, repair=True), expected)
    save(path, part, x=100, y=2, **window)
    with pytest.raises(ValueError, match="nothing of the picture is stored"):
        read_environment(path, repair=True)


def test_a_window_far_larger_than_the_picture_is_not_filled(tmp_path, picture):
    path = save(tmp_path / "a.exr", picture, full_x=0, full_y=0, full_width=320, full_height=160)
    with pytest.raises(ValueError, match=r"a\.exr: only 16 × 8 pixels of 320 × 160 are stored"):
        read_environment(path, repair=True)


def test_a_layer_alone_needs_no_name_and_two_do(tmp_path, picture):
    names = ["beauty.R", "beauty.G", "beauty.B", "beauty.A"]
    alpha = np.concatenate([picture, picture[..., :1]], axis=-1)
    path = save(tmp_path / "a.exr", alpha, names)
    for layer in (None, "beauty"):
        np.testing.assert_array_equal(read_environment(path, layer=layer), picture)
    two = np.concatenate([picture, 2 * picture], axis=-1)
    save(path, two, ["beauty.R", "beauty.G", "beauty.B", "glow.R", "glow.G", "glow.B"])
    with pytest.raises(ValueError, match=r"a\.exr: its colors are in layers 'beauty', 'glow'"):
        read_environment(path)
    np.testing.assert_array_equal(read_environment(path, layer="glow"), 2 * picture)
    with pytest.raises(ValueError, match="no layer 'halo': the file has 'beauty', 'glow'"):
        read_environment(path, layer="halo")
    save(path, two, ["R", "G", "B", "glow.R", "glow.G", "glow.B"])
    np.testing.assert_array_equal(read_environment(path), picture)
    np.testing.assert_array_equal(read_environment(path, layer="glow"), 2 * picture)
    with pytest.raises(ValueError, match=r"a\.hdr: only \.exr pictures have layers"):
        read_environment(path.rename(tmp_path / "a.hdr"), layer="glow")


def test_the_first_part_with_colors_is_read(tmp_path, picture):
    path, depth = str(tmp_path / "a.exr"), picture[..., :1]
    parts = [
        (depth, spec_of(depth, "Z", oiio__subimagename="depth")),
        (picture, spec_of(picture, oiio__subimagename="rgba")),
        (2 * picture, spec_of(picture, oiio__subimagename="glow")),
    ]
    save_parts(path, parts)
    np.testing.assert_array_equal(read_environment(path), picture)
    np.testing.assert_array_equal(read_environment(path, layer="glow"), 2 * picture)


def test_luminance_and_chroma(tmp_path, picture):
    """Y by the weights of the primaries, RY = (R - Y)/Y, BY = (B - Y)/Y, in OpenEXR's words."""
    y = picture @ [0.2126, 0.7152, 0.0722]
    chroma = [picture[..., 0] / y - 1, picture[..., 2] / y - 1]
    stored = np.stack([y, *chroma], axis=-1).astype(np.float32)
    path = save(tmp_path / "a.exr", stored, ("Y", "RY", "BY"))
    # Four digits of Rec. 709's weights.
    np.testing.assert_allclose(read_environment(path), picture, rtol=0, atol=3e-4)


@pytest.mark.parametrize("name", ["Y", "luma", "r"])
def test_one_channel_is_gray(tmp_path, picture, name):
    path = save(tmp_path / "a.exr", picture[..., :2], (name, "A"))
    expected = np.repeat(picture[..., :1], 3, axis=-1)
    np.testing.assert_array_equal(read_environment(path), expected)


def test_a_vector_is_no_picture(tmp_path, picture):
    names = ("normal.X", "normal.Y", "normal.Z", "view.R", "view.G", "view.B")
    path = save(tmp_path / "a.exr", np.concatenate([-picture, picture], axis=2), names)
    np.testing.assert_array_equal(read_environment(path), picture)
    with pytest.raises(ValueError, match="no layer 'normal'"):
        read_environment(path, layer="normal")
    path = save(tmp_path / "b.exr", picture, ("X", "Y", "Z"))
    with pytest.raises(ValueError, match="needs channels R, G, B or a single one"):
        read_environment(path)


def by_hand(path, planes, sampling=None):
    """An uncompressed file of planes by name, uint32 or float32, as OpenEXR's layout says."""
    planes = dict(sorted(planes.items()))
    height, width = next(iter(planes.values())).shape
    channels = b"".join(
        struct.pack(
            f"<{len(name) + 1}siiii", name.encode(), plane.dtype.kind == "f" and 2, 0, *each
        )
        for name, plane in planes.items()
        for each in [(sampling or {}).get(name, (1, 1))]
    )
    window = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    attributes = {
        "channels": ("chlist", channels + b"\0"),
        "compression": ("compression", b"\0"),
        "dataWindow": ("box2i", window),
        "displayWindow": ("box2i", window),
        "lineOrder": ("lineOrder", b"\0"),
        "pixelAspectRatio": ("float", struct.pack("<f", 1)),
        "screenWindowCenter": ("v2f", struct.pack("<ff", 0, 0)),
        "screenWindowWidth": ("float", struct.pack("<f", 1)),
    }
    header = struct.pack("<ii", 20000630, 2)
    for name, (kind, value) in attributes.items():
        header += b"%b\0%b\0" % (name.encode(), kind.encode())
        header += struct.pack("<i", len(value)) + value
    header += b"\0"
    rows = [b"".join(plane[y].tobytes() for plane in planes.values()) for y in range(height)]
    first, size = len(header) + 8 * height, 8 + len(rows[0])
    offsets = struct.pack(f"<{height}Q", *(first + size * y for y in range(height)))
    body = b"".join(struct.pack("<ii", y, len(row)) + row for y, row in enumerate(rows))
    path.write_bytes(header + offsets + body)
    return path


def test_counts_are_read_as_numbers(tmp_path, rng):
    counts = rng.integers(1, 1000, size=(8, 16, 3)).astype(np.uint32)
    path = by_hand(tmp_path / "a.exr", {c: counts[..., i] for i, c in enumerate("RGB")})
    np.testing.assert_array_equal(read_environment(path), counts)
    mixed = {"R": counts[..., 0], "G": counts[..., 1].astype(np.float32), "B": counts[..., 2]}
    np.testing.assert_array_equal(read_environment(by_hand(path, mixed)), counts)


def test_counts_of_a_later_part(tmp_path, rng):
    path, counts = str(tmp_path / "a.exr"), rng.integers(1, 1000, size=(2, 8, 16, 3))
    pixels = counts.astype(np.uint32)
    names = ("one", "two")
    save_parts(
        path,
        [
            (part, spec_of(part, kind="uint", oiio__subimagename=name))
            for part, name in zip(pixels, names, strict=True)
        ],
    )
    for part, name in zip(pixels, names, strict=True):
        np.testing.assert_array_equal(read_environment(path, layer=name), part)


def test_primaries_are_converted_to_rec709(tmp_path, picture):
    """XYZ as primaries, as in a public picture that is stored both ways: IEC 61966-2-1's matrix."""
    matrix = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    xyz = (picture @ np.transpose(matrix)).astype(np.float32)
    primaries = (1, 0, 0, 1, 0, 0, 1 / 3, 1 / 3)
    path = save(tmp_path / "a.exr", xyz, chromaticities=primaries)
    np.testing.assert_allclose(
        read_environment(path), picture, rtol=0, atol=1e-3
    )  # of four digits: 6.7e-4
    rec709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
    save(path, picture, chromaticities=rec709)
    np.testing.assert_array_equal(read_environment(path), picture)
    save(path, picture, chromaticities=(0.3,) * 8)
    with pytest.raises(ValueError, match=r"a\.exr: damaged: chromaticities .* span no colors"):
        read_environment(path)


def test_the_finest_level_of_a_tiled_picture(tmp_path, picture):
    plain, tiled = save(tmp_path / "plain.exr", picture), tmp_path / "tiled.exr"
    options = oiio.ImageSpec(0, 0, 0, "float")
    options.tile_width = options.tile_height = 8
    assert oiio.ImageBufAlgo.make_texture(oiio.MakeTxTexture, str(plain), str(tiled), options)
    source = oiio.ImageInput.open(str(tiled))
    assert source.seek_subimage(0, 4)  # down to one pixel
    source.close()
    np.testing.assert_array_equal(read_environment(tiled), picture)


def test_deep_pictures_are_refused_by_name(tmp_path):
    path = str(tmp_path / "a.exr")
    spec = oiio.ImageSpec(16, 8, 4, "float")
    spec.deep = True
    spec.channelnames = ("R", "G", "B", "A")
    deep = oiio.DeepData()
    deep.init(128, 4, ["float"] * 4, ["R", "G", "B", "A"])
    for pixel in range(128):
        deep.set_samples(pixel, 1)
    out = oiio.ImageOutput.create(path)
    assert out.open(path, spec)
    assert out.write_deep_image(deep)
    assert out.close()
    with pytest.raises(ValueError, match=r"a\.exr: it holds deep samples, no pixels"):
        read_environment(path)


def test_chroma_of_fewer_pixels_is_refused_by_name(tmp_path, picture):
    """The header alone says it: it is met before any pixel."""
    planes = dict(zip(("Y", "RY", "BY"), np.moveaxis(picture, -1, 0), strict=True))
    path = by_hand(tmp_path / "a.exr", planes, {"RY": (2, 2), "BY": (2, 2)})
    with pytest.raises(ValueError, match=r"a\.exr: its chroma has fewer pixels .* save it as R, G"):
        read_environment(path)
