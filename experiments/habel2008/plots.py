"""The picture of the experiment `habel2008.figure3`."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ..shared.plots import plt, save

_MAPS = {"published": "Greys", "rival": "Oranges", "plain": "Blues", "ours": "Greens"}
_MARKERS = "osv^D*"


def draw(path: Path, rows: list[dict[str, Any]], claim: dict[int, float]) -> None:
    """E_mean and E_max by bands, a line for each model and a color for each family."""
    figure, axes = plt.subplots(1, 2, figsize=(12, 5.6), sharey=True, layout="constrained")
    styles = _styles(rows)
    for axis, key, name in zip(axes, ("mean", "max"), ("E_mean", "E_max"), strict=True):
        for model, style in styles.items():
            line = [(row["bands"], row[key]) for row in rows if row["model"] == model]
            axis.plot(*zip(*line, strict=True), label=model, markersize=4, **style)
        axis.set_title(f"{name[0]}$_{{\\mathrm{{{name[2:]}}}}}$")
        axis.set_xlabel("bands")
        axis.set_xticks(range(1, max(row["bands"] for row in rows) + 1))
        axis.set_yscale("log")
        axis.yaxis.set_major_locator(LogLocator(numticks=20))
        axis.yaxis.set_major_formatter(
            FuncFormatter(lambda y, _: f"{y:.10f}".rstrip("0").rstrip("."))
        )
        axis.yaxis.set_minor_formatter(NullFormatter())
        axis.grid(alpha=0.3)
    low = [bands for bands in claim if claim[bands] == min(claim.values())]
    axes[0].plot(low, [claim[b] for b in low], "k-", linewidth=2.5, label="the paper's claim")
    high = [bands for bands in claim if bands not in low]
    axes[0].plot(high, [claim[b] for b in high], "k_", markersize=14, markeredgewidth=2.5)
    axes[0].set_ylabel("worst error over all suns and turbidities, %")
    handles, labels = axes[0].get_legend_handles_labels()
    last = {row["model"]: row["mean"] for row in rows if row["bands"] == 7}
    order = np.argsort([-last.get(label, 0.005) for label in labels])
    figure.legend(
        [handles[i] for i in order],
        [labels[i] for i in order],
        loc="outside right center",
        frameon=False,
    )
    save(figure, path, dpi=110)


def _styles(rows: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    families: dict[str, list[str]] = {}
    for row in rows:
        names = families.setdefault(row["family"], [])
        if row["model"] not in names:
            names.append(row["model"])
    return {
        model: {
            "color": plt.get_cmap(_MAPS[family])(shade),
            "marker": _MARKERS[i % len(_MARKERS)],
            "linestyle": "--" if family in ("published", "rival") else "-",
        }
        for family, models in families.items()
        for i, (model, shade) in enumerate(
            zip(models, np.linspace(0.5, 0.9, len(models)), strict=True)
        )
    }
