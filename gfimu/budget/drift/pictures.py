"""Picture of the position error of a unit that stands still, and of its prediction."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from gfimu.base.files.atomic_file import atomic_path
from gfimu.base.results.colours import AFTER_ON_PAPER, INK, PALE, css
from gfimu.budget.drift.rest_windows import RestDrift

__all__ = ["rest_drift_picture"]


def rest_drift_picture(path: str | Path, found: RestDrift) -> None:
    """Draw the position error of every window over time, x, y, z, on the band of ±2 predicted standard deviations."""
    figure = Figure(figsize=(13, 4.2), layout="constrained")
    mean = np.mean(found.predicted_mean_m, axis=0)  # (m, 3)
    std = np.sqrt(np.mean(found.predicted_std_m**2, axis=0))
    times = np.concatenate([[0.0], found.predicted_t_s])
    for axis, axes in enumerate(figure.subplots(1, 3)):
        middle, band = (np.concatenate([[0.0], one[:, axis]]) for one in (mean, 2.0 * std))
        axes.fill_between(times, middle - band, middle + band, color=css(PALE), label="±2 σ, predicted from the noise")
        for index, error in enumerate(found.error_m):
            label = f"navigation, {len(found.start_s)} windows" if index == 0 else None
            axes.plot(found.t_s, error[:, axis], color=css(AFTER_ON_PAPER), lw=0.9, label=label)
        axes.axhline(0.0, color=css(INK), lw=0.5)
        axes.set_title(f"{'xyz'[axis]}: rms {found.rms_m[axis]:.3g} m, predicted {found.predicted_m[axis]:.3g} m")
        axes.set_xlabel("time since the start of navigation, s")
        axes.set_ylabel("position error, m")
        axes.legend(fontsize=7, loc="upper left")
    figure.suptitle(f"{found.array} at rest, biases read off over {found.lead_s:g} s")
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=120, format=Path(path).suffix.lstrip(".") or "png")
