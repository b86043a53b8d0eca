"""The solver by itself, on what needs no mesh."""

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest

from jaxsh.inverse._solve import covariance, levenberg_marquardt


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_the_best_start_wins_in_either_dtype_under_x64(dtype):
    """A circle's constant and a slope: from the constant 4 it ends in a worse valley."""

    def residual(p, constant):
        return jnp.stack([p[0] ** 2 - constant, p[1] - p[0], 0.5 * (p[0] - 1)])

    starts, constants = jnp.array([[3.0, 0.0], [2.0, 1.0]], dtype), jnp.array([4.0, 1.0], dtype)
    solved = jax.jit(
        lambda: levenberg_marquardt(residual, starts, constants, tolerance=1e-4, max_steps=50)
    )()
    assert solved.parameters.dtype == solved.residual.dtype == dtype
    assert solved.result == optx.RESULTS.successful
    assert (solved.start, solved.agreeing) == (1, 1)
    np.testing.assert_allclose(solved.parameters, [1, 1], rtol=0, atol=1e-5)


def test_starts_go_side_by_side_off_the_cpu(monkeypatch):
    """Beside the solver's own loop there is one over starts on the CPU alone."""
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")

    def residual(p, constant):
        return jnp.stack([p[0] ** 2 - constant, p[1] - p[0]])

    def solve(starts, constants):
        solved = levenberg_marquardt(residual, starts, constants, tolerance=1e-4, max_steps=9)
        return solved.residual

    traced = jax.jit(solve).trace(jnp.ones((3, 2)), jnp.ones(3))
    loops = [
        traced.lower(lowering_platforms=(platform,)).as_text().count("stablehlo.while")
        for platform in ("cpu", "cuda")
    ]
    assert loops == [2, 1]


def test_only_what_the_data_do_not_determine_is_infinite(rng):
    """The second and the last number are known in their sum alone, the fourth not at all."""
    tall = rng.normal(size=(9, 5))
    tall[:, 4], tall[:, 3] = tall[:, 1], 0
    spread = np.array(covariance(jnp.asarray(tall), jnp.asarray(2.0)))
    known = [0, 2]
    others = tall[:, [0, 2, 1]]
    expected = 2 * np.linalg.inv(others.T @ others)[:2, :2]
    np.testing.assert_allclose(spread[np.ix_(known, known)], expected, rtol=1e-12)
    spread[np.ix_(known, known)] = np.inf
    assert np.isposinf(spread).all()
    few = covariance(jnp.asarray(tall[:1, :2]), jnp.asarray(2.0))  # fewer rows than numbers
    assert np.isposinf(few).all()
