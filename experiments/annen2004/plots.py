"""Plots of error by distance, by samples, by cost and by frame."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.ticker import NullFormatter
from matplotlib.typing import LineStyleType

from ..shared.plots import curve, plain_numbers, plt, save

_DPI = 110
_SCENES: dict[str, LineStyleType] = {"with the blocker": "-", "without it": "--"}


def draw_distances(path: Path, rows: list[dict[str, Any]]) -> None:
    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 4.8), layout="constrained")
    methods = list(dict.fromkeys(row["method"] for row in rows))
    first, edges = "first order", "first order, edge gradient"
    paper = [
        (first, "with the blocker", "C1", "with the blocker (the paper's red curve)"),
        (first, "without it", "C1", "without it (the paper's green curve)"),
        (edges, "with the blocker", "C4", "with the blocker, edge gradient"),
    ]
    for method, scene, color, label in paper:
        curved = curve(rows, "distance", "error", method=method, scene=scene)
        left.plot(*curved, _SCENES[scene], color=color, label=label)
    left.set_title("as the paper's figure 8: first order")
    left.legend(frameon=False)
    left.set_ylim(bottom=0)
    for number, method in enumerate(methods):
        for scene, style in _SCENES.items():
            curved = curve(rows, "distance", "error", method=method, scene=scene)
            right.plot(*curved, style, color=f"C{number}", label=method if style == "-" else None)
    right.set_yscale("log")
    plain_numbers(right.yaxis)
    right.set_title("all orders")
    handles, labels = right.get_legend_handles_labels()
    handles += [Line2D([], [], color="grey", linestyle=style) for style in _SCENES.values()]
    right.legend(
        handles, [*labels, *_SCENES], frameon=False, loc="center left", bbox_to_anchor=(1, 0.5)
    )
    for axis in (left, right):
        axis.set_xlabel("distance from the sample, in the object's radius")
        axis.set_ylabel("RMS error of radiance (red), %")
        axis.grid(alpha=0.3)
    save(figure, path, dpi=_DPI)


def draw_claims(path: Path, rows: list[dict[str, Any]], methods: Sequence[str], box: float) -> None:
    """A map for each method: PSNR by distance (across) and samples (up)."""
    distances = sorted({row["distance"] for row in rows})
    figure, axes = plt.subplots(
        1, len(methods), figsize=(2.9 * len(methods) + 1, 3.9), layout="constrained"
    )
    image = None
    for axis, method in zip(axes, methods, strict=True):
        mine = [row for row in rows if row["method"] == method]
        counts = sorted({row["samples"] for row in mine})
        values = np.full((len(counts), len(distances)), np.nan)
        for row in mine:
            values[counts.index(row["samples"]), distances.index(row["distance"])] = row["psnr"]
        image = axis.imshow(values, origin="lower", aspect="auto", cmap="viridis", vmin=15, vmax=60)
        for (i, j), value in np.ndenumerate(values):
            color, around = ("black", "white") if value > 42 else ("white", "black")
            halo = [withStroke(linewidth=2, foreground=around, alpha=0.6)]
            place = {"ha": "center", "va": "center"}
            axis.text(j, i, f"{value:.0f}", color=color, path_effects=halo, **place)
        place = np.interp(2 * box, distances, np.arange(len(distances)), left=-1, right=-1)
        if place >= 0:
            axis.axvline(float(place), color="white", linestyle="--", linewidth=1, alpha=0.7)
        axis.set_xticks(range(len(distances)), [f"{d:g}" for d in distances])
        axis.set_yticks(range(len(counts)), [str(count) for count in counts])
        axis.set_title(method, fontsize=10)
        axis.set_xlabel("distance of the lights, in radii")
    axes[0].set_ylabel("samples")
    if image is not None:
        figure.colorbar(image, ax=list(axes), label="PSNR, dB", extend="both")
    save(figure, path, dpi=_DPI)


def draw_orders(path: Path, rows: list[dict[str, Any]], exact: float) -> None:
    """PSNR by time: a line for each order through its numbers of samples."""
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.8), sharey=True, layout="constrained")
    panels = ("exact", "the method: exact terms"), ("cubes", "with radiance cubes as captured")
    for axis, (key, title) in zip(axes, panels, strict=True):
        for order in sorted({row["order"] for row in rows}):
            line = [row for row in rows if row["order"] == order]
            times, levels = [row["total"] for row in line], [row[key] for row in line]
            color = f"C{order}"
            axis.plot(times, levels, "-", color=color, alpha=0.5)
            for row, x, y in zip(line, times, levels, strict=True):
                filled = color if row[f"front {key}"] else "white"
                axis.plot(x, y, "o", color=color, markerfacecolor=filled, markersize=7)
                axis.annotate(
                    str(row["samples"]), (x, y), (5, -11), textcoords="offset points", fontsize=9
                )
        front = sorted((row["total"], row[key]) for row in rows if row[f"front {key}"])
        axis.step(*zip(*front, strict=True), where="post", color="grey", linestyle=":")
        axis.axvline(exact, color="black", linestyle="--", linewidth=1)
        axis.set_xscale("log")
        plain_numbers(axis.xaxis)
        axis.set_title(title)
        axis.set_xlabel("capture, project and shade, ms")
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("PSNR, dB")
    orders = sorted({row["order"] for row in rows})
    handles = [Line2D([], [], color=f"C{order}", marker="o") for order in orders]
    handles.append(Line2D([], [], color="grey", linestyle=":"))
    handles.append(Line2D([], [], color="black", linestyle="--", linewidth=1))
    labels = [*(f"order {order}" for order in orders), "the front", "exact at each vertex"]
    axes[0].legend(handles, labels, frameon=False, loc="upper left")
    save(figure, path, dpi=_DPI)


def draw_placement(path: Path, rows: list[dict[str, Any]]) -> None:
    """PSNR by samples: a panel for each scene, a line for each placement."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    methods = list(dict.fromkeys(row["method"] for row in rows))
    figure, axes = plt.subplots(
        1, len(scenes), figsize=(5 * len(scenes) + 1, 4.4), squeeze=False, layout="constrained"
    )
    for axis, scene in zip(axes[0], scenes, strict=True):
        for number, method in enumerate(methods):
            curved = curve(rows, "samples", "psnr", scene=scene, method=method)
            style = "s--" if "grid" in method else "o-"
            axis.plot(*curved, style, color=f"C{number}", label=method, markersize=5)
        counts = sorted({row["samples"] for row in rows})
        axis.set_xscale("log")
        axis.set_xticks(counts, [str(count) for count in counts])
        axis.xaxis.set_minor_formatter(NullFormatter())
        axis.set_title(scene)
        axis.set_xlabel("samples")
        axis.grid(alpha=0.3)
    axes[0, 0].set_ylabel("PSNR, dB")
    axes[0, -1].legend(frameon=False, fontsize=9)
    save(figure, path, dpi=_DPI)


def draw_frames(path: Path, rows: list[dict[str, Any]], target: float) -> None:
    """Error and samples by frame."""
    figure, (above, below) = plt.subplots(
        2, 1, figsize=(9, 5.4), sharex=True, height_ratios=(2, 1), layout="constrained"
    )
    frames = [row["frame"] for row in rows]
    for key, label, color in (
        ("one", "one sample", "C7"),
        ("eight", "eight k-means samples", "C1"),
        ("predicted", "samples that come and go: as predicted", "C0"),
        ("error", "samples that come and go: at all vertices", "C3"),
    ):
        style = ":" if key == "predicted" else "-"
        above.plot(frames, [row[key] for row in rows], style, color=color, label=label)
    above.axhline(100 * target, color="grey", linestyle="--", label="target")
    above.set_yscale("log")
    plain_numbers(above.yaxis)
    above.set_ylabel("error of the irradiance, %")
    above.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False, fontsize=9, ncols=3)
    below.step(frames, [row["samples"] for row in rows], where="mid", color="C0")
    below.bar(frames, [row["added"] for row in rows], color="C2", label="added")
    below.bar(frames, [-row["removed"] for row in rows], color="C3", label="removed")
    below.set_ylabel("samples")
    below.set_xlabel("frame")
    below.legend(frameon=False, fontsize=9, ncols=2)
    for axis in (above, below):
        axis.grid(alpha=0.3)
    save(figure, path, dpi=_DPI)
