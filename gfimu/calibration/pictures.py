"""Pictures of a calibration: magnitudes at rest before and after, and the correlation of the parameters."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from gfimu.calibration.result import Calibration
from gfimu.files.atomic_file import atomic_path
from gfimu.recording import Recording
from gfimu.recording.rest import detect_rest

if TYPE_CHECKING:
    from matplotlib.axes import Axes

mpl.use("Agg")

from matplotlib.figure import Figure

__all__ = ["calibration_picture"]

_LABELS = 40


def calibration_picture(path: str | Path, calibration: Calibration, recording: Recording | None = None) -> None:
    """Draw a calibration.

    Parameters
    ----------
    path : str or Path
        Image file; the extension decides the format.
    calibration : Calibration
        The result.
    recording : Recording, optional
        The recording it was made from, to show magnitudes at rest; readings in the calibration's unit.
    """
    show_rest = recording is not None and calibration.unit != "rad_s"
    figure = Figure(figsize=(13 if show_rest else 7, 6), layout="constrained")
    axes = figure.subplots(1, 2 if show_rest else 1, squeeze=False)[0]
    _correlation(axes[-1], calibration)
    if show_rest and recording is not None:
        _magnitudes(axes[0], calibration, recording)
    figure.suptitle(f"Calibration: {calibration.method}, {len(calibration.chips)} triad(s)")
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=120, format=Path(path).suffix.lstrip(".") or "png")


def _correlation(axes: Axes, calibration: Calibration) -> None:
    image = axes.imshow(calibration.correlation, cmap="RdBu_r", vmin=-1, vmax=1)
    axes.figure.colorbar(image, ax=axes, shrink=0.8, label="correlation")
    axes.set_title("correlation of the parameters")
    if len(calibration.names) <= _LABELS:
        several = len(calibration.chips) > 1
        names = [name if several else name.split("_", 1)[1] for name in calibration.names]
        axes.set_xticks(range(len(names)), names, rotation=90, fontsize=7)
        axes.set_yticks(range(len(names)), names, fontsize=7)
    else:
        axes.set_xlabel("parameter number")
        axes.set_ylabel("parameter number")


def _magnitudes(axes: Axes, calibration: Calibration, recording: Recording) -> None:
    """Draw |a| − g of every pose and chip, after calibration and, where the scale is known, before."""
    rest = detect_rest(recording)
    after = _rest_magnitudes(calibration.apply(recording), calibration, rest.start, rest.stop)
    pose = np.arange(1, len(rest) + 1)
    if recording.unit == "m_s2":
        before = _rest_magnitudes(recording, calibration, rest.start, rest.stop)
        axes.plot(pose, before - calibration.gravity, "o", color="0.7", ms=4, label="before")
    lines = axes.plot(pose, after - calibration.gravity, "o", ms=4)
    for line, chip in zip(lines, calibration.chips, strict=True):
        line.set_label(f"after, {chip}")
    axes.axhline(0.0, color="k", lw=0.5)
    axes.set_yscale("symlog", linthresh=0.005)
    axes.set_xlabel("pose")
    axes.set_ylabel("|a| − g, m/s²")
    axes.set_title("magnitude of the specific force at rest")
    handles, labels = axes.get_legend_handles_labels()
    kept = dict(zip(labels, handles, strict=True))
    axes.legend(kept.values(), kept.keys(), fontsize=7)


def _rest_magnitudes(
    recording: Recording, calibration: Calibration, start: NDArray[np.intp], stop: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Return |a| of every rest and chip, (p, k), m/s²."""
    columns = [recording.channels.index(channel) for channel in calibration.channels]
    means = np.array([np.nanmean(recording.readings[a:b, columns], axis=0) for a, b in zip(start, stop, strict=True)])
    return np.asarray(np.linalg.norm(means.reshape(len(means), -1, 3), axis=2), dtype=np.float64)
