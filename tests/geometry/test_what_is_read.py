"""The table of meshes in `docs/what-is-read.md`: each of its claims is tried on a file."""

import io
import json
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fuzz_files import seeds
from gltf_writer import CORNERS, FACES, Gltf
from PIL import Image
from test_gltf_packed import GRID, accessor, packed

from jaxsh.geometry import read_mesh
from jaxsh.geometry._files._write import _FORMATS
from jaxsh.geometry._read import _PARSERS

PAGE = Path(__file__).parents[2] / "docs" / "what-is-read.md"


def table() -> dict[tuple[str, str], str]:
    """(feature, extension) -> the first word of its cell, for all but "–"."""
    section = PAGE.read_text("utf-8").split("## Meshes")[1].split("\n## ")[0]
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in section.splitlines()
        if line.startswith("|")
    ]
    head, _, *body = rows
    return {
        (row[0], extension.split()[0].strip("`")): re.split(r"[ ,]", cell)[0]
        for row in body
        for extension, cell in zip(head[1:], row[1:], strict=True)
        if cell != "–"
    }


def test_the_page_names_what_is_read_and_written():
    section = PAGE.read_text("utf-8").split("## Meshes")[1].split("\n## ")[0]
    named = re.findall(r"`(\.\w+)`", next(ln for ln in section.splitlines() if "`.glb`" in ln))
    assert set(named) == set(_PARSERS)
    assert set(table().values()) == {"read", "said", "refused"}
    written = next(part for part in section.split("\n\n") if part.startswith("`geometry.write_m"))
    assert set(re.findall(r"`(\.\w+)`", written)) == set(_FORMATS)


def area(mesh) -> float:
    corners = np.asarray(mesh.vertices, np.float64)[np.asarray(mesh.faces)]
    edges = np.diff(corners, axis=1)
    return float(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum() / 2)


def has_area(expected):
    return lambda mesh: abs(area(mesh) - expected) < 1e-6


def normals_are(*expected):
    return lambda mesh: np.allclose(mesh.normals, expected, atol=1e-6)


def reddish(mesh) -> bool:
    """The color (0.5, 0, 0, 1) of a file, as it is or decoded from sRGB."""
    return np.abs(np.asarray(mesh.colors) - [0.2140411, 0, 0, 1]).max() < 1e-5


def picture(mesh) -> bool:
    return np.array_equal(mesh.materials[0].texture[0, 0], [10, 20, 30, 255])


TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
PLY = "ply\nformat ascii 1.0\n{c}element vertex 3\nproperty float x\nproperty float y\n"
PLY += "property float z\n{v}element face 1\n{f}end_header\n0 0 0{a}\n1 0 0{a}\n0 1 0{a}\n{b}\n"
LIST = "property list uchar int vertex_indices\n"


def ply(v="", f=LIST, a="", b="3 0 1 2", c=""):
    return PLY.format(v=v, f=f, a=a, b=b, c=c)


def off(head="OFF", more="", face="3 0 1 2", count=1):
    return f"{head}\n3 {count} 0\n0 0 0{more}\n1 0 0{more}\n0 1 0{more}\n{face}\n"


def png() -> bytes:
    out = io.BytesIO()
    Image.fromarray(np.array([[[10, 20, 30]]], "u1")).save(out, "png")
    return out.getvalue()


def gltf(change=lambda one: None, corners: Any = CORNERS, node: Any = (), **fields: Any) -> bytes:
    """A tetrahedron, changed before its node is added."""
    one = Gltf()
    mesh = {key: value(one) if callable(value) else value for key, value in fields.items()}
    one.mesh(corners(one) if callable(corners) else corners, **mesh)
    change(one)
    return one.glb(dict(node))


def material(one: Gltf, picture=False) -> int:
    surface: dict[str, Any] = {"baseColorFactor": [0.5, 0.25, 0, 1]}
    if picture:
        one.entry("images", bufferView=one.view(png()), mimeType="image/png")
        one.entry("textures", source=0)
        surface["baseColorTexture"] = {"index": 0}
    return one.entry("materials", pbrMetallicRoughness=surface)


def attribute(name, values):
    return {"attributes": lambda one: {name: one.add(np.asarray(values, "f4"))}}


def sparse(one: Gltf) -> int:
    index, value = one.view(np.uint8([3]).tobytes()), one.view(np.float32([0, 0, 5]).tobytes())
    inner = {"bufferView": index, "componentType": 5121}
    return one.add(CORNERS, sparse={"count": 1, "indices": inner, "values": {"bufferView": value}})


def instances(one: Gltf) -> dict:
    places = one.add(np.float32([[0, 0, 0], [5, 0, 0], [9, 0, 0]]))
    return {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}}


def instanced() -> bytes:
    one = Gltf()
    one.mesh()
    return one.glb({"extensions": instances(one)})


def skinned() -> bytes:
    one = Gltf()
    joints = one.add(np.zeros((4, 4), "u1"))
    weights = one.add(np.tile(np.float32([1, 0, 0, 0]), (4, 1)))
    one.mesh(attributes={"JOINTS_0": joints, "WEIGHTS_0": weights})
    one.entry("nodes", translation=[0, 0, 7])
    one.entry("skins", joints=[0])
    return one.glb({"skin": 0})


def draco() -> bytes:
    DracoPy = pytest.importorskip("DracoPy")
    one = Gltf(extensionsRequired=["KHR_draco_mesh_compression"])
    data = DracoPy.encode(CORNERS, FACES.astype(np.uint32), quantization_bits=14)
    packed = {"bufferView": one.view(data), "attributes": {"POSITION": 0}}
    position = one.entry("accessors", count=4, componentType=5126, type="VEC3")
    corners = one.entry("accessors", count=12, componentType=5125, type="SCALAR")
    primitive = {
        "attributes": {"POSITION": position},
        "indices": corners,
        "extensions": {"KHR_draco_mesh_compression": packed},
    }
    one.entry("meshes", primitives=[primitive])
    return one.glb({})


def meshopt() -> bytes:
    one = Gltf(extensionsRequired=["EXT_meshopt_compression"])
    view = packed(one, "floats 0", 49, 12, "ATTRIBUTES")
    one.mesh(accessor(one, view, 49, 5126, "VEC3"), np.uint8(GRID))
    one.json["buffers"] = [{"byteLength": len(one.bytes)}, {"byteLength": 10**6}]
    return one.glb({})


def morphed(one: Gltf) -> None:
    (primitive,) = one.json["meshes"][0]["primitives"]
    primitive["targets"] = [{"POSITION": one.add(np.float32([[0, 0, 2]] * 4))}]
    one.json["meshes"][0]["weights"] = [1]


def quantized(one: Gltf) -> int:
    one.json["extensionsRequired"] = ["KHR_mesh_quantization"]
    return one.add((CORNERS * 32767).astype("i2"), normalized=True)


def top(height):
    """The highest point of a y-up file whose z grew: our -y."""
    return lambda mesh: abs(-float(mesh.vertices[:, 1].min()) - height) < 1e-6


SURFACE = 1.5 + 3**0.5 / 2  # of the tetrahedron
MTL = "newmtl a\nKd 0.5 0.25 0\nd 1\n"
OBJ_FACE = TRIANGLE + "f 1 2 3\n"
UP, RIGHT = [0, 0, 1], [1, 0, 0]
TILTED = [0.6, 0, 0.8]
FILES = {kind: {i: data for i, data in enumerate(seeds(kind))} for kind in ("ply", "off", "stl")}

# (feature, extension) -> its file or files, and what shows that the claim holds.
TRIED: dict[tuple[str, str], tuple[Any, Any]] = {
    ("text", ".glb"): ("gltf", has_area(SURFACE)),
    ("text", ".obj"): (OBJ_FACE, has_area(0.5)),
    ("text", ".ply"): (ply(), has_area(0.5)),
    ("text", ".off"): (off(), has_area(0.5)),
    ("text", ".stl"): (FILES["stl"][1], has_area(5.75)),
    ("binary", ".glb"): (gltf(), has_area(SURFACE)),
    ("binary", ".ply"): ([FILES["ply"][1], FILES["ply"][2]], has_area(5.75)),
    ("binary", ".off"): (FILES["off"][3], has_area(5.75)),
    ("binary", ".stl"): (FILES["stl"][0], has_area(5.75)),
    ("polygons of more than three corners", ".obj"): (seeds("obj")[0], has_area(5.75)),
    ("polygons of more than three corners", ".ply"): (FILES["ply"][0], has_area(5.75)),
    ("polygons of more than three corners", ".off"): (FILES["off"][0], has_area(5.75)),
    ("strips", ".glb"): (gltf(faces=np.uint16([0, 1, 2, 3]), mode=5), has_area(0.5 + 3**0.5 / 2)),
    ("strips", ".ply"): (FILES["ply"][4], has_area(3.75)),
    ("fans", ".glb"): (gltf(faces=np.uint16([0, 1, 2, 3]), mode=6), has_area(1.0)),
    ("normals", ".glb"): (
        gltf(faces=np.uint16([0, 1, 2]), corners=CORNERS[:3], **attribute("NORMAL", [TILTED] * 3)),
        normals_are([0.6, -0.8, 0]),
    ),
    ("normals", ".obj"): (TRIANGLE + "vn .6 0 .8\nf 1//1 2//1 3//1\n", normals_are(TILTED)),
    ("normals", ".ply"): (
        ply(v="property float nx\nproperty float ny\nproperty float nz\n", a=" .6 0 .8"),
        normals_are(TILTED),
    ),
    ("normals", ".off"): (off("NOFF", " .6 0 .8"), normals_are(TILTED)),
    ("UV", ".glb"): (
        gltf(**attribute("TEXCOORD_0", [[0.25, 0.875]] * 4)),
        lambda mesh: np.array_equal(mesh.uv[0], [0.25, 0.125]),
    ),
    ("UV", ".obj"): (
        TRIANGLE + "vt .25 .125\nf 1/1 2/1 3/1\n",
        lambda mesh: np.array_equal(mesh.uv[0], [0.25, 0.125]),
    ),
    ("UV", ".ply"): (
        [
            ply(v="property float s\nproperty float t\n", a=" .25 .125"),
            ply(f=LIST + "property list uchar float texcoord\n", b="3 0 1 2 6" + " .25 .125" * 3),
        ],
        lambda mesh: np.array_equal(mesh.uv[0], [0.25, 0.125]),
    ),
    ("UV", ".off"): (
        off("STOFF", " .25 .125"),
        lambda mesh: np.array_equal(mesh.uv[0], [0.25, 0.125]),
    ),
    ("vertex colors", ".glb"): (gltf(**attribute("COLOR_0", [[0.2140411, 0, 0, 1]] * 4)), reddish),
    ("vertex colors", ".obj"): ("".join(f"{ln} .5 0 0\n" for ln in TRIANGLE.splitlines())
                                + "f 1 2 3\n", reddish),
    ("vertex colors", ".ply"): (
        ply(v="".join(f"property float {c}\n" for c in ("red", "green", "blue")), a=" .5 0 0"),
        reddish,
    ),
    ("vertex colors", ".off"): (off("COFF", " .5 0 0 1"), reddish),
    ("face colors", ".ply"): (
        ply(f=LIST + "".join(f"property float {c}\n" for c in ("red", "green", "blue")),
            b="3 0 1 2 .5 0 0"),
        reddish,
    ),
    ("face colors", ".off"): (off(face="3 0 1 2 0.5 0 0"), reddish),
    ("face colors", ".stl"): (FILES["stl"][0][:-2] + b"\x1f\x80", "attribute bytes of 1 facets"),
    ("base color", ".glb"): (
        gltf(material=material),
        lambda mesh: tuple(mesh.materials[0].factor) == (0.5, 0.25, 0, 1),
    ),
    ("base color", ".obj"): (
        {"a.obj": f"mtllib a.mtl\nusemtl a\n{OBJ_FACE}", "a.mtl": MTL},
        lambda mesh: tuple(mesh.materials[0].factor) == (0.5, 0.25, 0, 1),
    ),
    ("base color's picture", ".glb"): (
        gltf(material=lambda one: material(one, True), **attribute("TEXCOORD_0", CORNERS[:, :2])),
        picture,
    ),
    ("base color's picture", ".obj"): (
        {
            "a.obj": f"mtllib a.mtl\nusemtl a\n{OBJ_FACE}",
            "a.mtl": MTL + "map_Kd a.png\n",
            "a.png": png(),
        },
        picture,
    ),
    ("base color's picture", ".ply"): (
        {"a.ply": ply(c="comment TextureFile a.png\n"), "a.png": png()},
        picture,
    ),
    ("other maps", ".glb"): (
        gltf(material=lambda one: one.entry("materials", normalTexture={"index": 0})),
        "1 other maps of materials ignored",
    ),
    ("other maps", ".obj"): (
        {"a.obj": f"mtllib a.mtl\nusemtl a\n{OBJ_FACE}", "a.mtl": MTL + "map_Bump a.png\n"},
        r"of materials ignored \(map_bump",
    ),
    ("several objects", ".glb"): (
        gltf(lambda one: one.entry("nodes", mesh=0, translation=[9, 0, 0])), has_area(2 * SURFACE)
    ),
    ("several objects", ".obj"): (
        "o a\n" + OBJ_FACE + "o b\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf -3 -2 -1\n", has_area(1.0)
    ),
    ("several objects", ".stl"): (FILES["stl"][2], has_area(5.75)),
    ("node transforms", ".glb"): (gltf(node={"scale": [2, 2, 2]}), has_area(4 * SURFACE)),
    ("instances", ".glb"): (instanced(), has_area(3 * SURFACE)),
    ("morph targets", ".glb"): (gltf(morphed), top(3)),
    ("skins", ".glb"): (skinned(), top(8)),
    ("animations", ".glb"): (gltf(lambda one: one.entry("animations")), "1 animations ignored"),
    ("sparse accessors", ".glb"): (gltf(corners=sparse), top(5)),
    ("quantized positions", ".glb"): (gltf(corners=quantized), has_area(SURFACE)),
    ("meshopt", ".glb"): (meshopt, top(0.5)),
    ("Draco", ".glb"): (draco, lambda mesh: abs(area(mesh) - SURFACE) < 1e-3),
    ("unknown required extensions", ".glb"): (
        gltf(lambda one: one.json.update(extensionsRequired=["VENDOR_one"])), "it requires .?VENDOR"
    ),
    ("points and lines", ".glb"): (
        gltf(lambda one: one.json["meshes"][0]["primitives"].append(
            {"attributes": {"POSITION": 0}, "mode": 0})), "1 primitives of points or lines"
    ),
    ("points and lines", ".obj"): (OBJ_FACE + "p 1\nl 1 2\n", "1 points ignored, 1 lines ignored"),
    ("points and lines", ".ply"): (
        ply(f=LIST, b="2 0 1\n3 0 1 2").replace("face 1", "face 2"), "1 faces of fewer than three"
    ),
    ("points and lines", ".off"): (
        off(face="2 0 1\n3 0 1 2", count=2), "1 faces of fewer than three"
    ),
    ("curves and surfaces", ".obj"): (OBJ_FACE + "curv 0 1 1 2\nend\n", "1 curves ignored"),
    ("smoothing groups", ".obj"): ("s 1\n" + OBJ_FACE + "s 2\nf 3 2 1\n", "2 smoothing groups"),
    ("other columns", ".obj"): (OBJ_FACE.replace("0 1 0", "0 1 0 1 1"), "further values of 1"),
    ("other columns", ".ply"): (
        ply(v="property float quality\n", a=" 1"), r"vertices ignored \(quality"
    ),
    ("other columns", ".off"): (off(more=" 7"), "1 further values of each vertex ignored"),
}  # fmt: skip


def test_every_claim_is_tried():
    assert set(TRIED) == set(table())


@pytest.mark.parametrize(("feature", "extension"), TRIED)
def test_the_claim_holds(tmp_path, feature, extension):
    content, expected = TRIED[feature, extension]
    content = content() if callable(content) else content
    if content == "gltf":  # the JSON alone, its buffer beside it
        one = Gltf()
        one.mesh()
        one.entry("nodes", mesh=0)
        one.entry("buffers", byteLength=len(one.bytes), uri="a.bin")
        text = json.dumps(one.json)
        content, extension = {"a.gltf": text, "a.bin": bytes(one.bytes)}, ".gltf"
    verdict = table()[feature, ".glb" if extension == ".gltf" else extension]
    for data in content if isinstance(content, list) else [content]:
        files = data if isinstance(data, dict) else {f"a{extension}": data}
        for name, part in files.items():
            (tmp_path / name).write_bytes(part.encode() if isinstance(part, str) else part)
        path = tmp_path / f"a{extension}"
        if verdict == "refused":
            with pytest.raises(ValueError, match=rf"a{re.escape(extension)}: {expected}"):
                read_mesh(path)
        elif verdict == "said":
            with pytest.warns(UserWarning, match=rf"a{re.escape(extension)}: .*{expected}"):
                read_mesh(path)
        else:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                mesh = read_mesh(path)
            assert expected(mesh)
