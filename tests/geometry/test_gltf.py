"""What the primitives of a glTF file hold: accessors, attributes, lists and strips."""

import numpy as np
import pytest
from gltf_writer import CORNERS, FACES, Gltf, read, triangles


def test_positions_and_faces_as_stored():
    gltf = Gltf()
    gltf.mesh()
    polygons = read(gltf, {})
    np.testing.assert_array_equal(triangles(polygons), CORNERS[FACES])
    assert polygons.positions.dtype == np.float64
    assert polygons.normals is polygons.uv is polygons.colors is polygons.polygon_material is None
    assert polygons.found == polygons.materials == ()


@pytest.mark.parametrize("stored", [True, False])
def test_sparse_positions(stored):
    gltf = Gltf()
    where, what = gltf.view(np.uint8([3]).tobytes()), gltf.view(np.float32([0, 0, 5]).tobytes())
    sparse = {
        "count": 1,
        "indices": {"bufferView": where, "componentType": 5121},
        "values": {"bufferView": what},
    }
    if stored:
        position = gltf.add(CORNERS, sparse=sparse)
        expected = CORNERS * [1, 1, 5]
    else:  # zeros, but for the sparse part
        position = gltf.entry("accessors", componentType=5126, type="VEC3", count=4, sparse=sparse)
        expected = np.zeros((4, 3))
        expected[3, 2] = 5
    gltf.mesh(position)
    np.testing.assert_array_equal(triangles(read(gltf, {})), expected[FACES])


@pytest.mark.parametrize(
    ("dtype", "largest"), [("i1", 127), ("u1", 255), ("i2", 32767), ("u2", 65535)]
)
def test_normalized_integers(dtype, largest):
    gltf = Gltf(extensionsRequired=["KHR_mesh_quantization"])
    corners = (CORNERS * largest).astype(dtype)
    if dtype[0] == "i":
        corners[0, 0] = -largest - 1  # as far as -1 and no farther
    gltf.mesh(gltf.add(corners, normalized=True))
    expected = CORNERS.astype(float)
    expected[0, 0] = -1 if dtype[0] == "i" else 0
    np.testing.assert_array_equal(triangles(read(gltf, {})), expected[FACES])
    gltf = Gltf()
    gltf.mesh(gltf.add(corners))
    np.testing.assert_array_equal(triangles(read(gltf, {})), corners.astype(float)[FACES])


def test_interleaved_attributes():
    gltf = Gltf()
    rows = np.zeros(4, [("p", "<f4", 3), ("n", "i1", 4), ("t", "<u2", 2)])
    rows["p"], rows["n"][:, 2], rows["t"][:, 0] = CORNERS, 127, 65535
    view = gltf.view(rows.tobytes(), byteStride=rows.itemsize)

    def accessor(offset, code, kind):
        return gltf.entry(
            "accessors",
            bufferView=view,
            byteOffset=offset,
            componentType=code,
            type=kind,
            count=4,
            normalized=code != 5126,
            min=[7] * 3,  # not looked at
        )

    attributes = {"NORMAL": accessor(12, 5120, "VEC3"), "TEXCOORD_0": accessor(16, 5123, "VEC2")}
    gltf.mesh(accessor(0, 5126, "VEC3"), attributes=attributes)
    polygons = read(gltf, {})
    np.testing.assert_array_equal(triangles(polygons), CORNERS[FACES])
    np.testing.assert_array_equal(polygons.normals, np.tile([0.0, 0, 1], (12, 1)))
    np.testing.assert_array_equal(polygons.uv, np.ones((12, 2)))  # v upwards


@pytest.mark.parametrize("dtype", ["u1", "u2", "u4"])
@pytest.mark.parametrize("indexed", [True, False])
@pytest.mark.parametrize(
    ("mode", "order", "faces"),
    [
        (4, [0, 1, 2, 2, 1, 3], [[0, 1, 2], [2, 1, 3]]),
        (5, [0, 1, 2, 3, 4], [[0, 1, 2], [1, 3, 2], [2, 3, 4]]),
        (6, [0, 1, 2, 3, 4], [[1, 2, 0], [2, 3, 0], [3, 4, 0]]),
        # A vertex repeated joins two strips.
        (5, [0, 1, 2, 2, 3, 3, 4, 5], [[0, 1, 2], [3, 5, 4]]),
    ],
)
def test_lists_strips_and_fans(dtype, indexed, mode, order, faces):
    points = np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 1], [2, 2, 2], [3, 0, 1]])
    gltf = Gltf()
    if indexed:
        gltf.mesh(points, np.array(order, dtype), mode=mode)
    else:
        gltf.mesh(points[order], None, mode=mode)
    got = triangles(read(gltf, {}))
    assert got.shape == (len(faces), 3, 3)
    for triangle, face in zip(got, points[faces], strict=True):
        assert any((np.roll(triangle, turn, axis=0) == face).all() for turn in range(3))


@pytest.mark.parametrize("others", [3, 60])
def test_unused_vertices_are_no_finding(others):
    # Primitives often share one list of vertices.
    gltf = Gltf()
    corners = np.concatenate([np.full((others, 3), np.nan), CORNERS])
    gltf.mesh(corners.astype(np.float32), (FACES + others).astype(np.uint16))
    polygons = read(gltf, {})
    assert polygons.positions.shape == (4, 3)
    np.testing.assert_array_equal(triangles(polygons), CORNERS[FACES])


def test_points_and_lines_are_said():
    gltf = Gltf()
    gltf.mesh()
    primitives = gltf.json["meshes"][0]["primitives"]
    primitives += [{**primitives[0], "mode": mode} for mode in (0, 1, 2, 3)]
    primitives.append({"attributes": {}})
    polygons = read(gltf, {})
    assert len(polygons.sizes) == 4
    assert polygons.found == (
        "4 primitives of points or lines ignored",
        "1 primitives without positions ignored",
    )


def test_normals_of_any_length():
    gltf = Gltf()
    normals = np.float32([[0, 0, 3e38], [3e-38, 0, 4e-38], [0, 0, 0], [np.nan, 0, 1]])
    gltf.mesh(attributes={"NORMAL": gltf.add(normals)})
    polygons = read(gltf, {"scale": [1e100, 1e100, 1e100]})
    expected = np.array([[0, 0, 1], [0.6, 0, 0.8], [np.nan] * 3, [np.nan] * 3])
    np.testing.assert_allclose(polygons.normals, expected[polygons.corners], rtol=1e-7)
