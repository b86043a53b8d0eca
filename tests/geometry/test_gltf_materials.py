"""Base color, texture coordinates and pictures of glTF files."""

import base64
import io
import zlib
from pathlib import Path

import numpy as np
import pytest
from gltf_writer import CORNERS, Gltf
from PIL import Image

from jaxsh.geometry._files._gltf import read_gltf

PICTURE = np.random.default_rng(0).integers(0, 256, (3, 5, 4), np.uint8)
UV = np.float32([[0, 0], [1, 0], [0, 1], [0.25, 0.75]])


def encoded(picture=PICTURE, kind="PNG", **options) -> bytes:
    file = io.BytesIO()
    image = picture if isinstance(picture, Image.Image) else Image.fromarray(picture)
    image.save(file, kind, **options)
    return file.getvalue()


def textured(data: bytes | None = None, info: dict | None = None, **material) -> Gltf:
    """A tetrahedron with TEXCOORD_0 of `UV`; its base color texture is image 0."""
    gltf = Gltf()
    gltf.mesh(material=0, attributes={"TEXCOORD_0": gltf.add(UV)})
    if data is not None:
        gltf.entry("images", bufferView=gltf.view(data))
    gltf.entry("textures", source=0)
    gltf.entry(
        "materials",
        pbrMetallicRoughness={"baseColorTexture": {"index": 0, **(info or {})}},
        **material,
    )
    return gltf


def read(gltf: Gltf, node: dict | None = None, folder: Path = Path(".")):
    return read_gltf(folder / "a.glb", gltf.glb({} if node is None else node))


def test_factor_name_and_sides():
    gltf = Gltf()
    color = {"pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 1]}}
    gltf.entry("materials")
    gltf.entry("materials", name="brick", doubleSided=True, extras={"a": 1}, **color)
    for material in (1, 0, None, 1):
        fields = {} if material is None else {"material": material}
        gltf.entry("nodes", mesh=gltf.mesh(**fields))
    polygons = read_gltf(Path("a.glb"), gltf.glb())
    first, second = polygons.materials  # in the order of use
    assert (first.name, first.factor, first.double_sided) == ("brick", (0.1, 0.2, 0.3, 1), True)
    assert (second.name, second.factor, second.double_sided) == ("", (1, 1, 1, 1), False)
    assert first.texture is second.texture is None
    np.testing.assert_array_equal(polygons.polygon_material, np.repeat([0, 1, -1, 0], 4))
    assert polygons.found == ()


def test_a_picture_from_a_view_and_v_upwards():
    polygons = read(textured(encoded()))
    np.testing.assert_array_equal(polygons.materials[0].texture, PICTURE)
    np.testing.assert_allclose(polygons.uv, (UV * [1, -1] + [0, 1])[polygons.corners])
    assert polygons.found == ()


@pytest.mark.parametrize("uri", ["picture.png", "sub%20a/picture.png", "data"])
def test_a_picture_from_a_uri(tmp_path, uri):
    gltf, data = textured(), encoded()
    if uri == "data":
        uri = "data:image/png;base64," + base64.b64encode(data).decode()
    else:
        (tmp_path / "sub a").mkdir()
        (tmp_path / uri.replace("%20", " ")).write_bytes(data)
    gltf.entry("images", uri=uri)
    np.testing.assert_array_equal(read(gltf, folder=tmp_path).materials[0].texture, PICTURE)


def test_kinds_of_pictures():
    rgb, gray = PICTURE[..., :3], PICTURE[..., 0]
    opaque = np.full((3, 5, 1), 255, np.uint8)
    deep = np.uint16([[0, 257, 65535, 1000, 30000]])
    cases = [
        (encoded(rgb), np.concatenate([rgb, opaque], 2), 0),
        (encoded(gray), np.concatenate([gray[..., None]] * 3 + [opaque], 2), 0),
        (encoded(deep), np.round(deep[..., None] / 257 * [1, 1, 1, 0] + [0, 0, 0, 255]), 0),
        (encoded(Image.fromarray(gray).point(lambda x: 255 * (x > 99)).convert("1")), None, 0),
        (encoded(Image.fromarray(rgb).quantize(15)), np.concatenate([rgb, opaque], 2), 0),
        (encoded(PICTURE, "WEBP", lossless=True, exact=True), PICTURE, 0),
        (
            encoded(np.full((8, 8, 3), (200, 100, 50), np.uint8), "JPEG", quality=95),
            np.full((8, 8, 4), (200, 100, 50, 255)),
            2,
        ),
    ]
    for data, expected, error in cases:
        texture = read(textured(data)).materials[0].texture
        assert texture.dtype == np.uint8
        if expected is None:
            expected = np.stack([255 * (gray > 99)] * 3 + [opaque[..., 0]], 2)
        assert np.abs(texture.astype(int) - expected).max() <= error


def test_the_set_and_the_transform_of_the_texture():
    gltf = textured(encoded(), {"texCoord": 1})
    attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["TEXCOORD_1"] = gltf.add((UV * 65535).round().astype(np.uint16), normalized=True)
    attributes["TEXCOORD_0"] = gltf.add(np.float32(9 * UV))
    polygons = read(gltf)
    np.testing.assert_allclose(
        polygons.uv, (UV * [1, -1] + [0, 1])[polygons.corners], rtol=0, atol=1e-5
    )

    info = gltf.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    angle = 0.4
    info["extensions"] = {
        "KHR_texture_transform": {
            "offset": [0.1, -0.2],
            "rotation": angle,
            "scale": [2, 3],
            "texCoord": 0,
        }
    }
    polygons = read_gltf(Path("a.glb"), gltf.glb())
    # The extension's text: matrices that act on (u, v, 1), offset · rotation · scale.
    move = np.array([[1, 0, 0.1], [0, 1, -0.2], [0, 0, 1]])
    turn = np.array(
        [[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    expected = np.c_[9 * UV, np.ones(4)] @ (move @ turn @ np.diag([2, 3, 1])).T
    expected = expected[:, :2] * [1, -1] + [0, 1]
    np.testing.assert_allclose(polygons.uv, expected[polygons.corners], rtol=0, atol=1e-7)


@pytest.mark.parametrize("kind", ["f4", "u1", "u2"])
@pytest.mark.parametrize("width", [3, 4])
@pytest.mark.parametrize("flagged", [True, False])
def test_vertex_colors(kind, width, flagged):
    gltf = Gltf()
    colors = np.random.default_rng(1).uniform(size=(4, width))
    largest = 1 if kind == "f4" else np.iinfo(kind).max
    stored = (colors * largest).astype(kind)
    gltf.mesh(attributes={"COLOR_0": gltf.add(stored, normalized=flagged)})
    polygons = read(gltf)
    expected = np.ones((4, 4))
    expected[:, :width] = stored / largest
    np.testing.assert_allclose(polygons.colors, expected[polygons.corners], rtol=0, atol=1e-7)


def test_what_only_some_primitives_have_is_nan_elsewhere():
    gltf = textured(encoded())
    gltf.entry("nodes", mesh=gltf.mesh(CORNERS + np.float32(5)))
    polygons = read(gltf)
    far = polygons.positions[polygons.corners, 0] >= 5
    np.testing.assert_array_equal(np.isnan(polygons.uv).all(axis=1), far)
    assert far.sum() == 12


def test_diffuse_color_of_specular_materials_comes_first():
    diffuse = {"diffuseFactor": [0.5, 0.6, 0.7, 1], "diffuseTexture": {"index": 0}}
    gltf = textured(
        encoded(), extensions={"KHR_materials_pbrSpecularGlossiness": diffuse}, alphaMode="OPAQUE"
    )
    gltf.json["materials"][0]["pbrMetallicRoughness"] = {"baseColorFactor": [0, 0, 0, 1]}
    material = read(gltf).materials[0]
    assert material.factor == (0.5, 0.6, 0.7, 1)
    np.testing.assert_array_equal(material.texture, PICTURE)


def said(gltf: Gltf, folder: Path = Path(".")) -> str:
    """What is found, where the shape is read all the same."""
    polygons = read(gltf, folder=folder)
    assert len(polygons.sizes) == 4
    (phrase,) = polygons.found
    return phrase


def test_pictures_that_cannot_be_read_are_said(tmp_path):
    gltf = textured()
    gltf.json["textures"] = [{"extensions": {"KHR_texture_basisu": {"source": 0}}}]
    assert said(gltf) == "1 textures not read (first: texture 0 is with KHR_texture_basisu only)"
    assert "image 0 cannot be decoded: it is KTX2" in said(
        textured(b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(80))
    )
    assert "image 0 is in 'none.png', which is not there" in said(missing("none.png"), tmp_path)
    assert "only files in the folder" in said(missing("../a.png"), tmp_path)
    assert "cannot be decoded" in said(textured(encoded()[:60]))
    assert "it is neither PNG, JPEG nor WebP" in said(textured(b"no picture"))
    gltf = textured(encoded())
    gltf.json["bufferViews"][-1]["byteLength"] = 9999
    assert "needs bytes" in said(gltf)
    huge = bytearray(encoded())
    huge[16:24] = (12000).to_bytes(4, "big") * 2  # the size in the header, and its checksum
    huge[29:33] = zlib.crc32(huge[12:29]).to_bytes(4, "big")
    assert "12000 × 12000 pixels are out of proportion" in said(textured(bytes(huge)))


def missing(uri: str) -> Gltf:
    gltf = textured()
    gltf.entry("images", uri=uri)
    return gltf


def test_a_fallback_picture_is_taken():
    gltf = textured(encoded())
    gltf.json["textures"][0]["extensions"] = {"KHR_texture_basisu": {"source": 1}}
    assert read(gltf).found == ()
    gltf = textured(b"no picture")
    gltf.json["textures"][0]["extensions"] = {"EXT_texture_webp": {"source": 1}}
    gltf.entry("images", bufferView=gltf.view(encoded(PICTURE, "WEBP", lossless=True, exact=True)))
    np.testing.assert_array_equal(read(gltf).materials[0].texture, PICTURE)


def test_what_the_base_color_does_not_hold_is_said():
    assert "cut out or blended by alpha" in said(textured(encoded(), alphaMode="MASK"))
    gltf = textured(encoded(), {"texCoord": 2})
    assert said(gltf) == "1 primitives have a texture but no TEXCOORD_2"
    gltf = textured(encoded())
    gltf.json["textures"][0]["sampler"] = gltf.entry("samplers", wrapS=33071)
    assert read(gltf).found == ()
    gltf = textured(encoded())
    gltf.json["textures"][0]["sampler"] = gltf.entry("samplers", wrapS=33071)
    attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["TEXCOORD_0"] = gltf.add(np.float32(2 * UV))
    assert "goes on otherwise along u than v, read as repeated" in said(gltf)
    gltf = textured(encoded())
    attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["TEXCOORD_0"] = gltf.add(np.where(UV.max() == UV, np.nan, UV).astype(np.float32))
    assert "texture coordinates are NaN or infinite, read as 0" in said(gltf)
    for wrap, code in (("clamp", 33071), ("mirror", 33648)):
        gltf = textured(encoded())
        gltf.json["textures"][0]["sampler"] = gltf.entry("samplers", wrapS=code, wrapT=code)
        attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"]
        attributes["TEXCOORD_0"] = gltf.add(np.float32(2 * UV))
        polygons = read(gltf)
        assert polygons.found == ()
        assert polygons.materials[0].wrap == wrap
    gltf = textured(encoded(), normalTexture={"index": 0})
    (material,) = gltf.json["materials"]
    material["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {"index": 0}
    material["extensions"] = {"KHR_materials_clearcoat": {"clearcoatTexture": {"index": 0}}}
    maps = "clearcoatTexture metallicRoughnessTexture normalTexture"
    assert said(gltf) == f"3 other maps of materials ignored ({maps})"
    gltf = textured(encoded())
    gltf.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = [2, -1, 0.5, 1]
    assert said(gltf) == "1 base colors beyond 0 to 1 cut off there"
    assert read_gltf(Path("a.glb"), gltf.glb()).materials[0].factor == (1, 0, 0.5, 1)
    assert "give off light" in said(textured(encoded(), emissiveFactor=[0, 1, 0]))
    gltf = textured(encoded())
    gltf.json["extensions"] = {"KHR_materials_variants": {"variants": [{"name": "a"}] * 3}}
    assert said(gltf) == "3 material variants ignored: the default is read"


def test_materials_are_read_once_and_checked():
    gltf = textured(encoded())
    gltf.json["meshes"][0]["primitives"] *= 3
    gltf.json["materials"][0]["doubleSided"] = 1
    with pytest.raises(ValueError, match="material 0 should have true or false as 'doubleSided'"):
        read(gltf)
    del gltf.json["materials"][0]["doubleSided"]
    gltf.json["nodes"] = []
    gltf.json["textures"] = []
    with pytest.raises(ValueError, match="names textures 0, but the file has 0"):
        read(gltf)
