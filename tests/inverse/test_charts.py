"""The maps from free numbers to bounded ones."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxsh.inverse._charts import even_hemisphere, from_hemisphere, tangents, to_hemisphere


def test_there_and_back():
    suns = np.concatenate([even_hemisphere(50), [[0.0, 0, 1], [0.6, -0.8, 0]]])
    back = jax.jit(jax.vmap(to_hemisphere))(jnp.asarray(from_hemisphere(suns)))
    np.testing.assert_allclose(back, suns, rtol=0, atol=1e-12)


def test_always_in_the_upper_hemisphere(rng):
    suns = jax.jit(jax.vmap(to_hemisphere))(jnp.asarray(rng.normal(0, 5, (200, 2))))
    np.testing.assert_allclose(np.linalg.norm(suns, axis=1), 1, rtol=1e-12)
    assert (np.asarray(suns)[:, 2] >= 0).all()


def test_smooth_at_the_zenith():
    # The joint between series and closed form is at |q|² = 1e-7.
    derivative = jax.jit(jax.jacfwd(to_hemisphere))
    for q in ([0.0, 0.0], [1e-9, 0.0], [0.0, 3.16e-4], [0.0, 3.17e-4]):
        slope = np.asarray(derivative(jnp.array(q)))
        np.testing.assert_allclose(slope[:2], np.pi / 2 * np.eye(2), rtol=0, atol=1e-6)
        np.testing.assert_allclose(slope[2], -((np.pi / 2) ** 2) * np.array(q), rtol=0, atol=1e-9)


def test_tangents_are_a_frame():
    for sun in even_hemisphere(20):
        frame = np.concatenate([tangents(jnp.asarray(sun)), sun[None]])
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), rtol=0, atol=1e-14)
