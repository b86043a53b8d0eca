"""The widget's side in Python; its side in the browser is in test_browser.py."""

import base64
import io
import sys

import numpy as np
import pytest
import viewer_pages as pages
from PIL import Image
from scipy.ndimage import binary_erosion

from jaxsh import imaging, midrange, transfer, viewer


def widget():
    pytest.importorskip("anywidget", reason="needs the package anywidget")
    mesh, made, light, _ = pages.example()
    return viewer.view(made, light, mesh.faces), light


def test_the_mesh_is_sent_when_asked_for_and_not_kept_in_the_state(monkeypatch):
    shown, light = widget()
    sent = []
    monkeypatch.setattr(type(shown), "send", lambda self, *said, **more: sent.append((said, more)))
    shown._answer(shown, {"kind": "ready"}, [])
    shown._answer(shown, {"kind": "something else"}, [])
    ((message,), more) = sent[0]
    assert len(sent) == 1
    assert message["header"]["numVertices"] == 300
    assert len(more["buffers"][0]) > 100_000
    state = {key: shown.get_state(key)[key] for key in shown.keys if not key.startswith("_")}
    np.testing.assert_array_equal(state["lights"], light[None].astype(np.float64))
    assert set(state) == {"lights", "moved", "height", "layout", "tabbable", "tooltip"}


def test_its_light_can_be_changed_and_no_other_shape():
    shown, light = widget()
    shown.light = 2 * light
    np.testing.assert_array_equal(shown.light, 2 * light[None].astype(np.float64))
    with pytest.raises(ValueError, match=r"expected light \(1, 3, 121\) as at first, got shape"):
        shown.light = light[:, :4]
    with pytest.raises(ValueError, match="light must be finite"):
        shown.light = light * np.inf


@pytest.mark.slow
def test_a_picture_stands_where_no_script_runs():
    pytest.importorskip("anywidget", reason="needs the package anywidget")
    mesh, _, light, _ = pages.example(300, 2)
    made = transfer.unshadowed(mesh.vertices, mesh.normals, 2)
    camera = imaging.Camera.facing(mesh, width=30, height=20)
    albedo = np.full((300, 1), 0.5, np.float32)
    shown = viewer.view(made, light, mesh.faces, albedo, camera=camera, exposure=1.5, height=100)
    data, _ = shown._repr_mimebundle_()
    assert data["text/plain"] == "viewer of 300 vertices"
    with Image.open(io.BytesIO(base64.b64decode(data["image/png"]))) as image:
        picture = np.asarray(image)
    assert picture.shape == (100, 150, 4)
    larger = imaging.Camera.facing(mesh, width=150, height=100)
    raster = imaging.rasterize(mesh, larger)
    shaded = transfer.shade_diffuse(light, made, albedo)
    expected = imaging.tone_map(imaging.interpolate(raster, shaded), 1.5)
    inside = binary_erosion(np.asarray(raster.mask), np.ones((3, 3)))
    assert (picture[inside, 3] == 255).all()
    apart = abs(picture[inside, :3] - 255 * np.asarray(expected)[inside]).max(axis=-1)
    assert np.median(apart) < 1  # four samples, and one


def test_without_anywidget_it_says_what_to_install(monkeypatch):
    mesh, made, light, _ = pages.example()
    monkeypatch.setitem(sys.modules, "anywidget", None)
    viewer._widget._widget_class.cache_clear()
    with pytest.raises(ImportError, match=r"pip install 'jaxsh\[viewer\]'"):
        viewer.view(made, light, mesh.faces)


def test_sun_and_lamp_are_moved_from_python():
    pytest.importorskip("anywidget", reason="needs the package anywidget")
    mesh, made, light, _ = pages.example()
    ball = midrange.Sphere(np.array([0.0, -2.0, 1.0]), 0.2, np.ones(3))
    extra = {"sky": viewer.Sky(), "lamp": viewer.Lamp(ball), "exposure": 1.0}
    shown = viewer.view(made, light[:, :4], mesh.faces, **extra)
    assert len(shown.light) == 1
    shown.sun, shown.turbidity, shown.lamp = (3.0, 0.0, 4.0), 5.0, (0.0, -3.0, 0.5)
    assert shown.moved == {"sun": [0.6, 0.0, 0.8], "turbidity": 5.0, "lamp": [0.0, -3.0, 0.5]}
    assert shown.sun == [0.6, 0.0, 0.8]
    with pytest.raises(ValueError, match="turbidity must be a number"):
        shown.turbidity = 11.0
    plain, _ = widget()
    with pytest.raises(ValueError, match="expected a viewer with a sky"):
        plain.sun = (0.0, 0.0, 1.0)
