"""The table of lights in `docs/what-is-read.md`: each of its claims is tried on a file."""

import json
import re
import warnings
from pathlib import Path

import light_files as files
import numpy as np
import pytest
import splat_files
from fuzz_pictures import npy

from jaxsh import harmonics
from jaxsh.imaging import read_light, read_splats, write_light, write_splats
from jaxsh.imaging._light import _SAID
from jaxsh.imaging._light_files import FORMATS

PAGE = Path(__file__).parents[2] / "docs" / "what-is-read.md"
SECTION = PAGE.read_text("utf-8").split("## Lights")[1].split("\n## ")[0]


def table() -> dict[tuple[str, str], str]:
    """(feature, extension) -> the first word of its cell, for all but "–"."""
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in SECTION.splitlines()
        if line.startswith("|")
    ]
    head, _, _, *body = rows  # without the names of the packages
    return {
        (row[0], extension.split()[0].strip("`")): re.split(r"[ ,]", cell)[0]
        for row in body
        for extension, cell in zip(head[1:], row[1:], strict=True)
        if cell != "–"
    }


def test_the_page_names_what_is_read_and_written():
    named = re.findall(r"`(\.\w+)`", next(ln for ln in SECTION.splitlines() if "`.json`" in ln))
    assert {*FORMATS, ".ply"} == set(named)
    assert set(table().values()) == {"read", "said", "ignored", "refused"}
    written = next(part for part in SECTION.split("\n\n") if part.startswith("`imaging.write_l"))
    assert {*_SAID, ".ply"} == set(re.findall(r"`(\.\w+)`", written))
    assert write_light.__name__ in written
    assert write_splats.__name__ in written
    for name in re.findall(r"read, `([\w.-]+)`", SECTION.split("other degrees")[0]):
        assert name in harmonics.conventions()


LIGHT = ((np.arange(27) * 5) % 13 - 6.0).reshape(3, 9) / 8


def three(**more) -> dict:
    return files.THREE["object"] | more


def gltf(**more) -> dict:
    return files.gltf(files.rows(), **more)


def npz(name: str = "coefficients", convention: str | None = "jaxsh", **arrays):
    said = {} if convention is None else {"convention": convention}
    return {name: LIGHT} | said | arrays


def splats(degree: int = 1, kind: str = "<f4", **more) -> bytes:
    values = splat_files.table(3, degree).astype(kind)
    data = splat_files.ply(values, splat_files.names(degree), **more)
    return data.replace(b"little", b"big") if kind[0] == ">" else data


def same(**how):
    """The light is that of the plain file, read with options or not."""
    return {"as": "plain"} | how


def times(factor: float):
    return {"as": "plain", "times": factor}


PLAIN = {
    ".json": three(intensity=1),
    ".txt": files.cmgen(files.rows(), ", irradiance, pre-scaled base"),
    ".gltf": gltf(),
    ".npz": npz(),
    ".npy": npy(LIGHT),
    ".ply": splats(),
}
QUARTER = [0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)]  # about y, which leaves the constant as it is
BIG = LIGHT.astype(">f8")
# (feature, extension) -> the file, and what is expected: a shape, a comparison or words.
TRIED = {
    ("convention", ".json"): (three(), (3, 9)),
    ("convention", ".txt"): (files.cmgen(files.rows(), ", irradiance"), (3, 9)),
    ("convention", ".gltf"): (gltf(), (3, 9)),
    ("convention", ".npz"): (npz(convention="e3nn-norm"), (3, 9)),
    ("convention", ".ply"): (splats(), (3, 3, 4)),
    ("other degrees than 2", ".json"): (three(sh=[0.5] * 12), "should have 27 numbers"),
    ("other degrees than 2", ".txt"): (files.cmgen(np.ones((4, 3)), ""), (3, 4)),
    ("other degrees than 2", ".gltf"): (gltf(irradianceCoefficients=[[1, 2, 3]]), "have 9 rows"),
    ("other degrees than 2", ".npz"): (npz(coefficients=np.ones((3, 25))), (3, 25)),
    ("other degrees than 2", ".npy"): (npy(np.ones((3, 25))), (3, 25)),
    ("other degrees than 2", ".ply"): (splats(0), (3, 3, 1)),
    ("several lights", ".json"): (
        files.three_scene(three(name="a"), three(name="b", intensity=1)), same(which="b")
    ),
    ("several lights", ".gltf"): (gltf(name="b"), same(which="b")),
    ("several lights", ".npz"): (npz("b", a=np.ones(3)), same(which="b")),
    ("several lights", ".ply"): (splats(), (3, 3, 4)),
    ("batches", ".npz"): (npz(coefficients=np.ones((5, 3, 9))), (5, 3, 9)),
    ("batches", ".npy"): (npy(np.ones((5, 3, 9))), (5, 3, 9)),
    ("batches", ".ply"): (splats(), (3, 3, 4)),
    ("one channel", ".npz"): (npz(coefficients=np.ones(9)), (3, 9)),
    ("one channel", ".npy"): (npy(np.ones(9)), (3, 9)),
    ("intensity", ".json"): (three(intensity=2.5), times(2.5)),
    ("intensity", ".gltf"): (gltf(intensity=2.5), times(2.5)),
    ("rotation", ".json"): (three(intensity=1, matrix=[2.0] * 16), same()),
    ("rotation", ".gltf"): (gltf(rotation=QUARTER), "turned"),
    ("rotation", ".ply"): (splats(), (3, 3, 4)),
    ("pictures", ".gltf"): (gltf(specularImages=[[7] * 6]), same()),
    ("halves and doubles", ".npz"): (npz(coefficients=LIGHT.astype("f2")), same()),
    ("halves and doubles", ".npy"): (npy(LIGHT.astype("f2")), same()),
    ("halves and doubles", ".ply"): (splats(kind="<f8").replace(b"float", b"double"), same()),
    ("both orders of bytes", ".npz"): (npz(coefficients=BIG), same()),
    ("both orders of bytes", ".npy"): (npy(BIG), same()),
    ("both orders of bytes", ".ply"): (splats(kind=">f4"), same()),
    ("text", ".json"): (three(intensity=1), same()),
    ("text", ".txt"): (PLAIN[".txt"], same()),
    ("text", ".gltf"): (gltf(), same()),
    ("text", ".ply"): (splat_files.text(splat_files.table(3, 1), splat_files.names(1)), same()),
    ("other properties", ".json"): (three(intensity=1, color=255, userData={"a": 1}), same()),
    ("other properties", ".gltf"): (gltf(extras=3), same()),
    ("other properties", ".npz"): (npz(more=np.ones(3)), same()),
    ("other properties", ".ply"): (
        splat_files.ply(splat_files.table(3, 1)[:, :9], [*splat_files.names(0)[:9]]).replace(
            b"float nz", b"float a").replace(b"float nx", b"float q"), same()
    ),
    ("pickles and complex numbers", ".npz"): (npz(coefficients=LIGHT + 1j), "got dtype complex"),
    ("pickles and complex numbers", ".npy"): (npy(np.array([{}])), "it holds Python objects"),
    ("NaN and infinite values", ".json"): (json.dumps(three(intensity=np.nan)), "NaN is no number"),
    ("NaN and infinite values", ".txt"): ("(nan, 0, 0); // L00", "1 of its 3 numbers are NaN"),
    ("NaN and infinite values", ".gltf"): (json.dumps(gltf(intensity=np.inf)), "Infinity is no n"),
    ("NaN and infinite values", ".npz"): (npz(coefficients=LIGHT + np.inf), "27 of its 27 num"),
    ("NaN and infinite values", ".npy"): (npy(LIGHT * np.nan), "27 of its 27 numbers are NaN"),
    ("NaN and infinite values", ".ply"): (
        splats()[:-4] + b"\0\0\xc0\x7f", "1 of 12 numbers of its rotations are NaN"
    ),
}  # fmt: skip


def read(folder, extension: str, content, which=None):
    path = folder / f"a{extension}"
    if extension == ".npz":
        np.savez(path, **content)
    else:
        content = json.dumps(content) if isinstance(content, dict) else content
        path.write_bytes(content.encode() if isinstance(content, str) else content)
    if extension == ".ply":
        return np.asarray(read_splats(path).coefficients)
    convention = "jaxsh" if extension == ".npy" else None
    return np.asarray(read_light(path, which=which, convention=convention))


def test_every_claim_is_tried():
    assert set(TRIED) == set(table())


@pytest.mark.parametrize(("feature", "extension"), TRIED)
def test_the_claim_holds(tmp_path, feature, extension):
    content, expected = TRIED[feature, extension]
    verdict = table()[feature, extension]
    if verdict == "refused":
        with pytest.raises(ValueError, match=rf"a\{extension}: .*{expected}"):
            read(tmp_path, extension, content)
        return
    if verdict == "said":
        with pytest.warns(UserWarning, match=rf"a\{extension}: properties ignored \(q a\)"):
            read(tmp_path, extension, content)
        return
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        which = expected.get("which") if isinstance(expected, dict) else None
        light = read(tmp_path, extension, content, which)
    if isinstance(expected, tuple):
        assert light.shape == expected
        return
    plain = read(tmp_path, extension, PLAIN[extension])
    if expected == "turned":
        assert np.abs(light - plain).max() > 0.1
        np.testing.assert_allclose(light[:, 0], plain[:, 0], rtol=0, atol=1e-15)
        return
    np.testing.assert_allclose(light, expected.get("times", 1) * plain, rtol=0, atol=2e-15)
