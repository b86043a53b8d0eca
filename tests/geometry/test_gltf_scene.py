"""What the scene of a glTF file shows: nodes, instances, morph targets and skins."""

import numpy as np
import pytest
from gltf_writer import CORNERS, FACES, Gltf, read, triangles, volume
from scipy.spatial.transform import Rotation


def test_nodes_multiply_from_the_root():
    gltf = Gltf()
    gltf.mesh()
    turn = Rotation.from_euler("xyz", [0.3, -0.5, 1.1])
    matrix = np.eye(4)
    matrix[:3] = [[2, 0.5, 0, 1], [0, 1, 0, 2], [0, 0.25, 3, -1]]
    gltf.entry("nodes", matrix=matrix.T.ravel().tolist(), children=[1])
    gltf.entry("nodes", rotation=list(turn.as_quat()), children=[2])
    gltf.entry("nodes", translation=[0.1, 0.2, 0.3], scale=[1, 2, 3], mesh=0)
    expected = turn.apply(CORNERS * [1, 2, 3] + [0.1, 0.2, 0.3]) @ matrix[:3, :3].T + matrix[:3, 3]
    np.testing.assert_allclose(triangles(read(gltf)), expected[FACES], rtol=0, atol=5e-15)


def test_a_matrix_comes_before_its_parts():
    gltf = Gltf()
    gltf.mesh()
    polygons = read(gltf, {"matrix": np.eye(4).ravel().tolist(), "scale": [2, 2, 2], "skin": None})
    np.testing.assert_array_equal(polygons.positions, CORNERS)
    assert polygons.found == ("1 nodes have both a matrix and its parts: the matrix is taken",)


@pytest.mark.parametrize("scale", [[-1, 1, 1], [2, -3, 4], [-1, -1, -1], [-1, -2, 1]])
def test_mirrored_nodes_keep_outside_outside(scale):
    gltf = Gltf()
    outward = np.float32([[-1, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    gltf.mesh(attributes={"NORMAL": gltf.add(outward)})
    polygons = read(gltf, {"scale": scale})
    np.testing.assert_allclose(volume(polygons), abs(np.prod(scale)) / 6, rtol=1e-15)
    expected = outward / np.array(scale)
    expected = expected / np.linalg.norm(expected, axis=1, keepdims=True)
    # Corners name their vertices in the order of the faces, which is that of the file.
    np.testing.assert_allclose(polygons.normals, expected[polygons.corners], rtol=0, atol=1e-7)


def test_a_flattened_mesh_keeps_its_normals():
    gltf = Gltf()
    gltf.mesh(attributes={"NORMAL": gltf.add(np.float32([[0, 0.6, 0.8]] * 4))})
    polygons = read(gltf, {"scale": [1, 1, 0]})
    np.testing.assert_array_equal(polygons.normals, np.tile([0.0, 0, 1], (12, 1)))


def test_the_named_scene_is_shown():
    gltf = Gltf(scene=1, scenes=[{"nodes": [0]}, {"nodes": [1, 2, 2]}])
    gltf.mesh()
    for x in (10, 20, 30, 40):
        gltf.entry("nodes", mesh=0, translation=[x, 0, 0])
    polygons = read(gltf)
    assert sorted(set(polygons.positions[:, 0])) == [20, 21, 30, 31]
    assert polygons.found == ("2 nodes with meshes outside the scene ignored",)
    del gltf.json["scene"]
    polygons = read(gltf)
    assert sorted(set(polygons.positions[:, 0])) == [10, 11]
    assert polygons.found[0] == "1 further scenes ignored, since none is named"
    del gltf.json["scenes"]
    assert len(read(gltf).sizes) == 16
    del gltf.json["nodes"]  # a library of meshes
    np.testing.assert_array_equal(triangles(read(gltf)), CORNERS[FACES])


def test_invisible_nodes_are_said():
    gltf = Gltf(extensionsRequired=["KHR_node_visibility"])
    gltf.mesh()
    gltf.entry("nodes", mesh=0)
    gltf.entry("nodes", children=[2], extensions={"KHR_node_visibility": {"visible": False}})
    gltf.entry("nodes", mesh=0)
    polygons = read(gltf)
    assert len(polygons.sizes) == 4
    assert polygons.found == ("1 invisible nodes ignored, with what is below them",)


def test_copies_by_instancing():
    gltf = Gltf(extensionsRequired=["EXT_mesh_gpu_instancing"])
    gltf.mesh()
    places = np.float32([[2, 0, 0], [0, 2, 0], [0, 0, 2]])
    turns = Rotation.from_euler("zyx", [[0, 0, 0], [0.5, 0.1, 0], [1, 2, 3]])
    scales = np.float32([[1, 1, 1], [1, 2, 3], [-1, 1, 1]])
    attributes = {
        "TRANSLATION": gltf.add(places),
        "ROTATION": gltf.add(np.round(turns.as_quat() * 32767).astype(np.int16), normalized=True),
        "SCALE": gltf.add(scales),
    }
    extensions = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    polygons = read(gltf, {"extensions": extensions, "scale": [2, 2, 2]})
    assert len(polygons.sizes) == 12
    expected = [
        2 * (turn.apply(CORNERS * scale) + place)
        for turn, scale, place in zip(turns, scales, places, strict=True)
    ]
    np.testing.assert_allclose(polygons.positions, np.concatenate(expected), rtol=0, atol=2e-4)
    np.testing.assert_allclose(volume(polygons), 8 * (1 + 6 + 1) / 6, rtol=1e-7)


@pytest.mark.parametrize("on_node", [True, False])
def test_morph_targets_with_their_weights(on_node):
    gltf = Gltf()
    rng = np.random.default_rng(0)
    moves = rng.normal(size=(3, 4, 3)).astype(np.float32)
    turns = rng.normal(size=(3, 4, 3)).astype(np.float32)
    tints = np.zeros((3, 4, 3), np.float32)
    tints[0, :, 1] = 0.5
    normal = np.float32([[0, 0, 1]] * 4)
    gltf.mesh(
        attributes={"NORMAL": gltf.add(normal), "COLOR_0": gltf.add(np.float32([[0.5] * 4] * 4))},
        targets=[
            {"POSITION": gltf.add(move), "NORMAL": gltf.add(turn), "COLOR_0": gltf.add(tint)}
            for move, turn, tint in zip(moves, turns, tints, strict=True)
        ],
    )
    weights = [1, 0, -0.25]
    if not on_node:
        gltf.json["meshes"][0]["weights"] = weights
    else:
        gltf.json["meshes"][0]["weights"] = [0, 1, 0]
    polygons = read(gltf, {"weights": weights} if on_node else {})
    expected = CORNERS + np.tensordot(weights, moves.astype(float), 1)
    np.testing.assert_allclose(triangles(polygons), expected[FACES], rtol=0, atol=2e-15)
    expected = normal + np.tensordot(weights, turns.astype(float), 1)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(polygons.normals, expected[FACES.ravel()], rtol=0, atol=1e-15)
    np.testing.assert_array_equal(polygons.colors, np.tile([0.5, 1, 0.5, 0.5], (12, 1)))


def skinned(gltf: Gltf, joints, weights, **more) -> None:
    """A skin of two joints, nodes 0 and 1; the mesh is to be shown by node 2."""
    normals = np.float32([[0, 0, 1], [0, 1, 0], [1, 0, 0], [0.6, 0, 0.8]])
    attributes = {"NORMAL": gltf.add(normals)}
    for number, (joint, weight) in enumerate(zip(joints, weights, strict=True)):
        attributes[f"JOINTS_{number}"] = gltf.add(joint)
        attributes[f"WEIGHTS_{number}"] = gltf.add(weight)
    gltf.mesh(attributes=attributes)
    gltf.entry("skins", joints=[0, 1], **more)


def test_a_skin_in_its_stored_pose():
    gltf = Gltf()
    rng = np.random.default_rng(1)
    rest = np.tile(np.eye(4), (2, 1, 1))
    rest[:, :3] += 0.3 * rng.normal(size=(2, 3, 4))
    rest = rest.astype(np.float32)
    bind = gltf.add(rest.transpose(0, 2, 1).reshape(2, 16).copy())
    first = np.uint8([[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0], [1, 1, 0, 0]])
    second = np.uint16([[1, 0, 0, 0]] * 4)
    weights = [
        np.float32([[0.25, 0.5, 0, 0], [1, 0, 0, 0], [0.5, 0.5, 0, 0], [0.5, 0.25, 0, 0]]),
        np.uint8([[64, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0], [64, 0, 0, 0]]),
    ]
    skinned(gltf, [first, second], weights, inverseBindMatrices=bind)
    turn = Rotation.from_euler("y", 0.7)
    gltf.entry("nodes", translation=[1, 2, 3], children=[1])
    gltf.entry("nodes", rotation=list(turn.as_quat()))
    gltf.entry("nodes", mesh=0, skin=0, translation=[100, 100, 100])  # which does not count
    polygons = read(gltf)
    # Vertex by vertex, as the specification has it.
    pose = [np.eye(4), np.eye(4)]
    pose[0][:3, 3] = pose[1][:3, 3] = [1, 2, 3]
    pose[1][:3, :3] = turn.as_matrix()
    normals = [[0, 0, 1], [0, 1, 0], [1, 0, 0], [0.6, 0, 0.8]]
    places, turned = [], []
    for vertex in range(4):
        blend = np.zeros((4, 4))
        shares = [*weights[0][vertex].astype(float), *(weights[1][vertex] / 255)]
        for joint, share in zip([*first[vertex], *second[vertex]], shares, strict=True):
            blend += share / sum(shares) * pose[joint] @ rest[joint].astype(float)
        places.append((blend @ [*CORNERS[vertex], 1])[:3])
        normal = np.linalg.inv(blend[:3, :3]).T @ normals[vertex]
        turned.append(normal / np.linalg.norm(normal))
    np.testing.assert_allclose(polygons.positions, places, rtol=0, atol=2e-15)
    np.testing.assert_allclose(
        polygons.normals, np.array(turned)[polygons.corners], rtol=0, atol=1e-7
    )


def test_a_skin_under_a_mirrored_root():
    gltf = Gltf()
    skinned(gltf, [np.uint8([[0, 0, 0, 0]] * 4)], [np.uint8([[255, 0, 0, 0]] * 4)])
    gltf.entry("nodes", scale=[-1, 1, 1])
    gltf.entry("nodes")
    gltf.entry("nodes", mesh=0, skin=0)
    polygons = read(gltf)
    np.testing.assert_array_equal(polygons.positions, CORNERS * [-1, 1, 1])
    np.testing.assert_allclose(volume(polygons), 1 / 6, rtol=1e-15)


def test_vertices_without_joints_stay_and_are_said():
    gltf = Gltf()
    joints, weights = np.uint8([[9, 0, 0, 0]] * 4), np.float32([[0, 0, 0, 0]] * 4)
    skinned(gltf, [joints], [weights])
    gltf.entry("nodes", translation=[5, 0, 0])
    gltf.entry("nodes")
    gltf.entry("nodes", mesh=0, skin=0)
    polygons = read(gltf)
    np.testing.assert_array_equal(polygons.positions, CORNERS)
    assert polygons.found == ("4 vertices of a skin follow no joint, left in place",)


def test_animations_are_said():
    gltf = Gltf(animations=[{}, {}])
    gltf.mesh()
    assert read(gltf, {}).found == ("2 animations ignored: the stored pose is read",)


def test_positions_beyond_all_numbers_are_left_to_cleaning():
    gltf = Gltf()
    gltf.mesh()
    gltf.entry("nodes", children=[1], scale=[1e300, 1, 1])
    positions = read(gltf, {"scale": [1e300, 1, 1]}).positions
    assert np.isinf(positions[1, 0])
