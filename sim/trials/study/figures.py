"""Figures of a study: detection against size, confusion, reliability."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gfimu.base.results import save_figure

__all__ = ["draw_confusion", "draw_detection", "draw_reliability"]


def _axes(width: float, height: float) -> tuple[Any, Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots()


def _save(figure: Any, path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    save_figure(path, figure)
    return path


def draw_detection(by_size: Sequence[tuple[float, Sequence[Mapping[str, bool]]]], path: Path) -> Path:
    """Draw the share of right, set, nothing and unknown verdicts against the size d′."""
    figure, axes = _axes(6.4, 4.0)
    sizes = [size for size, _ in by_size]
    lines = {"exact": "right name alone", "within": "right name in the set", "wrong": "wrong name"}
    lines |= {"nothing": "nothing found", "unknown": "unknown"}
    for what, label in lines.items():
        axes.plot(sizes, [np.mean([entry[what] for entry in group]) for _, group in by_size], "o-", label=label)
    axes.set(xscale="log", xlabel="size d′", ylabel="share of runs", ylim=(-0.02, 1.02))
    axes.grid(alpha=0.3)
    axes.legend()
    return _save(figure, path)


def draw_confusion(pairs: Sequence[tuple[str, str]], path: Path) -> Path:
    """Draw how often each hidden effect (row) was named as what (column), as shares of its runs."""
    rows = sorted({hidden for hidden, _ in pairs})
    columns = [*rows, *sorted({said for _, said in pairs} - set(rows))]
    shares = np.zeros((len(rows), len(columns)))
    for hidden, said in pairs:
        shares[rows.index(hidden), columns.index(said)] += 1.0
    shares /= shares.sum(axis=1, keepdims=True)
    figure, axes = _axes(0.22 * len(columns) + 3.0, 0.22 * len(rows) + 3.0)
    axes.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0)
    axes.set_xticks(range(len(columns)), columns, rotation=90, fontsize=7)
    axes.set_yticks(range(len(rows)), rows, fontsize=7)
    axes.set(xlabel="said", ylabel="hidden")
    return _save(figure, path)


def draw_reliability(bins: Sequence[tuple[float, float, int]], path: Path) -> Path:
    """Draw observed frequency against stated probability with binomial standard errors."""
    stated, observed, count = (np.array(values, dtype=float) for values in zip(*bins, strict=True))
    figure, axes = _axes(4.8, 4.4)
    axes.plot([0, 1], [0, 1], color="0.6", lw=1)
    spread = np.sqrt(np.maximum(observed * (1 - observed), 0.25 / count) / count)
    axes.errorbar(stated, observed, yerr=spread, fmt="o", capsize=3)
    for x, y, n in zip(stated, observed, count, strict=True):
        axes.annotate(f"{n:.0f}", (x, y), xytext=(6, -10), textcoords="offset points", fontsize=8)
    axes.set(xlabel="stated probability", ylabel="observed frequency", xlim=(0, 1.03), ylim=(0, 1.03))
    return _save(figure, path)
