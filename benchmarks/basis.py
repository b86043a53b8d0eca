"""Values, gradients and reverse mode of the basis beside sphericart, e3nn and SciPy."""

import functools
import itertools
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from experiments.runner import Column
from experiments.shared.timing import Timing, interleaved, ratio, timed
from jaxsh import harmonics

from . import page
from ._sections import Cores, Rows, Section

# SciPy is measured where one call of it ends in a second or so, e3nn where it compiles in seconds.
_SCIPY_COUNT, _E3NN_COUNT = 10_000, 10_000
# Seconds that a function is called for before the next one takes its turn.
_TURN = 8e-3
# Up to here a call of no work is timed beside.
_SMALL = 100

DEGREES, COUNTS = (1, 2, 3, 4, 6, 10, 13), (1, 100, 10_000, 100_000)
# Derivatives are timed at these alone.
DERIVED = {(degree, count) for degree in (3, 6, 10, 13) for count in (10_000, 100_000)}
QUANTITIES = {"values": "#0072B2", "with gradient": "#D55E00", "reverse": "#009E73"}
CORES = {"one": "one core", "all": "all cores"}


def timings(cores: Cores, rounds: int, dtype: str) -> Iterator[dict[str, Any]]:
    """Rows of each degree and number of directions."""
    for degree, count in itertools.product(DEGREES, COUNTS):
        yield from _timings(degree, count, np.dtype(dtype), rounds)


def _timings(degree: int, count: int, dtype, rounds: int) -> Iterator[dict[str, Any]]:
    """One row per quantity. Ours is `axis=0`, values also -1; peers have their own layout."""
    from . import _peers

    generator = np.random.default_rng(0)
    vectors = generator.normal(size=(count, 3))
    vectors = jnp.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True), dtype)
    cotangent = jnp.asarray(generator.normal(size=((degree + 1) ** 2, count)), dtype)
    ours = functools.partial(harmonics.evaluate, axis=0)

    values = {
        "ours": lambda v: ours(v, degree),
        "last": lambda v: harmonics.evaluate(v, degree),
        "sphericart": lambda v: _peers.sphericart_values(v, degree),
        "solid": lambda v: _peers.sphericart_solid(v, degree),
        "floor": _writer((degree + 1) ** 2),
    }
    if count <= _SMALL:
        values["empty"] = lambda v: v + 1
    if count == _E3NN_COUNT and dtype == np.float32:
        values["e3nn"] = lambda v: _peers.e3nn_values(v, degree)
    scipy = {}
    if count == _SCIPY_COUNT and dtype == np.float64:
        host = np.asarray(vectors)
        scipy["scipy"] = lambda: _peers.scipy_values(host, degree)
    gradients = {
        "ours": lambda v: harmonics.evaluate_with_gradient(v, degree, axis=0),
        "sphericart": lambda v: _peers.sphericart_gradient(v, degree),
        "floor": _writer(4 * (degree + 1) ** 2),
    }
    reverse = {
        "ours": _peers.pullback(ours, degree, cotangent),
        "sphericart": _peers.pullback(_peers.sphericart_values, degree, cotangent.T),
        "floor": _writer((degree + 1) ** 2),
    }
    quantities = [("values", values)]
    if (degree, count) in DERIVED:
        quantities += [("with gradient", gradients), ("reverse", reverse)]
    for quantity, functions in quantities:
        calls = {
            name: functools.partial(jax.jit(function), vectors)
            for name, function in functions.items()
        }
        times = _at_length(calls | (scipy if quantity == "values" else {}), rounds=rounds)
        row = {
            "quantity": quantity,
            "dtype": np.dtype(dtype).name,
            "degree": degree,
            "count": count,
            "ours_ms": times["ours"].median_ms,
            "compile_s": times["ours"].first_seconds,
            "over_floor": ratio(times["ours"], times["floor"]),
        }
        peers = ("sphericart", "solid", "e3nn", "scipy")
        if "last" in times:
            row["last"] = ratio(times["sphericart"], times["last"])
        if "empty" in times:
            row["over_empty"] = max(ratio(times[one], times["empty"]) for one in ("ours", "last"))
        yield row | {
            peer: ratio(times[peer], times["ours"]) if peer in times else None for peer in peers
        }


def _at_length(calls: Mapping[str, Callable[[], Any]], *, rounds: int) -> dict[str, Timing]:
    """Time the calls in turn, each again and again for several milliseconds.

    For milliseconds after a call of sphericart its threads wait for the next one in a loop that
    keeps their cores busy, and what is timed right then has one core of two. A round takes the
    fastest of three lengths in a row, so the first of them may pay for that.
    """
    first = {name: timed(call)[1] for name, call in calls.items()}
    repeats = {name: max(1, int(_TURN / timed(call)[1])) for name, call in calls.items()}

    def several(name: str) -> None:
        for _ in range(repeats[name]):
            jax.block_until_ready(calls[name]())

    turns = interleaved({name: functools.partial(several, name) for name in calls}, rounds=rounds)
    return {
        name: Timing(first[name], [seconds / repeats[name] for seconds in turn.seconds])
        for name, turn in turns.items()
    }


def _writer(rows: int):
    """The floor: write an output of this size once, with next to no arithmetic."""
    scale = np.linspace(0.5, 1.0, rows)[:, None]
    return lambda v: jnp.asarray(scale, v.dtype) * v[:, 0][None]


def draw(figure: Figure, rows: Rows) -> None:
    """Plot sphericart's time over ours by degree, for 10,000 directions."""
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, dtype in zip(panels, ("float32", "float64"), strict=True):
        axes.axhspan(1, 8, color="#0072B2", alpha=0.06, lw=0)
        axes.axhline(1, color="0.4", lw=1)
        lines = {name: ("sphericart", name, color) for name, color in QUANTITIES.items()}
        lines["values, points first"] = "last", "values", "#56B4E9"
        for label, (key, quantity, color) in lines.items():
            for cores, style in (("one", "-"), ("all", "--")):
                wanted = {"dtype": dtype, "quantity": quantity, "cores": cores, "count": 10_000}
                some = page.matching(rows, **wanted)
                if some:
                    points = [(row["degree"], row.get(key, np.nan)) for row in some]
                    said = f"{label}, {CORES[cores]}" if dtype == "float32" else None
                    line = {"color": color, "marker": "o", "label": said}
                    axes.plot(*zip(*points, strict=True), style, **line)
        axes.set(title=f"{dtype}, 10,000 directions", xlabel="degree", yscale="log", ylim=(0.12, 6))
        axes.set_xticks(sorted({row["degree"] for row in rows}))
        axes.set_yticks([0.125, 0.25, 0.5, 1, 2, 4], ["⅛", "¼", "½", "1", "2×", "4×"])
        axes.minorticks_off()
        axes.grid(alpha=0.3)
        axes.text(0.02, 0.97, "jaxsh is faster", transform=axes.transAxes, va="top")
        axes.text(0.98, 0.03, "sphericart is faster", transform=axes.transAxes, ha="right")
    panels[0].set_ylabel("time of sphericart over jaxsh's")
    figure.legend(loc="outside lower center", ncols=3, frameon=False)


def glance(rows: Rows) -> str:
    """Sphericart's time over ours, a column for each degree."""
    return "\n".join(
        f"**{dtype}**\n\n{_by_degree(page.matching(rows, dtype=dtype))}"
        for dtype in ("float32", "float64")
    )


def _by_degree(rows: Rows) -> str:
    """A row for each quantity, number of directions and cores, a column for each degree."""
    degrees = sorted({row["degree"] for row in rows})
    counts = sorted({row["count"] for row in rows})
    lines = []
    ratios = {name: (name, "sphericart") for name in QUANTITIES}
    ratios["values, points first"] = "values", "last"
    for (label, (quantity, key)), count, cores in itertools.product(ratios.items(), counts, CORES):
        some = page.matching(rows, quantity=quantity, count=count, cores=cores)
        found = {row["degree"]: row[key] for row in some if row.get(key)}
        if found and count > _SMALL:
            shown = [page.number(found.get(degree), 2) for degree in degrees]
            lines.append([label, f"{count:,}", cores, *shown])
    return page.table(
        ["quantity", "directions", "cores", f"degree {degrees[0]}", *degrees[1:]], lines
    )


SECTION = Section(
    name="basis",
    title="The basis",
    intro="Time of sphericart, whose kernels are in C++, over ours, on the same directions: values "
    "alone, values with their gradients, and a gradient by reverse mode. Ours with `axis=0`, "
    "and where it says points first with `axis=-1`, sphericart's layout.",
    columns=[
        Column("quantity", "quantity"),
        Column("dtype", "dtype"),
        Column("degree", "degree"),
        Column("count", "N"),
        Column("ours_ms", "ours, ms", digits=3),
        Column("over_floor", "ours / write floor", digits=1),
        Column("over_empty", "the slower layout / an empty call", digits=2),
        Column("sphericart", "sphericart / ours", digits=2),
        Column("last", "the same, points first", digits=2),
        Column("solid", "its solid harmonics / ours", digits=2),
        Column("e3nn", "e3nn / ours", digits=1),
        Column("scipy", "SciPy / ours", digits=0),
        Column("compile_s", "first call, s", digits=2),
    ],
    timings=timings,
    draw=draw,
    glance=glance,
    dtypes=("float32", "float64"),
    peers=("sphericart-jax", "e3nn-jax", "scipy"),
)
