"""Surfaces that a page is sent: a textured mesh, texels. Their pixels: test_browser_surface.py."""

import base64
import dataclasses
import io

import jax.numpy as jnp
import numpy as np
import pytest
import viewer_pages as pages
from PIL import Image

from jaxsh import geometry, imaging, transfer, viewer

LIGHT = pages.example(300, 2)[2]


@pytest.fixture(scope="module")
def texels() -> geometry.Texels:
    return geometry.texels(pages.textured(6, 12), (24, 12))


def made_of(surface) -> transfer.Transfer:
    if isinstance(surface, geometry.Texels):
        made = transfer.unshadowed(surface.positions, surface.normals, 2)
        return dataclasses.replace(made, surface="texels")
    return transfer.unshadowed(surface.vertices, surface.normals, 2)


def arrays_of(page) -> tuple[dict, dict[str, np.ndarray]]:
    header, data, _ = pages.parts(page)
    start, found = 0, {}
    for one in header["arrays"]:
        kind = np.dtype("<" + one["type"])
        found[one["name"]] = np.frombuffer(data, kind, one["length"], start)
        start += -(-one["length"] * kind.itemsize // 4) * 4
    assert start == len(data)
    return header, found


def test_the_base_color_is_sent_whole(tmp_path):
    mesh = pages.textured(6, 12)
    page = viewer.export_html(tmp_path / "t.html", made_of(mesh), LIGHT, mesh, exposure=1.0)
    header, arrays = arrays_of(page)
    surface = header["surface"]
    assert [surface[name] for name in ("tinted", "colored", "texels")] == [True, True, None]
    assert header["albedo"] == [1, 1, 1]
    faces = arrays["faces"].reshape(-1, 3)
    scale = np.asarray(mesh.colors, np.float64)[:, :3].max(axis=0)
    seen = []
    for group, row in zip(surface["groups"], (-1, 0, 1), strict=True):
        rows = np.asarray(mesh.face_material) == row
        own = faces[group["first"] // 3 :][: group["count"] // 3]
        np.testing.assert_array_equal(own, np.asarray(mesh.faces)[rows])
        factor = np.array(mesh.materials[row].factor[:3]) if row >= 0 else np.ones(3)
        np.testing.assert_allclose(group["factor"], factor * scale, rtol=1e-7, atol=0)
        assert group["texture"] == row
        seen.append(group["count"])
    assert sum(seen) == faces.size
    for i, one in enumerate(surface["textures"]):
        with Image.open(io.BytesIO(arrays[one["array"]].tobytes())) as picture:
            np.testing.assert_array_equal(picture, mesh.materials[i].texture[..., :3])
    np.testing.assert_array_equal(arrays["uv"].reshape(-1, 2), np.asarray(mesh.uv))
    colors = arrays["colorCodes"].reshape(-1, 3) / 65535 * scale
    np.testing.assert_allclose(colors, np.asarray(mesh.colors)[:, :3], rtol=0, atol=1e-5)


@pytest.mark.slow
def test_the_exposure_is_that_of_points_with_their_base_color(tmp_path, texels):
    mesh = pages.textured(6, 12)
    for surface, base in (
        (mesh, imaging.base_color(mesh)),
        (texels, imaging.base_color(mesh, texels)),
    ):
        made = made_of(surface)
        page = viewer.export_html(tmp_path / "t.html", made, LIGHT, surface)
        sent = transfer.shade_diffuse(LIGHT, made, base)
        exposure = float(imaging.auto_exposure(sent[None]))
        assert arrays_of(page)[0]["exposure"] == pytest.approx(exposure, rel=1e-5)


def test_an_albedo_takes_the_place_of_the_base_color(tmp_path):
    mesh = pages.textured(6, 12)
    page = viewer.export_html(tmp_path / "t.html", made_of(mesh), LIGHT, mesh, 0.5, exposure=1.0)
    header, arrays = arrays_of(page)
    assert not header["surface"]["tinted"]
    assert header["albedo"] == [0.5] * 3
    assert not {"uv", "colorCodes", "texture0"} & set(arrays)
    plain = dataclasses.replace(mesh, colors=None, materials=(), face_material=None)
    page = viewer.export_html(tmp_path / "p.html", made_of(plain), LIGHT, plain, exposure=1.0)
    assert arrays_of(page)[0]["albedo"] == [0.8] * 3


def test_texels_are_sent_with_the_mesh_that_they_lie_on(tmp_path, texels):
    page = viewer.export_html(tmp_path / "t.html", made_of(texels), LIGHT, texels, exposure=1.0)
    header, arrays = arrays_of(page)
    assert header["numVertices"] == texels.num_points
    assert header["surface"]["texels"] == {"width": 24, "height": 12}
    for name, expected in (
        ("positions", texels.positions),
        ("vertices", texels.mesh.vertices),
        ("uv", texels.mesh.uv),
        ("source", texels.source),
    ):
        np.testing.assert_array_equal(arrays[name], np.asarray(expected).ravel())


def test_large_textures_are_halved_in_linear_light(monkeypatch):
    monkeypatch.setattr(viewer._surface, "_MOST_SIDE", 4)
    texture = np.full((3, 9, 4), 255, np.uint8)
    texture[:, ::2] = 0
    with pytest.warns(UserWarning, match="a texture of 9 × 3 is halved for the page"):
        data = viewer._surface._png(texture)
    with Image.open(io.BytesIO(data)) as picture:
        np.testing.assert_array_equal(picture, np.full((3, 4, 3), 188))


def test_what_is_not_the_transfers_is_refused(tmp_path, texels, unchecked):
    mesh = pages.textured(6, 12)
    made, at_texels = made_of(mesh), made_of(texels)
    other = dataclasses.replace(mesh, vertices=2 * mesh.vertices)
    bare = dataclasses.replace(mesh, colors=None, materials=(), face_material=None)
    volume = dataclasses.replace(made, cosine=False)
    for message, change in (
        (r"transfer's 91 vertices are of, got 91 vertices of other places", {"faces": other}),
        (r"transfer's 91 vertices are of, got \d+ texels", {"faces": texels}),
        (r"transfer's \d+ texels are of, got 91 vertices", {"transfer": at_texels}),
        (
            "expected geometry.Texels for a transfer of texels",
            {"transfer": at_texels, "faces": mesh.faces},
        ),
        ("got that of points without normals", {"transfer": volume}),
        (
            "with materials or colors for textured=True, got one w",
            {"faces": bare, "textured": True},
        ),
        ("for textured=True, got", {"faces": mesh.faces, "textured": True}),
        ("expected UV of a mesh whose", {"faces": dataclasses.replace(mesh, uv=None)}),
        ("expected face_material", {"faces": dataclasses.replace(mesh, face_material=None)}),
        (
            "materials -1 to 1, but",
            {"faces": dataclasses.replace(mesh, materials=mesh.materials[:1])},
        ),
    ):
        given = {"transfer": made, "light": LIGHT, "faces": mesh} | change
        with pytest.raises(ValueError, match=message):
            viewer.export_html(tmp_path / "no.html", **given)


@pytest.mark.slow
@pytest.mark.parametrize("at", ["vertices", "texels"])
def test_the_widgets_picture_has_the_base_color(at, texels):
    pytest.importorskip("anywidget", reason="needs the package anywidget")
    surface = texels if at == "texels" else pages.textured(6, 12)
    made = made_of(surface)
    shown = viewer.view(made, LIGHT, surface, textured=True, exposure=1.5, height=100)
    data, _ = shown._repr_mimebundle_()
    with Image.open(io.BytesIO(base64.b64decode(data["image/png"]))) as image:
        picture = np.asarray(image).astype(float)
    mesh = texels.mesh if at == "texels" else surface
    camera = imaging.Camera.facing(mesh, width=picture.shape[1], height=picture.shape[0])
    raster = imaging.rasterize(mesh, camera)
    white = transfer.shade_diffuse(LIGHT, made, 1.0)
    color = imaging.base_color(mesh, raster)
    if at == "texels":
        seen = color * imaging.sample_texture(texels.image(white), raster.uv, wrap="clamp")
    else:
        seen = imaging.interpolate(raster, white, color=color)
    expected = 255 * np.asarray(imaging.tone_map(jnp.asarray(seen), 1.5))
    inside = np.asarray(raster.mask)
    apart = abs(picture[..., :3] - expected).max(axis=-1)[inside]
    assert expected[inside].std() > 10
    assert np.median(apart) < 1  # four samples, and one


def test_transfer_in_clusters_is_sent_as_it_is(tmp_path):
    mesh, made, light, _ = pages.example(300, 4)
    small = transfer.compress(made, clusters=4, components=5)
    page = viewer.export_html(tmp_path / "c.html", small, light[:, :16], mesh, 0.5, exposure=1.0)
    header, arrays = arrays_of(page)
    assert "transfer" not in arrays
    assert header["clusters"] == {"points": 300, "components": 5}
    # As the page unpacks it.
    codes = arrays["clusterCodes"].reshape(4, 6, 16) * arrays["clusterScales"].reshape(4, 6, 1)
    weights = np.concatenate([np.ones((1, 300)), arrays["weights"].reshape(5, 300)])
    found = np.einsum("iv,vik->vk", weights, codes[arrays["clusterOf"]])
    expected = np.asarray(small.decompressed().coefficients)[:, :16]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-5)
