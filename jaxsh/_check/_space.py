"""Everything that a convention may be: the facts of `harmonics.conventions`, in all combinations.

Nothing about conventions is stated here a second time: signs, constants and places come from
`harmonics`' own table.
"""

import functools
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..harmonics import Convention, clamped_cosine, conventions, degrees, orders
from ..harmonics._convention import (
    NORMALIZATIONS,
    ORDERS,
    PHASES,
    QUANTITIES,
    axes_matrix,
    places,
    scales,
)
from ._placements import placements, turned

# What one deviation from a named convention costs, in the same unit as a logarithm of probability.
_COST_OF_HEADING, _COST_OF_AXES, _COST_OF_MIRROR, _COST_OF_FACT = 2.0, 3.0, 4.0, 5.0


class Combination(NamedTuple):
    """One place in the space: an index into each of its lists."""

    order: int
    normalization: int
    phase: int
    placement: int
    quantity: int


class Space(NamedTuple):
    """All facts up to a degree, as tables over our K coefficients."""

    degree: int
    orders: tuple[str | tuple[tuple[int, int], ...], ...]
    normalizations: tuple[str, ...]
    phases: tuple[str, ...]
    quantities: tuple[str, ...]
    order_table: Int[np.ndarray, "o k"]  # where each of ours stands
    norm_table: Float[np.ndarray, "n k"]  # theirs over ours, positive
    phase_table: Float[np.ndarray, "s k"]
    turned: Float[np.ndarray, "a k k"]
    quantity_table: Float[np.ndarray, "q k"]
    named: dict[str, Combination]
    cost: Float[np.ndarray, "o n s a q"]
    # Equal numbers where combinations are the same linear map but for its scale.
    map: Int[np.ndarray, "o n s a q"]
    maps: int

    def convention(self, at: Combination, layout: str | None = None) -> Convention:
        """The combination as a `Convention`, written as the nearest named one has it."""
        base = conventions()[self.nearest(at)]
        matrix = placements()[at.placement]
        rows = np.empty_like(matrix)
        rows[["xyz".index(axis) for axis in base.basis_axes]] = matrix
        axes = tuple(("+" if row.sum() > 0 else "-") + "xyz"[np.argmax(abs(row))] for row in rows)
        facts = {
            "phase": self.phases[at.phase],
            "order": self.orders[at.order],
            "normalization": self.normalizations[at.normalization],
            "quantity": self.quantities[at.quantity],
            "axes": axes,
            "layout": layout or base.layout,
        }
        return replace(base, **facts, degree=None, about="")

    def nearest(self, at: Combination) -> str:
        """The named convention with the most facts in common, jaxsh's own before others."""
        return min(self.named, key=lambda name: _distance(at, self.named[name]))


def _distance(at: Combination, other: Combination) -> float:
    same = at.placement == other.placement
    facts = (at.order, at.normalization, at.phase, at.quantity)
    others = (other.order, other.normalization, other.phase, other.quantity)
    differ = sum(a != b for a, b in zip(facts, others, strict=True))
    return _COST_OF_FACT * differ + (0 if same else _placement_costs(other.placement)[at.placement])


@functools.cache
def _placement_costs(base: int) -> Float[np.ndarray, " a"]:
    """Price each placement in place of a named convention's."""
    theirs = placements()[base]
    up = theirs[:, 2]
    costs = []
    for placement in placements():
        if (placement == theirs).all():
            costs.append(0.0)
            continue
        turn = placement @ theirs.T
        cost = _COST_OF_HEADING if (turn @ up == up).all() else _COST_OF_AXES
        costs.append(cost + (_COST_OF_MIRROR - 1 if np.linalg.det(turn) < 0 else 0.0))
    return np.array(costs)


def handmade_orders(degree: int) -> dict[str, tuple[tuple[int, int], ...]]:
    """Orders that no named convention has, but hand-written code does, by what to call them."""
    pairs = list(zip(degrees(degree).tolist(), orders(degree).tolist(), strict=True))
    keys = {
        "m as 0, 1, …, l, −1, …, −l": lambda l, m: (l, m < 0, abs(m)),
        "m as 0, 1, −1, 2, −2, …": lambda l, m: (l, abs(m), m < 0),
        "m as 0, −1, 1, −2, 2, …": lambda l, m: (l, abs(m), m > 0),
        "by m first, then l": lambda l, m: (m, l),
    }
    return {name: tuple(sorted(pairs, key=lambda p, k=key: k(*p))) for name, key in keys.items()}


def irradiance_factors(degree: int) -> Float[np.ndarray, " bands"]:
    """Tabulate what each degree of radiance is multiplied by to give irradiance."""
    zonal = np.asarray(clamped_cosine(degree), np.float64)
    return zonal * np.sqrt(4 * np.pi / (2 * np.arange(degree + 1) + 1))


@functools.lru_cache(maxsize=32)
def space(degree: int, whole: int, *, basis: bool = False) -> Space:
    """Tabulate all combinations up to a degree, of coefficients that go up to degree `whole`.

    With `basis` for the functions of a basis in place of coefficients: constants the other way
    round, and no quantity, which is one of light.
    """
    count = (degree + 1) ** 2
    kept = [
        name
        for name in NORMALIZATIONS
        if (Convention(normalization=name).degree or whole) >= whole or whole == 0
    ]
    quantities = QUANTITIES[:1] if basis else QUANTITIES
    sequences = [*ORDERS, *handmade_orders(whole).values()][: None if whole else 1]
    for convention in conventions().values():
        fits = isinstance(convention.order, str) or len(convention.order) == (whole + 1) ** 2
        if fits and convention.order not in sequences:
            sequences.append(convention.order)
    scale = np.stack([scales(Convention(normalization=name), degree) for name in kept])
    signs = [scales(Convention(phase=name), degree) for name in PHASES]
    lambdas = irradiance_factors(degree)[degrees(degree)]
    table = {"radiance": np.ones(count), "irradiance": lambdas, "irradiance/pi": lambdas / np.pi}
    stands = [places(Convention(order=order), whole)[:count] for order in sequences]
    norm_table = scale if basis else 1 / scale
    quantity_table = np.stack([table[name] for name in quantities])
    named = {}
    for name, c in conventions().items():
        too_low = c.degree is not None and c.degree < whole
        if too_low or c.normalization not in kept or c.order not in sequences:
            continue
        place = np.flatnonzero((placements() == axes_matrix(c)).all((1, 2)))
        named[name] = Combination(
            sequences.index(c.order),
            kept.index(c.normalization),
            PHASES.index(c.phase),
            int(place[0]),
            0 if basis else quantities.index(c.quantity),
        )
    shape = (len(sequences), len(kept), len(PHASES), 48, len(quantities))
    which, maps = _equal_maps(np.stack(stands), norm_table, np.stack(signs), quantity_table, degree)
    return Space(
        degree,
        tuple(sequences),
        tuple(kept),
        PHASES,
        tuple(quantities),
        np.stack(stands),
        norm_table,
        np.stack(signs),
        turned(degree),
        quantity_table,
        named,
        _costs(named, shape),
        which.reshape(shape),
        maps,
    )


def _costs(named: dict[str, Combination], shape: tuple[int, ...]) -> Float[np.ndarray, "o n s a q"]:
    """The distance of every combination from the nearest named one."""
    cost = np.full(shape, np.inf)
    for other in named.values():
        each = np.zeros(shape)
        for axis, index in enumerate(other):
            apart = np.full(shape[axis], _COST_OF_FACT)
            apart[index] = 0.0
            if axis == 3:
                apart = _placement_costs(index)
            each = each + np.expand_dims(apart, [i for i in range(5) if i != axis])
        cost = np.minimum(cost, each)
    return cost


def _equal_maps(stands, norm_table, phase_table, quantity_table, degree: int):
    """Number the linear maps, alike but for a scale: by what they make of one random function."""
    rng = np.random.default_rng(0)
    count = (degree + 1) ** 2
    turned_one = turned(degree) @ rng.normal(size=count)
    weights = rng.normal(size=(2, stands.max() + 1))
    factors = np.einsum("nk,sk,qk->nsqk", norm_table, phase_table, quantity_table)
    made = np.einsum("nsqk,ak->nsaqk", factors, turned_one)
    made /= np.linalg.norm(made, axis=-1, keepdims=True)
    seen = np.einsum("wok,nsaqk->onsaqw", weights[:, stands], made, optimize=True)
    _, which = np.unique(np.round(seen.reshape(-1, 2), 8) + 0.0, axis=0, return_inverse=True)
    return which.ravel(), int(which.max()) + 1
