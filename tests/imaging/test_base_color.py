"""UV and base color of a mesh: at its vertices, and at what a camera sees.

Where errors of 1e-14 are let pass, at most 5e-16 were measured.
"""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh.geometry import BaseColor, Mesh, make_mesh, read_mesh, texels, write_mesh
from jaxsh.imaging import (
    Camera,
    Raster,
    base_color,
    interpolate,
    rasterize,
    sample_texture,
    srgb_decode,
)

CAMERA = Camera((0.7, -2.5, 0.9), (0.0, 0.0, 0.0), width=10, height=8)
CODES = np.random.default_rng(18).integers(0, 256, size=(6, 8, 4), dtype=np.uint8)


def sheet(dtype=np.float64, **fields):
    """Two triangles in the plane y = 0 that face -y, with UV that is linear in x and z."""
    vertices = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], dtype)
    uv = jnp.asarray(vertices[:, [0, 2]] @ np.array([[0.4, 0.3], [-0.2, 0.7]], dtype).T)
    faces = jnp.asarray([[0, 1, 2], [0, 2, 3]], jnp.int32)
    normals = jnp.asarray(np.tile(np.array([[0, -1, 0]], dtype), (4, 1)))
    return Mesh(jnp.asarray(vertices), faces, normals, uv, **fields)


@pytest.fixture(scope="module")
def raster():
    return rasterize(sheet(), CAMERA, samples=2)


def on_plane(x, y):
    """Where the ray through a place of the finer picture meets y = 0, as UV: by slopes alone."""
    tan = np.tan(np.radians(20))
    position = jnp.array([0.7, -2.5, 0.9])
    forward = -position / jnp.linalg.norm(position)
    right = jnp.cross(forward, jnp.array([0.0, 0.0, 1.0]))
    right = right / jnp.linalg.norm(right)
    down = jnp.cross(forward, right)
    across, along = (2 * (x + 0.5) / 20 - 1) * tan * 10 / 8, (2 * (y + 0.5) / 16 - 1) * tan
    ray = forward + across * right + along * down
    point = position - ray * (position[1] / ray[1])
    return jnp.stack([0.4 * point[0] + 0.3 * point[2], -0.2 * point[0] + 0.7 * point[2]])


def test_a_raster_has_uv_and_their_derivative(raster):
    y, x = np.nonzero(np.asarray(raster.face) >= 0)
    assert 100 < len(x) < 320
    both = jax.vmap(lambda x, y: (on_plane(x, y), jax.jacfwd(on_plane, (0, 1))(x, y)))
    place, slope = jax.jit(both)(jnp.asarray(x, float), jnp.asarray(y, float))
    # Rays and barycentric coordinates are float32: 6e-7 and 3e-8 measured.
    np.testing.assert_allclose(raster.uv[y, x], place, rtol=0, atol=2e-6)
    np.testing.assert_allclose(raster.footprint[y, x], jnp.stack(slope, -1), rtol=0, atol=1e-7)
    behind = np.asarray(raster.face) < 0
    assert not np.asarray(raster.uv)[behind].any()
    assert not np.asarray(raster.footprint)[behind].any()
    plain = rasterize(dataclasses.replace(sheet(), uv=None), CAMERA)
    assert plain.uv is plain.footprint is None


def textured(**fields):
    """The upper left face textured, the other plain red, over colors of vertices."""
    return sheet(
        colors=jnp.linspace(0.2, 1, 16).reshape(4, 4),
        face_material=jnp.array([1, 0], jnp.int32),
        materials=(
            BaseColor("picture", (0.5, 0.8, 1.0, 0.3), CODES),
            BaseColor("red", (0.9, 0.1, 0.2, 1.0)),
        ),
        **fields,
    )


@pytest.mark.slow
def test_base_color_is_factor_times_texture_times_vertex_color(raster):
    mesh = textured()
    found = base_color(mesh, raster)
    assert found.shape == (16, 20, 3)
    picture = srgb_decode(jnp.asarray(CODES[..., :3] / 255))
    seen = sample_texture(picture, raster.uv, raster.footprint)
    face, weights = np.asarray(raster.face), np.asarray(raster.barycentric, np.float64)
    expected = np.where(face[..., None] == 1, np.asarray(seen) * [0.5, 0.8, 1.0], [0.9, 0.1, 0.2])
    corners = np.asarray(mesh.colors)[np.asarray(mesh.faces)[face], :3]
    expected *= np.einsum("hwk,hwkc->hwc", weights, corners)
    expected[face < 0] = 0
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)
    # Drawn: the mean over samples of light times color.
    light = jnp.linspace(0.5, 2, 12).reshape(4, 3)
    image = interpolate(raster, light, 0.25, color=found)
    at = np.einsum("hwk,hwkc->hwc", weights, np.asarray(light)[np.asarray(mesh.faces)[face]])
    drawn = np.where(face[..., None] < 0, 0.25, at * expected)
    drawn = drawn.reshape(8, 2, 10, 2, 3).mean((1, 3))
    np.testing.assert_allclose(image, drawn, rtol=0, atol=1e-14)


@pytest.mark.slow
def test_base_color_at_vertices_is_the_mean_over_their_faces():
    mesh = textured()
    found = base_color(mesh)
    picture = srgb_decode(jnp.asarray(CODES[..., :3] / 255))
    edges = np.diff(np.asarray(mesh.uv)[[0, 2, 3]], axis=0)
    area = abs(np.linalg.det(edges))
    # The step whose square in texels is the face's area, twice.
    step = np.sqrt(area * 6 * 8) * np.diag([1 / 8, 1 / 6])
    steps = jnp.asarray(np.broadcast_to(step, (4, 2, 2)))
    seen = np.asarray(sample_texture(picture, mesh.uv, steps)) * [0.5, 0.8, 1.0]
    red = np.array([0.9, 0.1, 0.2])
    expected = np.stack([(seen[0] + red) / 2, red, (seen[2] + red) / 2, seen[3]])
    expected = expected * np.asarray(mesh.colors)[:, :3]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


@pytest.mark.slow
def test_base_color_at_texels_is_filtered_over_them():
    """An atlas of its own UV, then one whose UV the texture's are an affine function of."""
    mesh = dataclasses.replace(sheet(), face_material=jnp.zeros(2, jnp.int32))
    mesh = dataclasses.replace(mesh, materials=(BaseColor(texture=CODES),))
    atlas = dataclasses.replace(mesh, uv=(mesh.vertices[:, [0, 2]] + 1) / 2)
    held = texels(atlas, (3, 4), gutter=0)
    picture = srgb_decode(jnp.asarray(CODES[..., :3] / 255))
    step = np.broadcast_to(np.diag([1 / 3, -1 / 4]), (12, 2, 2))
    found = base_color(atlas, held)
    expected = sample_texture(picture, held.uv, jnp.asarray(step))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)
    # uv = A (x, z) and (x, z) = 2 (u, v) - 1 of the atlas.
    turn = np.array([[0.4, 0.3], [-0.2, 0.7]])
    uv = (2 * np.asarray(held.uv) - 1) @ turn.T
    expected = sample_texture(picture, jnp.asarray(uv), jnp.asarray(2 * turn @ step))
    np.testing.assert_allclose(base_color(mesh, held), expected, rtol=0, atol=1e-14)


@pytest.mark.slow
def test_a_lightmap_is_drawn_as_its_texels_are(raster):
    """Values of samples go through as those of vertices do, where both are the same."""
    light = jnp.linspace(0.5, 2, 12).reshape(4, 3)
    at = jnp.asarray(sheet().faces)[raster.face]
    seen = jnp.einsum("hwk,hwkc->hwc", raster.barycentric.astype(float), light[at])
    drawn = interpolate(raster, seen, 0.25)
    np.testing.assert_allclose(drawn, interpolate(raster, light, 0.25), rtol=0, atol=1e-14)


def test_textures_go_on_as_their_materials_say(raster):
    texture = srgb_decode(jnp.asarray(CODES[..., :3] / 255))
    clamped, mirrored = (BaseColor(texture=CODES, wrap=wrap) for wrap in ("clamp", "mirror"))
    mesh = sheet(face_material=jnp.array([2, 0]), materials=(clamped, BaseColor(), mirrored))
    seen = np.asarray(base_color(mesh, raster))
    uv, mirror = np.asarray(raster.uv), np.asarray(raster.face) == 0
    for here in (mirror, np.asarray(raster.face) == 1):
        assert ((uv[here] < 0) | (uv[here] > 1)).any()
    # A picture turned over shows its outermost texel twice, as a clamped one does.
    folded = np.where(mirror[..., None], 1 - abs(1 - uv % 2), uv)
    expected = sample_texture(texture, jnp.asarray(folded), raster.footprint, wrap="clamp")
    on_sheet = np.asarray(raster.face) >= 0
    np.testing.assert_allclose(seen[on_sheet], expected[on_sheet], rtol=0, atol=1e-14)


def test_a_mesh_without_colors_is_white(raster):
    np.testing.assert_array_equal(base_color(sheet()), 1)
    seen = np.asarray(raster.face)[..., None] >= 0
    np.testing.assert_array_equal(base_color(sheet(), raster), np.tile(seen, (1, 1, 3)))


@pytest.mark.slow
def test_base_color_differentiates_in_what_is_no_code(raster, rng):
    def loss(factor, colors, uv):
        mesh = textured()
        part = dataclasses.replace(mesh.materials[0], factor=factor)
        materials = (part, mesh.materials[1])
        mesh = dataclasses.replace(mesh, materials=materials, colors=colors, uv=uv)
        return jnp.sum(base_color(mesh, raster) ** 2) + jnp.sum(base_color(mesh) ** 2)

    mesh = textured()
    start = (jnp.array([0.5, 0.8, 1.0, 0.3]), mesh.colors, mesh.uv)
    step = tuple(
        jnp.asarray(np.random.default_rng(k).normal(size=a.shape)) for k, a in enumerate(start)
    )
    loss = jax.jit(loss)
    _, slope = jax.jvp(loss, start, step)
    ahead, behind = (
        loss(*(a + s * 1e-6 * b for a, b in zip(start, step, strict=True))) for s in (1, -1)
    )
    np.testing.assert_allclose(slope, (ahead - behind) / 2e-6, rtol=1e-8)
    gradient = jax.grad(loss, (0, 1, 2))(*start)
    total = sum(jnp.sum(a * b) for a, b in zip(gradient, step, strict=True))
    np.testing.assert_allclose(total, slope, rtol=1e-14)


@pytest.mark.slow
def test_a_textured_glb_shows_its_picture(tmp_path):
    """Written, read back and drawn: each sample has the color that was painted at its UV."""
    u, v = np.meshgrid((np.arange(64) + 0.5) / 64, 1 - (np.arange(64) + 0.5) / 64)
    codes = np.stack([255 * u, 255 * v, 128 + 0 * u, 255 + 0 * u], -1).round().astype(np.uint8)
    vertices = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], np.float32)
    mesh = make_mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]]))
    order = np.asarray(mesh.vertices)
    mesh = dataclasses.replace(
        mesh,
        uv=jnp.asarray((order[:, [0, 2]] + 1) / 2),
        face_material=jnp.zeros(2, jnp.int32),
        materials=(BaseColor(texture=codes),),
    )
    write_mesh(tmp_path / "sheet.glb", mesh)
    mesh = read_mesh(tmp_path / "sheet.glb")
    raster = rasterize(mesh, Camera((0.0, -3.0, 0.0), (0.0, 0.0, 0.0), width=16, height=16))
    found = base_color(mesh, raster)
    assert found.dtype == jnp.float32
    inner = np.asarray(jnp.all((raster.uv > 0.1) & (raster.uv < 0.9), axis=-1))
    assert inner.sum() > 100
    expected = np.concatenate([raster.uv, np.full((16, 16, 1), 128 / 255)], axis=-1)[inner]
    # Red to the right, green upwards; codes are rounded and the curve is not a line.
    expected = srgb_decode(jnp.asarray(expected, jnp.float32))
    np.testing.assert_allclose(found[inner], expected, rtol=0, atol=4e-3)


def test_what_does_not_fit_is_refused(raster, unchecked):
    mesh = textured()
    for change, message in (
        ({"uv": None}, "has a texture, but the mesh has no UV"),
        ({"face_material": None}, "has 2 materials, but no face_material"),
        (
            {"face_material": jnp.array([2, 0], jnp.int32)},
            "names materials 0 to 2, but it has 0 to 1",
        ),
    ):
        with pytest.raises(ValueError, match=message):
            base_color(dataclasses.replace(mesh, **change))
    other = Raster(raster.face, raster.barycentric, raster.faces[:1], 2)
    with pytest.raises(
        ValueError, match="a raster of this mesh, with its 2 faces, got those of another"
    ):
        base_color(mesh, other)
    held = texels(dataclasses.replace(mesh, uv=(mesh.vertices[:, [0, 2]] + 1) / 2), 4)
    turned = dataclasses.replace(mesh, faces=mesh.faces[::-1])
    with pytest.raises(ValueError, match="expected texels of this mesh, with its 2 faces"):
        base_color(turned, held)
    for texture in (CODES / 255, CODES[..., :3]):
        wrong = dataclasses.replace(mesh.materials[0], texture=texture)
        with pytest.raises(ValueError, match=r"texture of material 0 as 8-bit sRGB \(h, w, 4\)"):
            base_color(dataclasses.replace(mesh, materials=(wrong, wrong)))
    with pytest.raises(ValueError, match=r"wrap must be one of .* did you mean 'mirror'"):
        BaseColor(texture=CODES, wrap="mirrored")
    with pytest.raises(TypeError, match="expected at as a Raster or a Texels"):
        base_color(mesh, "raster")
    with pytest.raises(ValueError, match=r"expected color \(16, 20, 3\), one for each sample"):
        interpolate(raster, jnp.ones((4, 3)), color=jnp.ones((8, 10, 3)))
