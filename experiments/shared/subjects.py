"""Meshes of the data with their baked transfer."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsh import geometry, transfer

from ..runner import Context


class Subject(NamedTuple):
    """A mesh and its transfer, with shadows."""

    name: str
    mesh: geometry.Mesh
    baked: transfer.Transfer

    @property
    def about(self) -> str:
        """Its name and size, for a note."""
        return f"{self.name}, {len(self.mesh.vertices):,} vertices"

    @property
    def centroid(self) -> Float[Array, " 3"]:
        """Of the vertices: where the paper takes a single sample (§5)."""
        return jnp.mean(self.mesh.vertices, axis=0)

    @property
    def box(self) -> tuple[Float[Array, " 3"], Float[Array, " 3"]]:
        """The corners of the bounding box."""
        return jnp.min(self.mesh.vertices, axis=0), jnp.max(self.mesh.vertices, axis=0)


def load(context: Context, name: str | None, degree: int, *, directions: int = 1024) -> Subject:
    """A mesh of the data, the first where none is named; its bake is timed."""
    name = name or context.data.meshes()[0]
    mesh = context.data.mesh(name)
    with context.time(f"{name}: bake"):
        baked = transfer.bake(
            mesh, degree, directions=directions, seed=context.seed, progress=False
        )
        jax.block_until_ready(baked.coefficients)
    return Subject(name, mesh, baked)


def double(subject: Subject) -> Subject:
    """Its transfer in float64, so that what is seen without noise is the method, not rounding."""
    return subject._replace(baked=subject.baked.astype(jnp.float64))
