"""Relit meshes, opened again by the rules of glTF and PLY with NumPy, by trimesh, by our reader."""

import dataclasses
import io
import json
import re
import struct

import jax.numpy as jnp
import numpy as np
import pytest
import trimesh
from PIL import Image

from jaxsh import geometry, imaging
from jaxsh.geometry import BaseColor, Mesh

KINDS = {5126: "<f4", 5125: "<u4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class Glb:
    """A GLB by its specification, without our reader."""

    def __init__(self, path):
        data = path.read_bytes()
        (length,) = struct.unpack_from("<I", data, 12)
        self.json = json.loads(data[20 : 20 + length])
        self.binary = data[20 + length + 8 :]

    def view(self, index: int) -> bytes:
        view = self.json["bufferViews"][index]
        return self.binary[view["byteOffset"] :][: view["byteLength"]]

    def array(self, index: int) -> np.ndarray:
        accessor = self.json["accessors"][index]
        numbers = np.frombuffer(self.view(accessor["bufferView"]), KINDS[accessor["componentType"]])
        return numbers.reshape(-1, WIDTHS[accessor["type"]])

    def attribute(self, name: str, primitive: int = 0) -> np.ndarray:
        return self.array(self.json["meshes"][0]["primitives"][primitive]["attributes"][name])

    def picture(self, material: int) -> np.ndarray:
        """The base color's texture of a material."""
        surface = self.json["materials"][material]["pbrMetallicRoughness"]
        source = self.json["textures"][surface["baseColorTexture"]["index"]]["source"]
        view = self.json["images"][source]["bufferView"]
        return np.asarray(Image.open(io.BytesIO(self.view(view))).convert("RGB"))


def square(**more) -> Mesh:
    """Two faces, with UV."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    normals = np.tile(np.float32([0, 0, 1]), (4, 1))
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    arrays = (jnp.asarray(one) for one in (corners, faces, normals, corners[:, :2]))
    return Mesh(*arrays, **more)


RADIANCE = np.array(
    [[0.1, 0.2, 0.3], [0.002, 0.5, 0.9], [0.0, -0.1, 0.25], [0.4, 1.5, 0.05]], np.float32
)


def screen(radiance, exposure) -> np.ndarray:
    return 255 * np.asarray(imaging.tone_map(jnp.asarray(radiance), exposure), np.float64)


def test_a_glb_shows_the_tone_mapped_radiance_under_any_light(tmp_path):
    mesh = square(origin=(8.0, 0.0, 0.0))
    path = imaging.write_relit(tmp_path / "a" / "relit.glb", mesh, RADIANCE, exposure=0.75)
    glb = Glb(path)
    (material,) = glb.json["materials"]
    assert material["extensions"] == {"KHR_materials_unlit": {}}
    assert glb.json["extensionsUsed"] == ["KHR_materials_unlit"]
    assert [one["material"] for one in glb.json["meshes"][0]["primitives"]] == [0]
    # Unlit: factor times vertex color, linear, which the program encodes as sRGB.
    seen = glb.attribute("COLOR_0")[:, :3] * np.float32(
        material["pbrMetallicRoughness"]["baseColorFactor"][:3]
    )
    assert seen.min() >= 0 <= 1 >= seen.max()
    np.testing.assert_allclose(screen(seen, 1.0), screen(RADIANCE, 0.75), rtol=0, atol=1e-4)
    read = geometry.read_mesh(path)
    assert read.materials[0].unlit
    np.testing.assert_array_equal(read.vertices, np.asarray(mesh.vertices) + np.float32([8, 0, 0]))
    np.testing.assert_allclose(read.colors[:, :3], seen, rtol=0, atol=1e-7)
    loaded = trimesh.load(path, process=False)
    (part,) = loaded.geometry.values()
    assert part.faces.tolist() == np.asarray(mesh.faces).tolist()


def test_a_ply_has_the_colors_of_the_screen(tmp_path):
    mesh = square(materials=(BaseColor("unused"),))
    path = imaging.write_relit(tmp_path / "relit.ply", mesh, RADIANCE, exposure=0.75)
    expected = np.rint(screen(RADIANCE, 0.75))
    header, body = path.read_bytes().split(b"end_header\n")
    kinds = {"float": "<f4", "uchar": "u1"}
    fields = re.findall(r"property (float|uchar) (\w+)\n", header.decode())
    rows = np.frombuffer(body, [(name, kinds[kind]) for kind, name in fields], 4)
    codes = np.stack([rows[name] for name in ("red", "green", "blue")], axis=1)
    assert codes.dtype == np.uint8
    np.testing.assert_array_equal(codes, expected)
    loaded = trimesh.load(path, process=False)
    np.testing.assert_array_equal(loaded.visual.vertex_colors[:, :3], expected)
    colors = geometry.read_mesh(path).colors
    np.testing.assert_allclose(screen(colors[:, :3], 1.0), expected, rtol=0, atol=1e-4)


def test_the_exposure_is_by_default_the_pictures(tmp_path):
    path = imaging.write_relit(tmp_path / "relit.glb", square(), RADIANCE)
    exposure = float(imaging.auto_exposure(jnp.asarray(RADIANCE)[None]))
    seen = Glb(path).attribute("COLOR_0")[:, :3]
    np.testing.assert_allclose(seen, np.clip(exposure * RADIANCE, 0, 1), rtol=0, atol=1e-7)


def test_textures_and_colors_stay_and_are_multiplied(tmp_path, rng):
    texture = rng.integers(0, 256, (2, 3, 4)).astype(np.uint8)
    texture[..., 3] = 255
    brick = BaseColor("brick", (0.5, 0.25, 1.0, 1.0), texture)
    colors = rng.uniform(size=(4, 4)).astype(np.float32)
    mesh = square(colors=jnp.asarray(colors), face_material=jnp.array([0, -1]), materials=(brick,))
    path = imaging.write_relit(tmp_path / "t.glb", mesh, RADIANCE, exposure=0.5, textured=True)
    glb = Glb(path)
    assert [one["name"] for one in glb.json["materials"]] == ["brick", "relit"]
    assert all(one["extensions"] == {"KHR_materials_unlit": {}} for one in glb.json["materials"])
    np.testing.assert_array_equal(glb.picture(0), texture[..., :3])
    factor = glb.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"]
    assert factor == [0.5, 0.25, 1.0, 1.0]
    lit = np.clip(0.5 * RADIANCE, 0, 1) * colors[:, :3]
    np.testing.assert_allclose(glb.attribute("COLOR_0")[:, :3], lit, rtol=0, atol=1e-7)
    np.testing.assert_array_equal(glb.attribute("COLOR_0")[:, 3], colors[:, 3])


def test_texels_become_a_texture_that_lies_where_they_do(tmp_path, rng):
    u = jnp.asarray([[0.1, 0.1], [0.9, 0.1], [0.9, 0.6], [0.1, 0.6]], jnp.float32)
    mesh = square(materials=(BaseColor("old", double_sided=True),), face_material=jnp.zeros(2, int))
    texels = geometry.texels(dataclasses.replace(mesh, uv=u), (12, 10))
    radiance = rng.uniform(0, 1.2, (texels.num_points, 3)).astype(np.float32)
    path = imaging.write_relit(tmp_path / "t.glb", texels, radiance, exposure=0.9)
    glb = Glb(path)
    (material,) = glb.json["materials"]
    assert material["extensions"] == {"KHR_materials_unlit": {}}
    assert material["doubleSided"]
    picture = glb.picture(0)
    assert picture.shape == (10, 12, 3)
    # glTF: (0, 0) is the upper left of the picture.
    corners = glb.attribute("TEXCOORD_0")[
        glb.array(glb.json["meshes"][0]["primitives"][0]["indices"])
    ]
    face, weights = np.asarray(texels.face), np.asarray(texels.barycentric)
    place = np.einsum("nkc,nk->nc", corners.reshape(-1, 3, 2)[face], weights) * [12, 10]
    column, row = np.floor(place).astype(int).T
    expected = np.rint(screen(radiance, 0.9))
    np.testing.assert_array_equal(picture[row, column], expected)
    # Nothing dark beside the chart, which a smaller picture would mix in.
    mean = np.clip(0.9 * radiance.astype(np.float64), 0, 1).mean(axis=0)
    np.testing.assert_allclose(picture[0, 0], screen(mean, 1.0), rtol=0, atol=0.51)
    (read,) = geometry.read_mesh(path).materials
    np.testing.assert_array_equal(read.texture[..., :3], picture)
    assert read.wrap == "clamp"  # an edge shows nothing of the one across
    (part,) = trimesh.load(path, process=False).geometry.values()
    np.testing.assert_array_equal(part.visual.material.baseColorTexture, picture)
    for name, more in (("a.ply", {}), ("a.glb", {"textured": True})):
        with pytest.raises(ValueError, match="expected a mesh as surface, got Texels"):
            imaging.write_relit(tmp_path / name, texels, radiance, **more)


def test_what_does_not_fit_is_refused_and_nothing_is_left(tmp_path, unchecked):
    mesh = square()
    picture = BaseColor("picture", texture=np.full((1, 1, 4), 255, np.uint8))
    blind = square(face_material=jnp.array([0, 0]), materials=(picture,))
    blind = dataclasses.replace(blind, uv=None)
    loose = square(materials=(BaseColor("loose"),))
    for message, change in (
        ("cannot write .obj, only .glb and .ply", {"path": tmp_path / "a.obj"}),
        (r"expected radiance \(4, 3\), got shape \(4,\)", {"radiance": np.ones(4)}),
        ("radiance must be finite, got nan in 12 of 12", {"radiance": np.full((4, 3), np.nan)}),
        ("exposure must be a number > 0", {"exposure": -1.0}),
        ("a .ply has no textures to leave", {"path": tmp_path / "a.ply", "textured": True}),
        ("expected a mesh with materials or colors", {"textured": True}),
        ("has a texture, but the mesh has no UV", {"surface": blind, "textured": True}),
        ("1 materials, but no face_material", {"surface": loose, "textured": True}),
    ):
        given = {"path": tmp_path / "a.glb", "surface": mesh, "radiance": RADIANCE} | change
        with pytest.raises(ValueError, match=message):
            imaging.write_relit(given.pop("path"), given.pop("surface"), **given)
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "ü").touch()
    with pytest.raises(NotADirectoryError, match=r"ü/a\.glb: cannot be written: a file stands"):
        imaging.write_relit(tmp_path / "ü" / "a.glb", mesh, RADIANCE)


def test_unlit_survives_a_file_and_is_said_where_it_cannot(tmp_path):
    lit, bare = BaseColor("lit"), BaseColor("bare", unlit=True)
    mesh = square(face_material=jnp.array([0, 1]), materials=(lit, bare))
    read = geometry.read_mesh(geometry.write_mesh(tmp_path / "a.glb", mesh))
    assert [one.unlit for one in read.materials] == [False, True]
    with pytest.warns(UserWarning, match=r"left out, as \.obj has none: unlit materials"):
        geometry.write_mesh(tmp_path / "a.obj", mesh)
