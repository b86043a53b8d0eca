"""Meshes from trimesh and back."""

import numpy as np
import pytest
import shapes
import trimesh
from PIL import Image

from jaxsh import geometry


def test_a_mesh_goes_there_and_back():
    mesh = geometry.knot(300)
    there = geometry.to_trimesh(mesh)
    assert there.is_watertight
    assert there.is_winding_consistent
    np.testing.assert_allclose(there.vertex_normals, mesh.normals, rtol=0, atol=1e-7)
    back = geometry.from_trimesh(there, normals="file")
    np.testing.assert_array_equal(back.vertices, mesh.vertices)
    np.testing.assert_array_equal(back.faces, mesh.faces)
    np.testing.assert_allclose(back.normals, mesh.normals, rtol=0, atol=1e-7)


def test_a_scene_stands_where_its_nodes_put_it():
    box = trimesh.creation.box()
    scene = trimesh.Scene()
    for x in (0.0, 10.0):
        scene.add_geometry(box, transform=trimesh.transformations.translation_matrix([x, 0, 0]))
    mesh = geometry.from_trimesh(scene)
    assert mesh.vertices.shape == (16, 3)
    np.testing.assert_allclose(mesh.vertices.max(axis=0), [10.5, 0.5, 0.5])
    assert geometry.topology(mesh).components == 2
    assert mesh.materials == ()


def test_hard_edges_by_an_angle():
    mesh = geometry.from_trimesh(trimesh.creation.box(), normals=30.0)
    assert mesh.vertices.shape == (24, 3)
    np.testing.assert_allclose(np.abs(mesh.normals).max(axis=1), 1)


def test_uv_and_texture_there_and_back():
    vertices, faces = shapes.sphere(4, 6)
    pixels = np.arange(48, dtype=np.uint8).reshape(3, 4, 4)
    uv = np.random.default_rng(1).uniform(size=(len(vertices), 2))
    material = trimesh.visual.material.PBRMaterial(
        name="paint", baseColorFactor=[255, 51, 0, 255], baseColorTexture=Image.fromarray(pixels)
    )
    textured = trimesh.Trimesh(
        vertices,
        faces,
        visual=trimesh.visual.TextureVisuals(uv=uv, material=material),
        process=False,
    )
    mesh = geometry.from_trimesh(textured)
    assert mesh.uv is not None
    assert mesh.uv.shape == (len(mesh.vertices), 2)
    at = {tuple(v): c for v, c in zip(vertices.astype(np.float32).tolist(), uv, strict=True)}
    for vertex, coordinates in zip(mesh.vertices.tolist(), mesh.uv, strict=True):
        np.testing.assert_allclose(coordinates, at[tuple(vertex)], rtol=1e-6)
    (color,) = mesh.materials
    np.testing.assert_allclose(color.factor, [1, 0.2, 0, 1])
    np.testing.assert_array_equal(color.texture, pixels)
    back = geometry.to_trimesh(mesh).visual
    np.testing.assert_allclose(back.uv, mesh.uv)
    np.testing.assert_array_equal(np.asarray(back.material.baseColorTexture), pixels)


@pytest.mark.parametrize("kind", ["vertex", "face"])
def test_colors_are_linear(kind):
    box = trimesh.creation.box()
    if kind == "vertex":
        box.visual.vertex_colors = np.tile([188, 0, 255, 255], (8, 1))
    else:
        box.visual.face_colors = np.tile([188, 0, 255, 255], (12, 1))
    mesh = geometry.from_trimesh(box)
    assert mesh.colors is not None
    red = ((188 / 255 + 0.055) / 1.055) ** 2.4  # sRGB, IEC 61966-2-1
    np.testing.assert_allclose(mesh.colors, [[red, 0, 1, 1]] * len(mesh.colors), rtol=1e-7)
    codes = geometry.to_trimesh(mesh).visual.vertex_colors
    np.testing.assert_array_equal(codes, [[188, 0, 255, 255]] * len(codes))


def test_what_it_refuses(unchecked):
    with pytest.raises(
        ValueError, match=r"expected a trimesh\.Trimesh or trimesh\.Scene, got tuple"
    ):
        geometry.from_trimesh(([[0, 0, 0]], [[0, 0, 0]]))
    with pytest.raises(ValueError, match="holds no faces"):
        geometry.from_trimesh(trimesh.Scene())
    with pytest.raises(ValueError, match="normals must be"):
        geometry.from_trimesh(trimesh.creation.box(), normals="hard")
    two = (geometry.BaseColor("a"), geometry.BaseColor("b"))
    knot = geometry.knot(300)
    with pytest.raises(ValueError, match="holds one material"):
        geometry.to_trimesh(geometry.Mesh(knot.vertices, knot.faces, knot.normals, materials=two))
