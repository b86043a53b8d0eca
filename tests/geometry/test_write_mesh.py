"""Written meshes read back, and what is refused."""

import warnings

import jax.numpy as jnp
import numpy as np
import pytest
from written_meshes import COUNT, FORMATS, by_material, full_mesh, to_y_up, written

from jaxsh.geometry import BaseColor, Mesh, knot, read_mesh, write_mesh


@pytest.fixture
def full(rng):
    return full_mesh(rng)


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


@pytest.mark.parametrize("suffix", FORMATS)
def test_up_turns_as_reading_turns_back(tmp_path, full, suffix):
    mesh = Mesh(full.vertices, full.faces, full.normals)
    turned = Mesh(*[jnp.asarray(to_y_up(np.asarray(a))) for a in (mesh.vertices,)], mesh.faces,
                  jnp.asarray(to_y_up(np.asarray(mesh.normals))))  # fmt: skip
    files = [tmp_path / name / f"a{suffix}" for name in ("up_y", "turned_before")]
    written(files[0], mesh, up="y")
    written(files[1], turned, up="z")
    assert files[0].read_bytes() == files[1].read_bytes()


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
