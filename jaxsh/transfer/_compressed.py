"""Transfer in clusters, each of them a mean and a few directions of its own."""

import dataclasses
import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, Int8, Int16, UInt

from .._core.checks import check_known
from .._core.devices import Devices, last_of, mesh_of, own_numbers, share, whole
from .._core.linalg import shading_matmul
from .._core.xla import keep_rows
from ..harmonics import degree_of
from ._glossy_kernels import reflected
from ._nodes import node_passes
from ._transfer import AbstractTransfer, SurfaceKind, Transfer


class CompressedTransfer(AbstractTransfer):
    """Holds the transfer of V points by clusters of like ones: made once by `compress`.

    The coefficients of a point are the mean of its cluster and a sum of the cluster's components,
    each times a weight of the point:

        O ≈ scale_c0 code_c0 + Σ_i weight_i scale_ci code_ci.

    So shading multiplies the light with the codes of all clusters, and looks up as many numbers for
    each point as it has weights. `shade_diffuse`, `fluence` and `shade_glossy` take it as it is;
    what needs a `Transfer` takes the result of `decompressed`, which is also what lights of their
    own for each point are multiplied with on the way.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import geometry, transfer
    >>> made = transfer.bake(geometry.knot(300), degree=2, shadows=False)
    >>> small = transfer.compress(made, clusters=4, components=3)
    >>> small.num_points, small.num_clusters, small.num_components, small.degree
    (300, 4, 3, 2)
    >>> transfer.shade_diffuse(jnp.ones((3, 9)), small, 0.5).shape
    (300, 3)
    """

    weights: Int8[Array, "n v"]
    cluster: UInt[Array, " v"]  # of each point
    codes: Int16[Array, "c p k"]  # of each cluster: its mean, then the n components
    scales: Float[Array, "c p"]
    positions: Float[Array, "v 3"]
    normals: Float[Array, "v 3"]
    neighbors: Int[Array, "v m"]
    surface: SurfaceKind = eqx.field(static=True, default="vertices", kw_only=True)
    cosine: bool = eqx.field(static=True, default=True, kw_only=True)

    @property
    def num_points(self) -> int:
        return self.weights.shape[1]

    @property
    def num_clusters(self) -> int:
        """The number of clusters."""
        return self.codes.shape[0]

    @property
    def num_components(self) -> int:
        """The number of weights of a point."""
        return self.weights.shape[0]

    @property
    def degree(self) -> int:
        return degree_of(self.codes.shape[-1])

    @property
    def dtype(self) -> jnp.dtype:
        return self.scales.dtype

    @property
    def num_bytes(self) -> int:
        """The bytes that stand for coefficients, without positions, normals and neighbors."""
        return sum(a.nbytes for a in (self.weights, self.cluster, self.codes, self.scales))

    def sharded(self, devices: Devices = None) -> "CompressedTransfer":
        """Share the points out over devices, as `Transfer.sharded` does; each has all clusters.

        A point that fills up is black: it is of a further cluster, whose mean is zero.
        """
        check_known("transfer", self)
        mesh, count = mesh_of(devices), self.num_clusters
        cluster = self.cluster.astype(index_type(count + 1))

        def black(first: int, last: int):
            return jnp.full(last - first, count)

        return dataclasses.replace(
            self,
            weights=share(self.weights, mesh, axis=1),
            cluster=share(cluster, mesh, filling=black),
            codes=whole(jnp.pad(self.codes, ((0, 1), (0, 0), (0, 0))), mesh),
            scales=whole(jnp.pad(self.scales, ((0, 1), (0, 0))), mesh),
            positions=share(self.positions, mesh, filling=last_of(self.positions)),
            normals=share(self.normals, mesh),
            neighbors=share(self.neighbors, mesh, filling=own_numbers(self.neighbors.shape[1])),
        )

    def decompressed(self) -> Transfer:
        """Compute the coefficients of all points, as a `Transfer`."""
        return Transfer(
            _vectors(self, self.codes.shape[-1]),
            self.positions,
            self.normals,
            self.neighbors,
            surface=self.surface,
            cosine=self.cosine,
        )

    def irradiances(self, lights: Float[Array, "n k"]) -> Float[Array, "v n"]:
        return self._products(lights).T

    def vectors(self, width: int) -> Float[Array, "v k"]:
        return _vectors(self, width)

    def glossy_form(self, degree: int) -> "CompressedTransfer":
        return self

    def reflections(self, eye: Float[Array, " 3"], distant: bool) -> Float[Array, "3 v"]:
        """Mirror the direction towards the eye about each normal, components first."""
        return reflected(eye, self.positions, self.normals, distant)

    def normal_rows(self) -> Float[Array, "3 v"]:
        """Return the normals, components first."""
        return self.normals.T

    def node_passes(self, degree: int) -> Float[Array, "p n k"]:
        """Return what `at_nodes` takes of each pass of nodes."""
        return jnp.asarray(node_passes(degree).basis, self.dtype)

    def at_nodes(self, some: Float[Array, "n k"], width: int) -> Float[Array, "n v"]:
        """Evaluate the transfer at the nodes of one pass."""
        return self._products(some)

    def _products(self, rows: Float[Array, "n k"]) -> Float[Array, "n v"]:
        """Multiplies each row with the coefficients of all points."""
        width = rows.shape[1]
        codes = self.codes[..., :width].astype(self.dtype).reshape(-1, width)
        products = shading_matmul(rows, codes.T).reshape(len(rows), *self.scales.shape)
        return _of_points(self, products * self.scales[None])


@functools.partial(jax.jit, static_argnums=1)
def _vectors(transfer: CompressedTransfer, width: int) -> Float[Array, "v k"]:
    coefficients = transfer.codes[..., :width].astype(transfer.dtype) * transfer.scales[..., None]
    return _of_points(transfer, jnp.moveaxis(coefficients, 2, 0)).T


def _of_points(
    transfer: CompressedTransfer, of_clusters: Float[Array, "n c p"]
) -> Float[Array, "n v"]:
    """Sums, for each point, what the mean and the components of its cluster have."""

    def sums(of_clusters, cluster, weights):
        mean, *components = jnp.moveaxis(of_clusters, 2, 0)
        # Signed, which XLA's gathers want, and one at a time: each is then a loop over the points.
        cluster = cluster.astype(jnp.int32)
        total = mean.at[:, cluster].get(mode="promise_in_bounds")
        for component, some in zip(components, weights, strict=True):
            looked_up = component.at[:, cluster].get(mode="promise_in_bounds")
            total = total + looked_up * some.astype(total.dtype)[None]
        return total

    cluster, weights = transfer.cluster, transfer.weights
    return keep_rows(sums, of_clusters, cluster, weights, like=cluster, axis=0, out=1)


def index_type(count: int) -> np.dtype:
    """The smallest integers that tell so many clusters apart."""
    return np.min_scalar_type(max(count - 1, 0))
