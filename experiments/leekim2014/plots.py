"""Plots of frames, gains and errors of the experiments on Lee & Kim 2014."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from ..shared.plots import logarithmic, plain_numbers, plt, save

_DPI = 110
_COLORS = {
    "masks": "C4",
    "levels": "C3",
    "two_stage": "C1",
    "probes": "C2",
    "tiles": "C0",
    "einsum": "0.65",
    "product form": "0.4",
    "full": "k",
}
Rows = Sequence[Mapping[str, Any]]


def draw_degrees(path: Path, rows: Rows, paper: Mapping[int, tuple[float, float, float]]) -> None:
    """Figure 11: frames per second, and gains against the fastest full computation."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 5.4), layout="constrained")
    frames = [row for row in rows if "fps full" in row]
    degrees = [row["degree"] for row in frames]
    for name in (key.removeprefix("fps ") for key in frames[0] if key.startswith("fps ")):
        style = "--" if name in ("einsum", "product form", "full") else "-"
        values = [row[f"fps {name}"] for row in frames]
        left.plot(degrees, values, style, marker=".", color=_COLORS[name], label=name)
    if paper:
        for number, (label, style) in enumerate((("full", "--"), ("adaptive", "-"))):
            values = [figures[number] for figures in paper.values()]
            label = f"the paper's {label}, its machine"
            left.plot(list(paper), values, style, color="C6", linewidth=1, label=label)
    left.set_yscale("log")
    left.set_ylabel("frames per second")
    plain_numbers(left.yaxis)
    methods = dict.fromkeys(row["method"] for row in rows if "method" in row)
    for name in methods:
        mine = [row for row in rows if row.get("method") == name]
        at = [row["degree"] for row in mine]
        values = [row["gain full"] for row in mine]
        right.plot(at, values, marker=".", color=_COLORS[name], label=name)
        values = [row["gain product form"] for row in mine]
        right.plot(at, values, ":", color=_COLORS[name])
    right.plot([], [], ":", color="k", label="dotted: against the product form")
    if paper:
        values = [adaptive / full for full, adaptive, _ in paper.values()]
        right.plot(list(paper), values, color="C6", linewidth=1, label="the paper's levels")
    right.axhline(1, color="0.6", linewidth=0.8)
    right.set_yscale("log")
    plain_numbers(right.yaxis)
    right.set_ylabel("gain against the full computation")
    for axis in (left, right):
        axis.set_xlabel("degree")
        axis.set_xticks(degrees)
        below = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.12), "ncols": 3}
        axis.legend(frameon=False, fontsize=8, **below)
    _finish(figure, path)


def draw_thresholds(path: Path, rows: Rows) -> None:
    """Error, shares and gain by threshold, a line of panels for each method."""
    methods = _methods(rows)
    shown = (
        ("psnr_object", "object PSNR, dB"),
        ("spent", "multiply-adds, of the product form's"),
        ("gain_product", "gain against the product form"),
    )
    variants = list(dict.fromkeys(row["variant"] for row in rows))
    figure, panels = plt.subplots(
        len(methods), 3, figsize=(13, 3.8 * len(methods)), layout="constrained", squeeze=False
    )
    for method, axes in zip(methods, panels, strict=True):
        mine = [row for row in rows if row["method"] == method]
        for axis, (key, label) in zip(axes, shown, strict=True):
            for variant in variants:
                some = [row for row in mine if row["variant"] == variant]
                at = [row["threshold"] for row in some]
                axis.plot(at, [row[key] for row in some], marker=".", label=variant)
            _by_threshold(axis, sorted({row["threshold"] for row in mine}))
            axis.set(title=method, ylabel=label)
        plain = [row for row in mine if row["variant"] == variants[0]]
        at, kept = [[row[key] for row in plain] for key in ("threshold", "kept")]
        axes[1].plot(at, kept, "k--", label="share of vertices kept")
        axes[0].set_ylim(top=min(axes[0].get_ylim()[1], 80))  # more is rounding
        axes[1].set_ylim(bottom=0)
        axes[2].axhline(1, color="0.6", linewidth=0.8)
        axes[2].set_ylim(bottom=0)
    handles, labels = panels[0, 1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=7, frameon=False, fontsize=9)
    _finish(figure, path)


def _by_threshold(axis: Axes, thresholds: Sequence[float]) -> None:
    axis.axvline(0.02, color="0.6", linewidth=0.8)
    logarithmic(axis, thresholds)
    axis.set_xlabel("threshold of specular change")


def draw_exponents(path: Path, rows: Rows) -> None:
    """Object PSNR and gain by the lobe's exponent."""
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
    exponents = sorted({row["exponent"] for row in rows})
    shown = (("psnr_object", "object PSNR, dB"), ("gain", "gain against full"))
    for axis, (key, label) in zip(axes, shown, strict=True):
        for method in _methods(rows):
            mine = [row for row in rows if row["method"] == method]
            values = [row[key] for row in mine]
            at = [row["exponent"] for row in mine]
            # Levels give what masks give: both are to be seen.
            wide = {"linewidth": 5, "alpha": 0.4} if method == "masks" else {}
            axis.plot(at, values, marker=".", color=_COLORS[method], label=method, **wide)
            if key == "psnr_object" and method in ("probes", "tiles"):
                rivals = [float(row["rival_psnr_object"]) for row in mine]
                finite = [value if np.isfinite(value) else np.nan for value in rivals]
                if np.isfinite(finite).any():
                    name = f"truncation at the cost of {method}"
                    axis.plot(at, finite, ":", color=_COLORS[method], label=name)
        logarithmic(axis, exponents)
        axis.set_xlabel("exponent of the lobe")
        axis.set_ylabel(label)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    axes[1].set_ylim(bottom=0)
    axes[1].axhline(1, color="0.6", linewidth=0.8)
    _finish(figure, path)


def _methods(rows: Rows) -> list[str]:
    return list(dict.fromkeys(row["method"] for row in rows))


def _finish(figure, path: Path) -> None:
    for axis in figure.axes:
        axis.spines[["top", "right"]].set_visible(False)
        axis.grid(alpha=0.25)
    save(figure, path, dpi=_DPI)
