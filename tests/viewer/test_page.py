"""The page as a file: self-contained, and its arrays those of Python. No browser is needed."""

import re
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import viewer_pages as pages

from jaxsh import imaging, viewer
from jaxsh.viewer import _script

JS = sorted(_script.files("jaxsh.viewer").joinpath("js").iterdir(), key=str)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    mesh, made, light, albedo = pages.example()
    path = tmp_path_factory.mktemp("page") / "made" / "knot.html"
    assert viewer.export_html(path, made, light, mesh.faces, albedo, exposure=1.0) == path
    return path


def colors_of(header: dict, arrays: bytes, light: np.ndarray) -> np.ndarray:
    """Linear radiance by the steps of the shader, in float64."""
    count, faces = header["numVertices"], header["numFaces"]
    start = 12 * count + 12 * faces
    texels = header["layers"] * header["rows"] * header["rowLength"] * 4
    codes = np.frombuffer(arrays, "<i2", texels, start).reshape(header["layers"], -1, 4)
    codes = codes.swapaxes(0, 1).reshape(codes.shape[1], -1)[:count, : len(header["scales"])]
    albedo = np.broadcast_to(header["albedo"], (count, 3))
    if header["arrays"][-1]["name"] == "albedoCodes":
        last = np.frombuffer(arrays, "<u2", 3 * count, start + 2 * texels)
        albedo = albedo * last.reshape(count, 3) / 65535
    return albedo / np.pi * (codes * np.array(header["scales"]) @ light.T)


def levels(colors) -> np.ndarray:
    """What a screen shows of linear radiance, in steps of 8 bits."""
    return 255 * np.asarray(imaging.tone_map(jnp.asarray(colors)))


def test_arrays_shade_as_python_does(page):
    mesh, made, light, albedo = pages.example()
    header, arrays, _ = pages.parts(page)
    exact = albedo / np.pi * (np.asarray(made.coefficients, np.float64) @ light.T)
    found = colors_of(header, arrays, light)
    low, high = np.percentile(exact, [1, 90])
    assert low < 0.05  # the whole of the curve
    assert 0.5 < high < 1
    assert abs(levels(found) - levels(exact)).max() < 0.02
    count = header["numVertices"]
    positions = np.frombuffer(arrays, "<f4", 3 * count).reshape(-1, 3)
    np.testing.assert_array_equal(positions, np.asarray(mesh.vertices))
    faces = np.frombuffer(arrays, "<u4", 3 * header["numFaces"], 12 * count).reshape(-1, 3)
    np.testing.assert_array_equal(faces, np.asarray(mesh.faces))
    assert header["degree"] == pages.DEGREE
    np.testing.assert_array_equal(np.array(header["lights"]), light[None].astype(np.float64))


@pytest.mark.parametrize("shape", [(), (3,), (300, 1)])
def test_every_shape_of_albedo_shades_as_python_does(shape, tmp_path):
    mesh, made, light, albedo = pages.example()
    given = albedo[:, :1] if shape == (300, 1) else albedo[0] if shape else 0.5
    page = viewer.export_html(tmp_path / "a.html", made, light[:, :4], mesh.faces, given)
    header, arrays, _ = pages.parts(page)
    exact = given / np.pi * (np.asarray(made.coefficients, np.float64)[:, :4] @ light[:, :4].T)
    assert abs(levels(colors_of(header, arrays, light[:, :4])) - levels(exact)).max() < 0.02
    # The brightest channel, but for one vertex in a hundred, is shown.
    assert header["exposure"] == pytest.approx(1 / np.percentile(exact.max(axis=1), 99), rel=1e-5)


def test_the_page_asks_for_nothing_from_outside(page):
    text = page.read_text("utf-8")
    assert not re.findall(r"(?:https?:)?//[\w.-]+\.\w", pages.ARRAYS.sub("", text))
    assert not re.findall(r"<(?:script|link|img)[^>]+(?:src|href)=\"(?!data:)", text)
    assert "default-src 'none'" in text
    assert "$" not in re.findall("<title>(.*)</title>", text)[0]


@pytest.mark.parametrize("last", ["page", "widget"])
def test_modules_become_one(last):
    joined = _script.script(last)
    assert re.findall("^import .*", joined, re.MULTILINE) == []
    exports = re.findall("^export .*", joined, re.MULTILINE)
    assert exports == ([] if last == "page" else ["export default { render };"])
    # Side by side, so no two may have one name.
    pattern = r"^(?:async )?(?:const|let|class|function) (\w+)"
    named = re.findall(pattern, joined, re.MULTILINE)
    assert len(named) == len(set(named)) > 20


def test_every_file_of_the_page_is_used():
    joined = _script.script("page") + _script.script("widget")
    for file in JS:
        if file.name.endswith(".js"):
            first = file.read_text("utf-8").splitlines()[0]
            assert first.startswith("// ")
            assert first in joined
    assert {"page.html", "style.css"} < {file.name for file in JS}


def test_values_become_ramps_and_levels(tmp_path):
    mesh, made, light, _ = pages.example()
    count = len(mesh.vertices)
    height = np.asarray(mesh.vertices, np.float64)[:, 2]
    given = {
        "height": height,
        "degree": np.arange(count) % 3 + 2,
        "seen": np.arange(count) % 2 == 0,
        "number": np.arange(count),
        "one": np.zeros(count),
    }
    page = viewer.export_html(tmp_path / "v.html", made, light[:, :4], mesh.faces, values=given)
    header, arrays, _ = pages.parts(page)
    kinds = [(one["name"], one["kind"], one.get("labels")) for one in header["values"]]
    assert kinds == [
        ("height", "ramp", None),
        ("degree", "levels", ["2", "3", "4"]),
        ("seen", "levels", ["no", "yes"]),
        ("number", "ramp", None),
        ("one", "ramp", None),
    ]
    codes = np.frombuffer(arrays, "<u2", 5 * count, len(arrays) - 10 * count).reshape(5, -1)
    low, high = header["values"][0]["low"], header["values"][0]["high"]
    np.testing.assert_allclose(low + codes[0] / 65535 * (high - low), height, rtol=0, atol=3e-5)
    np.testing.assert_array_equal(codes[1], np.arange(count) % 3)
    np.testing.assert_array_equal(codes[2], np.arange(count) % 2 == 0)
    assert not codes[4].any()


@pytest.mark.parametrize(
    ("values", "error", "message"),
    [
        ({"a": np.ones(3)}, ValueError, r"values 'a' \(300,\), got shape \(3,\)"),
        ({"a": np.full(300, np.nan)}, ValueError, "values 'a' must be finite"),
        ({1: np.ones(300)}, TypeError, "names of values as str"),
        (np.ones(300), TypeError, "values by their names, as a dict"),
        ({"a": np.full(300, "x")}, ValueError, "real numbers"),
    ],
)
def test_values_that_do_not_fit_are_refused(values, error, message, tmp_path, unchecked):
    mesh, made, light, _ = pages.example()
    with pytest.raises(error, match=message):
        viewer.export_html(tmp_path / "v.html", made, light, mesh.faces, values=values)


def test_words_of_a_user_stay_words(tmp_path):
    mesh, made, light, _ = pages.example()
    title, names = "a </script><b>$knot</b> & more", ["day", "</script><script>alert(1)"]
    page = viewer.export_html(
        tmp_path / "words.html",
        made,
        np.stack([light, light]),
        mesh.faces,
        names=names,
        title=title,
    )
    header, _, script = pages.parts(page)
    assert (header["title"], header["names"]) == (title, names)
    assert script.strip() == _script.script("page").strip()
    assert "<title>a &lt;/script&gt;" in page.read_text("utf-8")


def test_the_camera_is_sent_as_it_is(tmp_path):
    mesh, made, light, _ = pages.example()
    camera = imaging.Camera((1.0, -4.0, 2.0), (0.0, 0.5, 0.0), fov_y=25.0, width=30, height=20)
    page = viewer.export_html(tmp_path / "c.html", made, light, mesh.faces, camera=camera)
    assert pages.parts(page)[0]["camera"] == {
        "position": [1.0, -4.0, 2.0],
        "target": [0.0, 0.5, 0.0],
        "up": [0.0, 0.0, 1.0],
        "fovY": 25.0,
        "aspect": 1.5,
    }


def test_what_does_not_fit_is_refused(tmp_path, unchecked):
    mesh, made, light, _ = pages.example()
    path, faces = tmp_path / "no.html", np.asarray(mesh.faces)
    high, nan = np.zeros((3, 144)), np.where(light == light[0, 0], np.nan, light)
    for message, change in (
        (r"degree 11 is above the transfer's, 10; cut .* light\[\.\.\., :121\]", {"light": high}),
        (r"expected light \(3, K\) or \(n, 3, K\), got shape \(121,\)", {"light": light[0]}),
        ("light must be finite, got nan in 1 of 363", {"light": nan}),
        ("faces of the mesh name vertices 1 to 300, but it has 0 to 299", {"faces": faces + 1}),
        ("at least one, got shape", {"faces": faces[:0]}),
        ("expected 1 names, one for each light, got 2", {"names": ["a", "b"]}),
        ("exposure must be a number > 0", {"exposure": 0.0}),
        (r"expected albedo as .* got shape \(2,\)", {"albedo": np.ones(2)}),
    ):
        given = {"transfer": made, "light": light, "faces": faces} | change
        with pytest.raises(ValueError, match=message):
            viewer.export_html(path, **given)
    assert not path.exists()


def test_vertices_beside_the_mesh_do_not_count(tmp_path):
    mesh, made, light, _ = pages.example()
    shown = np.asarray(mesh.faces)[:40]
    page = viewer.export_html(tmp_path / "some.html", made, light[:, :4], shown)
    positions = np.asarray(mesh.vertices)[np.unique(shown)]
    header = pages.parts(page)[0]
    middle = (positions.min(axis=0) + positions.max(axis=0)) / 2
    np.testing.assert_allclose(header["middle"], middle, rtol=0, atol=1e-6)
    far = np.linalg.norm(positions - middle, axis=1).max()
    assert header["radius"] == pytest.approx(far, rel=1e-6)


def test_traced_arrays_are_refused(tmp_path):
    mesh, made, light, _ = pages.example()

    def drawn(whose, value):
        given = {"transfer": made, "light": light, "faces": mesh.faces} | {whose: value}
        return viewer.export_html(tmp_path / "no.html", **given)

    for whose, value in (
        ("transfer", made),
        ("light", light),
        ("albedo", np.ones(3)),
        ("values", {"a": np.ones(300)}),
    ):
        with pytest.raises(ValueError, match=f"expected known values for {whose}"):
            jax.jit(drawn, static_argnums=0)(whose, value)


def test_a_page_is_whole_or_not_there(tmp_path):
    mesh, made, light, _ = pages.example()
    path = tmp_path / "old.html"
    path.write_text("old")
    with pytest.raises(UnicodeEncodeError):
        viewer.export_html(path, made, light, mesh.faces, title="\ud800")
    assert path.read_text() == "old"
    with pytest.raises(IsADirectoryError, match=r"cannot be written: it is a folder"):
        viewer.export_html(tmp_path, made, light, mesh.faces)


def test_the_documentations_example_is_of_this_viewer():
    # Otherwise: python tools/make_viewer_example.py docs
    example = Path(__file__).parents[2] / "docs" / "examples" / "viewer.html"
    assert pages.parts(example)[2].strip() == _script.script("page").strip()
