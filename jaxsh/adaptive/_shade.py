"""The one door: a frame, and the method to shade it by."""

from jaxtyping import ArrayLike, Float

from .._core.checks import check_choice, check_type
from ..transfer import AbstractTransfer, Material
from ._anchors import Anchors
from ._levels import Levels, Masks
from ._method import AbstractMethod
from ._result import AdaptiveResult
from ._tiles import Tiles
from ._two_stage import TwoStage

METHODS: dict[str, type[AbstractMethod]] = {
    "masks": Masks,
    "levels": Levels,
    "two_stage": TwoStage,
    "anchors": Anchors,
    "tiles": Tiles,
}


def shade(
    light: Float[ArrayLike, "3 k"],
    transfer: AbstractTransfer,
    eye: Float[ArrayLike, " 3"],
    material: Material,
    method: AbstractMethod | str,
) -> AdaptiveResult:
    """Compute the diffuse and glossy radiance of V vertices with less work than `shade_glossy`.

    - `Masks()`, "masks": Lee & Kim 2014 as printed, everyone through every level under a mask. The
      reference; never pays.
    - `Levels()`, "levels": the same, at the cost of those alone that are left. Pays against an
      einsum of three operands, and no more.
    - `TwoStage()`, "two_stage": one decision at a middle degree, then all or nothing. Pays against
      products with the light's matrix, not against `transfer.shade_glossy`.
    - `Anchors()`, "anchors": glossy light at anchor vertices, interpolated where it is smooth.
      Somewhat faster than `transfer.shade_glossy`.
    - `Tiles()`, "tiles": sums of few numbers a vertex, whose weights change smoothly with the
      reflected direction. Pays against all of them.

    **Arguments**

    - `light`, `eye`, `material`: as for `transfer.shade_glossy`; one light (3, K) for all vertices.
    - `transfer`: the last three prepare it. Do that once for many frames: give `TwoStage` the
      result of `stage` as the transfer, `Anchors(make_anchors(...))`, `Tiles(make_tiles(...))`;
      what is not given is made anew in each call. An anchor or tile set shades by itself, too:
      `tiles(light, eye, material)`.
    - `method`: one of these objects, whose fields are the options, or its name for the defaults.

    **Returns** an `AdaptiveResult`. The class of the method says what is differentiable.

    `shade_glossy` in these comparisons is that of a sampled transfer, on the CPU. Where only the
    light turns, none of these is as fast as `transfer.fixed_view`, which is exact; where only the
    eye moves, a `transfer.fixed_light` is at hand. Experiment `leekim2014.table1` prints what each
    method gains, and what it costs in quality.

    Raises `ValueError` for an unknown method and for shapes that do not fit; the constructors of
    the methods raise `TypeError` for an option that they do not have. Both name the nearest one.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import adaptive, sphere, transfer
    >>> points, eye = sphere.fibonacci(50).directions, jnp.asarray([0.0, -3.0, 0.0])
    >>> made = transfer.unshadowed(points, points, degree=2)
    >>> frame = jnp.ones((3, 9)), made, eye, transfer.Material(0.5, 0.5, 8.0)
    >>> adaptive.shade(*frame, adaptive.Tiles(num_tiles=3, block=16)).color.shape
    (50, 3)
    >>> adaptive.shade(*frame, "tile")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ValueError: method must be one of ... got 'tile'; did you mean 'tiles'?
    """
    if isinstance(method, str):
        check_choice("method", method, METHODS)
        method = METHODS[method]()
    check_type("method", method, AbstractMethod)
    return method(light, transfer, eye, material)
