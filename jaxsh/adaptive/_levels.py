"""Lee and Kim's filter: with every vertex under a mask, and compacted."""

from typing import Literal

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import ArrayLike, Float

from .._core.checks import check_choice, check_degree, check_flag, check_size, check_type
from ..harmonics import degree_of
from ..transfer import AbstractTransfer, Material
from ._by_device import filtered_by_device
from ._filter import Filter, filtered
from ._method import (
    AbstractMethod,
    check_neighbors,
    checked_frame,
    checked_scalar,
    plain_transfer,
    scalars,
)
from ._result import AdaptiveResult

FALLBACKS = ("level", "base")


class AbstractFilter(AbstractMethod):
    """Holds the options that the filtering methods share; `Masks` says what they mean."""

    threshold: Float[ArrayLike, ""] = 0.02
    exposure: Float[ArrayLike, ""] = 1.0
    base: int = eqx.field(static=True, default=2)
    fallback: Literal["level", "base"] = eqx.field(static=True, default="level")
    rings: int = eqx.field(static=True, default=0)
    smoothing: bool = eqx.field(static=True, default=False)
    previous: AdaptiveResult | None = None
    hysteresis: Float[ArrayLike, ""] = 1.0
    distant: bool = eqx.field(static=True, default=False)
    normalized: bool = eqx.field(static=True, default=True)

    def __check_init__(self):
        check_degree(self.base, "base")
        check_size("rings", self.rings, least=0)
        check_choice("fallback", self.fallback, FALLBACKS)
        for name in ("smoothing", "distant", "normalized"):
            check_flag(name, getattr(self, name))
        if self.previous is not None:
            check_type("previous", self.previous, AdaptiveResult)
        for name in ("threshold", "exposure", "hysteresis"):
            checked_scalar(name, getattr(self, name))

    def settings(self, light, diffuse_threshold) -> Filter:
        """Cast to the light's dtype; raises `ValueError` for a base above the light's degree."""
        target = degree_of(light.shape[-1])
        if self.base > target:
            raise ValueError(
                f"expected base from 0 to the light's degree, {target}, got {self.base}"
            )
        cast = scalars(
            light.dtype,
            threshold=self.threshold,
            diffuse_threshold=diffuse_threshold,
            exposure=self.exposure,
            hysteresis=self.hysteresis,
        )
        return Filter(
            {"specular": cast["threshold"], "diffuse": cast["diffuse_threshold"]},
            cast["exposure"],
            cast["hysteresis"],
            self.base,
            self.rings,
            self.smoothing,
            self.fallback,
            self.distant,
            self.normalized,
        )

    def remembered(self, count: int):
        """Return the degrees that the previous frame showed, or None."""
        if self.previous is None:
            return None
        shown = self.previous.shown_degree
        if {"diffuse", "specular"} - set(shown) or any(len(one) != count for one in shown.values()):
            raise ValueError(f"expected previous as a result of this method for {count} vertices")
        return {name: jnp.asarray(one) for name, one in shown.items()}


class Masks(AbstractFilter):
    """Filters level by level, everyone under a mask: Lee & Kim 2014, algorithms 1 to 3.

    Diffuse and specular light are accumulated from degree `base` to the light's, each with a
    region of interest of its own, which all vertices are in at first. A vertex leaves where the
    change since the base falls below a threshold, and comes back only by refinement. Everything
    is computed for everyone, so this is the reference and never pays: see `Levels`.

    **Options**

    - `threshold`, `diffuse_threshold`: of the largest change over red, green and blue, after the
      albedo and times `exposure`. At 0 everyone stays.
    - `base`: degree that everyone is computed at.
    - `fallback`: what a vertex shows that left. "level": all it was computed to, the level at
      which it left included, as in algorithm 1, where the change is added before the test. "base":
      up to the last level at which it stayed, so that only those inside differ from the base, as
      in the text. The paper does not say which.
    - `rings`: of breadth-first refinement (§4.4) around the region. Neighbors are computed in
      full and join where their change reaches the threshold. The number of vertices means to
      convergence.
    - `smoothing`: the paper's, of two rings around the region.
    - `previous`, `hysteresis`: a memory, not in the paper. For a vertex that the previous result
      showed at a level, that level's threshold is `hysteresis` times as high.
    - `distant`, `normalized`: as for `transfer.shade_glossy`.

    Called with a frame as `shade` is, it **returns** an `AdaptiveResult`. `active_fraction` counts
    who stays after each level, before refinement; the paper's filtering ratio is one less it.
    Differentiable in light, material and transfer, forward and reverse, where nobody enters or
    leaves; thresholds and exposure have no gradient. It keeps a sharding over vertices; with rings
    or smoothing devices tell each other who is inside, and colors, but not inside `shard_map`.

    Deviations: |change|, the largest over the channels, where the paper writes change; the second
    loop of algorithm 3 adds the increment alone. Raises `ValueError` for shapes and options that
    do not fit.

    **Example**

    >>> from jaxsh import adaptive
    >>> adaptive.Masks(threshold=0.05).base
    2
    """

    diffuse_threshold: Float[ArrayLike, ""] = 0.01

    def __check_init__(self):
        checked_scalar("diffuse_threshold", self.diffuse_threshold)

    def __call__(
        self,
        light: Float[ArrayLike, "3 k"],
        transfer: AbstractTransfer,
        eye: Float[ArrayLike, " 3"],
        material: Material,
    ) -> AdaptiveResult:
        return _filtered(self, "masks", light, transfer, eye, material, compact=False)


class Levels(AbstractFilter):
    """Filters as `Masks` does, at the cost of the vertices inside alone.

    Each level gathers the vertices that are left into blocks. Their number may change from frame
    to frame without another compilation. The diffuse part is decided on, but computed for all,
    which costs less than to gather. Options, result and errors are those of `Masks`, with which it
    agrees to rounding. Where several devices share the vertices, each gathers its own; shares and
    cost are means over them.

    It pays against an einsum of light product, transfer and lobe; not against the same product in
    tiles of vertices, nor against `transfer.shade_glossy` of a sampled transfer. Experiment
    `leekim2014.table1` prints all three.

    **Example**

    >>> from jaxsh import adaptive
    >>> adaptive.Levels(treshold=0.05)
    Traceback (most recent call last):
    TypeError: Levels has no option 'treshold'; did you mean 'threshold'?
    """

    diffuse_threshold: Float[ArrayLike, ""] = 0.01

    def __check_init__(self):
        checked_scalar("diffuse_threshold", self.diffuse_threshold)

    def __call__(
        self,
        light: Float[ArrayLike, "3 k"],
        transfer: AbstractTransfer,
        eye: Float[ArrayLike, " 3"],
        material: Material,
    ) -> AdaptiveResult:
        return _filtered(self, "levels", light, transfer, eye, material, compact=True)


def _filtered(method, name, light, transfer, eye, material, compact):
    plain = plain_transfer(name, transfer)
    light, eye, material = checked_frame(light, plain, eye, material)
    settings = method.settings(light, method.diffuse_threshold)
    previous = method.remembered(plain.num_points)
    frame = light, plain, eye, material, settings, previous
    if method.rings or method.smoothing:
        check_neighbors(type(method).__name__, plain)
    elif not compact:
        return filtered(*frame, compact=False)
    return filtered_by_device(*frame, compact=compact)
