"""Conventions against the other packages' own functions, and against published polynomials.

`tools/make_convention_references.py` has let the packages evaluate coefficients of theirs. Here
ours are converted and evaluated by SciPy. What does not install is written down by hand.
"""

import dataclasses
import json
import pathlib

import numpy as np
import oracles
import pytest

from jaxsh import harmonics

FILE = pathlib.Path(__file__).with_name("convention_references.json")
REFERENCES = json.loads(FILE.read_text("utf-8"))
# Constants of six digits, and single precision.
ROUNDED = {
    "three": 1.5e-6,
    "DirectXMath": 3e-7,
    "kaolin": 3e-11,
    "filament": 3e-7,
}


def in_ours(name: str, directions) -> np.ndarray:
    """Directions in a package's axes, written in ours: from its documentation, not its facts."""
    x, y, z = np.asarray(directions).T
    if name in ("three.js", "gltf", "filament", "filament-sh", "filament-irradiance"):
        turned = (x, -z, y)  # right-handed, y up
    elif name in ("unity", "babylon.js"):
        turned = (-x, -z, y)  # left-handed, y up; glTF comes in with x turned round
    elif name == "unreal":
        turned = (x, -y, z)  # left-handed, z up; glTF comes in as (x, z, y)
    else:
        turned = (x, y, z)
    return np.stack(turned, -1)


def ours_at(light, name, directions):
    """The function's values, the channels last."""
    light = np.asarray(light, float)
    return oracles.scipy_basis(in_ours(name, directions), harmonics.degree_of(light.shape[-1])) @ (
        light.T
    )


def parameters():
    """One entry for each package in the default run, the rest with the slow tests."""
    seen = set()
    for entry in REFERENCES:
        package = entry["package"].split()[0]
        said = f"{entry['convention']}, {entry['function']} of {package}"
        more = package in {"pyshtools", "e3nn-jax"} and package in seen
        seen.add(package)
        yield pytest.param(entry, id=said, marks=pytest.mark.slow if more else ())


@pytest.mark.parametrize("entry", list(parameters()))
def test_the_packages_own_function(entry):
    name = entry["convention"]
    convention = dataclasses.replace(harmonics.conventions()[name], **entry.get("facts", {}))
    atol = ROUNDED.get(entry["package"].split()[0], 2e-15)
    if "lights" in entry:  # light of (1, 2, 3) from a direction: its coefficients are the basis
        for direction, given in zip(entry["directions"], entry["lights"], strict=True):
            light = harmonics.convert(np.array(given), convention, "jaxsh")
            basis = oracles.scipy_basis(in_ours(name, [direction]), 2)
            np.testing.assert_allclose(light, [[1], [2], [3]] * basis, rtol=0, atol=atol)
        return
    given = np.array(entry["coefficients"])
    target = harmonics.Convention(quantity=entry.get("quantity", convention.quantity))
    light = harmonics.convert(given, convention, target)
    found = ours_at(light, name, entry["directions"])
    scale = np.abs(entry["values"]).max()
    np.testing.assert_allclose(found, entry["values"], rtol=0, atol=scale * atol)
    np.testing.assert_allclose(
        harmonics.convert(light, target, convention), given, rtol=0, atol=1e-14 * scale
    )


def unity(given, x, y, z):
    """What Unity's shaders make of `unity_SHAr` … `unity_SHC`, which its scripts fill so."""
    rows = given.reshape(3, 9)
    values = []
    for sh in rows:
        a = [sh[3], sh[1], sh[2], sh[0] - sh[6]]
        b = [sh[4], sh[5], 3 * sh[6], sh[7]]
        linear = a[0] * x + a[1] * y + a[2] * z + a[3]
        quadratic = b[0] * x * y + b[1] * y * z + b[2] * z * z + b[3] * z * x
        values.append(linear + quadratic + sh[8] * (x * x - y * y))
    return np.stack(values, -1)


def filament(given, x, y, z):
    """Irradiance_SphericalHarmonics of its surface shaders; Fd_Lambert is in the coefficients."""
    terms = [1 + 0 * x, y, z, x, y * x, y * z, 3 * z * z - 1, z * x, x * x - y * y]
    return np.stack(terms, -1) @ given


def signed(given, x, y, z):
    """The basis of cmgen's printShBase and Unreal's SHBasisFunction: negative for odd m."""
    pi = np.pi
    c1, c2, c20 = np.sqrt(3 / (4 * pi)), np.sqrt(15 / (4 * pi)), np.sqrt(5 / (16 * pi))
    terms = [np.sqrt(1 / (4 * pi)) + 0 * x, -c1 * y, c1 * z, -c1 * x]
    terms += [c2 * x * y, -c2 * y * z, c20 * (3 * z * z - 1), -c2 * z * x]
    terms += [c2 / 2 * (x * x - y * y)]
    return np.stack(terms, -1) @ given


def alicevision(given, x, y, z):
    """AugmentedNormal."""
    terms = [x, y, z, 1 + 0 * x, x * y, x * z, y * z, x * x - y * y, 3 * z * z - 1]
    return np.stack(terms, -1) @ given


PUBLISHED = {
    "unity": (unity, "irradiance/pi"),
    "filament": (filament, "irradiance/pi"),
    "filament-sh": (signed, "radiance"),
    "filament-irradiance": (signed, "irradiance"),
    "unreal": (lambda given, *xyz: signed(given.T, *xyz), "radiance"),
    "habel": (signed, "radiance"),
    "alicevision": (alicevision, "irradiance/pi"),
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_polynomials(name, rng):
    """From a light to what their shaders see of it, and back."""
    light = rng.normal(size=(3, 9))
    function, quantity = PUBLISHED[name]
    directions = oracles.unit_vectors(rng, 5)
    seen = np.pi * np.array([1] + 3 * [2 / 3] + 5 * [1 / 4])  # of the clamped cosine
    factor = {"radiance": 1, "irradiance": seen, "irradiance/pi": seen / np.pi}[quantity]
    given = harmonics.convert(light, "jaxsh", name)
    found = function(np.asarray(given), *directions.T)
    np.testing.assert_allclose(found, ours_at(light * factor, name, directions), rtol=0, atol=2e-15)
    np.testing.assert_allclose(harmonics.convert(given, name, "jaxsh"), light, rtol=0, atol=2e-15)


def test_every_convention_is_proved():
    proved = {entry["convention"] for entry in REFERENCES} | set(PUBLISHED)
    assert set(harmonics.conventions()) - proved == {"jaxsh", "irradiance"}
