"""Points in space, of which a light's effect is wanted."""

import equinox as eqx
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import as_finite
from .._core.known import is_concrete

# How far from 1 the length of a normal may be: what halves and written decimals leave.
_UNIT = 1e-2


class Points(eqx.Module):
    """Holds points of a surface with their unit normals, or points in space without.

    For what is no mesh: a scan, the centers of Gaussians, probes in a volume. They stop no rays and
    have no neighbors; what shadows them is a mesh or a scene of its own, in the same coordinates
    (those of a `Mesh` are relative to its `origin`). Differentiable in both; a tree of arrays,
    whose rows may be shared out between devices.

    **Arguments**

    - `positions`: (n, 3).
    - `normals`: (n, 3), of length 1, taken to the dtype of the positions; or None, for points that
      light reaches from all sides.

    Raises `ValueError` for shapes that do not fit, for no points, and where values are known for
    what is not finite and for a normal whose length is not 1 to a hundredth.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import geometry
    >>> geometry.Points(jnp.zeros((5, 3))).num_points
    5
    """

    positions: Float[Array, "n 3"]
    normals: Float[Array, "n 3"] | None

    def __init__(
        self, positions: Float[ArrayLike, "n 3"], normals: Float[ArrayLike, "n 3"] | None = None
    ):
        self.positions = as_finite(positions, "positions", wait=True)
        self.normals = None
        if normals is not None:
            self.normals = as_finite(normals, "normals", dtype=self.positions.dtype, wait=True)

    def __check_init__(self):
        shape = self.positions.shape
        if len(shape) != 2 or shape[1] != 3 or shape[0] == 0:
            raise ValueError(f"expected positions (n, 3) of at least one point, got shape {shape}")
        if self.normals is None:
            return
        if self.normals.shape != shape:
            raise ValueError(
                f"expected normals {shape}, one for each of the positions, got shape "
                f"{self.normals.shape}"
            )
        if is_concrete(self.normals):
            lengths = np.linalg.norm(np.asarray(self.normals, np.float64), axis=1)
            wrong = np.abs(lengths - 1) > _UNIT
            if wrong.any():
                row = int(wrong.argmax())
                raise ValueError(
                    f"expected normals of length 1, got {lengths[row]:.3g} in row {row}, "
                    f"{wrong.sum():,} of {len(wrong):,} such"
                )

    @property
    def num_points(self) -> int:
        """Number of points, n."""
        return self.positions.shape[0]
