"""Written mesh files, read by packages that have nothing of ours in them."""

import io
import json
import re
import struct
import warnings

import jax.numpy as jnp
import numpy as np
import pytest
import trimesh
from PIL import Image

from jaxsh.geometry import BaseColor, Mesh, knot, read_mesh, write_mesh

FORMATS = [".ply", ".obj", ".glb", ".stl", ".off"]
COUNT = 12  # vertices; 7 faces


@pytest.fixture
def full(rng):
    """A mesh with all that a mesh can hold, in float32, and two vertices at one position."""
    normals = rng.normal(size=(COUNT, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    vertices = rng.normal(size=(COUNT, 3)) * 10.0 ** rng.integers(-3, 4, (COUNT, 1))
    vertices[7] = vertices[2]
    order = np.arange(COUNT)
    faces = np.concatenate([order, order[:9] - 1]).reshape(-1, 3) % COUNT  # none has both 2 and 7
    faces = rng.permutation(faces)

    def array(values, dtype=jnp.float32):
        return jnp.asarray(values, dtype)

    return Mesh(
        array(vertices),
        array(faces, jnp.int32),
        array(normals),
        array(rng.random((COUNT, 2))),
        array(rng.random((COUNT, 4))),
        array([1, 1, -1, 0, 0, 1, -1], jnp.int32),
        (
            BaseColor("red brick", (0.5, 0.25, 0.125, 1.0), rng.integers(0, 256, (5, 7, 4), "u1")),
            BaseColor("red brick", (1.0, 0.1, 0.0, 0.5), double_sided=True),
        ),
    )


def written(path, mesh, **options):
    """Write, and give the one warning's text, or none."""
    with warnings.catch_warnings(record=True) as met:
        warnings.simplefilter("always")
        assert write_mesh(path, mesh, **options) == path
    assert len(met) <= 1
    return str(met[0].message) if met else ""


def to_y_up(vectors):
    return np.stack([vectors[:, 0], vectors[:, 2], -vectors[:, 1]], axis=1)


def by_material(mesh, ranks):
    """The faces with those of the materials `ranks` first, in that order."""
    chosen = np.asarray(mesh.face_material).tolist()
    keys = [ranks.index(one) if one in ranks else len(ranks) for one in chosen]
    return np.asarray(mesh.faces)[np.argsort(keys, kind="stable")]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # trimesh's own, at seams
@pytest.mark.parametrize("suffix", FORMATS)
def test_trimesh_reads_the_same_triangles(tmp_path, full, suffix):
    path = tmp_path / f"full{suffix}"
    written(path, full)
    loaded = trimesh.load(path, process=False, maintain_order=True)
    parts = loaded.dump() if isinstance(loaded, trimesh.Scene) else [loaded]
    triangles = np.concatenate([np.asarray(part.vertices)[part.faces] for part in parts])
    vertices = np.asarray(full.vertices)
    if suffix == ".glb":
        vertices = to_y_up(vertices)
    # It groups an OBJ's faces by material in an order of its own.
    expected = vertices[by_material(full, {".glb": [1, -1, 0]}.get(suffix, []))]
    triangles = triangles.astype(np.float32)
    if suffix == ".obj":
        triangles, expected = (np.sort(one.reshape(7, 9), axis=0) for one in (triangles, expected))
    np.testing.assert_array_equal(triangles, expected)


def ply(path):
    """Read a PLY by what its header says, NumPy alone."""
    header, body = path.read_bytes().split(b"end_header\n")
    kinds = {"float": "<f4", "double": "<f8", "uchar": "u1"}
    fields = [
        (name, kinds[kind]) for kind, name in re.findall(r"property (\w+) (\w+)\n", header.decode())
    ]
    rows = np.frombuffer(body, fields, COUNT)
    return {name: rows[name] for name, _ in fields}


def test_ply_holds_each_number_to_the_bit(tmp_path, full):
    path = tmp_path / "full.ply"
    assert written(path, full) == f"{path}: left out, as .ply has none: materials"
    rows = ply(path)
    for names, array in [("x y z", full.vertices), ("nx ny nz", full.normals), ("s t", full.uv)]:
        stored = np.stack([rows[name] for name in names.split()], axis=1)
        assert stored.dtype == np.float32
        np.testing.assert_array_equal(stored, array)
    # Random colors are in no byte: sRGB by its definition, in floats; alpha as it is.
    red, alpha = np.asarray(full.colors, np.float64)[:, [0, 3]].T
    encoded = np.where(red <= 0.0031308, 12.92 * red, 1.055 * red ** (1 / 2.4) - 0.055)
    np.testing.assert_allclose(rows["red"], encoded, atol=6e-8)
    np.testing.assert_array_equal(rows["alpha"], alpha.astype(np.float32))


def test_ply_colors_that_came_from_bytes_go_back_into_them(tmp_path, full, rng):
    codes = rng.integers(0, 256, (COUNT, 4), "u1")
    codes[:3] = [[0, 1, 2, 3], [9, 10, 11, 12], [253, 254, 255, 255]]  # both branches of sRGB
    value = codes / 255
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    linear[:, 3] = value[:, 3]
    mesh = Mesh(full.vertices, full.faces, full.normals, colors=jnp.asarray(linear, jnp.float32))
    path = tmp_path / "bytes.ply"
    assert written(path, mesh) == ""
    rows = ply(path)
    stored = np.stack([rows[name] for name in ("red", "green", "blue", "alpha")], axis=1)
    assert stored.dtype == np.uint8
    np.testing.assert_array_equal(stored, codes)


def test_obj_holds_nine_digits_and_shares_positions(tmp_path, full):
    path = tmp_path / "full.obj"
    same = full.colors.at[7].set(full.colors[2])
    full = Mesh(full.vertices, full.faces, full.normals, full.uv, same, None, ())
    assert written(path, full) == f"{path}: left out, as .obj has none: alpha of colors"
    lines = [line.split() for line in path.read_text().splitlines()]
    rows = {key: [line[1:] for line in lines if line[0] == key] for key in ("v", "vt", "vn", "f")}
    assert [len(rows[key]) for key in ("v", "vt", "vn")] == [COUNT - 1, COUNT, COUNT]
    corners = np.array([[word.split("/") for word in face] for face in rows["f"]], int) - 1
    faces = np.asarray(full.faces)
    for key, place, array in [("v", 0, full.vertices), ("vt", 1, full.uv), ("vn", 2, full.normals)]:
        values = np.array(rows[key], float)[:, : array.shape[1]].astype(np.float32)
        np.testing.assert_array_equal(values[corners[..., place]], np.asarray(array)[faces])


def test_obj_materials(tmp_path, full):
    path = tmp_path / "full.obj"
    assert "alpha of colors, double-sided materials" in written(path, full)
    names = re.findall(r"^(?:usemtl (\S+)|f )", path.read_text(), re.M)
    assert names == ["", "", "red_brick_1", "", "", "red_brick", "", "", "red_brick_1", ""]
    assert path.with_suffix(".mtl").read_text() == (
        "newmtl red_brick\nKd 0.5 0.25 0.125\nd 1\nmap_Kd full_0.png\n"
        "newmtl red_brick_1\nKd 1 0.1 0\nd 0.5\n"
    )
    with Image.open(tmp_path / "full_0.png") as picture:
        np.testing.assert_array_equal(picture, full.materials[0].texture)
    assert {file.name for file in tmp_path.iterdir()} == {"full.obj", "full.mtl", "full_0.png"}


def glb(path):
    """Take a GLB apart: its JSON, and each accessor as an array."""
    data = path.read_bytes()
    magic, version, size, length, kind = struct.unpack("<4sIII4s", data[:20])
    assert (magic, version, size, kind) == (b"glTF", 2, len(data), b"JSON")
    content = json.loads(data[20 : 20 + length])
    body = data[28 + length :]
    assert len(body) == content["buffers"][0]["byteLength"]
    parts = [
        body[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        for view in content["bufferViews"]
    ]
    widths = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
    arrays = [
        np.frombuffer(parts[one["bufferView"]], {5126: "<f4", 5125: "<u4"}[one["componentType"]])
        .reshape(one["count"], widths[one["type"]])
        for one in content["accessors"]
    ]  # fmt: skip
    return content, arrays, parts


def test_colors_over_1(tmp_path, plain):
    """Readers of glTF must cut them off; the others have them in sRGB."""
    colors = np.asarray(plain.colors).copy()
    colors[0] = 4, 0.5, 1.5, 1
    colors[:, 3] = 1
    mesh = Mesh(plain.vertices, plain.faces, plain.normals, colors=jnp.asarray(colors))
    for suffix in (".glb", ".ply", ".obj"):
        path = tmp_path / f"a{suffix}"
        glb = suffix == ".glb"
        assert written(path, mesh) == (
            f"{path}: left out, as .glb has none: colors over 1" if glb else ""
        )
        phrase = (
            "1 primitives have colors over 1, cut off as glTF says" if glb else " to 1.82 taken"
        )
        with pytest.warns(UserWarning, match=phrase):
            read = read_mesh(path)
        expected = np.minimum(colors, 1) if glb else colors
        met = np.asarray(read.colors)[np.asarray(read.faces)]
        np.testing.assert_allclose(met, expected[np.asarray(mesh.faces)], rtol=1e-6, atol=2e-7)


def test_glb_holds_each_number_to_the_bit(tmp_path, full):
    path = tmp_path / "full.glb"
    assert written(path, full) == ""
    content, arrays, parts = glb(path)
    primitives = content["meshes"][0]["primitives"]
    assert [one.get("material") for one in primitives] == [1, None, 0]
    faces = np.concatenate([arrays[one["indices"]].reshape(-1, 3) for one in primitives])
    np.testing.assert_array_equal(faces, by_material(full, [1, -1, 0]))
    at = primitives[0]["attributes"]
    np.testing.assert_array_equal(arrays[at["POSITION"]], to_y_up(np.asarray(full.vertices)))
    np.testing.assert_array_equal(arrays[at["NORMAL"]], to_y_up(np.asarray(full.normals)))
    np.testing.assert_array_equal(arrays[at["COLOR_0"]], full.colors)
    np.testing.assert_array_equal(arrays[at["TEXCOORD_0"]][:, 0], full.uv[:, 0])
    np.testing.assert_allclose(
        1 - arrays[at["TEXCOORD_0"]][:, 1].astype(float), full.uv[:, 1], atol=3e-8
    )
    bounds = content["accessors"][at["POSITION"]]
    np.testing.assert_array_equal(bounds["min"], arrays[at["POSITION"]].min(axis=0))
    np.testing.assert_array_equal(bounds["max"], arrays[at["POSITION"]].max(axis=0))

    brick, other = content["materials"]
    assert brick["pbrMetallicRoughness"]["baseColorFactor"] == [0.5, 0.25, 0.125, 1]
    assert other["doubleSided"]
    assert other["pbrMetallicRoughness"] == {
        "baseColorFactor": [1, 0.1, 0, 0.5],
        "metallicFactor": 0,
    }
    with Image.open(io.BytesIO(parts[content["images"][0]["bufferView"]])) as picture:
        np.testing.assert_array_equal(picture, full.materials[0].texture)


@pytest.mark.parametrize("suffix", FORMATS)
def test_up_turns_as_reading_turns_back(tmp_path, full, suffix):
    mesh = Mesh(full.vertices, full.faces, full.normals)
    turned = Mesh(*[jnp.asarray(to_y_up(np.asarray(a))) for a in (mesh.vertices,)], mesh.faces,
                  jnp.asarray(to_y_up(np.asarray(mesh.normals))))  # fmt: skip
    files = [tmp_path / name / f"a{suffix}" for name in ("up_y", "turned_before")]
    written(files[0], mesh, up="y")
    written(files[1], turned, up="z")
    assert files[0].read_bytes() == files[1].read_bytes()


def test_assimp_reads_normals_uv_and_colors(tmp_path, full):
    assimp_py = pytest.importorskip("assimp_py")
    mesh = Mesh(full.vertices, full.faces, full.normals, full.uv, full.colors)
    for suffix in (".ply", ".obj", ".glb"):
        path = tmp_path / f"full{suffix}"
        written(path, mesh)
        (loaded,) = assimp_py.import_file(str(path), assimp_py.Process_Triangulate).meshes
        corners = np.asarray(loaded.indices)
        faces = np.asarray(mesh.faces).reshape(-1)
        turn = to_y_up if suffix == ".glb" else np.asarray
        for theirs, ours in [
            (loaded.vertices, turn(mesh.vertices)),
            (loaded.normals, turn(mesh.normals)),
            (loaded.texcoords[0], mesh.uv),
        ]:
            theirs = np.asarray(theirs).reshape(loaded.num_vertices, -1)[corners]
            ours = np.asarray(ours)[faces]
            np.testing.assert_allclose(theirs[:, : ours.shape[1]], ours, rtol=1e-6, atol=6e-8)


def same(read, mesh, suffix):
    """Assert that a mesh was read as it was written, but for what a format does to numbers."""
    shared = dict.fromkeys(("vertices", "faces", "normals", "face_material"), 0)
    uv = {".glb": 3e-8}.get(suffix, 0)
    colors = {".ply": 1e-7, ".obj": 1e-7}.get(suffix, 0)
    for name, off in (shared | {"uv": uv, "colors": colors}).items():
        ours, theirs = getattr(mesh, name), getattr(read, name)
        assert (theirs is None) == (ours is None), name
        if ours is not None:
            assert theirs.dtype == ours.dtype
            np.testing.assert_allclose(theirs, ours, rtol=0, atol=off, err_msg=name)
    assert [one.factor for one in read.materials] == [one.factor for one in mesh.materials]
    for one, other in zip(read.materials, mesh.materials, strict=True):
        np.testing.assert_array_equal(one.texture, other.texture)


@pytest.fixture
def plain(rng):
    """A closed mesh, its faces in groups of materials, all colors opaque; no seams."""
    mesh = knot(300)
    count, faces = len(mesh.vertices), len(mesh.faces)
    colors = rng.random((count, 4)).astype(np.float32)
    colors[:, 3] = 1
    return Mesh(
        mesh.vertices,
        mesh.faces,
        mesh.normals,
        jnp.asarray(rng.random((count, 2)), jnp.float32),
        jnp.asarray(colors),
        jnp.asarray(np.repeat([-1, 0, 1], faces // 3), jnp.int32),
        (
            BaseColor("brick", (0.5, 0.25, 0.125, 1.0), rng.integers(0, 256, (5, 7, 4), "u1")),
            BaseColor("glass", (1.0, 0.1, 0.0, 0.5)),
        ),
    )


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".glb"])
@pytest.mark.parametrize("up", [None, "y"])
def test_read_mesh_gives_the_same_mesh_back(tmp_path, plain, suffix, up):
    path = tmp_path / f"full{suffix}"
    if suffix == ".ply":
        plain = Mesh(*[getattr(plain, name) for name in
                       ("vertices", "faces", "normals", "uv", "colors")])  # fmt: skip
    assert written(path, plain, up=up) == ""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read = read_mesh(path, up=up)
    same(read, plain, suffix)
    # What was read is written as the same bytes.
    again = tmp_path / "again" / path.name
    written(again, read, up=up)
    if suffix != ".ply":  # whose colors are rounded twice
        assert again.read_bytes() == path.read_bytes()


@pytest.mark.parametrize("suffix", FORMATS)
def test_hard_edges_and_seams_come_back(tmp_path, full, suffix):
    path = tmp_path / f"full{suffix}"
    written(path, full)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of normals that are random
        read = read_mesh(path)
    order = by_material(full, {".glb": [1, -1, 0], ".obj": [-1]}.get(suffix, []))
    names = ["vertices", "normals", "uv"] if suffix in (".ply", ".obj", ".glb") else ["vertices"]
    for name in names:
        ours, theirs = np.asarray(getattr(full, name)), np.asarray(getattr(read, name))
        off = 3e-8 if (suffix, name) == (".glb", "uv") else 0
        np.testing.assert_allclose(theirs[read.faces], ours[order], rtol=0, atol=off)


@pytest.mark.parametrize("stem", ["my own mesh", "x #1", "#2", "-bm 1", "a\\", ' "b" '])
def test_names_of_any_text_and_a_path_of_any(tmp_path, plain, stem):
    path = tmp_path / f"{stem}.obj"
    odd = ["a b", "\ud800 \n é", "", "#", "#c", "d\\"]
    mesh = Mesh(
        plain.vertices,
        plain.faces,
        plain.normals,
        plain.uv,
        face_material=jnp.asarray(np.arange(len(plain.faces)) * 6 // len(plain.faces), jnp.int32),
        materials=tuple(BaseColor(name, texture=plain.materials[0].texture) for name in odd),
    )
    assert written(path, mesh) == ""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read = read_mesh(path)
    same(read, mesh, ".obj")
    assert [one.name for one in read.materials] == ["a_b", "?_é", "material_2", "_", "_c", "d_"]
    written(path.with_suffix(".glb"), mesh)
    same(read_mesh(path.with_suffix(".glb")), mesh, ".glb")


def test_origin_comes_back(tmp_path, plain):
    for suffix in (".ply", ".obj", ".glb", ".off"):
        mesh = Mesh(plain.vertices, plain.faces, plain.normals, origin=(4e5, 8e5, -32.0))
        path = tmp_path / f"far{suffix}"
        written(path, mesh)
        read = read_mesh(path, origin=mesh.origin)
        assert read.origin == mesh.origin
        # In float64 the sum is off by 6e-11, which float32 sees near zero alone.
        np.testing.assert_allclose(read.vertices, mesh.vertices, rtol=0, atol=6e-11)


ORIGIN = (4e5 + 1 / 3, 8e5, -1e-3)


def test_origin_is_added_back(tmp_path, full):
    mesh = Mesh(full.vertices, full.faces, full.normals, origin=ORIGIN)
    expected = np.asarray(full.vertices, np.float64) + ORIGIN
    written(tmp_path / "far.ply", mesh)
    rows = ply(tmp_path / "far.ply")
    np.testing.assert_array_equal(np.stack([rows[axis] for axis in "xyz"], axis=1), expected)
    written(tmp_path / "far.glb", mesh)
    content, arrays, _ = glb(tmp_path / "far.glb")
    assert content["nodes"][0]["translation"] == [ORIGIN[0], ORIGIN[2], -ORIGIN[1]]
    np.testing.assert_array_equal(arrays[0], to_y_up(np.asarray(full.vertices)))
    for suffix, skip in ((".obj", 0), (".off", 2)):
        written(tmp_path / f"far{suffix}", mesh)
        lines = (tmp_path / f"far{suffix}").read_text().splitlines()[skip:]
        rows = [line.split()[-3:] for line in lines[: COUNT - (suffix == ".obj")]]
        kept = np.delete(expected, 7, axis=0) if suffix == ".obj" else expected
        np.testing.assert_array_equal(np.array(rows, float), kept)
    with pytest.raises(ValueError, match=r"far\.stl: \.stl has float32 positions, which cannot"):
        write_mesh(tmp_path / "far.stl", mesh)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"vertices": "nan"}, "1 values of vertices are NaN or infinite"),
        ({"colors": np.full((COUNT, 4), -0.5, "f4")}, "48 values of colors are negative"),
        ({"normals": np.ones((3, 3), "f4")}, r"normals must be floats \(12, 3\), got float32"),
        ({"faces": np.array([[0, 1, 12]])}, "faces name vertices 0 to 12, but there are 12"),
        ({"faces": np.array([[0, -1, 2]])}, "faces name vertices -1 to 2, but there are 12"),
        ({"faces": np.zeros((0, 3), int)}, r"faces must be whole numbers \(f, 3\) with f > 0"),
        ({"uv": np.zeros((COUNT, 2), int)}, r"uv must be floats \(12, 2\), got int64"),
        ({"face_material": np.zeros(3, int)}, r"face_material must be \(7,\)"),
        ({"materials": ()}, "face_material names materials -1 to 1, but there are 0"),
        ({"origin": (0.0, np.inf, 0.0)}, r"its origin is \(0.0, inf, 0.0\)"),
        ({"materials": {"factor": (1.0, np.nan, 0.0, 1.0)}}, "factor of material 0"),
        ({"materials": {"texture": np.zeros((2, 2, 4), "u2")}}, "must be uint8"),
        ({"materials": {"texture": np.zeros((2, 2), "u1")}}, r"be \(h, w, 4\), got"),
    ],
)
@pytest.mark.usefixtures("unchecked")
def test_what_is_no_mesh_is_refused_and_nothing_is_made(tmp_path, full, change, reason):
    fields = {name: getattr(full, name) for name in full.__dataclass_fields__} | change
    if change == {"vertices": "nan"}:
        fields["vertices"] = full.vertices.at[3, 1].set(jnp.nan)
    if isinstance(fields["materials"], dict):
        fields["materials"] = (BaseColor(**fields["materials"]),) * 2
    path = tmp_path / "folder" / "bad.glb"
    mesh = object.__new__(Mesh)  # as `equinox.tree_at` makes one: nobody looks whether parts fit
    for name, value in fields.items():
        object.__setattr__(mesh, name, value)
    with pytest.raises(ValueError, match=rf"bad\.glb: cannot be written: .*{reason}"):
        write_mesh(path, mesh)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("unchecked")
@pytest.mark.parametrize("name", ["a.fbx", "a", "a.ply.zip"])
def test_unknown_extension(tmp_path, full, name):
    with pytest.raises(ValueError, match=r"cannot write .*, only \('\.ply', '\.obj', "):
        write_mesh(tmp_path / "folder" / name, full)
    with pytest.raises(ValueError, match="up must be one of z, y, got 'x'"):
        write_mesh(tmp_path / "folder" / "a.ply", full, up="x")
    with pytest.raises(TypeError, match="expected mesh as a Mesh, got a tuple of 2"):
        write_mesh(tmp_path / "folder" / "a.ply", (full.vertices, full.faces))
    assert list(tmp_path.iterdir()) == []


def test_a_folder_of_that_name_is_refused_and_nothing_is_made(tmp_path, full):
    (tmp_path / "full.obj").mkdir()
    with pytest.raises(IsADirectoryError, match=r"full\.obj: cannot be written: it is a folder"):
        write_mesh(tmp_path / "full.obj", full)
    assert [file.name for file in tmp_path.iterdir()] == ["full.obj"]


def test_an_interrupted_write_leaves_the_old_files(tmp_path, full, monkeypatch):
    path = tmp_path / "full.obj"
    written(path, full)
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    whole = type(path).write_bytes

    def broken(self, data):
        if self.name.startswith("full.obj"):
            whole(self, data[:10])
            raise OSError(28, "No space left on device", str(self))
        return whole(self, data)

    monkeypatch.setattr(type(path), "write_bytes", broken)
    moved = Mesh(2 * full.vertices, *[getattr(full, name) for name in
                 list(full.__dataclass_fields__)[1:]])  # fmt: skip
    with pytest.raises(OSError, match="No space left"):
        write_mesh(path, moved)
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before
