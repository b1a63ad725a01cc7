"""Picture of Allan deviations with the fitted terms."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from gfimu.base.files.atomic_file import atomic_path
from gfimu.base.results.colours import STYLES, chip_colour, css
from gfimu.sensor_noise.recording_noise import RecordingNoise

__all__ = ["noise_picture"]


def noise_picture(path: str | Path, noise: RecordingNoise) -> None:
    """Draw the Allan deviation of every channel, dots, with its fitted terms, line; gyros in a panel of their own.

    A chip has one hue; its axes 1, 2, 3 have full, dashed and dotted lines.
    """
    groups = [("specific force", noise.accelerometers, "m/s²" if noise.unit == "m_s2" else noise.unit)]
    if noise.gyros:
        groups.append(("angular rate", noise.gyros, "rad/s"))
    figure = Figure(figsize=(7 * len(groups), 5.5), layout="constrained")
    for axes, (title, models, unit) in zip(figure.subplots(1, len(groups), squeeze=False)[0], groups, strict=True):
        places = _chip_and_axis(list(models))
        for name, model in models.items():
            chip, axis = places[name]
            hue = css(chip_colour(chip, on_paper=True))
            axes.loglog(model.allan.tau, model.allan.deviation, ".", ms=4, color=hue)
            tau = np.geomspace(model.allan.tau[0], model.allan.tau[-1], 100)
            axes.loglog(tau, model.deviation(tau), linestyle=STYLES[axis], lw=0.9, color=hue, label=name)
        axes.set_title(f"{title}, {noise.duration_s:.0f} s at {noise.rate:.4g} Hz")
        axes.set_xlabel("averaging time τ, s")
        axes.set_ylabel(f"Allan deviation, {unit}")
        axes.grid(which="both", lw=0.3)
        axes.legend(fontsize=7, ncols=max(2, -(-len(models) // 12)))
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=120, format=Path(path).suffix.lstrip(".") or "png")


def _chip_and_axis(channels: Sequence[str]) -> dict[str, tuple[int, int]]:
    """Return the number of the chip of each channel, and of the axis on it: names that differ in their last letter."""
    chips: dict[str, list[str]] = {}
    for name in channels:
        chips.setdefault(name[:-1], []).append(name)
    return {name: (chip, axis % 3) for chip, group in enumerate(chips.values()) for axis, name in enumerate(group)}
