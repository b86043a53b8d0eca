"""Damaged and made-up files of lights: light that is one, or refused by name in one sentence."""

import json

import light_files as files
import numpy as np
import pytest
from fuzz_pictures import npy

from jaxsh.imaging import read_light

TEXT = files.cmgen(files.rows(), ", irradiance, pre-scaled base")


def three(**more) -> str:
    return json.dumps({"object": files.THREE["object"] | more})


def gltf(scene: int = 0, **more) -> str:
    fields = files.gltf(files.rows(), **more)
    fields["scenes"][0]["extensions"]["EXT_lights_image_based"]["light"] = scene
    return json.dumps(fields)


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("a.json", three(sh=[0.5] * 24), "LightProbe 0 should have 27 numbers as 'sh', got a list"),
        ("a.json", three(sh=["x"] * 27), "LightProbe 0 should have 27 numbers as 'sh'"),
        (
            "a.json",
            three(sh=[0.5] * 27).replace("0.5", "1e999", 1),
            "LightProbe 0 should have finite numbers as 'sh'",
        ),
        ("a.json", three(sh=[0.5] * 27).replace("0.5", "NaN", 1), "its JSON is damaged: NaN is no"),
        (
            "a.json",
            three(intensity="bright"),
            "LightProbe 0 should have a finite number as 'in",
        ),
        ("a.json", three()[:-2], "its JSON is damaged: "),
        ("a.json", "{}", "it holds no LightProbe of three.js, which is an object with 'sh'"),
        ("a.json", gltf(), "it is glTF: its name should end in .gltf"),
        ("a.json", "3", "its JSON should be an object, got 3"),
        ("a.json", "[1, 2, [3]]", "the file should have numbers as 'list'"),
        ("a.txt", TEXT.replace("L11", "L12"), "line 4 should be L11 of cmgen, but its comment is"),
        ("a.txt", TEXT[: TEXT.index("(", 500)], r"expected coefficients \(..., K, C\) with K = "),
        ("a.txt", TEXT.replace(", pre-scaled base", "", 1), "its comments contradict each other"),
        ("a.txt", TEXT.replace("(", "(1, ", 1), "line 1 should hold three numbers, got '"),
        ("a.txt", TEXT.replace("0.", "nan ; 0.", 1), "line 1 should hold three numbers, got '"),
        ("a.txt", "nan 0 0 // L00", "1 of its 3 numbers are NaN or infinite"),
        ("a.txt", "// nothing", "it holds no numbers"),
        ("a.txt", b"\x89PNG\r\n\x1a\n", "line 1 should hold three numbers, got "),
        ("a.gltf", json.dumps({"asset": {"version": "2.0"}}), "it holds no light of EXT_lights_im"),
        ("a.gltf", gltf(rotation=[0, 0, 0, 0]), "light 0 has a rotation of length 0, expected 1"),
        ("a.gltf", gltf(scene=1), "scene 0 names light 1, but there are 1"),
        ("a.gltf", gltf(irradianceCoefficients=[[1, 2, 3]] * 4), "light 0 should have 9 rows as"),
        (
            "a.gltf",
            gltf(irradianceCoefficients=[[1, 2]] * 9),
            "light 0, coefficient 0, sh",
        ),
        ("a.gltf", three(), "it names no version of glTF"),
        ("a.glb", TEXT, "it begins with "),
        ("a.npy", npy(np.ones((3, 5))), r"expected coefficients \(..., K\) with K = "),
        ("a.npy", npy(np.ones((4, 9))), r"expected light of three channels, \(..., 3, K\), got sh"),
        ("a.npy", npy(np.ones((3, 9), complex)), "expected real numbers, got dtype complex128"),
        ("a.npy", npy(np.full((3, 9), np.inf)), "27 of its 27 numbers are NaN or infinite"),
        ("a.npy", npy(np.ones((3, 9)))[:-1], "damaged: shape"),
        ("a.npz", b"PK\3\4", "damaged: not an archive"),
    ],
)
def test_a_fault_is_named(tmp_path, name, content, expected):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    convention = "jaxsh" if name == "a.npy" else None
    with pytest.raises(ValueError, match=rf"{name}: {expected}") as met:
        read_light(path, convention=convention)
    assert str(met.value).isprintable()


@pytest.mark.parametrize(
    ("arrays", "expected"),
    [
        ({"a": np.ones(9), "b": np.ones(9)}, r"it holds 2 arrays \('a', 'b'\): say which"),
        (
            {"format": "jaxsh transfer", "version": 1},
            "it is a file 'jaxsh transfer' of",
        ),
        ({"format": "jaxsh light", "version": 2}, "it is a file 'jaxsh light' of version '2'"),
        ({"coefficients": np.ones((3, 9))}, "it does not say its convention"),
        ({"coefficients": np.ones(9), "convention": "unit"}, "its convention 'unit' is none of"),
        ({"coefficients": np.ones(9), "facts": '{"up": 1}'}, "its convention has unknown facts up"),
        ({"coefficients": np.ones(9), "facts": '{"phase": "x"}'}, "its facts are no convention: "),
        ({"coefficients": np.array([None])}, "damaged: it holds Python objects"),
    ],
)
def test_a_fault_of_an_archive_is_named(tmp_path, unchecked, arrays, expected):
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(ValueError, match=rf"a\.npz: {expected}"):
        read_light(tmp_path / "a.npz")


def test_what_is_asked_for_is_checked(tmp_path, unchecked):
    path = tmp_path / "a.npy"
    np.save(path, np.ones((3, 9)))
    with pytest.raises(ValueError, match=r"a\.npy: a \.npy holds one array: which must be None"):
        read_light(path, which="a")
    with pytest.raises(ValueError, match=r"expected convention as a Convention or a name .*; did"):
        read_light(path, convention="three.json")
    with pytest.raises(ValueError, match=r"a\.ply: cannot read \.ply: splats are for imaging"):
        read_light(tmp_path / "a.ply")
    with pytest.raises(FileNotFoundError, match=r"b\.json: there is no such light"):
        read_light(tmp_path / "b.json")
