"""Bases given as functions: what they are, and each fault by name."""

import jax.numpy as jnp
import numpy as np
import pytest
import samples
from scipy.special import sph_harm_y

import jaxsh
from jaxsh import harmonics

# A basis has no coefficients of another shape than (K,).
NAMES = [name for name, c in harmonics.conventions().items() if c.layout != "cosine-sine"]


def degree_3(directions):
    """Real harmonics from SciPy's complex ones, which have the Condon–Shortley phase."""
    x, y, z = np.moveaxis(directions, -1, 0)
    theta, phi = np.arccos(np.clip(z, -1, 1)), np.arctan2(y, x)
    rows = []
    for l in range(4):
        for m in range(-l, l + 1):
            value = sph_harm_y(l, abs(m), theta, phi)
            part = value.real if m >= 0 else value.imag
            rows.append(part * (np.sqrt(2) if m else 1))
    return np.stack(rows, axis=-1)


def test_scipys_is_condon_shortley():
    verdict = jaxsh.check(degree_3)
    assert verdict.decided
    assert {"condon-shortley", "directxmath"} <= set(verdict.agree)
    assert "unreal" not in verdict.agree
    assert "orthonormal" in verdict.summary


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_each_convention_is_recognized(name):
    known = harmonics.conventions()[name]

    def basis(directions):
        # f = Σ u_i b_i = Σ c_i y_i for all u: row i of b is what a lone u_i stands for.
        gray = np.eye(9)[:, None]
        layout = harmonics.Convention(
            **{
                fact: getattr(known, fact)
                for fact in ("phase", "order", "normalization", "basis_axes", "axes")
            }
        )
        ours = np.asarray(harmonics.convert(gray, layout, "jaxsh"))[:, 0]
        return samples.basis(directions) @ ours.T

    verdict = jaxsh.check(basis)
    assert verdict.decided
    assert name in verdict.agree
    assert "a basis does not show layout and quantity" in verdict.notes[-1]


@pytest.mark.parametrize(
    ("spoil", "fault"),
    [
        (lambda b: b * np.array([1, -1, 1, -1, 1, 1, 1, 1, 1]), "sign of l=1, m=±1 flipped"),
        (lambda b: b[..., [0, 1, 2, 3, 8, 5, 6, 7, 4]], "l=2, m=−2 and l=2, m=2 exchanged"),
        (
            lambda b: b * np.array([1, 1, 1, 1, 1, 1, 0.32 / 0.315392, 1, 1]),
            "l=2, m=0 is off by a factor 1.015: a constant 0.32 in place of 0.3154",
        ),
    ],
)
def test_single_functions(spoil, fault):
    verdict = jaxsh.check(lambda directions: spoil(samples.basis(directions)))
    assert not verdict.decided
    assert verdict.faults == (fault,)
    assert verdict.found.axes == ("+x", "+y", "+z")


def test_a_term_left_out():
    def basis(directions):
        values = samples.basis(directions)
        values[..., 6] = 0.315392 * 3 * directions[..., 2] ** 2  # and no -1
        return values

    verdict = jaxsh.check(basis)
    assert not verdict.decided
    assert verdict.faults[0].startswith("l=2, m=0 is a sum: 1.12 of (l=0, m=0) + 1 of (l=2, m=0)")
    assert "not orthogonal: functions 0 and 6 overlap by 0.75" in verdict.notes


def test_the_constants_left_out():
    verdict = jaxsh.check(samples.polynomials)
    assert verdict.decided
    assert "pre-multiplied by the constants" in verdict.summary
    assert any("not orthonormal" in note for note in verdict.notes)


def test_reversed_and_scaled():
    verdict = jaxsh.check(lambda d: 3 * samples.basis(d)[..., [0, 3, 2, 1, 8, 7, 6, 5, 4]])
    assert verdict.decided
    assert "order of m reversed" in verdict.summary
    assert verdict.scale == pytest.approx(3, rel=1e-5, abs=0)
    # 3 b_i with coefficients c is b_i with 3 c.
    assert verdict.conversion.endswith("* 3, with found = verdict.found")


def test_no_space_of_harmonics():
    def basis(directions):
        values = samples.basis(directions)
        values[..., 8] = np.abs(directions[..., 0])
        return values

    verdict = jaxsh.check(basis)
    assert not verdict.decided
    assert any("not a rotation-invariant space: function 8" in note for note in verdict.notes)
    verdict = jaxsh.check(lambda d: samples.basis(d)[..., [0, 1, 2, 3, 4, 5, 6, 7, 4]])
    assert any("depend on each other" in note for note in verdict.notes)
    verdict = jaxsh.check(lambda d: samples.basis(d) * (np.arange(9) != 8))
    assert any(note.endswith("space: function 8 is zero") for note in verdict.notes)


def test_one_function_shows_a_constant():
    verdict = jaxsh.check(lambda d: np.full((len(d), 1), 0.2821))
    assert not verdict.decided
    assert verdict.summary == "one function, the constant 0.2821 (1/√(4π))"
    assert {"jaxsh", "unreal"} <= set(verdict.agree)
    assert "pyshtools-4pi" not in verdict.agree
    assert "pyshtools-4pi" in jaxsh.check(lambda d: np.ones((len(d), 1))).agree
    assert jaxsh.check(lambda d: d[:, :1]).summary == "one function, and no constant"


def test_axes_askew(rng):
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    verdict = jaxsh.check(lambda d: samples.basis(d @ turn.T))
    assert not verdict.decided
    assert "invariant under rotation" in verdict.summary


def test_functions_of_several_forms():
    def one_direction(direction):
        x, y, z = direction
        return [1.0, y, z, x]

    for function, note in (
        (one_direction, ""),
        (lambda d: samples.basis(d).T, "its values come as (K, N); (N, K) is expected"),
        (lambda d: jnp.asarray(samples.basis(d), jnp.float32), ""),
        (lambda d: (samples.basis(d), d.fill(0.0))[0], ""),  # writes into what it was given
    ):
        verdict = jaxsh.check(function)
        assert verdict.decided
        assert not note or note in verdict.notes


def test_a_pole_without_a_value():
    def basis(directions):
        x, y, z = np.moveaxis(directions, -1, 0)
        with np.errstate(all="ignore"):
            sine = np.sqrt(1 - z * z)
            rows = [np.ones_like(z), sine * (y / sine), z, sine * (x / sine)]
        return np.stack(rows, -1) * samples.CONSTANTS[:4]

    assert "NaN or infinite values in the direction of an axis" in str(jaxsh.check(basis))


def test_errors():
    with pytest.raises(ValueError, match="got 7 for a direction"):
        jaxsh.check(lambda d: np.ones((len(d), 7)))
    with pytest.raises(ValueError, match="expected real values of the basis, got dtype complex"):
        jaxsh.check(lambda d: samples.basis(d) + 0j)
    with pytest.raises(ValueError, match="expected real values of the basis, got dtype object"):
        jaxsh.check(lambda d: None)
    with pytest.raises(ValueError, match="expected finite values"):
        jaxsh.check(lambda d: np.full((len(d), 9), np.nan))
