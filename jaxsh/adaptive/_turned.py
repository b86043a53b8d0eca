"""Functions turned from +z to the axis of each tile."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._core.linalg import matmul
from .._core.xla import materialize
from ..harmonics import degree_of, orders, rotation_matrix

# Takes +z to +y: a turn about y is one about z between this and its inverse.
_QUARTER = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))


def turned(rows: Float[Array, "n k"], axes: Float[Array, "tiles 3"]) -> Float[Array, "tiles n k"]:
    """Turns each function as `harmonics.rotate` does by rotations about y, then about z.

    Turns about z mix orders m and -m alone; between them stands one large product with a constant
    matrix, where `rotate` makes a matrix for each tile.
    """
    x, y, z = axes.T
    about_y, about_z = jnp.arctan2(jnp.hypot(x, y), z), jnp.arctan2(y, x)
    quarter = rotation_matrix(jnp.asarray(_QUARTER, rows.dtype), degree_of(rows.shape[1]))
    values = _about_z(matmul(rows, quarter).T[:, None], about_y)
    values = matmul(quarter, values.reshape(len(values), -1)).reshape(values.shape)
    return jnp.moveaxis(_about_z(values, about_z), 0, 2)


def _about_z(values, angles):
    m = orders(degree_of(len(values)))
    phase = jnp.asarray(m, angles.dtype)[:, None] * angles[None]
    # Once for each tile, where XLA would take them anew for every function.
    cosine, sine = materialize(lambda phase: (jnp.cos(phase), jnp.sin(phase)), phase)
    mirrored = values[np.arange(len(m), dtype=np.int32) - 2 * m]
    return cosine[..., None] * values - sine[..., None] * mirrored
