"""Conversion between conventions: to and fro, turns of axes, layouts, quantities, derivatives."""

import dataclasses
import itertools

import jax
import jax.numpy as jnp
import numpy as np
import oracles
import pytest

from jaxsh import harmonics
from jaxsh.harmonics._turns import axes_blocks

NAMES = list(harmonics.conventions())
SHAPES = {
    "coefficients-last": (3, 9),
    "channels-last": (9, 3),
    "by-channel": (27,),
    "by-coefficient": (27,),
    "cosine-sine": (3, 2, 3, 3),
}
Convention = harmonics.Convention


@pytest.mark.slow
def test_every_pair_to_and_fro(rng):
    """Each convention is taken to and fro once in `test_convert_references`, too."""
    light = rng.normal(size=(3, 9))
    said = {name: harmonics.convert(light, "jaxsh", name) for name in NAMES}
    for source, target in itertools.permutations(NAMES, 2):
        with jax.disable_jit():  # 500 programs, each for one call
            there = harmonics.convert(said[source], source, target)
        assert there.shape == SHAPES[harmonics.conventions()[target].layout]
        np.testing.assert_allclose(there, said[target], rtol=0, atol=6e-15)


def turns():
    for order in itertools.permutations(range(3)):
        for signs in itertools.product([1, -1], repeat=3):
            yield np.eye(3, dtype=int)[list(order)] * np.array(signs)[:, None]


def test_all_axes_against_scipy(rng):
    """All 48 ways to exchange and turn round axes: y_j(Qᵀω) = Σ_i D_ij y_i(ω)."""
    directions = oracles.unit_vectors(rng, 20)
    basis = oracles.scipy_basis(directions, 4)
    for turn in turns():
        turned = oracles.scipy_basis(directions @ turn, 4)
        for l, block in enumerate(axes_blocks(tuple(map(tuple, turn.tolist())), 4)):
            band = slice(l * l, (l + 1) ** 2)
            np.testing.assert_allclose(basis[:, band] @ block, turned[:, band], rtol=0, atol=3e-15)


def test_axes_of_a_high_degree(rng):
    """Degree 30: no digit is lost, where a recursion would lose them."""
    directions = oracles.unit_vectors(rng, 3)
    turn = ((0, 0, 1), (-1, 0, 0), (0, 1, 0))
    block = axes_blocks(turn, 30)[30]
    np.testing.assert_allclose(block @ block.T, np.eye(61), rtol=0, atol=1e-15)
    basis, turned = (
        oracles.scipy_basis(d, 30)[:, 900:] for d in (directions, directions @ np.array(turn))
    )
    np.testing.assert_allclose(basis @ block, turned, rtol=0, atol=2e-14)


def test_up_is_a_rotation(rng):
    """Axes with y up: (x, y, z) → (x, -z, y), as `read_mesh(path, up="y")` turns meshes."""
    light = rng.normal(size=(3, 100))  # of a degree whose bands are turned one by one
    rotation = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    found = harmonics.convert(light, Convention(axes="y-up"), "jaxsh")
    np.testing.assert_allclose(found, harmonics.rotate(light, rotation), rtol=0, atol=5e-15)
    back = harmonics.convert(light, "jaxsh", Convention(axes=("+x", "+z", "-y")))
    np.testing.assert_allclose(back, harmonics.rotate(light, rotation.T), rtol=0, atol=5e-15)


def test_mirrored_axes(rng):
    """Left-handed axes: the value at ω is the one at (-x, z, y) of a package like Unity."""
    light = rng.normal(size=9)
    directions = oracles.unit_vectors(rng, 10)
    found = harmonics.convert(light, Convention(axes=("-x", "+z", "+y")), "jaxsh")
    there = directions[:, [0, 2, 1]] * [-1, 1, 1]
    expected = oracles.scipy_basis(there, 2) @ light
    np.testing.assert_allclose(oracles.scipy_basis(directions, 2) @ found, expected, rtol=4e-14)


def test_orders():
    """Sines and cosines exchanged, and any order."""
    reverse = harmonics.convert(np.arange(9.0), Convention(order="descending"), "jaxsh")
    assert reverse.tolist() == [0, 3, 2, 1, 8, 7, 6, 5, 4]
    order = ((1, 1), (1, -1), (1, 0), (0, 0))
    own = Convention(order=order)
    assert own.degree == 1
    found = harmonics.convert(np.array([1.0, 2, 3, 4]), own, "jaxsh")
    assert found.tolist() == [4, 2, 3, 1]
    assert harmonics.convert(found, "jaxsh", own).tolist() == [1, 2, 3, 4]


def test_layouts_in_a_batch(rng):
    light = rng.normal(size=(2, 3, 4))
    for layout, shape in {
        "coefficients-last": (2, 3, 4),
        "channels-last": (2, 4, 3),
        "by-channel": (2, 12),
        "by-coefficient": (2, 12),
        "cosine-sine": (2, 3, 2, 2, 2),
    }.items():
        there = np.asarray(harmonics.convert(light, "jaxsh", Convention(layout=layout)))
        assert there.shape == shape
        assert (harmonics.convert(there, Convention(layout=layout), "jaxsh") == light).all()
        if layout == "by-channel":
            assert (there[1, 4:8] == light[1, 1]).all()
        if layout == "by-coefficient":
            assert (there[1, 3:6] == light[1, :, 1]).all()
        if layout == "cosine-sine":
            assert (there[:, :, 0, 1, 1] == light[:, :, 3]).all()
            assert (there[:, :, 1, 1, 1] == light[:, :, 1]).all()
            assert (there[:, :, 1, :, 0] == 0).all()
            assert (there[:, :, :, 0, 1] == 0).all()


def test_quantities(rng):
    light = rng.normal(size=(3, 9))
    irradiance = harmonics.convolve(light, harmonics.clamped_cosine(2))
    found = harmonics.convert(light, "jaxsh", "irradiance")
    np.testing.assert_allclose(found, irradiance, rtol=1e-15)
    over_pi = harmonics.convert(irradiance, "irradiance", Convention(quantity="irradiance/pi"))
    np.testing.assert_allclose(over_pi, irradiance / np.pi, rtol=1e-15)
    back = harmonics.convert(over_pi, Convention(quantity="irradiance/pi"), "jaxsh")
    np.testing.assert_allclose(back, light, rtol=1e-15)
    # From irradiance to irradiance there is nothing to lose at any degree.
    high = rng.normal(size=16)
    same = harmonics.convert(high, "irradiance", Convention(quantity="irradiance/pi"))
    np.testing.assert_allclose(same, high / np.pi, rtol=1e-15)


def test_dtypes_and_transforms(rng):
    """float32 stays float32; a linear map under `jit`, `vmap` and reverse mode."""

    def to_unity(light):
        return harmonics.convert(light, "e3nn-norm", "unity")

    light = rng.normal(size=(4, 3, 9)).astype(np.float32)
    assert to_unity(light).dtype == jnp.float32
    eager = to_unity(light.astype(float))
    mapped = jax.jit(jax.vmap(to_unity))(light)
    np.testing.assert_allclose(mapped, eager, rtol=0, atol=3e-7)
    cotangent = rng.normal(size=(4, 27))
    value, pull = jax.vjp(to_unity, light.astype(float))
    (gradient,) = pull(jnp.asarray(cotangent))
    np.testing.assert_allclose(np.vdot(gradient, light), np.vdot(cotangent, value), rtol=1e-14)


@pytest.mark.parametrize(
    ("shape", "source", "target", "said"),
    [
        ((3, 9), "jaxsh", "threejs", "did you mean 'three.js'?"),
        ((3, 8), "jaxsh", "unity", r"\(\.\.\., K\) with K = .*, got shape \(3, 8\)"),
        ((9,), "three.js", "jaxsh", r"\(\.\.\., K, C\)"),
        ((28,), "unity", "jaxsh", r"\(\.\.\., 3·K\)"),
        ((2, 3, 4), "pyshtools-4pi", "jaxsh", r"2, degree \+ 1, degree \+ 1"),
        ((3, 16), "jaxsh", "three.js", "target has coefficients up to degree 2"),
        ((16, 3), "gltf", "jaxsh", "source has coefficients up to degree 2"),
        ((3, 16), "jaxsh", "irradiance", "the clamped cosine has no bands 3, 5"),
        ((9,), "jaxsh", "three.js", "of some channels"),
        ((2, 9), "jaxsh", "unity", "of 3 channels"),
        ((), "jaxsh", "e3nn-norm", r"got shape \(\)"),
    ],
)
def test_refusals(shape, source, target, said):
    with pytest.raises(ValueError, match=said):
        harmonics.convert(np.ones(shape), source, target)


def test_factors_that_a_dtype_does_not_hold():
    """P_lm without normalization grows like (2l)!: float32 ends there at degree 28."""
    ones = np.ones((2, 27, 27), np.float32)
    assert np.isfinite(harmonics.convert(ones, "pyshtools-unnorm", "jaxsh")).all()
    with pytest.raises(ValueError, match="do not fit into the dtype"):
        harmonics.convert(np.ones((2, 32, 32), np.float32), "pyshtools-unnorm", "jaxsh")
    # The other way what is divided by infinity would be zero without a word.
    with pytest.raises(ValueError, match="do not fit into the dtype"):
        harmonics.convert(np.ones(156**2), "jaxsh", "pyshtools-unnorm")


def test_elements_of_a_turn_may_vanish(rng):
    """Axes turned by matrices whose smallest elements no half or single holds."""
    light = rng.normal(size=400).astype(np.float16)
    found = harmonics.convert(light, "jaxsh", "e3nn-integral")
    assert found.dtype == jnp.float16
    exact = harmonics.convert(light.astype(float), "jaxsh", "e3nn-integral")
    np.testing.assert_allclose(found.astype(float), exact, rtol=0, atol=3e-3)


@pytest.mark.parametrize(
    ("facts", "said"),
    [
        ({"phase": "condon"}, "phase must be one of none, condon-shortley"),
        ({"order": "zigzag"}, "order must be one of ascending, descending"),
        ({"order": ((0, 0), (1, 0))}, "each"),
        ({"normalization": "2pi"}, "normalization must be one of"),
        ({"basis_axes": "xyy"}, "expected basis_axes as x, y and z in some order"),
        ({"axes": ("+x", "+x", "+z")}, "expected axes as 'y-up'"),
        ({"axes": "x-up"}, "axes must be one of z-up, y-up"),
        ({"layout": "rows"}, "layout must be one of"),
        ({"quantity": "light"}, "quantity must be one of"),
        ({"degree": -1}, "degree must be an integer >= 0"),
    ],
)
def test_wrong_facts(facts, said):
    with pytest.raises(ValueError, match=said):
        Convention(**facts)


def test_a_convention_says_what_is_not_ours():
    said = repr(harmonics.conventions()["unreal"])
    assert said.startswith("Convention(phase='condon-shortley', axes=('+x', '-y', '+z'), about=")
    for convention in harmonics.conventions().values():
        assert eval(repr(convention), {"Convention": Convention}) == convention


def test_facts_can_be_changed(unchecked):
    conventions = harmonics.conventions()
    changed = dataclasses.replace(conventions["filament"], layout="by-coefficient", degree=5)
    assert changed.degree == 2  # the polynomials end there
    assert len({*conventions.values(), changed}) > 15  # can be a static argument of `jit`
    numbers = Convention(order=[(np.int64(0), np.int32(0))], degree=np.int64(3))
    assert repr(numbers) == "Convention(order=((0, 0),), degree=0)"
    with pytest.raises(TypeError):
        conventions["mine"] = changed  # pyright: ignore[reportIndexIssue]
