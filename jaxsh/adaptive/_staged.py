"""Transfer at several degrees, each as values in directions, for methods that recompute."""

import functools
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Int8

from .._core.checks import check_cosine, check_degree, check_flag, check_known, check_type
from .._core.devices import Devices, mesh_of, share, whole
from .._core.linalg import matmul, shading_tall_product
from .._core.xla import materialize
from ..harmonics import degree_of
from ..transfer import (
    AbstractTransfer,
    QuantizedTransfer,
    SampledTransfer,
    Transfer,
    quantize,
    sample,
)
from ..transfer._glossy_kernels import in_steps, lobe, product_nodes


class SampledRows(eqx.Module):
    """Holds a transfer in the directions of `product_nodes`, vertex by vertex."""

    samples: Int8[Array, "v n"] | Float[Array, "v n"]
    scales: Float[Array, " n"]  # a value is its sample times its scale


class StagedTransfer(AbstractTransfer):
    """Holds a transfer ready for `TwoStage`, made once by `stage`.

    All vertices at two low degrees, and vertex by vertex the values of the whole transfer at
    nodes: the form in which any vertices, wherever they are, are recomputed in full fast.

    **Example**

    >>> from jaxsh import adaptive, sphere, transfer
    >>> points = sphere.fibonacci(50).directions
    >>> made = transfer.unshadowed(points, points, degree=2)
    >>> adaptive.stage(made, middle=2, base=1).degrees
    (1, 2, 2)
    """

    transfer: Transfer
    diffuse: AbstractTransfer
    base: SampledTransfer
    middle: SampledTransfer
    rows: SampledRows
    target: int = eqx.field(static=True)  # degree of the lights to come
    surface: Literal["vertices", "points", "texels"] = eqx.field(
        static=True, default="vertices", kw_only=True
    )
    cosine: bool = eqx.field(static=True, default=True, kw_only=True)

    @property
    def num_points(self) -> int:
        return self.transfer.num_points

    @property
    def degree(self) -> int:
        return self.transfer.degree

    @property
    def dtype(self) -> jnp.dtype:
        return self.transfer.dtype

    @property
    def degrees(self) -> tuple[int, int, int]:
        """The degrees of base, middle and light."""
        return self.base.degree, self.middle.degree, self.target

    def sharded(self, devices: Devices = None) -> "StagedTransfer":
        """Share the points out over devices, as `Transfer.sharded` does."""
        check_known("transfer", self)
        mesh = mesh_of(devices)
        assert isinstance(self.diffuse, Transfer | QuantizedTransfer)  # what `stage` makes
        return StagedTransfer(
            self.transfer.sharded(mesh),
            self.diffuse.sharded(mesh),
            self.base.sharded(mesh),
            self.middle.sharded(mesh),
            SampledRows(share(self.rows.samples, mesh), whole(self.rows.scales, mesh)),
            self.target,
            surface=self.surface,
            cosine=self.cosine,
        )

    def irradiances(self, lights: Float[Array, "n k"]) -> Float[Array, "v n"]:
        return self.diffuse.irradiances(lights)

    def vectors(self, width: int) -> Float[Array, "v k"]:
        return self.transfer.vectors(width)

    def glossy_form(self, degree: int) -> Transfer:
        return self.transfer


def stage(
    transfer: Transfer,
    degree: int | None = None,
    *,
    middle: int | None = None,
    base: int = 2,
    quantized: bool = True,
) -> StagedTransfer:
    """Prepare the transfer for `TwoStage` with lights of `degree` (default: its own).

    **Arguments**

    - `middle`: degree of the first stage (default: three fifths of `degree`, but above `base`, or
      there is no change to see).
    - `base`: degree below which nobody falls.
    - `quantized`: whether the samples and the diffuse part are rounded to eight bits.

    Of a transfer that several devices share, each stages its own points; for eight bits they give
    each other the largest value of each harmonic and node. Raises `ValueError` unless base <=
    middle <= degree <= the transfer's.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import adaptive, transfer
    >>> up = jnp.asarray([[0.0, 0.0, 1.0]])
    >>> adaptive.stage(transfer.unshadowed(up, up, degree=4), base=1).degrees
    (1, 2, 4)
    """
    check_type("transfer", transfer, Transfer)
    check_cosine(transfer)
    quantized = check_flag("quantized", quantized)
    degree = transfer.degree if degree is None else check_degree(degree)
    base = check_degree(base, "base")
    default = min(max(3 * degree // 5, base + 1), degree)
    middle = default if middle is None else check_degree(middle, "middle")
    if not base <= middle <= degree <= transfer.degree:
        raise ValueError(
            f"expected base <= middle <= degree <= the transfer's, {transfer.degree}, got {base}, "
            f"{middle} and {degree}"
        )
    return StagedTransfer(
        transfer,
        diffuse_part(transfer, None, quantized),
        sample(transfer, base),
        sample(transfer, middle),
        sample_rows(transfer.coefficients, degree, quantized),
        degree,
        surface=transfer.surface,
    )


def diffuse_part(
    transfer: Transfer, given: AbstractTransfer | None, quantized: bool
) -> AbstractTransfer:
    """Returns the diffuse part of a prepared set: the given one, eight bits, or the transfer."""
    if given is None:
        return quantize(transfer) if quantized else transfer
    check_type("diffuse", given, AbstractTransfer)
    if given.num_points != transfer.num_points or given.degree != transfer.degree:
        raise ValueError(
            f"expected a diffuse part of {transfer.num_points} vertices and degree "
            f"{transfer.degree}, got {given.num_points} and {given.degree}"
        )
    return given


@functools.partial(jax.jit, static_argnums=(1, 2))
def sample_rows(
    coefficients: Float[Array, "v k"], degree: int, quantized: bool = True
) -> SampledRows:
    """Evaluates coefficients, cut to a degree, at the nodes of `product_nodes`."""
    basis = jnp.asarray(product_nodes(degree).basis, coefficients.dtype)
    samples = matmul(coefficients[:, : basis.shape[1]], basis.T)
    if quantized:
        return SampledRows(*in_steps(samples, 0))
    return SampledRows(samples, jnp.ones_like(basis[:, 0]))


def row_products(
    light: Float[Array, "3 k"],
    transfer: SampledRows,
    axis: Float[Array, "3 v"],
    lobes: Float[Array, "bands ..."],
    rows: Int[Array, " b"],
) -> Float[Array, "3 b"]:
    """Integrates L O lobe(B·ω) for some vertices, as `shade_glossy` does for all."""
    nodes = product_nodes(degree_of(light.shape[-1]))
    directions, project = (jnp.asarray(a, light.dtype) for a in (nodes.directions, nodes.project))
    weights = matmul(light, project) * transfer.scales[None]
    if lobes.ndim == 2:
        lobes = lobes.at[:, rows].get(mode="promise_in_bounds")
    lobes = lobes.reshape(len(lobes), -1, 1)
    x, y, z = directions.T[:, None]

    def lobed(axis, samples, lobes, rows):
        # Gathered here, where it is used: XLA writes a gather of its own out at half the speed.
        some = samples.at[rows].get(mode="promise_in_bounds")
        a, b, c = axis[..., None]
        return some.astype(axis.dtype) * lobe(x * a + y * b + z * c, lobes)

    axis = axis.at[:, rows].get(mode="promise_in_bounds")
    values = materialize(lobed, axis, transfer.samples, lobes, rows)
    return shading_tall_product(values, weights).T
