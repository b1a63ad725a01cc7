"""Picture of one impact: p, α and ω from time zero."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from gfimu.base.files.atomic_file import atomic_path
from gfimu.base.results.colours import AXES, css
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.motion.impact.event import Impact

__all__ = ["impact_picture"]

_BEFORE_S, _AFTER_DURATIONS, _LEAST_S = 0.005, 3.0, 0.02


def impact_picture(path: str | Path, impact: Impact) -> None:
    """Draw p, g, α, rad/s², and ω, rad/s, over time, ms; x red, y green, z blue, the resultant grey."""
    motion = impact.motion
    end = max(_AFTER_DURATIONS * impact.duration_s, _LEAST_S)
    shown = (motion.t_s >= -_BEFORE_S) & (motion.t_s <= end)
    time = 1e3 * motion.t_s[shown]
    panels = (
        ("p, g", motion.p / STANDARD_GRAVITY),
        ("α, rad/s²", motion.alpha),
        ("ω, rad/s", motion.omega),
    )
    figure = Figure(figsize=(7.5, 7.5), layout="constrained")
    for axes, (title, values) in zip(figure.subplots(len(panels), 1, sharex=True), panels, strict=True):
        axes.plot(time, np.linalg.norm(values[shown], axis=1), color="0.6", lw=2.5, label="resultant")
        for k, name in enumerate("xyz"):
            axes.plot(time, values[shown, k], color=css(AXES[k]), lw=1.1, label=name)
        axes.axvspan(0.0, 1e3 * impact.duration_s, color="0.93", zorder=-1)
        axes.set_ylabel(title)
        axes.grid(lw=0.3)
    figure.axes[0].legend(ncols=4, fontsize=8)
    figure.axes[-1].set_xlabel("time after time zero, ms (shaded: the impact)")
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=120, format=Path(path).suffix.lstrip(".") or "png")
