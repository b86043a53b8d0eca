"""Transfer at points, of surfaces and in volumes: against vertices and quadrature; its stores."""

import dataclasses
import functools
import json

import bodies
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import stopping
import zarr
from bodies import relative, texels_at_vertices
from stopping import Scene

from jaxsh.geometry import Mesh, Points, Surface, knot, ray_scene
from jaxsh.harmonics import evaluate
from jaxsh.transfer import Transfer, bake, fluence, load, open, save, shade_diffuse

MESH = knot(300)
POINTS = Points(MESH.vertices, MESH.normals)
AROUND = Points(1.4 * MESH.vertices[:150])
SEEING = "ignore:bake. .* of .* points see nothing"
OPTIONS = {"directions": 64, "progress": False}


def baked(surface: Surface = POINTS, degree=2, **options) -> Transfer:
    return bake(surface, degree, **OPTIONS | options)


@functools.cache
def vertices(bounces: int) -> Transfer:
    return baked(MESH, bounces=bounces, albedo=0.8)


@pytest.mark.parametrize("bounces", [0, pytest.param(2, marks=pytest.mark.slow)])
def test_points_and_texels_at_the_vertices_have_their_coefficients(bounces):
    expected = vertices(bounces)
    points = baked(scene=MESH, bounces=bounces, albedo=0.8)
    atlas = texels_at_vertices(MESH)
    at = baked(atlas, bounces=bounces, albedo=0.8)
    assert relative(points.coefficients, expected.coefficients) < 1e-7  # 0 measured
    assert relative(at.coefficients, expected.coefficients) < 5e-8  # 3.7e-8 measured
    assert (points.surface, at.surface, at.cosine) == ("points", "texels", True)
    np.testing.assert_array_equal(at.neighbors, np.arange(len(MESH.vertices))[:, None])
    for made, surface in ((points, POINTS), (at, atlas)):
        np.testing.assert_array_equal(made.normals, surface.normals)
        assert made.belongs_to(surface)
        assert not made.belongs_to(Points(MESH.vertices))
        assert not made.belongs_to(Points(MESH.vertices + 1, MESH.normals))


@pytest.mark.slow
def test_another_mesh_may_be_in_the_way():
    """Vertices of one mesh under the shadow and the bounces of another, as a mesh and as points."""
    roof = bodies.moved(bodies.box([-2, -2, -0.1], [2, 2, 0.1]), [0, 0, 1.5])
    albedo = np.linspace(0.1, 0.9, len(roof.vertices))
    got = baked(MESH, scene=roof, bounces=1, albedo=albedo).coefficients
    alike = baked(scene=roof, bounces=1, albedo=albedo).coefficients
    np.testing.assert_allclose(got, alike, rtol=0, atol=2e-7)  # 1.2e-7 measured
    alone = baked(MESH, scene=ray_scene(roof)).coefficients
    np.testing.assert_array_equal(baked(MESH, scene=roof).coefficients, alone)
    np.testing.assert_array_equal(baked(MESH, scene=MESH).coefficients, baked(MESH).coefficients)
    assert relative(got, alone) > 0.01


def whole_sphere(lowest: float, degree: int) -> np.ndarray:
    """∫ y_i over directions with z > `lowest`, by Gauss–Legendre: only m = 0 is not zero."""
    z, weights = np.polynomial.legendre.leggauss(64)
    z, weights = (1 + lowest) / 2 + (1 - lowest) / 2 * z, (1 - lowest) / 2 * weights
    directions = np.stack([np.sqrt(1 - z**2), 0 * z, z], axis=1)
    rows = 2 * np.pi * weights @ np.asarray(evaluate(directions, degree))
    numbers = np.arange(degree + 1)
    only = np.zeros_like(rows)
    only[numbers**2 + numbers] = rows[numbers**2 + numbers]
    return only


def test_points_of_a_volume_see_half_of_space_and_around_a_disc():
    """Above a plane the upper half, beside nothing all, and over a disc all but a cone."""
    plane = bodies.rectangle([-1e4, -1e4, 0], [2e4, 0, 0], [0, 2e4, 0])
    above = Points(jnp.asarray([[0, 0, 1], [3, 2, 0.1]], jnp.float32))
    options = {"directions": 1024}
    half = baked(above, 2, scene=plane, **options)
    exact = whole_sphere(0.0, 2)
    np.testing.assert_allclose(half.coefficients, [exact] * 2, rtol=0, atol=8e-3)  # 6.8e-3 measured
    angle = np.linspace(0, 2 * np.pi, 97)[:-1]
    rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    each = np.arange(96)
    disc = bodies.by_hand(
        np.concatenate([[[0, 0, 0]], rim]),
        np.stack([0 * each, 1 + each, 1 + (each + 1) % 96], axis=1),
        [[0, 0, 1]] * 97,
    )
    over = baked(
        Points(jnp.asarray([[0, 0, 1.0], [0, 0, 9e3]], jnp.float32)), 2, scene=disc, **options
    )
    # The cone of half angle 45° about -z; from far away nothing is in the way.
    cone = whole_sphere(-1.0, 2) - whole_sphere(np.sqrt(0.5), 2) * np.sign(exact_parity(2))
    np.testing.assert_allclose(over.coefficients[0], cone, rtol=0, atol=5e-3)  # 4.3e-3 measured
    np.testing.assert_array_equal(over.coefficients[1, 1:], 0)
    free = baked(above, 2, shadows=False)
    np.testing.assert_allclose(free.coefficients[:, 0], np.sqrt(4 * np.pi), rtol=1e-7)
    np.testing.assert_array_equal(free.coefficients[:, 1:], 0)
    assert (free.surface, free.cosine) == ("points", False)
    sky = jnp.zeros((3, 9), jnp.float32).at[:, 0].set((4 * np.pi) ** 0.5)  # radiance 1
    np.testing.assert_allclose(fluence(sky, half), 2 * np.pi, rtol=4e-3)  # 3.5e-3 measured


def exact_parity(degree: int) -> np.ndarray:
    """By what zonal harmonics change where z is turned around."""
    return np.concatenate([np.full(2 * l + 1, (-1.0) ** l) for l in range(degree + 1)])


@pytest.mark.filterwarnings(SEEING)
@pytest.mark.slow
@pytest.mark.parametrize("surface", [AROUND, POINTS], ids=["volume", "points"])
def test_a_store_goes_on_and_keeps_what_its_points_are(tmp_path, monkeypatch, surface):
    mesh = stopping.MESH
    options = {"bounces": 2, "scene": mesh, "albedo": np.linspace(0, 1, len(mesh.vertices))}
    expected = baked(surface, **options)
    path = tmp_path / "points"
    with monkeypatch.context() as patch:
        patch.setattr("jaxsh.transfer._bake._bake.scene_for", lambda *_: Scene(after=20))
        with pytest.raises(KeyboardInterrupt):
            baked(surface, store=path, chunk=64, **options)
    assert (path / "passes" / "1").exists()
    again = baked(surface, store=path, **options)
    np.testing.assert_array_equal(again.coefficients, expected.coefficients)
    assert not (path / "passes").exists()
    stored = open(path)
    whole = stored.load()
    assert (
        (stored.surface, stored.cosine)
        == (whole.surface, whole.cosine)
        == ("points", surface is POINTS)
    )
    assert whole.belongs_to(surface)
    assert stored.sharded(jax.devices()).belongs_to(surface)
    assert {(part.surface, part.cosine) for _, part in stored.blocks()} == {
        ("points", whole.cosine)
    }
    light = jnp.ones((3, 9), jnp.float32)
    shade = (
        (lambda made: shade_diffuse(light, made, 1.0))
        if whole.cosine
        else (lambda made: fluence(light, made))
    )
    np.testing.assert_allclose(shade(stored), shade(whole), rtol=0, atol=1e-5)
    assert load(save(tmp_path / "file", whole)).cosine == whole.cosine
    np.testing.assert_array_equal(zarr.open_group(path, mode="r")["occluder/faces"][:], mesh.faces)
    for changed, said in (
        ({"scene": knot(400), "albedo": 0.5}, "its albedo is"),
        ({"scene": knot(300), "albedo": options["albedo"][:300]}, "its albedo is"),
    ):
        with pytest.raises(ValueError, match=said):
            baked(surface, store=path, **options | changed)
    with pytest.raises(ValueError, match="its surface is points, and vertices here"):
        baked(mesh, store=path, bounces=2, albedo=options["albedo"])
    moved = dataclasses.replace(surface, positions=surface.positions + 1)
    with pytest.raises(ValueError, match="its point cloud is"):
        baked(moved, store=path, **options)


def test_stores_that_do_not_say_what_they_are_of_hold_vertices(tmp_path):
    """As those were written that knew of nothing else: read, and gone on from."""
    path = tmp_path / "knot"
    expected = baked(MESH, store=path).coefficients
    file = path / "zarr.json"
    about = json.loads(file.read_text())
    assert about["attributes"]["version"] == 1
    for name in ("surface", "cosine", "occluder"):
        del about["attributes"]["arguments"][name]
    file.write_text(json.dumps(about))
    (path / "coefficients" / "c" / "3" / "0").unlink()
    np.testing.assert_array_equal(baked(MESH, store=path).coefficients, expected)
    assert (open(path).surface, open(path).cosine) == ("vertices", True)
    about["attributes"]["surface"] = "sea"
    file.write_text(json.dumps(about))
    with pytest.raises(ValueError, match="damaged: surface must be one of vertices, points"):
        open(path)


@pytest.mark.slow
@pytest.mark.filterwarnings(SEEING)
def test_the_bits_are_those_of_the_points_alone():
    options = {"scene": MESH, "bounces": 1}
    expected = baked(AROUND, **options).coefficients
    np.testing.assert_array_equal(baked(AROUND, chunk=64, **options).coefficients, expected)
    with jax.enable_x64(False):
        np.testing.assert_array_equal(baked(AROUND, **options).coefficients, expected)


@pytest.mark.slow
def test_a_device_takes_a_mesh_of_another_dtype():
    """The coefficients are in that of the points, and but for rays at an edge the host's."""
    ball, high = bodies.ball(), jnp.asarray([[0, 0, 1.5], [0, 1.5, 0]], jnp.float32)
    fine = Mesh(ball.vertices.astype(float), ball.faces, ball.normals.astype(float))
    host, device = (
        baked(Points(high), scene=fine, bounces=2, device=where).coefficients
        for where in (False, True)
    )
    assert device.dtype == host.dtype == jnp.float32
    np.testing.assert_allclose(device, host, rtol=0, atol=2e-6)


def test_points_that_see_nothing_are_counted_and_explained():
    ball = bodies.ball()
    some = jnp.asarray([[0, 0, 0], [0.3, 0, 0], [0, 0, 4]], jnp.float32)
    up = jnp.asarray([[0, 0, 1]] * 3, jnp.float32)
    for points, scene, said in (
        (Points(some), ball, "2 of 3 points see nothing (2 behind faces, as inside the mesh)"),
        (Points(some, up), ball, "2 of 3 points see nothing (2 behind faces, as inside the mesh)"),
        (Points(some), ray_scene(ball), "2 of 3 points see nothing (2 shut in by the scene)"),
    ):
        with pytest.warns(UserWarning, match="bake: ") as record:
            made = baked(points, scene=scene)
        assert [said in str(one.message) for one in record] == [True]
        np.testing.assert_array_equal(np.asarray(made.coefficients).any(axis=1), [0, 0, 1])
    inverted = dataclasses.replace(ball, faces=ball.faces[:, ::-1])
    with pytest.warns(UserWarning, match="2 shut in by the fronts of faces, as in a cavity"):
        baked(Points(some), scene=inverted)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "points stop no rays: give scene, the mesh or the ray scene that shadows them, or"),
        ({"scene": bodies.by_hand(*np.zeros((3, 0, 3)))}, "the scene has no vertices"),
        ({"scene": "knot"}, "expected scene as a RayScene or a Mesh, got 'knot'"),
        ({"scene": ray_scene(MESH), "bounces": 1}, "bounces=1 of points need the mesh that light"),
        ({"bounces": 1, "shadows": False}, "bounces=1 needs rays"),
        ({"scene": MESH, "albedo": np.ones(3)}, r"albedo must be a number or have shape \(\d+,\)"),
        ({"scene": ray_scene(MESH), "albedo": np.ones(3)}, r"albedo must be a number, got shape"),
        (
            {"surface": AROUND, "scene": MESH, "offset": 0.1},
            "ray_bias and offset are along normals",
        ),
        ({"scene": MESH, "ray_bias": 1.0, "offset": 1.0}, "expected ray_bias or offset, not both"),
        (
            {"surface": jax.tree.map(lambda x: x.astype(jnp.float16), AROUND), "scene": MESH},
            "expected positions of the points in float32 or float64, got float16",
        ),
        (
            {
                "surface": dataclasses.replace(
                    texels_at_vertices(MESH), vertex=jnp.zeros(len(MESH.vertices), int)
                ),
                "albedo": np.ones(3),
            },
            r"shape \(3,\); that of the mesh given is albedo\[texels.vertex\]",
        ),
        (
            {"surface": texels_at_vertices(MESH), "scene": ray_scene(knot(400)), "bounces": 1},
            "expected a scene whose first mesh is the baked one",
        ),
    ],
)
def test_what_points_lack_is_said(unchecked, options, message):
    with pytest.raises((ValueError, TypeError), match=message):
        bake(**{"surface": POINTS, "degree": 2} | OPTIONS | options)
