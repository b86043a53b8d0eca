"""Sums over the basis, and their derivatives, beside sphericart's basis and an einsum."""

import functools
import itertools
from collections.abc import Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from experiments.runner import Column
from experiments.shared.timing import interleaved, ratio
from jaxsh import harmonics

from . import page
from ._sections import Cores, Rows, Section

SIZES = ((1, 100_000), (2, 100_000), (3, 100_000), (3, 1_000_000), (4, 100_000), (6, 100_000))
CHANNELS = 3
EACH, SHARED = "each its own", "shared by all"
QUANTITIES = {"values": "#0072B2", "reverse": "#009E73"}


def timings(cores: Cores, rounds: int, dtype: str) -> Iterator[dict[str, Any]]:
    """Two rows for each size and kind of coefficients: values, and both gradients by reverse."""
    for (degree, count), kind in itertools.product(SIZES, (EACH, SHARED)):
        yield from _timings(degree, count, kind, np.dtype(dtype), rounds)


def _timings(degree: int, count: int, kind: str, dtype, rounds: int) -> Iterator[dict[str, Any]]:
    from . import _peers

    generator = np.random.default_rng(0)
    leading = (count, CHANNELS) if kind == EACH else (CHANNELS,)
    c, vectors, cotangent = (
        jnp.asarray(generator.normal(size=shape), dtype)
        for shape in ((*leading, (degree + 1) ** 2), (count, 3), (count, CHANNELS))
    )
    letters = "nck,nk->nc" if kind == EACH else "ck,nk->nc"

    def einsum(c, vectors):
        return jnp.einsum(letters, c, _peers.sphericart_values(vectors, degree))

    def multiplied(c, vectors):
        basis = _peers.sphericart_values(vectors, degree)
        return jnp.dot(basis, c.T) if kind == SHARED else (c * basis[:, None]).sum(axis=-1)

    functions = {"ours": harmonics.synthesize, "einsum": einsum, "multiplied": multiplied}
    floors = {
        "values": lambda c, v: _read(c) + _read(v),
        "reverse": lambda c, v: (0.5 * c, 0.5 * v),
    }
    for quantity in QUANTITIES:
        calls = {
            name: jax.jit(_pullback(f, cotangent) if quantity == "reverse" else f)
            for name, f in functions.items()
        }
        calls["floor"] = jax.jit(floors[quantity])
        times = interleaved(
            {name: functools.partial(call, c, vectors) for name, call in calls.items()},
            rounds=rounds,
        )
        peer = min(times["einsum"], times["multiplied"], key=lambda timing: timing.median_ms)
        yield {
            "coefficients": kind,
            "quantity": quantity,
            "degree": degree,
            "count": count,
            "dtype": np.dtype(dtype).name,
            "ours_ms": times["ours"].median_ms,
            "over_floor": ratio(times["ours"], times["floor"]),
            "sphericart": ratio(peer, times["ours"]),
            "compile_s": times["ours"].first_seconds,
        }


def _pullback(function, cotangent):
    return lambda c, vectors: jax.vjp(function, c, vectors)[1](cotangent)


def _read(array):
    """Each number once, with next to no arithmetic."""
    return array.sum()


def draw(figure: Figure, rows: Rows) -> None:
    """Plot sphericart's time over ours by degree."""
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, kind in zip(panels, (EACH, SHARED), strict=True):
        axes.axhspan(1, 32, color="#0072B2", alpha=0.06, lw=0)
        axes.axhline(1, color="0.4", lw=1)
        for (quantity, color), cores in itertools.product(QUANTITIES.items(), ("one", "all")):
            style = "-" if cores == "one" else "--"
            some = page.matching(rows, coefficients=kind, quantity=quantity, cores=cores)
            small = [(row["degree"], row["sphericart"]) for row in some if row["count"] < 10**6]
            large = [(row["degree"], row["sphericart"]) for row in some if row["count"] >= 10**6]
            label = f"{quantity}, {cores} core{'s' if cores == 'all' else ''}"
            if small:
                axes.plot(*zip(*small, strict=True), style, color=color, marker="o", label=label)
            if large:
                fill = {"markerfacecolor": color if cores == "one" else "white"}
                axes.plot(*zip(*large, strict=True), "*", color=color, markersize=13, **fill)
        axes.set(title=f"coefficients {kind}", xlabel="degree", yscale="log", ylim=(0.5, 16))
        axes.set_xticks(sorted({row["degree"] for row in rows}))
        axes.set_yticks([0.5, 1, 2, 4, 8, 16], ["½", "1", "2×", "4×", "8×", "16×"])
        axes.minorticks_off()
        axes.grid(alpha=0.3)
        axes.text(0.02, 0.97, "jaxsh is faster", transform=axes.transAxes, va="top")
        axes.text(0.98, 0.03, "sphericart is faster", transform=axes.transAxes, ha="right")
    panels[0].set_ylabel("time of sphericart and a sum over ours")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)


SECTION = Section(
    name="synthesis",
    title="Sums over the basis",
    intro="`harmonics.synthesize` in three channels: colors of points that have coefficients of "
    "their own (splats), and one light at many normals. Beside it sphericart's basis and a sum "
    "over it, an einsum or a product and its sum, whichever is faster. Reverse is the gradient "
    "with respect to coefficients and vectors both. Stars are a million vectors, dots 100,000.",
    columns=[
        Column("coefficients", "coefficients"),
        Column("quantity", "quantity"),
        Column("degree", "degree"),
        Column("count", "N"),
        Column("ours_ms", "ours, ms", digits=2),
        Column("over_floor", "ours / floor", digits=1),
        Column("sphericart", "sphericart / ours", digits=2),
        Column("compile_s", "first call, s", digits=2),
    ],
    timings=timings,
    draw=draw,
    note="The floor reads coefficients and vectors once; reverse writes as much again.",
    peers=("sphericart-jax",),
)
