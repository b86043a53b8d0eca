"""Tables of what `leekim2014.table1` measured."""

import statistics
from collections.abc import Iterator, Sequence
from typing import Any

from ..runner import Column, Table
from .columns import IN_FULL, per_method
from .methods import STILL, Method
from .scenes import Row

# What figures 1 and 9 print, of scenes that the paper does not name.
_FIGURE_1_PSNR, _FIGURE_9_PSNR, _FIGURE_9_GAIN = 41.73, 43.87, 3.0
_PAPER_LEAST = 2.2  # of the gains in table 1
GAIN = {"full": "gain", "product form": "gain_product", "einsum": "gain_einsum"}


def tables(
    rows: list[dict[str, Any]], methods: Sequence[Method], views: int, step: float
) -> Iterator[Table]:
    scenes = [row for row in rows if "vertices" in row]
    lines = [row for row in rows if "method" in row]
    names = [Column(name, name) for name in Row._fields]
    yield Table(
        "Frames per second",
        [
            *names,
            Column("vertices", "vertices", "vertices_paper"),
            Column("coefficients", "coefficients"),
            *IN_FULL,
            Column(f"fps {STILL}", STILL, digits=1),
            *per_method("fps", methods, "adaptive_paper"),
        ],
        scenes,
        values={"apart": max(row["largest_difference"] for row in scenes)},
    )
    yield Table(
        "Gains and errors",
        rows=lines,
    )
    yield Table(
        "The diffuse part in eight bits",
        rows=scenes,
    )
    summed = gains(lines)
    yield Table(
        "Where the paper's gain holds",
        rows=summed,
        note=verdict(summed),
    )
    if "masks" in methods:
        yield Table("Filtering ratios", rows=scenes)
    yield _summary(lines)
    yield Table(
        "Light and eye both move",
        rows=[row for row in rows if "moving_gain" in row],
        values={"step": step, "views": views},
    )
    yield _goals(scenes, lines, [row for row in rows if "moving_gain" in row])


def _summary(lines: list[dict[str, Any]]) -> Table:
    """Over the rows, beside what figures 1 and 9 print."""
    rows: list[dict[str, Any]] = [
        {"what": "the paper's figure 1", "psnr_image": _FIGURE_1_PSNR},
        {
            "what": "the paper's figure 9",
            "psnr_image": _FIGURE_9_PSNR,
            "gain": _FIGURE_9_GAIN,
        },
    ]
    for method, mine in _by_method(lines).items():
        row: dict[str, Any] = {"what": f"ours, {method}"}
        for key in ("psnr_image", "psnr_object", "gain", "gain_product", "gain_einsum"):
            values = [line[key] for line in mine]
            row |= {key: statistics.median(values), f"{key} least": min(values)}
        rows.append(row)

    return Table("Beside figures 1 and 9", rows=rows)


def _by_method(lines: list[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    methods = dict.fromkeys(line["method"] for line in lines)
    return {method: [line for line in lines if line["method"] == method] for method in methods}


def gains(lines: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Each method's gain over the scenes, against each form of the full computation."""
    rows = []
    for method, mine in _by_method(lines).items():
        for name, key in GAIN.items():
            values = [line[key] for line in mine]
            row = {"method": method, "against": name, "scenes": len(values)}
            row |= {"least": min(values), "median": statistics.median(values), "most": max(values)}
            row["faster"] = sum(value > 1 for value in values)
            row["holds"] = sum(value >= _PAPER_LEAST for value in values)
            rows.append(row)
    return rows


def verdict(rows: list[dict[str, Any]]) -> str:
    """Where the paper's method keeps its gain, in words, from `gains`."""
    said = []
    for row in rows:
        if row["method"] == "levels":
            said.append(
                f"{row['least']:.2f} to {row['most']:.2f} × against {row['against']} "
                f"({row['holds']} of {row['scenes']} scenes at {_PAPER_LEAST} × and more)"
            )
    if not said:
        return ""
    return (
        f"The paper's method, compacted (levels), gains {', '.join(said)}; the paper says 2.20 to "
        "3.38 × against its own full computation."
    )


def _goals(
    scenes: list[dict[str, Any]], lines: list[dict[str, Any]], moves: list[dict[str, Any]]
) -> Table:
    by = _by_method(lines)
    count = len(scenes)

    def meeting(method: str, **least: float) -> int:
        return sum(all(line[key] >= value for key, value in least.items()) for line in by[method])

    def least(rows: list[dict[str, Any]], key: str) -> str:
        return f"{min(row[key] for row in rows):.2f} at least"

    rows = [
        ("full / einsum", "≥ 4 ×", least(scenes, "full_to_einsum")),
        ("full, of the matmul rate", "≥ 70 %", least(scenes, "share_full")),
        ("product form, of the matmul rate", "", least(scenes, "share_product")),
        ("light alone turns: eye product's gain", "", least(scenes, "still_gain")),
        ("light and eye move: tiles' gain, sets made before", "≥ 3 ×", least(moves, "moving_gain")),
        ("and made on the way, means", "", least(moves, "moving_following_gain_mean")),
    ]
    if "tiles" in by:
        met = meeting("tiles", gain=4, psnr_object=47)
        rows.append(("tiles: gain ≥ 4, object ≥ 47 dB", "all scenes", f"{met} of {count}"))
        more = f"{min(line['gain_eight_bits'] for line in by['tiles']):.2f} at least"
        rows.append(("tiles: gain, the full's diffuse part in eight bits too", "", more))
        rows.append(("tiles: object ≥ 47 dB", "", f"{meeting('tiles', psnr_object=47)} of {count}"))
        rows.append(
            ("the same, worst turn of the light, dB", "", least(by["tiles"], "psnr_turned"))
        )
        rows.append(("tiles: gain against product form ≥ 4", "", _of("tiles", 4, by, count)))
    if "probes" in by:
        met = meeting("probes", gain=2.2, psnr_object=39)
        rows.append(("probes: gain ≥ 2.2, object ≥ 39 dB", "five scenes", f"{met} of {count}"))
        rows.append(("probes: gain against product form ≥ 2.2", "", _of("probes", 2.2, by, count)))
    if "two_stage" in by:
        rows.append(("two_stage: image PSNR, dB", "≥ 41", least(by["two_stage"], "psnr_image")))
        gain = statistics.median(line["gain"] for line in by["two_stage"])
        rows.append(("two_stage: median gain", "≥ 1.1", f"{gain:.2f}"))

    return Table("Goals", rows=[dict(zip(("goal", "wanted", "got"), r, strict=True)) for r in rows])


def _of(method: str, gain: float, by: dict[str, list[dict[str, Any]]], count: int) -> str:
    return f"{sum(line['gain_product'] >= gain for line in by[method])} of {count}"
