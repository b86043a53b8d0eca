"""Vertices that stand for others: spread evenly over positions and normals together."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._core.checks import check_degree
from ..transfer import SampledTransfer, Transfer, sample
from ._staged import SampledRows, sample_rows

# Distance of opposite normals, in half-extents of the mesh.
_NORMALS = 2.0
# Probes that a vertex looks at.
NEAREST = 4


class ProbeSet(eqx.Module):
    """Probe vertices of a mesh, and which of them each vertex lies between. Made by `make_probes`.

    Independent of light and eye.
    """

    probes: Int[Array, " p"]
    nearest: Int[Array, "v 4"]  # numbers into `probes`
    weights: Float[Array, "v 4"]  # sum to one
    rows: SampledRows
    base: SampledTransfer
    degree: int = eqx.field(static=True)


def make_probes(
    transfer: Transfer, *, share: float = 0.1, base: int = 1, quantized: bool = True
) -> ProbeSet:
    """Every so many vertices a probe, and the four nearest to each vertex.

    **Arguments**

    - `transfer`: concrete, of at least four vertices.
    - `share`: of the vertices that are probes, in (0, 1].
    - `base`: degree to which all vertices are computed.
    - `quantized`: whether the transfer's samples are rounded to eight bits.

    Takes three quarters of the transfer's memory for its samples, or three times that where they
    are not rounded. Neither traceable nor differentiable;
    raises `ValueError` for a share or a base that is out of range.
    """
    from scipy.spatial import KDTree

    count = len(transfer.positions)
    if not 0 < share <= 1 or count < NEAREST:
        raise ValueError(
            f"expected a share in (0, 1] of at least {NEAREST} vertices, got {share} of {count}"
        )
    if check_degree(base) > transfer.degree:
        raise ValueError(f"expected base of at most {transfer.degree}, got {base}")
    points, normals = np.asarray(transfer.positions), np.asarray(transfer.normals)
    extent = max(float(np.ptp(points, axis=0).max()) / 2, 1e-30)
    features = np.concatenate([points / extent, _NORMALS / 2 * normals], axis=1)
    probes = _spread(features, max(round(share * count), NEAREST))
    distance, nearest = KDTree(features[probes]).query(features, k=NEAREST)
    weights = 1 / (distance**2 + 1e-12)
    dtype = transfer.coefficients.dtype
    return ProbeSet(
        jnp.asarray(probes.astype(np.int32)),
        jnp.asarray(nearest.astype(np.int32)),
        jnp.asarray((weights / weights.sum(axis=1, keepdims=True)).astype(dtype)),
        sample_rows(transfer.coefficients, transfer.degree, quantized),
        sample(transfer, base),
        transfer.degree,
    )


def _spread(features: Float[np.ndarray, "v f"], count: int) -> Int[np.ndarray, " p"]:
    """One point of each of `count` cells, which halve the largest cell's widest side in turn."""
    cells = [np.arange(len(features))]
    while len(cells) < count:
        halves = []
        room = count - len(cells)
        for i, cell in enumerate(sorted(cells, key=len, reverse=True)):
            if i >= room or len(cell) < 2:
                halves.append(cell)
                continue
            side = features[cell][:, np.ptp(features[cell], axis=0).argmax()]
            order = np.argpartition(side, len(cell) // 2)
            halves += [cell[order[: len(cell) // 2]], cell[order[len(cell) // 2 :]]]
        cells = halves
    middle = [np.sum((features[c] - features[c].mean(axis=0)) ** 2, axis=1).argmin() for c in cells]
    return np.array([cell[i] for cell, i in zip(cells, middle, strict=True)])
