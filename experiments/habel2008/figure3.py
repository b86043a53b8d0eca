"""The paper's figure 3: the worst errors of the sky's coefficients, by bands.

The paper fits polynomials in θ and τ, names a tabulation and a Fourier basis as what it was better
than, and tells its errors by two sentences and a figure without numbers. All of these on the same
suns, beside the authors' published tables and this package's fit.
"""

import dataclasses
import functools
import itertools
import math
from collections.abc import Iterator
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from jaxtyping import Float
from scipy.interpolate import make_interp_spline

from jaxsh import harmonics, sky

from ..runner import Column, Context, Data, Table, experiment
from .plots import draw
from .suns import (
    CLAIM,
    PLAIN,
    TURBIDITY,
    ZENITH,
    Columns,
    Suns,
    polynomials,
    project,
    published,
    scaled,
)

Reading = Literal["luminance", "channel", "harmonics", "range"]
_READINGS: tuple[Reading, ...] = get_args(Reading)
_STORED_BANDS = 7  # of the paper's tables and of those that the package comes with


@dataclasses.dataclass(frozen=True)
class Figure3:
    bands: int = 10
    """errors for one band up to so many; stored tables end at 7"""
    heights: int = 61
    """zenith angles of the sun at which errors are measured"""
    turbidities: int = 23
    """turbidities at which errors are measured"""
    degrees: tuple[tuple[int, int], ...] = ((9, 5), (13, 7), (16, 12))
    """degrees in θ and τ of plain polynomials"""
    fits: tuple[tuple[int, int], ...] = ()
    """terms in θ² and log τ of fits of our own, to all the bands"""

    def __post_init__(self):
        if not _STORED_BANDS <= self.bands <= 20:
            raise ValueError(f"bands must be {_STORED_BANDS} to 20, got {self.bands}")
        if min(self.heights, self.turbidities) < 2:
            raise ValueError("heights and turbidities must be at least 2")
        if min((min(pair) for pair in self.degrees), default=0) < 1:
            raise ValueError("degrees must be one or more pairs of numbers >= 1")


class Model(NamedTuple):
    """A way to the coefficients: how many numbers per weight it stores, and what it gives."""

    name: str
    family: str
    numbers: int
    coefficients: Float[np.ndarray, "h t 3 k"]
    claimed: bool = False  # whether to hold it against the paper's claim


@experiment("habel2008.figure3", x64=True)
def figure3(config: Figure3, context: Context) -> list[Table]:
    suns = Suns.even(config.heights, config.turbidities)
    grids = suns, _nodes(config), Suns.even(*PLAIN)
    with context.time("exact projection"):
        exact, samples, corners = project(grids, config.bands)
    lows = {reading: smallest(suns, reading) for reading in _READINGS}
    rivals = *_fitted(config, samples, suns), *_interpolated(corners, suns)
    models = itertools.chain(_published(context.data, suns), rivals, _ours(config, context, suns))
    for model in context.progress(models, "models"):
        for row in _errors(model, exact, lows):
            context.record(row)
    caption = "worst errors over suns and turbidities, by bands; black: the paper's claim"
    draw(context.path("figure3.png", caption), context.rows, CLAIM)
    return list(_tables(config, context.rows))


def smallest(suns: Suns, reading: Reading) -> Float[np.ndarray, "h t 3"]:
    """L_min, infinite for channels that turn negative somewhere: they cannot be divided by it."""
    low = np.asarray(sky.smallest_luminance(suns.directions, suns.turbidity[None], reading=reading))
    return np.where((low > 0).all(axis=(0, 1)), low, np.inf)


def _nodes(config: Figure3) -> Suns:
    """Samples for all fits: twice as many as the largest has polynomials."""
    most = [max(PLAIN[i], *(pair[i] + 1 for pair in config.degrees)) for i in range(2)]
    return Suns.nodes(*(2 * count for count in most))


def _published(data: Data, suns: Suns) -> Iterator[Model]:
    table = published(data)
    if table is None:
        return
    theta, turbidity = np.meshgrid(suns.theta, suns.turbidity, indexing="ij")
    values = sky.habel2008_evaluate(table, theta.ravel(), turbidity.ravel())
    values = values.reshape(*theta.shape, 3, -1)
    yield Model("the authors' tables", "published", 112, values, True)
    # With the sun at azimuth 0 nearly half of the weights are zero by symmetry; theirs are not.
    symmetric = np.where(harmonics.orders(_STORED_BANDS - 1) < 0, 0, values)
    yield Model("the authors' tables, m < 0 made zero", "published", 112, symmetric)


def _fitted(config: Figure3, samples: Float[np.ndarray, "n m 3 k"], suns: Suns) -> Iterator[Model]:
    """Least squares in products of two bases."""
    nodes = _nodes(config)
    for degrees in config.degrees:
        terms = degrees[0] + 1, degrees[1] + 1
        values = fitted(samples, nodes, suns, polynomials, terms)
        name = f"polynomials of degree {degrees[0]}, {degrees[1]}"
        yield Model(name, "plain", terms[0] * terms[1], values, terms == PLAIN)
    for name, basis in _RIVALS.items():
        yield Model(f"{name}, 14 × 8", "rival", 112, fitted(samples, nodes, suns, basis, PLAIN))


def _interpolated(corners: Float[np.ndarray, "14 8 3 k"], suns: Suns) -> Iterator[Model]:
    """The exact coefficients in a table of even steps."""
    table = Suns.even(*PLAIN)
    for name, degree in (("bilinear", 1), ("bicubic", 3)):
        along = (
            make_interp_spline(here, np.eye(len(here)), degree)(there)
            for here, there in zip(table, suns, strict=True)
        )
        yield Model(f"table 14 × 8, {name}", "rival", 112, _separable(corners, *along))


def _ours(config: Figure3, context: Context, suns: Suns) -> Iterator[Model]:
    tables: dict[Literal["precise", "small"], Any] = {"precise": np.float64, "small": np.float32}
    for name, dtype in tables.items():
        fit = sky.preetham_table(name)
        yield _our(f'ours, table "{name}", {np.dtype(dtype).name}', fit, suns, dtype)
    for terms in config.fits:
        with context.time(f"fit {terms[0]} × {terms[1]}"):
            fit = sky.preetham_fit(terms, degree=config.bands - 1, solver="qr")
        yield _our(f"ours, fitted here, {terms[0]} × {terms[1]}", fit, suns)


def _our(name: str, fit: sky.SkyFit, suns: Suns, dtype: Any = np.float64) -> Model:
    values = fit(suns.directions.astype(dtype), suns.turbidity[None].astype(dtype))
    numbers = math.prod(fit.coefficients.shape[2:])
    return Model(name, "ours", numbers, np.asarray(values, np.float64), True)


def fitted(
    samples: Float[np.ndarray, "n m 3 k"],
    nodes: Suns,
    suns: Suns,
    basis: Columns,
    terms: tuple[int, int],
) -> Float[np.ndarray, "h t 3 k"]:
    """Least squares on a grid in products of two bases, evaluated on another grid."""
    along = [
        basis(axis, there, count) @ np.linalg.pinv(basis(axis, here, count))
        for axis, here, there, count in zip((ZENITH, TURBIDITY), nodes, suns, terms, strict=True)
    ]
    return _separable(samples, *along)


def _separable(samples, along_theta, along_turbidity):
    return np.einsum("hn,tm,nmck->htck", along_theta, along_turbidity, samples, optimize=True)


def fourier(axis: sky.Axis, values, count: int, period: int = 1) -> Float[np.ndarray, "n c"]:
    """1, cos πx, sin πx, cos 2πx, … for x in [-1, 1]: the range is the period, or a part of it."""
    x, n = scaled(axis, values)[:, None] * np.pi / period, np.arange(count)
    k = (n + 1) // 2
    return np.where((n % 2 == 1) | (n == 0), np.cos(k * x), np.sin(k * x))


def cosines(axis: sky.Axis, values, count: int) -> Float[np.ndarray, "n c"]:
    """The discrete cosine basis of Dobashi et al. 1995: the range mirrored, so without a jump."""
    return np.cos(np.pi * np.arange(count) * (scaled(axis, values)[:, None] + 1) / 2)


_RIVALS: dict[str, Columns] = {
    "Fourier": fourier,
    "Fourier, twice the period": functools.partial(fourier, period=2),
    "cosines": cosines,
}


def _errors(model: Model, exact, lows: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """A row for each number of bands: per cent, the worst of the range, for all readings."""
    most = min(harmonics.degree_of(a.shape[-1]) + 1 for a in (model.coefficients, exact))
    difference = model.coefficients[..., : most**2] - exact[..., : most**2]
    # `sky.fit_error` of all numbers of bands at once.
    squares, sums = (np.cumsum(a, axis=-1) for a in (difference**2, np.abs(difference)))
    for bands in range(1, most + 1):
        row: dict[str, Any] = {
            "model": model.name,
            "family": model.family,
            "numbers": model.numbers,
            "bands": bands,
        }
        for key, norm in (("mean", np.sqrt(squares)), ("max", sums)):
            for reading, low in lows.items():
                name = key if reading == _READINGS[0] else f"{key} {reading}"
                row[name] = 100 * float(np.max(norm[..., bands**2 - 1] / low))
        if model.claimed and bands in CLAIM:
            row["mean_paper"] = CLAIM[bands]
        yield row


def _tables(config: Figure3, rows: list[dict[str, Any]]) -> Iterator[Table]:
    models = [Column("model", "model"), Column("numbers", "numbers per weight")]
    known = _by_model(rows)
    compared = [
        column
        for bands in (5, _STORED_BANDS)
        for column in (
            Column(f"mean {bands}", f"E_mean, {bands} bands, %", f"mean_paper {bands}"),
            Column(f"max {bands}", f"E_max, {bands} bands, %"),
        )
    ]
    without = "" if any(row["family"] == "published" for row in rows) else _NO_TABLES
    yield Table(
        "Worst errors at 5 and 7 bands", [*models, *compared], known, values={"without": without}
    )
    for key, name in (("mean", "E_mean"), ("max", "E_max")):
        by_bands = [Column(f"{key} {n}", f"{n}") for n in range(1, config.bands + 1)]
        title, note = f"{name} by bands, %", "Stored tables end at 7 bands."
        yield Table(title, [models[0], *by_bands], known, note)
    yield _by_reading(rows, models)


_NO_TABLES = "The authors' tables are left out: the data has no reference/habel2008_tables.npz."


def _by_reading(rows: list[dict[str, Any]], models: list[Column]) -> Table:
    lines = [row for n in (5, _STORED_BANDS) for row in rows if row["bands"] == n]
    headings = {
        "mean": "of the sky at that setting",
        "mean channel": "of each channel",
        "mean harmonics": "of the projected sky",
        "mean range": "of all settings",
    }
    columns = [Column(key, heading) for key, heading in headings.items()]
    title = "E_mean under each reading of L_min, %"
    return Table(title, [*models[:1], Column("bands", "bands"), *columns], lines)


def _by_model(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """One line for each model, with the keys "mean …" and "max …" for each number of bands."""
    lines: dict[str, dict[str, Any]] = {}
    for row in rows:
        line = lines.setdefault(row["model"], {"model": row["model"], "numbers": row["numbers"]})
        for key in ("mean", "max", "mean_paper"):
            if key in row:
                line[f"{key} {row['bands']}"] = row[key]
    return list(lines.values())
