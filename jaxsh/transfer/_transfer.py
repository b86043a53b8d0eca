"""Transfer: what all its forms offer, and the one that holds coefficients."""

import abc
import dataclasses
from typing import get_args

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, DTypeLike, Float, Int

from .._core.checks import (
    as_float,
    as_integer,
    check_choice,
    check_coefficients,
    check_degree,
    check_flag,
    check_known,
    check_type,
)
from .._core.devices import Devices, last_of, mesh_of, own_numbers, share
from .._core.known import is_concrete
from .._core.linalg import shading_matmul, shading_tall_product
from ..geometry import Mesh, Points, Surface, Texels
from ..harmonics import degree_of, num_coefficients
from ._glossy_kernels import AtNodes, node_passes, reflected
from ._surfaces import SurfaceKind, points_and_normals


class AbstractTransfer(eqx.Module):
    """Holds how light from all around reaches V points, up to a degree, in one form or another.

    The forms are `Transfer`, `SampledTransfer`, `QuantizedTransfer`, `CompressedTransfer` and
    `adaptive.StagedTransfer`; `shade_diffuse` takes each of them.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import transfer
    >>> up = jnp.asarray([[0.0, 0.0, 1.0]])
    >>> made = transfer.unshadowed(up, up, degree=1)
    >>> forms = made, transfer.sample(made), transfer.quantize(made)
    >>> [(form.num_points, form.degree) for form in forms]
    [(1, 1), (1, 1), (1, 1)]
    >>> made.irradiances(jnp.ones((2, 4))).shape
    (1, 2)
    """

    surface: eqx.AbstractVar[SurfaceKind]
    cosine: eqx.AbstractVar[bool]  # False for points without normals, which `fluence` takes

    @property
    @abc.abstractmethod
    def num_points(self) -> int:
        """V."""

    @property
    @abc.abstractmethod
    def degree(self) -> int:
        """The largest degree of a light that it takes."""

    @property
    @abc.abstractmethod
    def dtype(self) -> jnp.dtype:
        """The dtype of the colors that it shades."""

    @abc.abstractmethod
    def irradiances(self, lights: Float[Array, "n k"]) -> Float[Array, "v n"]:
        """Compute what reaches each point of n lights that all points share, cosine included."""

    @abc.abstractmethod
    def vectors(self, width: int) -> Float[Array, "v k"]:
        """Return the first `width` coefficients of each point.

        Raises `ValueError` for a form that does not hold them.
        """

    @abc.abstractmethod
    def glossy_form(self, degree: int) -> AtNodes:
        """Return the form that glossy shading with a light of this degree takes.

        Raises `ValueError` where there is none.
        """


class Transfer(AbstractTransfer):
    """Holds transfer coefficients of V points, baked by `bake` or made by `unshadowed`.

    `coefficients` are ∫ V(ω) max(0, n·ω) y_i(ω) dω: visibility and cosine, without albedo and
    without 1/π, so that their product with the coefficients of a light is irradiance. Bounces, if
    baked, are in them. `neighbors` is the padded table of `geometry.neighbors`: a row names the
    point itself where it has fewer neighbors than others.

    `surface` says what the V points are: the "vertices" of a mesh, "points", or "texels". Without
    `cosine` they are points of a volume: the coefficients are ∫ V(ω) y_i(ω) dω, all normals are
    zero, and `fluence` takes the place of shading.

    Shading differentiates in the coefficients, and glossy shading in positions and normals too,
    through the mirrored direction alone. The coefficients of a bake are constants: neither they
    nor `shade_diffuse` change with the positions and normals stored beside them, so that its
    derivative in those is 0. `unshadowed` gives coefficients that do depend on the normals.
    Raises `ValueError` for shapes that do not fit.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import transfer
    >>> up = jnp.asarray([[0.0, 0.0, 1.0]])
    >>> made = transfer.unshadowed(up, up, degree=2)
    >>> made.num_points, made.degree, made.truncated(1).coefficients.shape
    (1, 2, (1, 4))
    """

    coefficients: Float[Array, "v k"] = eqx.field(converter=lambda v: as_float(v, "coefficients"))
    positions: Float[Array, "v 3"] = eqx.field(converter=lambda v: as_float(v, "positions"))
    normals: Float[Array, "v 3"] = eqx.field(converter=lambda v: as_float(v, "normals"))
    neighbors: Int[Array, "v n"] = eqx.field(converter=lambda v: as_integer(v, "neighbors"))
    surface: SurfaceKind = eqx.field(static=True, default="vertices", kw_only=True)
    cosine: bool = eqx.field(static=True, default=True, kw_only=True)

    def __check_init__(self):
        check_choice("surface", self.surface, get_args(SurfaceKind))
        check_flag("cosine", self.cosine)
        if self.coefficients.ndim != 2:
            raise ValueError(f"expected coefficients (V, K), got shape {self.coefficients.shape}")
        check_coefficients("coefficients", self.coefficients)
        count = len(self.coefficients)
        for name in ("positions", "normals"):
            if getattr(self, name).shape != (count, 3):
                raise ValueError(
                    f"expected {name} ({count}, 3), one for each vertex of the coefficients, got "
                    f"shape {getattr(self, name).shape}"
                )
        if self.neighbors.ndim != 2 or len(self.neighbors) != count:
            raise ValueError(f"expected neighbors ({count}, n), got shape {self.neighbors.shape}")

    @property
    def num_points(self) -> int:
        return self.coefficients.shape[0]

    @property
    def dtype(self) -> jnp.dtype:
        return self.coefficients.dtype

    @property
    def degree(self) -> int:
        return degree_of(self.coefficients.shape[-1])

    def truncated(self, degree: int) -> "Transfer":
        """Cut the coefficients to a degree; raises `ValueError` for one above the transfer's."""
        cut = self.coefficients[:, : num_coefficients(checked_degree(self, degree))]
        return dataclasses.replace(self, coefficients=cut)

    def astype(self, dtype: DTypeLike) -> "Transfer":
        """Cast all but the neighbors."""
        coefficients, positions, normals = (
            array.astype(dtype) for array in (self.coefficients, self.positions, self.normals)
        )
        return dataclasses.replace(
            self, coefficients=coefficients, positions=positions, normals=normals
        )

    def sharded(self, devices: Devices = None) -> "Transfer":
        """Share the points out over devices (default: all), filled up as `shard_rows` does.

        `num_points` grows to a multiple of the devices. A point that fills up has coefficients and
        a normal of zero and the last point's position: it is black, and the fits of `inverse` skip
        it. A transfer too large for one device is made on the host, under
        `jax.default_device(jax.devices("cpu")[0])`. Raises `ValueError` as `shard_rows` does.
        """
        check_known("transfer", self)
        mesh = mesh_of(devices)
        return dataclasses.replace(
            self,
            coefficients=share(self.coefficients, mesh),
            positions=share(self.positions, mesh, filling=last_of(self.positions)),
            normals=share(self.normals, mesh),
            neighbors=share(self.neighbors, mesh, filling=own_numbers(self.neighbors.shape[1])),
        )

    def belongs_to(self, surface: Surface) -> bool:
        """Tell whether these are the points of a surface: as many, in the same places and order.

        Compares positions and normals, rounded to the transfer's dtype; of those that are traced or
        held by other processes the number alone. What `sharded` has filled up is passed over.
        Raises `TypeError` for what is no `Mesh`, `Points` or `Texels`.
        """
        check_type("surface", surface, Mesh, Points, Texels)
        points, normals = points_and_normals(surface)
        count = len(points)
        if (normals is not None) != self.cosine or not 0 < count <= self.num_points:
            return False
        if not all(map(is_concrete, (points, normals, self.positions, self.normals))):
            return self.num_points == count
        places, ways = np.asarray(self.positions), np.asarray(self.normals)
        if np.any(places[count:] != places[count - 1][None]):
            return False
        towards = np.zeros_like(points) if normals is None else np.asarray(normals)
        return all(
            np.array_equal(own[:count], given.astype(own.dtype), equal_nan=True)
            for own, given in ((places, np.asarray(points)), (ways, towards))
        )

    def irradiances(self, lights: Float[Array, "n k"]) -> Float[Array, "v n"]:
        return irradiances(self.coefficients, lights)

    def vectors(self, width: int) -> Float[Array, "v k"]:
        return self.coefficients[:, :width]

    def glossy_form(self, degree: int) -> "Transfer":
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
        return shading_matmul(some, self.coefficients[:, :width].T)


def irradiances(
    coefficients: Float[Array, "v k"], lights: Float[Array, "n j"]
) -> Float[Array, "v n"]:
    """Multiplies coefficients with those of lights up to their degree."""
    filled = jnp.pad(lights, ((0, 0), (0, coefficients.shape[1] - lights.shape[1])))
    return shading_tall_product(coefficients, filled)


def checked_degree(transfer: AbstractTransfer, degree: int | None) -> int:
    """Returns a degree that the transfer has (default: its own)."""
    degree = transfer.degree if degree is None else check_degree(degree)
    if degree > transfer.degree:
        raise ValueError(
            f"expected a degree of at most the transfer's, {transfer.degree}, got {degree}"
        )
    return degree
