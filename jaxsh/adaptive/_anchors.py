"""Anchors: the glossy part in full at a few vertices, carried over where it is smooth."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from .._core.checks import align, check_cosine, check_degree, check_flag, check_number, check_type
from .._core.xla import materialize, on_mesh
from ..harmonics import degree_of, num_coefficients
from ..transfer import (
    AbstractTransfer,
    Material,
    SampledTransfer,
    Transfer,
    sample,
    shade_diffuse,
)
from ..transfer._glossy_kernels import lobe_polynomial, lobe_products, mirrored, reflection
from ._method import (
    AbstractMethod,
    check_known,
    check_one_lobe,
    check_set,
    check_whole_degree,
    checked_frame,
    checked_scalar,
    plain_transfer,
    scalars,
)
from ._regions import compacted, everywhere, seen_as_changed
from ._result import AdaptiveResult, product_cost, sum_cost
from ._sharing import axes_of, made_of_rows, material_axes, on_rows, own, sharing, sharing_of_groups
from ._staged import SampledRows, diffuse_part, row_products, sample_rows

# Distance of opposite normals, in half-extents of the mesh.
_NORMALS = 2.0
# Anchors that a vertex looks at.
NEAREST = 4
SHARE, BASE, THRESHOLD = 0.1, 1, 0.06


class AnchorSet(eqx.Module):
    """Holds anchor vertices of a mesh, and which of them each vertex lies between.

    Made by `make_anchors`; called with a frame, it shades. Independent of light and eye.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import adaptive, sphere, transfer
    >>> points = sphere.fibonacci(50).directions
    >>> made = transfer.unshadowed(points, points, degree=2)
    >>> anchors = adaptive.make_anchors(made, share=0.2)
    >>> eye, mirror = jnp.asarray([0.0, -3.0, 0.0]), transfer.Material(0.5, 0.5, 8.0)
    >>> anchors(jnp.ones((3, 9)), eye, mirror).color.shape
    (50, 3)
    """

    anchors: Int[Array, " p"]
    nearest: Int[Array, "v 4"]  # numbers into `anchors`
    weights: Float[Array, "v 4"]  # sum to one
    rows: SampledRows
    base: SampledTransfer
    diffuse: AbstractTransfer
    # So many vertices after another have anchors among themselves: those of a device.
    group: int = eqx.field(static=True)

    @property
    def num_points(self) -> int:
        return len(self.nearest)

    @property
    def degree(self) -> int:
        return self.diffuse.degree

    def __call__(
        self,
        light: Float[ArrayLike, "3 k"],
        eye: Float[ArrayLike, " 3"],
        material: Material,
        *,
        threshold: Float[ArrayLike, ""] = THRESHOLD,
        exposure: Float[ArrayLike, ""] = 1.0,
        distant: bool = False,
        normalized: bool = True,
    ) -> AdaptiveResult:
        """Shade a frame in full only at the anchors and where these disagree.

        All vertices take the glossy part S at the anchors' base degree. The rest, ΔS, is computed
        at the anchors; a vertex takes the mean of its nearest four, weighed by 1/distance², where
        they differ by less than `threshold`, and is computed in full where they do not. Not in
        Lee & Kim 2014, whose filter decides by ΔS itself. Whether it pays against
        `transfer.shade_glossy` of a sampled transfer hangs on how many that are; experiment
        `leekim2014.table1` prints both.

        **Arguments**

        - `light`, `eye`, `material`, `distant`, `normalized`: as for `transfer.shade_glossy`; one
          light (3, K) of the transfer's degree, and one exponent or roughness.
        - `threshold`: of max - min over the four anchors, the largest channel, after the albedo
          and times `exposure`. At 0 every vertex is computed in full, exactly.

        **Returns** an `AdaptiveResult`; `active_fraction` has "anchors" and "specular", the shares
        computed in full as an anchor and as a vertex. Differentiable in light and albedos where
        the choice of vertices does not change, forward and reverse; the choice is a constant.

        Raises `ValueError` for shapes that do not fit, for an exponent or roughness per vertex, and
        for a set that is shared out over devices otherwise than the transfer was that it was made
        of.
        """
        light, eye, material = checked_frame(light, self.diffuse, eye, material)
        check_whole_degree("anchors", light, self.degree)
        check_one_lobe(material, self.num_points)
        shared = sharing_of_groups("an AnchorSet", self.rows.samples, self.group)
        distant, normalized = check_flag("distant", distant), check_flag("normalized", normalized)
        limits = scalars(light.dtype, threshold=threshold, exposure=exposure)
        limits = limits["threshold"], limits["exposure"]
        return _shade_anchors(light, eye, material, self, limits, distant, normalized, shared)


def make_anchors(
    transfer: Transfer,
    *,
    share: float = SHARE,
    base: int = BASE,
    quantized: bool = True,
    diffuse: AbstractTransfer | None = None,
) -> AnchorSet:
    """Choose anchors, spread evenly over positions and normals, and the four nearest each vertex.

    **Arguments**

    - `transfer`: of at least four vertices, with known values. Where several devices share them,
      of four on each, and each device's vertices have anchors of their own.
    - `share`: of the vertices that are anchors, in (0, 1].
    - `base`: degree to which all vertices are computed.
    - `quantized`: whether samples and the diffuse part are rounded to eight bits.
    - `diffuse`: the diffuse part, where it is there already, in any form.

    Takes three quarters of the transfer's memory for its samples, or three times that where they
    are not rounded, and the diffuse part. Neither traceable nor differentiable; raises
    `ValueError` for a share or a base that is out of range, and for too few vertices.

    **Example**

    >>> from jaxsh import adaptive, sphere, transfer
    >>> points = sphere.fibonacci(50).directions
    >>> anchors = adaptive.make_anchors(transfer.unshadowed(points, points, degree=2), share=0.2)
    >>> anchors.anchors.shape, anchors.nearest.shape
    ((10,), (50, 4))
    """
    from scipy.spatial import KDTree

    check_type("transfer", transfer, Transfer)
    check_cosine(transfer)
    quantized = check_flag("quantized", quantized)
    check_known("make_anchors", transfer)
    shared = sharing(transfer.coefficients)
    count = transfer.num_points // (shared.parts if shared else 1)
    share = check_number("share", share, above=0.0, most=1.0)
    if count < NEAREST:
        where = " on each device" if shared else ""
        raise ValueError(f"expected at least {NEAREST} vertices{where}, got {count}")
    if check_degree(base, "base") > transfer.degree:
        raise ValueError(f"expected base of at most {transfer.degree}, got {base}")
    extent = max(float(jnp.ptp(transfer.positions, axis=0).max()) / 2, 1e-30)
    dtype = transfer.coefficients.dtype

    def choose(part, points, normals):
        features = np.concatenate([points / extent, _NORMALS / 2 * normals], axis=1)
        anchors = _spread(features, max(round(share * count), NEAREST))
        distance, nearest = KDTree(features[anchors]).query(features, k=NEAREST)
        weights = 1 / (distance**2 + 1e-12)
        weights = (weights / weights.sum(axis=1, keepdims=True)).astype(dtype)
        anchors, nearest = anchors + part * count, nearest + part * len(anchors)
        return anchors.astype(np.int32), nearest.astype(np.int32), weights

    points = transfer.positions, transfer.normals
    anchors, nearest, weights = made_of_rows(choose, shared, *points)
    return AnchorSet(
        anchors,
        nearest,
        weights,
        sample_rows(transfer.coefficients, transfer.degree, quantized),
        sample(transfer, base),
        diffuse_part(transfer, diffuse, quantized),
        count,
    )


class Anchors(AbstractMethod):
    """Shades glossily in full at anchors, and between them where these disagree: see `AnchorSet`.

    **Options**

    - `anchors`: from `make_anchors`, of this transfer; serve any light and eye. Without them
      `share`, `base` and `quantized` are `make_anchors`' arguments, and they are made anew in each
      call.
    - `threshold`, `exposure`, `distant`, `normalized`: as for a call of an `AnchorSet`.

    **Example**

    >>> from jaxsh import adaptive
    >>> adaptive.Anchors(threshold=0.02).share
    0.1
    """

    anchors: AnchorSet | None = None
    share: float = eqx.field(static=True, default=SHARE)
    base: int = eqx.field(static=True, default=BASE)
    quantized: bool = eqx.field(static=True, default=True)
    threshold: Float[ArrayLike, ""] = THRESHOLD
    exposure: Float[ArrayLike, ""] = 1.0
    distant: bool = eqx.field(static=True, default=False)
    normalized: bool = eqx.field(static=True, default=True)

    def __check_init__(self):
        if self.anchors is not None:
            check_type("anchors", self.anchors, AnchorSet)
        check_number("share", self.share, above=0.0, most=1.0)
        check_degree(self.base, "base")
        for name in ("quantized", "distant", "normalized"):
            check_flag(name, getattr(self, name))
        for name in ("threshold", "exposure"):
            checked_scalar(name, getattr(self, name))

    def __call__(
        self,
        light: Float[ArrayLike, "3 k"],
        transfer: AbstractTransfer,
        eye: Float[ArrayLike, " 3"],
        material: Material,
    ) -> AdaptiveResult:
        anchors = self.anchors
        if anchors is None:
            plain = plain_transfer("anchors", transfer)
            options = {"share": self.share, "base": self.base, "quantized": self.quantized}
            anchors = make_anchors(plain, **options)
        check_set("anchors", anchors.num_points, anchors.degree, transfer)
        return anchors(
            light,
            eye,
            material,
            threshold=self.threshold,
            exposure=self.exposure,
            distant=self.distant,
            normalized=self.normalized,
        )


@functools.partial(jax.jit, static_argnames=("distant", "normalized", "shared"))
def _shade_anchors(light, eye, material, anchors, limits, distant, normalized, shared):
    chosen = anchors.anchors, anchors.nearest, anchors.weights
    glossy, active = on_rows(
        functools.partial(_glossy, distant, normalized),
        shared,
        (
            *(None, None, material_axes(material), None, 0),
            *(axes_of(anchors.base, 2, 0, 1, 1), axes_of(anchors.rows, 0, None)),
        ),
        (0, 0),
        *(light, eye, material, limits, chosen, anchors.base, anchors.rows),
    )
    diffuse = shade_diffuse(light, anchors.diffuse, material.diffuse)
    color = diffuse + glossy
    shares = {
        "anchors": jnp.asarray(len(anchors.anchors) / len(active), light.dtype),
        "specular": jnp.mean(active.astype(light.dtype)),
    }
    target = anchors.degree
    once = sum_cost(anchors.base.degree, target) + product_cost("diffuse", 0, target, target)
    again = sum_cost(target, target)
    return AdaptiveResult(color, shares, once + again * (shares["anchors"] + shares["specular"]))


def _glossy(distant, normalized, light, eye, material, limits, chosen, base, rows):
    """Computes the glossy part of the rows at hand, and which of them were computed in full."""
    threshold, exposure = limits
    anchors, nearest, weights = chosen
    anchors, nearest = own(anchors, len(nearest)), own(nearest, len(anchors))
    axis = mirrored(eye, base.positions, base.normals, distant)
    see = functools.partial(reflection, material, axis, base.normal_rows(), normalized=normalized)
    zonal, albedo = see(degree_of(light.shape[-1]))
    polynomial = lobe_polynomial(zonal)
    lights = light[:, : num_coefficients(base.degree)]
    low = lobe_products(lights, base, axis, lobe_polynomial(see(base.degree)[0]))

    def in_full(vertices):
        return row_products(light, rows, axis, polynomial, vertices)

    def some_anchors(some):
        return in_full(anchors if some is None else anchors[some])

    at_anchors = everywhere(some_anchors, len(anchors), whole=on_mesh(anchors))
    rest = at_anchors - low[:, anchors]
    spread, carried = materialize(_between, rest, nearest, weights, low)
    specular = albedo.T if albedo.ndim == 2 else albedo.reshape(-1, 1)
    active = materialize(seen_as_changed, spread, threshold, specular * exposure)
    glossy = jnp.where(active[None], compacted(in_full, active), carried).T
    return jnp.multiply(*align(glossy, albedo)), active


def _between(rest, nearest, weights, base):
    """Returns how much a vertex's anchors differ, and the value that they give it."""
    near = [rest.at[:, nearest[:, i]].get(mode="promise_in_bounds") for i in range(NEAREST)]
    spread = functools.reduce(jnp.maximum, near) - functools.reduce(jnp.minimum, near)
    return spread, base + sum(w[None] * n for w, n in zip(weights.T, near, strict=True))


def _spread(features: Float[np.ndarray, "v f"], count: int) -> Int[np.ndarray, " p"]:
    """Picks a point in each of `count` cells, made by halving the largest along its widest side."""
    cells = [np.arange(len(features))]
    while len(cells) < count:
        halves = []
        left = count - len(cells)
        for i, cell in enumerate(sorted(cells, key=len, reverse=True)):
            if i >= left or len(cell) < 2:
                halves.append(cell)
                continue
            side = features[cell][:, np.ptp(features[cell], axis=0).argmax()]
            order = np.argpartition(side, len(cell) // 2)
            halves += [cell[order[: len(cell) // 2]], cell[order[len(cell) // 2 :]]]
        cells = halves
    middle = [np.sum((features[c] - features[c].mean(axis=0)) ** 2, axis=1).argmin() for c in cells]
    return np.array([cell[i] for cell, i in zip(cells, middle, strict=True)])
