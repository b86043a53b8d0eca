"""Other forms of a transfer: its values in directions, and eight bits."""

import dataclasses
import functools

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int8

from .._core.checks import check_finite, check_known, check_type
from .._core.devices import Devices, last_of, mesh_of, share, whole
from .._core.linalg import matmul
from .._core.xla import materialize, on_mesh
from ..harmonics import degree_of, num_coefficients
from ._glossy_kernels import block_sums, in_steps, mirrored, node_passes, rows_of
from ._surfaces import SurfaceKind
from ._transfer import AbstractTransfer, Transfer, checked_degree, irradiances

# Vertices side by side: a block's coefficients stay in the first cache.
_BLOCK = 128


class SampledTransfer(AbstractTransfer):
    """Holds the transfer of V points, cut to a degree, at N directions: made once by `sample`.

    The directions are an exact quadrature for products of three functions of that degree, so
    that nothing is lost. `samples` are in the passes in which shading goes through them. At degree
    10 there are 350 directions; with the coefficients beside them, that is four times the memory
    of the transfer.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import transfer
    >>> up = jnp.asarray([[0.0, 0.0, 1.0]])
    >>> transfer.sample(transfer.unshadowed(up, up, degree=10)).samples.shape
    (10, 35, 1)
    """

    samples: Float[Array, "passes n v"]
    coefficients: Float[Array, "v k"]
    positions: Float[Array, "3 v"]
    normals: Float[Array, "3 v"]  # at unit length
    surface: SurfaceKind = eqx.field(static=True, default="vertices", kw_only=True)
    cosine: bool = eqx.field(static=True, default=True, kw_only=True)

    @property
    def degree(self) -> int:
        return degree_of(self.coefficients.shape[-1])

    @property
    def num_points(self) -> int:
        return self.coefficients.shape[0]

    @property
    def dtype(self) -> jnp.dtype:
        return self.coefficients.dtype

    def sharded(self, devices: Devices = None) -> "SampledTransfer":
        """Share the points out over devices, as `Transfer.sharded` does."""
        check_known("transfer", self)
        mesh = mesh_of(devices)
        return SampledTransfer(
            share(self.samples, mesh, axis=2),
            share(self.coefficients, mesh),
            share(self.positions, mesh, axis=1, filling=last_of(self.positions.T)),
            share(self.normals, mesh, axis=1),
            surface=self.surface,
            cosine=self.cosine,
        )

    def irradiances(self, lights: Float[Array, "n k"]) -> Float[Array, "v n"]:
        return irradiances(self.coefficients, lights)

    def vectors(self, width: int) -> Float[Array, "v k"]:
        return self.coefficients[:, :width]

    def glossy_form(self, degree: int) -> "SampledTransfer":
        if degree != self.degree:
            raise ValueError(
                f"expected a light of the sampled transfer's degree, {self.degree}, got "
                f"{degree}; sample the transfer at that degree"
            )
        return self

    def reflections(self, eye: Float[Array, " 3"], distant: bool) -> Float[Array, "3 v"]:
        """Mirror the direction towards the eye about each normal, components first."""
        return mirrored(eye, self.positions, self.normals, distant)

    def normal_rows(self) -> Float[Array, "3 v"]:
        """Return the normals, components first."""
        return self.normals

    def node_passes(self, degree: int) -> Float[Array, "p n v"]:
        """Return what `at_nodes` takes of each pass of nodes."""
        return self.samples

    def at_nodes(self, some: Float[Array, "n v"], width: int) -> Float[Array, "n v"]:
        """Evaluate the transfer at the nodes of one pass."""
        return some


class QuantizedTransfer(AbstractTransfer):
    """Holds int8 transfer coefficients of V points: a quarter of the memory traffic of float32.

    Made once by `quantize`, for `shade_diffuse` with lights that all points share, which reads
    each coefficient once a frame and waits for memory.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import transfer
    >>> up = jnp.asarray([[0.0, 0.0, 1.0]])
    >>> made = transfer.quantize(transfer.unshadowed(up, up, degree=1))
    >>> transfer.shade_diffuse(jnp.ones((3, 4)), made, 0.5).shape
    (1, 3)
    """

    codes: Int8[Array, "blocks k b"]  # points in their order
    scales: Float[Array, " k"]  # a coefficient is its code times its scale
    filled: int = eqx.field(static=True)  # places without a point at the end of the last block
    surface: SurfaceKind = eqx.field(static=True, default="vertices", kw_only=True)
    cosine: bool = eqx.field(static=True, default=True, kw_only=True)

    @property
    def num_points(self) -> int:
        return self.codes.shape[0] * self.codes.shape[2] - self.filled

    @property
    def dtype(self) -> jnp.dtype:
        return self.scales.dtype

    @property
    def degree(self) -> int:
        return degree_of(len(self.scales))

    def sharded(self, devices: Devices = None) -> "QuantizedTransfer":
        """Share the points out over devices, as `Transfer.sharded` does, in a single block."""
        check_known("transfer", self)
        mesh = mesh_of(devices)
        flat = jnp.moveaxis(self.codes, 0, 1).reshape(1, len(self.scales), -1)
        codes = share(flat[..., : self.num_points], mesh, axis=2)
        return dataclasses.replace(self, codes=codes, scales=whole(self.scales, mesh), filled=0)

    def irradiances(self, lights: Float[Array, "n k"]) -> Float[Array, "v n"]:
        width = lights.shape[1]
        scaled = (lights * self.scales[None, :width])[None]
        sums = materialize(block_sums, scaled, self.codes[:, :width])
        rows = jnp.swapaxes(sums, 1, 2).reshape(-1, len(lights))
        return rows[: self.num_points] if self.filled else rows

    def vectors(self, width: int) -> Float[Array, "v k"]:
        raise ValueError("expected lights that all vertices share, for a quantized transfer")

    def glossy_form(self, degree: int) -> Transfer:
        raise ValueError("glossy shading needs a transfer, or samples of it, not its eight bits")


def sample(transfer: Transfer, degree: int | None = None) -> SampledTransfer:
    """Evaluate the transfer, cut to `degree` (default: all of it), at the nodes of glossy shading.

    `shade_glossy` does this on the way where it is given coefficients. Linear and differentiable.
    Raises `ValueError` for a degree that the transfer does not have.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import transfer
    >>> up = jnp.asarray([[0.0, 0.0, 1.0]])
    >>> transfer.sample(transfer.unshadowed(up, up, degree=1)).samples.shape
    (1, 6, 1)
    """
    check_type("transfer", transfer, Transfer)
    return _sample(transfer, checked_degree(transfer, degree))


@functools.partial(jax.jit, static_argnums=1)
def _sample(transfer, degree):
    coefficients = transfer.coefficients[:, : num_coefficients(degree)]
    basis = jnp.asarray(node_passes(degree).basis, coefficients.dtype)
    values = matmul(basis.reshape(-1, basis.shape[2]), coefficients.T)
    samples = values.reshape(*basis.shape[:2], -1)
    positions, normals = rows_of(transfer.positions, transfer.normals)
    kind = {"surface": transfer.surface, "cosine": transfer.cosine}
    return SampledTransfer(samples, coefficients, positions, normals, **kind)


def quantize(transfer: Transfer) -> QuantizedTransfer:
    """Round the transfer's coefficients to eight bits.

    Each harmonic has a scale of its own, 1/127 of the largest of all points' coefficients, and
    what is lost is at most half of it. Experiment `leekim2014.table1` prints what that is in a
    picture. Rounding has no derivative: the result is a constant. Raises `ValueError` for
    coefficients that are not finite; under `jit` these make their harmonic non-finite.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import transfer
    >>> up = jnp.asarray([[0.0, 0.0, 1.0]])
    >>> transfer.quantize(transfer.unshadowed(up, up, degree=1)).codes.dtype.name
    'int8'
    """
    check_type("transfer", transfer, Transfer)
    rows = transfer.coefficients
    check_finite("coefficients", rows, wait=True)
    codes, scales = in_steps(rows, 0)
    count, width = rows.shape
    # On a mesh of devices a single block, whose points stay sharded as they are.
    size = count if on_mesh(rows) else _BLOCK
    filled = -count % size if count else 0
    blocks = jnp.pad(codes, ((0, filled), (0, 0))).reshape(-1, size, width)
    kind = {"surface": transfer.surface, "cosine": transfer.cosine}
    return QuantizedTransfer(jnp.swapaxes(blocks, 1, 2), scales, filled, **kind)
