"""Conventions of coefficients: a few facts each, and what follows from them."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from .._core.checks import check_choice, check_degree, check_type, described
from .._core.host import read_only_cache
from ._indexing import degrees, num_coefficients, orders

PHASES = "none", "condon-shortley"
ORDERS = "ascending", "descending"
NORMALIZATIONS = "orthonormal", "4pi", "schmidt", "unnormalized", "polynomial"
LAYOUTS = "coefficients-last", "channels-last", "by-channel", "by-coefficient", "cosine-sine"
QUANTITIES = "radiance", "irradiance", "irradiance/pi"
_UP = {"z-up": ("+x", "+y", "+z"), "y-up": ("+x", "+z", "-y")}
_OWN = _UP["z-up"]

Axes = tuple[str, str, str]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Convention:
    """States what coefficients mean: a handful of facts, jaxsh's own unless said otherwise.

    A function of the directions p of a package is f(p) = Σ c_lm b_lm(B p), with its basis b and the
    axes B that the basis reads. `conventions` lists known ones; `dataclasses.replace` changes a
    fact.

    **Arguments**

    - `phase`: `"none"`, or `"condon-shortley"`: b_lm has the sign (-1)^m of ours.
    - `order`: of m within a degree, `"ascending"` from -l to l or `"descending"`, or all (l, m) in
      their order. Sines are m < 0.
    - `normalization`: of the basis. `"orthonormal"`; `"4pi"`: ∫ b² = 4π (geodesy; e3nn's
      component); `"schmidt"`: 4π/(2l+1) (e3nn's norm); `"unnormalized"`: P_lm(cos θ) times cos mφ
      or sin |m|φ; `"polynomial"`: 1, y, z, x, xy, yz, 3z²-1, xz, x²-y², with the constants in the
      coefficients.
    - `basis_axes`: which of the package's coordinates its basis takes for x, y and z, as `"xyz"`;
      the last is the polar axis. e3nn's is `"zxy"`.
    - `axes`: where the package's x, y and z axis lie in ours, as `("+x", "+z", "-y")`; or `"y-up"`,
      which is that, as for meshes, or `"z-up"`. Mirrored, left-handed ones are good as well.
    - `layout`: `"coefficients-last"` (..., K); `"channels-last"` (..., K, C); `"by-channel"`
      (..., 3K), all of red first; `"by-coefficient"` (..., 3K), the three of the constant first;
      `"cosine-sine"` (..., 2, L+1, L+1), [0, l, m] the cosines and [1, l, m] the sines.
    - `quantity`: `"radiance"`, `"irradiance"` or `"irradiance/pi"`, what a white diffuse surface
      leaves.
    - `degree`: the largest that the package has, or None.
    - `about`: what it is and where that stands, in words.

    Raises `ValueError` for a fact that is none of these.

    **Example**

    >>> import dataclasses
    >>> from jaxsh import harmonics
    >>> splats = harmonics.conventions()["gaussian-splatting"]
    >>> splats.phase, splats.layout
    ('condon-shortley', 'channels-last')
    >>> dataclasses.replace(splats, axes="y-up").axes
    ('+x', '+z', '-y')
    """

    phase: str = "none"
    order: str | tuple[tuple[int, int], ...] = "ascending"
    normalization: str = "orthonormal"
    basis_axes: str = "xyz"
    axes: str | Axes = _OWN
    layout: str = "coefficients-last"
    quantity: str = "radiance"
    degree: int | None = None
    about: str = ""

    def __post_init__(self):
        check_choice("phase", self.phase, PHASES)
        check_choice("normalization", self.normalization, NORMALIZATIONS)
        check_choice("layout", self.layout, LAYOUTS)
        check_choice("quantity", self.quantity, QUANTITIES)
        check_type("about", self.about, str)
        _set(self, "axes", _checked_axes(self.axes))
        if not isinstance(self.basis_axes, str) or sorted(self.basis_axes) != ["x", "y", "z"]:
            raise ValueError(
                f"expected basis_axes as x, y and z in some order, got {described(self.basis_axes)}"
            )
        if self.degree is not None:
            _set(self, "degree", check_degree(self.degree))
        limits = [self.degree] if self.degree is not None else []
        if self.normalization == "polynomial":
            limits.append(2)
        if isinstance(self.order, tuple | list):
            pairs = _checked_pairs(self.order)
            _set(self, "order", pairs)
            limits.append(max(l for l, _ in pairs))
        else:
            check_choice("order", self.order, ORDERS)
        _set(self, "degree", min(limits, default=None))

    def __repr__(self):
        """Only what differs from our own convention, as it would be written down."""
        fields = {field.name: field.default for field in dataclasses.fields(self)}
        said = {name: getattr(self, name) for name in fields}
        own = {name: default for name, default in fields.items() if said[name] == default}
        return f"Convention({', '.join(f'{n}={v!r}' for n, v in said.items() if n not in own)})"


def places(convention: Convention, degree: int) -> Int[np.ndarray, " k"]:
    """Locate each of our coefficients among the package's K, before its layout."""
    l, m = degrees(degree), orders(degree)
    if convention.order == "ascending":
        return l * (l + 1) + m
    if convention.order == "descending":
        return l * (l + 1) - m
    order = list(convention.order)
    pairs = zip(l.tolist(), m.tolist(), strict=True)
    found = np.array([order.index(pair) for pair in pairs], np.int32)
    if found.max() >= len(found):
        raise ValueError(
            f"expected coefficients of degree {convention.degree} for a convention with an order "
            f"of its own, got degree {degree}"
        )
    return found


def scales(convention: Convention, degree: int) -> Float[np.ndarray, " k"]:
    """Tabulate the package's basis functions over ours, for each (l, m), in float64."""
    l, m = degrees(degree).astype(float), np.abs(orders(degree))
    full = np.full(len(l), math.sqrt(4 * math.pi))
    scale = {
        "orthonormal": lambda: np.ones(len(l)),
        "4pi": lambda: full,
        "schmidt": lambda: full / np.sqrt(2 * l + 1),
        "unnormalized": lambda: full * _unnormalized(degree),
        "polynomial": lambda: 1 / _POLYNOMIAL[: num_coefficients(degree)],
    }[convention.normalization]()
    return np.where((m % 2 == 1) & (convention.phase != "none"), -scale, scale)


@read_only_cache(maxsize=None)
def _unnormalized(degree: int) -> Float[np.ndarray, " k"]:
    """√((l+m)! / (l-m)!) / √((2-δ)(2l+1)); infinite where that is more than a float holds."""
    l, m = degrees(degree), np.abs(orders(degree))
    factors = (range(a - b + 1, a + b + 1) for a, b in zip(l.tolist(), m.tolist(), strict=True))
    ratio = np.array([math.prod(map(math.sqrt, some)) for some in factors])
    return ratio / np.sqrt(np.where(m == 0, 1, 2) * (2 * l + 1))


def _polynomial_constants() -> Float[np.ndarray, " 9"]:
    pi = math.pi
    y1, y2 = math.sqrt(3 / (4 * pi)), math.sqrt(15 / (4 * pi))
    y20 = math.sqrt(5 / (16 * pi))
    return np.array([math.sqrt(1 / (4 * pi)), y1, y1, y1, y2, y2, y20, y2, y2 / 2])


_POLYNOMIAL = _polynomial_constants()


def axes_matrix(convention: Convention) -> Int[np.ndarray, "3 3"]:
    """The signed permutation from our directions to the arguments x, y, z of the package's basis.

    The package's coordinates are the products of `axes_rows` with our direction.
    """
    return axes_rows(convention.axes)[["xyz".index(axis) for axis in convention.basis_axes]]


def axes_rows(axes: Sequence[str]) -> Int[np.ndarray, "3 3"]:
    """Say in rows where a package's x, y and z axis lie in ours."""
    rows = np.zeros((3, 3), np.int64)
    for row, axis in enumerate(axes):
        rows[row, "xyz".index(axis[1])] = int(axis[0] + "1")
    return rows


def _set(convention: Convention, field: str, value) -> None:
    object.__setattr__(convention, field, value)


def _checked_axes(axes) -> Axes:
    if isinstance(axes, str):
        check_choice("axes", axes, _UP)
        return _UP[axes]
    good = {sign + name for sign in "+-" for name in "xyz"}
    fits = isinstance(axes, tuple | list) and all(isinstance(a, str) and a in good for a in axes)
    if not fits or sorted(a[1] for a in axes) != ["x", "y", "z"]:
        raise ValueError(
            "expected axes as 'y-up', 'z-up' or three like ('+x', '+z', '-y'), where the package's "
            f"x, y and z lie in ours, got {axes if fits else described(axes)}"
        )
    return tuple(axes)


def _checked_pairs(order) -> tuple[tuple[int, int], ...]:
    pairs = tuple(tuple(pair) if isinstance(pair, tuple | list) else pair for pair in order)
    bands = math.isqrt(len(pairs))
    full = {(l, m) for l in range(bands) for m in range(-l, l + 1)}
    if len(pairs) != len(full) or not pairs or set(pairs) != full:
        raise ValueError(
            "expected order as 'ascending', 'descending' or each (l, m) up to a degree once, got "
            f"{described(order)}"
        )
    return tuple((int(l), int(m)) for l, m in pairs)
