"""A transfer at several degrees, each as values in directions, for methods that recompute."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Int8

from .._core.checks import check_degree
from .._core.linalg import matmul, tall_product
from .._core.xla import materialize
from ..harmonics import degree_of
from ..transfer import QuantizedTransfer, SampledTransfer, Transfer, quantize, sample
from ..transfer._glossy_kernels import in_steps, lobe, product_nodes


class SampledRows(eqx.Module):
    """A transfer in the directions of `product_nodes`, vertex by vertex. Made by `sample_rows`."""

    samples: Int8[Array, "v n"] | Float[Array, "v n"]
    steps: Float[Array, " n"]  # what samples count


class StagedTransfer(eqx.Module):
    """A transfer ready for `shade_two_stage`, made once by `stage`.

    All vertices at two low degrees, and vertex by vertex the values of the whole transfer at
    nodes: the form in which any vertices, wherever they are, are recomputed in full fast.
    """

    transfer: Transfer
    diffuse: Transfer | QuantizedTransfer
    base: SampledTransfer
    middle: SampledTransfer
    rows: SampledRows
    degree: int = eqx.field(static=True)

    @property
    def degrees(self) -> tuple[int, int, int]:
        """Of base, middle and light."""
        return self.base.degree, self.middle.degree, self.degree


def stage(
    transfer: Transfer,
    degree: int | None = None,
    *,
    middle: int | None = None,
    base: int = 2,
    quantized: bool = True,
) -> StagedTransfer:
    """The transfer, ready for `shade_two_stage` with lights of `degree` (default: its own).

    `middle` is the degree of the first stage (default: three fifths of `degree`, but above `base`,
    or there is no change to see), and `base` the one below which nobody falls. Raises `ValueError`
    unless base <= middle <= degree <= the transfer's.
    """
    degree = transfer.degree if degree is None else check_degree(degree)
    base = check_degree(base)
    default = min(max(3 * degree // 5, base + 1), degree)
    middle = default if middle is None else check_degree(middle)
    if not base <= middle <= degree <= transfer.degree:
        raise ValueError(
            f"expected base <= middle <= degree <= the transfer's, {transfer.degree}, got {base}, "
            f"{middle} and {degree}"
        )
    return StagedTransfer(
        transfer,
        quantize(transfer) if quantized else transfer,
        sample(transfer, base),
        sample(transfer, middle),
        sample_rows(transfer.coefficients, degree, quantized),
        degree,
    )


@functools.partial(jax.jit, static_argnums=(1, 2))
def sample_rows(
    coefficients: Float[Array, "v k"], degree: int, quantized: bool = True
) -> SampledRows:
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
    """∫ L O lobe(B·ω) dω of some vertices: what `shade_glossy` does for all."""
    nodes = product_nodes(degree_of(light.shape[-1]))
    directions, project = (jnp.asarray(a, light.dtype) for a in (nodes.directions, nodes.project))
    weights = matmul(light, project) * transfer.steps[None]
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
    return tall_product(materialize(lobed, axis, transfer.samples, lobes, rows), weights).T
