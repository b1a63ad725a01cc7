"""Picture of Allan deviations with the fitted terms."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np

from gfimu.files.atomic_file import atomic_path
from gfimu.sensor_noise.recording_noise import RecordingNoise

mpl.use("Agg")

from matplotlib.figure import Figure

__all__ = ["noise_picture"]


def noise_picture(path: str | Path, noise: RecordingNoise) -> None:
    """Draw the Allan deviation of every channel, dots, with its fitted terms, line; gyros in a panel of their own."""
    groups = [("specific force", noise.accelerometers, "m/s²" if noise.unit == "m_s2" else noise.unit)]
    if noise.gyros:
        groups.append(("angular rate", noise.gyros, "rad/s"))
    figure = Figure(figsize=(7 * len(groups), 5.5), layout="constrained")
    for axes, (title, models, unit) in zip(figure.subplots(1, len(groups), squeeze=False)[0], groups, strict=True):
        for name, model in models.items():
            dots = axes.loglog(model.allan.tau, model.allan.deviation, ".", ms=4, label=name)
            tau = np.geomspace(model.allan.tau[0], model.allan.tau[-1], 100)
            axes.loglog(tau, model.deviation(tau), "-", lw=0.8, color=dots[0].get_color())
        axes.set_title(f"{title}, {noise.duration_s:.0f} s at {noise.rate:.4g} Hz")
        axes.set_xlabel("averaging time τ, s")
        axes.set_ylabel(f"Allan deviation, {unit}")
        axes.grid(which="both", lw=0.3)
        axes.legend(fontsize=7, ncols=2)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=120, format=Path(path).suffix.lstrip(".") or "png")
