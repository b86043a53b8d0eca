"""Glossy shading under a fixed light: light times transfer, computed once, for eye after eye."""

import functools
import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, check_cosine, check_flag, check_type
from .._core.linalg import matmul
from .._core.xla import on_mesh
from ..harmonics import convolve, degree_of, evaluate, num_coefficients, product_matrix
from ._glossy_kernels import mirrored, reflection, rows_of
from ._material import Material, checked_eye, checked_material, checked_one_light
from ._transfer import Transfer

# Vertices of a tile: what is computed for them stays in cache.
_TILE = 1024


class FixedLight(eqx.Module):
    """Maps eye and material to radiance under one light, for V vertices: made by `fixed_light`.

    `radiance` is light times transfer, R = L̂ O of Lee & Kim 2014, equation 2, in tiles of
    vertices, the last one filled up with zeros.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import transfer
    >>> up = jnp.asarray([[0.0, 0.0, 1.0]])
    >>> still = transfer.fixed_light(jnp.ones((3, 4)), transfer.unshadowed(up, up, degree=1))
    >>> still.degree, still(up[0], transfer.Material(0.5, 0.5, 8.0), distant=True).shape
    (1, (1, 3))
    """

    radiance: Float[Array, "tiles 3 k tile"]
    irradiance: Float[Array, "v 3"]
    positions: Float[Array, "3 v"]
    normals: Float[Array, "3 v"]  # at unit length

    @property
    def degree(self) -> int:
        return degree_of(self.radiance.shape[2])

    def __call__(
        self,
        eye: Float[ArrayLike, " 3"],
        material: Material,
        *,
        distant: bool = False,
        normalized: bool = True,
    ) -> Float[Array, "v 3"]:
        """Compute the radiance (V, 3) towards an eye, as `shade_glossy` does.

        Arguments, derivatives and errors as for `shade_glossy`.
        """
        distant, normalized = check_flag("distant", distant), check_flag("normalized", normalized)
        count, dtype = self.irradiance.shape[0], self.irradiance.dtype
        eye, material = checked_eye(eye, dtype), checked_material(material, count, dtype)
        return _shade(self, eye, material, distant, normalized)


def fixed_light(light: Float[ArrayLike, "3 k"], transfer: Transfer) -> FixedLight:
    """Multiply light and transfer once, for any eye and material to come.

    **Arguments**

    - `light`: coefficients (3, K) that all vertices share.
    - `transfer`: of the light's degree or above, cut to the light's.

    **Returns** a `FixedLight`, to be called with eye and material. It holds three times what the
    transfer does. Bilinear and differentiable, forward and reverse. Raises `ValueError` for shapes
    that do not fit.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import transfer
    >>> up = jnp.asarray([[0.0, 0.0, 1.0]])
    >>> still = transfer.fixed_light(jnp.ones((3, 4)), transfer.unshadowed(up, up, degree=1))
    >>> still(jnp.asarray([0.0, 0.0, 5.0]), transfer.Material(0.5, 0.5, 8.0)).shape
    (1, 3)
    """
    check_type("transfer", transfer, Transfer)
    check_cosine(transfer)
    light = checked_one_light(light, transfer.num_points, transfer.degree, transfer.dtype)
    return _fixed_light(light, transfer)


@jax.jit
def _fixed_light(light, transfer):
    width = light.shape[-1]
    rows = jnp.concatenate([product_matrix(light).reshape(3 * width, width), light])
    coefficients = transfer.vectors(width)
    # On a mesh of devices a single tile, whose vertices stay sharded as they are.
    count = max(transfer.num_points, 1)
    size = count if on_mesh(coefficients) else min(count, _TILE)
    padding = ((0, -transfer.num_points % size), (0, 0))
    tiles = jnp.pad(coefficients, padding).reshape(-1, size, width)

    products = _over_tiles(lambda coefficients: matmul(rows, coefficients.T), tiles)
    radiance = products[:, :-3].reshape(len(products), 3, width, size)
    irradiance = _out_of_tiles(products[:, -3:], transfer.num_points).T
    positions, normals = rows_of(transfer.positions, transfer.normals)
    return FixedLight(radiance, irradiance, positions, normals)


@functools.partial(jax.jit, static_argnames=("distant", "normalized"))
def _shade(still, eye, material, distant, normalized):
    axis = mirrored(eye, still.positions, still.normals, distant)
    degree, (*_, size) = still.degree, still.radiance.shape
    zonal, specular = reflection(material, axis, still.normals, degree, normalized)
    lobes = convolve(jnp.ones(num_coefficients(degree), axis.dtype), zonal)

    def tile(radiance, axis, *own):
        # Σ_i α_i y_i(B) R_i
        kernel = evaluate(axis.T, degree, axis=0) * (own[0] if own else lobes[:, None])
        return jnp.stack([jnp.sum(kernel * channel, axis=0) for channel in radiance])

    parts = still.radiance, _in_tiles(axis, size)
    if lobes.ndim == 2:
        parts = *parts, _in_tiles(lobes.T, size)
    glossy = _out_of_tiles(_over_tiles(tile, *parts), axis.shape[-1]).T
    diffuse = jnp.multiply(*align(still.irradiance, material.diffuse / math.pi))
    return diffuse + jnp.multiply(*align(glossy, specular))


def _over_tiles(tile, *parts):
    """Maps over tiles: in a loop on one CPU, whose cache holds one, in a single call elsewhere."""
    if len(parts[0]) == 1:
        return tile(*(part[0] for part in parts))[None]

    # Not `in_blocks`: with blocks of one tile XLA's CPU backend takes two to four times as long.
    def loop(*parts):
        return jax.lax.map(jax.checkpoint(lambda part: tile(*part)), parts)

    return jax.lax.platform_dependent(*parts, cpu=loop, default=jax.vmap(tile))


def _in_tiles(vertices: Float[Array, "rows v"], size: int) -> Float[Array, "tiles rows tile"]:
    """Cuts the last axis into tiles, the last tile filled up with the last vertex."""
    rows, count = vertices.shape
    if count % size:
        vertices = jnp.pad(vertices, ((0, 0), (0, -count % size)), mode="edge")
    return jnp.moveaxis(vertices.reshape(rows, -1, size), 1, 0)


def _out_of_tiles(tiles: Float[Array, "tiles rows tile"], count: int) -> Float[Array, "rows v"]:
    rows = jnp.moveaxis(tiles, 0, 1).reshape(tiles.shape[1], -1)
    return rows if rows.shape[1] == count else rows[:, :count]
