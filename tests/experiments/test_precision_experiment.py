"""Products as accelerators round them, simulated on any device."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from runs import run

from experiments.devices.rounding import BITS, rounded


def by_hand(array, bits: int):
    """Rounded to so many bits of the mantissa, to the nearest, ties to even."""
    fraction, exponent = np.frexp(np.asarray(array, np.float64))
    return np.ldexp(np.rint(np.ldexp(fraction, bits + 1)), exponent - bits - 1)


@pytest.mark.parametrize("precision", list(BITS))
def test_operands_are_rounded_and_sums_are_not(precision, rng):
    a, b = (jnp.asarray(rng.normal(size=(5, 5)), jnp.float32) for _ in range(2))
    bits = BITS[precision]
    expected = by_hand(a, bits) @ by_hand(b, bits)
    found = rounded(jnp.matmul, precision)(a, b)
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-6)
    assert np.abs(expected - np.asarray(a, np.float64) @ np.asarray(b, np.float64)).max() > 1e-4


def test_what_does_not_obey_is_rounded_only_with_everything(rng):
    a, b = (jnp.asarray(rng.normal(size=(5, 5)), jnp.float32) for _ in range(2))

    def full(a, b):
        return jnp.matmul(a, b, precision="highest")

    assert (rounded(full, "tf32")(a, b) == full(a, b)).all()
    forced = rounded(full, "tf32", everything=True)(a, b)
    assert (forced == rounded(jnp.matmul, "tf32")(a, b)).all()
    # Doubles are none of the matrix units' business.
    wide = a.astype(jnp.float64)
    assert (rounded(jnp.matmul, "tf32", everything=True)(wide, wide) == wide @ wide).all()


def test_programs_within_programs_are_rounded(rng):
    a = jnp.asarray(rng.normal(size=(4, 4)) / 4, jnp.float32)
    once = rounded(jnp.matmul, "bfloat16")

    @jax.custom_jvp
    def custom(x):
        return x @ a

    custom.defjvps(lambda change, value, x: change @ a)

    def scanned(x):
        total, rows = jax.lax.scan(lambda x, scale: (scale * (x @ a), x), x, jnp.ones(3, x.dtype))
        return total + rows[-1]

    def twice(x):
        return jax.lax.while_loop(lambda s: s[0] < 2, lambda s: (s[0] + 1, s[1] @ a), (0, x))[1]

    def branched(x):
        return jax.lax.cond(x[0, 0] < 9, lambda x: x @ a, lambda x: x, x)

    ones = [once(a, a)]
    for _ in range(2):
        ones.append(once(ones[-1], a))
    expected = {
        custom: ones[0],
        jax.checkpoint(lambda x: x @ a): ones[0],
        branched: ones[0],
        twice: ones[1],
        scanned: ones[2] + ones[1],
    }
    for function, value in expected.items():
        found = rounded(jax.jit(function), "bfloat16")(a)
        np.testing.assert_allclose(found, value, rtol=0, atol=1e-7)
        assert (found != function(a)).any()


def test_the_way_of_accelerators_is_taken():
    def function(x):
        return jax.lax.platform_dependent(x, cpu=lambda x: x, default=lambda x: x + 1)

    assert (rounded(function, "tf32")(jnp.zeros(2)) == 1).all()


@pytest.mark.slow
def test_the_experiment_tells_precisions_apart(tmp_path):
    names = ["shade_diffuse", "project_lat_long"]
    options = ["--degree", "4", "--directions", "16", "--size", "32", "--results", *names]
    _, rows = run(tmp_path, "devices.precision", *options, small=True)
    assert [row["result"] for row in rows] == names
    picture, projection = rows
    assert picture["psnr_full"] > 120 > picture["psnr_tf32"] > 80 > picture["psnr_bfloat16"] > 60
    assert projection["error_full"] < 1e-6 < 1e-5 < projection["error_tf32"] < 1e-3
    assert 3 < projection["error_bfloat16"] / projection["error_tf32"] < 30
