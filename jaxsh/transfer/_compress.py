"""Clustered principal components: points with like transfer share a few directions of it."""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int, UInt

from .._core.checks import check_finite, check_flag, check_known, check_size, check_type
from .._core.known import is_concrete
from ._bake._passes import progress_bar
from ._compressed import CompressedTransfer, index_type
from ._stored import StoredTransfer
from ._transfer import Transfer

# Points that clusters are found from, at most, so that more of them take no more time there.
_LEARNED_FROM = 2**17
# Numbers of a block: products of its points with what all clusters have.
_BLOCK = 2**22
_WEIGHT, _CODE = 127, 32767  # the largest of eight and sixteen bits


def compress(
    transfer: Transfer | StoredTransfer,
    *,
    clusters: int | None = None,
    components: int | None = None,
    iterations: int = 16,
    seed: int = 0,
    progress: bool = True,
) -> CompressedTransfer:
    """Store a transfer by clusters of like points, a few bytes for each: clustered PCA.

    Sloan, Hall, Hart & Snyder 2003, "Clustered principal components for precomputed radiance
    transfer". A point goes to the cluster whose mean and principal components hold its coefficients
    best, those are found anew, and so on. At first a cluster is its mean alone; from the second
    fifth of the iterations on components are added, up to seven tenths. Each iteration brings them
    nearer to the principal ones by a step of subspace iteration, where the paper computes these.
    Weights are then rounded to 8 bits and clusters to 16, which the paper leaves in floats.

    Experiment `sloan2003.compression` prints errors, bytes and times beside `quantize` and float16.

    **Arguments**

    - `transfer`: a `Transfer`, or a `StoredTransfer`, which is read twice, block by block. Of more
      than 131,072 points, or 64 a cluster, so many that the seed chooses form the clusters.
    - `clusters`: by default one for 128 points, at most 256. All clusters together take
      2 (1 + components) K bytes each.
    - `components`: weights of each point, of a byte each, at most K, by default 16 where there are
      as many; beside them a point has the number of its cluster, in one or two bytes.
    - `iterations`: assignments of all points, each of about 2 V · clusters · components · K
      operations.
    - `seed`: of the points that the clusters start from. The same one gives the same result on the
      same machine.
    - `progress`: shows a bar when standard error is a terminal and it takes over a second.

    **Returns** what `shade_diffuse`, `shade_glossy`, `fluence` and `save` take. Float32, or the
    transfer's dtype where that is wider. Has no derivative: it is a constant. Runs on the host,
    outside `jit`. Raises `ValueError` for coefficients that are not finite, more clusters than
    points, or more components than coefficients.

    **Example**

    >>> from jaxsh import geometry, transfer
    >>> made = transfer.bake(geometry.knot(300), degree=2, shadows=False)
    >>> small = transfer.compress(made, clusters=4, components=6)
    >>> error = small.decompressed().coefficients - made.coefficients
    >>> round(float((error**2).mean() / (made.coefficients**2).mean()) ** 0.5, 2)
    0.02
    >>> small.num_bytes, made.coefficients.nbytes
    (2716, 10800)
    """
    check_type("transfer", transfer, Transfer, StoredTransfer)
    if isinstance(transfer, Transfer):
        check_known("transfer", transfer)
        if not is_concrete(transfer.coefficients):
            raise ValueError("expected a transfer that this process holds, got one of several's")
        check_finite("coefficients", transfer.coefficients, wait=True)
    count, width = transfer.num_points, (transfer.degree + 1) ** 2
    if not count:
        raise ValueError("expected a transfer of one point or more, got none")
    if components is None:
        components = min(16, width)
    components = check_size("components", components)
    iterations = check_size("iterations", iterations)
    if clusters is None:
        clusters = min(256, math.ceil(count / 128))
    clusters = check_size("clusters", clusters)
    for name, value, most, of in (
        ("clusters", clusters, count, "points"),
        ("components", components, width, "coefficients"),
    ):
        if value > most:
            raise ValueError(f"expected {name} of at most the {most} {of}, got {value}")
    generator = np.random.default_rng(check_size("seed", seed, least=0))
    learned = min(count, max(_LEARNED_FROM, 64 * clusters))
    with progress_bar(
        iterations * learned + count, check_flag("progress", progress), "compress"
    ) as bar:
        rows, scale = _chosen(transfer, learned, generator)
        found = _found(rows, clusters, components, iterations, generator, bar)
        del rows
        weights = np.empty((components, count), np.float32)
        cluster = np.empty(count, index_type(clusters))
        for part, block in _blocks(transfer):
            near = _nearest(_scaled(block, scale), found)
            weights[:, part], cluster[part] = near.weights.T, near.cluster
            bar.update(len(block))
    return _rounded(transfer, found, weights, cluster, scale)


class _Clusters(NamedTuple):
    """Holds the mean of each cluster and orthonormal directions of what is left."""

    means: Float[np.ndarray, "c k"]
    components: Float[np.ndarray, "c n k"]


class _Nearest(NamedTuple):
    """Holds the cluster of each point, its weights there, and the square of what they leave."""

    cluster: Int[np.ndarray, " v"]
    weights: Float[np.ndarray, "v n"]
    left: Float[np.ndarray, " v"]


def _blocks(transfer: Transfer | StoredTransfer) -> Iterator[tuple[slice, np.ndarray]]:
    """Give the coefficients with the points that they are of."""
    if isinstance(transfer, Transfer):
        rows = np.asarray(transfer.coefficients)
        yield slice(0, len(rows)), rows
        return
    for part, block in transfer.blocks():
        rows = np.asarray(block.coefficients)
        check_finite("coefficients", rows, wait=True)
        yield part, rows


def _chosen(
    transfer: Transfer | StoredTransfer, number: int, generator: np.random.Generator
) -> tuple[Float[np.ndarray, "v k"], float]:
    """Returns so many rows, over a number of about their largest, and that number."""
    count = transfer.num_points
    chosen = np.arange(count)
    if number < count:
        chosen = np.sort(generator.choice(count, number, replace=False))
    parts = []
    for part, rows in _blocks(transfer):
        first, last = np.searchsorted(chosen, (part.start, part.stop))
        parts.append(rows[chosen[first:last] - part.start])
    rows = np.concatenate(parts)
    scale = float(np.abs(rows).max()) or 1.0
    return _scaled(rows, scale), scale


def _scaled(rows: Float[np.ndarray, "v k"], scale: float) -> Float[np.ndarray, "v k"]:
    """Returns what is near 1, so that no square leaves the range of float32."""
    return (rows.astype(np.promote_types(rows.dtype, np.float32)) / scale).astype(np.float32)


def _found(
    rows: Float[np.ndarray, "v k"],
    clusters: int,
    components: int,
    iterations: int,
    generator: np.random.Generator,
    bar: Any,
) -> _Clusters:
    """Assign the points to clusters and fit these, in turn."""
    starts = generator.choice(len(rows), clusters, replace=False)
    found = _Clusters(rows[starts], np.zeros((clusters, 0, rows.shape[1]), np.float32))
    alone, rising = iterations // 5, max(1, iterations // 2)
    for iteration in range(iterations):
        near = _nearest(rows, found)
        cluster = near.cluster.copy()
        empty = np.flatnonzero(np.bincount(cluster, minlength=clusters) == 0)
        if len(empty):  # a new start for them, where the error is largest
            cluster[np.argsort(-near.left, kind="stable")[: len(empty)]] = empty
        number = math.ceil(components * (iteration + 1 - alone) / rising)
        if iteration == iterations - 1:
            number = components
        found = _fitted(rows, cluster, found, min(max(number, 0), components))
        bar.update(len(rows))
    return found


def _nearest(rows: Float[np.ndarray, "v k"], found: _Clusters) -> _Nearest:
    """Find the cluster that leaves least of each row."""
    clusters, number, width = found.components.shape
    flat = found.components.reshape(-1, width)
    both = np.concatenate([found.means, flat]).T
    offsets = np.einsum("cnk,ck->cn", found.components, found.means).reshape(-1)
    squares = np.sum(found.means**2, axis=1)
    cluster, left = np.empty(len(rows), np.int64), np.empty(len(rows), np.float32)
    weights = np.empty((len(rows), number), np.float32)
    size = max(1, _BLOCK // both.shape[1])
    for start in range(0, len(rows), size):
        part = slice(start, start + size)
        some = rows[part]
        products = some @ both
        # What the mean leaves, less what the components take of it.
        rest = squares - 2 * products[:, :clusters]
        each = (products[:, clusters:] - offsets).reshape(len(some), clusters, number)
        rest -= np.einsum("vcn,vcn->vc", each, each)
        best = np.argmin(rest, axis=1)
        place = np.arange(len(some))
        cluster[part], weights[part] = best, each[place, best]
        left[part] = np.sum(some**2, axis=1) + rest[place, best]
    return _Nearest(cluster, weights, left)


def _fitted(
    rows: Float[np.ndarray, "v k"], cluster: Int[np.ndarray, " v"], before: _Clusters, number: int
) -> _Clusters:
    """Returns the mean of each cluster's rows, and directions nearer to their principal ones."""
    means = before.means.copy()
    components = np.zeros((len(means), number, rows.shape[1]), np.float32)
    order = np.argsort(cluster, kind="stable")
    ends = np.cumsum(np.bincount(cluster, minlength=len(means)))
    for c, own in enumerate(np.split(order, ends[:-1])):
        if len(own):
            means[c] = rows[own].mean(axis=0)
        left = rows[own] - means[c]
        start = before.components[c][:number]
        if len(start) < number:  # one of the cluster's points for each new one
            new = np.resize(left, (number - len(start), left.shape[1]))
            start = np.concatenate([start, new])
        components[c] = np.linalg.qr(left.T @ (left @ start.T))[0].T
    return _Clusters(means, components)


def _rounded(
    transfer: Transfer | StoredTransfer,
    found: _Clusters,
    weights: Float[np.ndarray, "n v"],
    cluster: UInt[np.ndarray, " v"],
    scale: float,
) -> CompressedTransfer:
    """Round weights to 8 bits and clusters to 16, in steps of each component's own."""
    largest = np.zeros((len(found.means), len(weights)))
    for i, some in enumerate(weights):
        np.maximum.at(largest[:, i], cluster, np.abs(some))
    steps = largest / _WEIGHT
    codes = np.concatenate([found.means[:, None], found.components], axis=1).astype(np.float64)
    code_steps = np.abs(codes).max(axis=2) / _CODE
    safe = np.where(code_steps > 0, code_steps, 1.0)
    codes = np.rint(codes / safe[..., None]).astype(np.int16)
    for i, some in enumerate(weights):
        step = np.where(steps[:, i] > 0, steps[:, i], 1.0)
        some[:] = np.rint(some / step[cluster])
    scales = scale * code_steps * np.concatenate([np.ones((len(steps), 1)), steps], axis=1)
    dtype = np.promote_types(transfer.dtype, np.float32)
    if isinstance(transfer, Transfer):
        arrays = transfer.positions, transfer.normals, transfer.neighbors
    else:
        arrays = (transfer._store.whole(name) for name in ("positions", "normals", "neighbors"))
    positions, normals, neighbors = map(jnp.asarray, arrays)
    return CompressedTransfer(
        jax.device_put(weights.astype(np.int8)),
        jax.device_put(cluster),
        jax.device_put(codes),
        jax.device_put(scales.astype(dtype)),
        positions.astype(dtype),
        normals.astype(dtype),
        neighbors,
        surface=transfer.surface,
        cosine=transfer.cosine,
    )
