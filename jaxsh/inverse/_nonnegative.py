"""Lights that are nowhere negative: the nearest point of a polyhedron, by an interior-point method.

JAXopt's coordinate descent does not get there in 10,000 sweeps and its OSQP leaves half a percent
after 4,000 steps: where the data determine some coefficients a thousand times as well as others,
the rows are nearly parallel. Newton's steps do not mind.
"""

import jax
import jax.numpy as jnp
from jax.scipy.linalg import solve_triangular
from jaxtyping import Array, Bool, Float

from .._core.linalg import matmul
from .._core.xla import in_turn

# Of the way to the nearest bound, how much is gone; of the gap, how much remains to be aimed at.
_FAR, _CENTER = 0.99, 0.1


def nonnegative(
    light: Float[Array, "3 k"],
    inverse: Float[Array, "3 k k"],
    rows: Float[Array, "n k"],
    tolerance: float,
    max_steps: int,
) -> tuple[Float[Array, "3 k"], Bool[Array, ""], Bool[Array, ""]]:
    """Moves each channel x to the nearest x' with rows · x' >= 0, by (x' - x)ᵀ inverse⁻¹ (x' - x).

    Tells too whether any had to move, and whether all have come to an end. What the inverse has as
    infinite does not move.
    """

    def one(pair):
        return _nearest(pair[0], pair[1], rows, tolerance, max_steps)

    moved, met, done = in_turn(one, (light, inverse), lapack=True)
    return moved, jnp.any(met), jnp.all(done)


def _nearest(light, inverse, rows, tolerance: float, max_steps: int):
    """min zᵀz / 2 for A z + a >= 0, with x' = x + root · z and rows of A of length 1."""
    values, vectors = jnp.linalg.eigh(jnp.where(jnp.isfinite(inverse), inverse, 0))
    root = vectors * jnp.sqrt(jnp.maximum(values, 0))[None]
    a, matrix = matmul(rows, light), matmul(rows, root)
    length = jnp.linalg.norm(matrix, axis=1)
    length = jnp.where(length > 0, length, 1)
    matrix, a = matrix / length[:, None], a / length
    most = jnp.max(jnp.abs(a))
    unit = jnp.where(most > 0, most, 1)
    z, ended = _interior(matrix, a / unit, tolerance, max_steps)
    met = jnp.min(a) < 0
    moved = light + unit * matmul(root, z)
    return jnp.where(met, moved, light), met, ended | ~met


def _interior(
    matrix: Float[Array, "n k"], a: Float[Array, " n"], tolerance: float, max_steps: int
) -> tuple[Float[Array, " k"], Bool[Array, ""]]:
    """Solves by primal-dual steps (Nocedal & Wright 2006, "Numerical optimization", §16.6)."""
    unknowns = matrix.shape[1]

    def wrong(state):
        z, slack, force = state
        primal = jnp.max(jnp.abs(matmul(matrix, z) + a - slack))
        dual = jnp.max(jnp.abs(z - matmul(matrix.T, force)))
        return jnp.maximum(jnp.maximum(primal, dual), jnp.sqrt(jnp.mean(slack * force)))

    def step(carry):
        (z, slack, force), count = carry
        primal = matmul(matrix, z) + a - slack
        dual = z - matmul(matrix.T, force)
        aim = _CENTER * jnp.mean(slack * force) / slack - force
        stiff = force / slack
        # The Hessian is RᵀR: in float32 its own Cholesky factor would break down.
        tall = jnp.concatenate(
            [jnp.eye(unknowns, dtype=z.dtype), jnp.sqrt(stiff)[:, None] * matrix]
        )
        r = jnp.linalg.qr(tall, mode="r")
        pull = matmul(matrix.T, aim - stiff * primal) - dual
        along = solve_triangular(r, solve_triangular(r, pull, trans="T"))
        opened = matmul(matrix, along) + primal
        pushed = aim - stiff * opened
        size = jnp.minimum(_far(slack, opened), _far(force, pushed))
        return (z + size * along, slack + size * opened, force + size * pushed), count + 1

    def open_(carry):
        state, count = carry
        return (wrong(state) > tolerance) & (count < max_steps)

    start = jnp.zeros(unknowns, a.dtype), jnp.maximum(a, 0.1), jnp.full_like(a, 0.1)
    state, _ = jax.lax.while_loop(open_, step, (start, jnp.zeros((), jnp.int32)))
    return state[0], wrong(state) <= tolerance


def _far(values: Float[Array, " n"], steps: Float[Array, " n"]) -> Float[Array, ""]:
    """Size of a step, at most 1, that leaves values positive."""
    ratios = jnp.where(steps < 0, -values / jnp.where(steps < 0, steps, -1), jnp.inf)
    return jnp.minimum(1, _FAR * jnp.min(ratios))
