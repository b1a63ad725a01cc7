"""The rerun recording of a diagnosis: measured and predicted channels, the reference, and the rig in 3-D."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from gfimu.base.results.colours import AFTER, BEFORE, COMMAND, MEASURED
from gfimu.diagnosis.criticism.views.run_view import RunView
from gfimu.diagnosis.report.plain_words import headline, next_steps, parameter_texts, parameter_units, percent, story
from gfimu.diagnosis.report.rig import DrawnRig
from gfimu.diagnosis.verdict.verdict import Diagnosis
from gfimu.recording import Recording
from gfimu.visual import KnownMotion, Line, Plot, write_comparison

__all__ = ["write_picture"]

_MOST_SAMPLES = 20_000
_PER_CHANNEL = ("white",)


def write_picture(
    path: str | Path,
    diagnosis: Diagnosis,
    *,
    run: int = 0,
    rig: DrawnRig | None = None,
) -> None:
    """Write ``diagnosis.rrd`` for one run of a diagnosis.

    Parameters
    ----------
    path : str or Path
        File to write, ``.rrd``.
    diagnosis : Diagnosis
        The diagnosis.
    run : int
        Which of its runs.
    rig : DrawnRig, optional
        How the array stood on its table; upright at the usual height by default.
    """
    view, every = _thinned(diagnosis.runs[run])
    array = diagnosis.twin.array
    readings = np.where(view.valid, view.measured, np.nan)
    recording = Recording.from_arrays(view.t, readings, array)
    stood = rig or DrawnRig()
    if stood.lean is not None and array.turning_axis is None:
        array = replace(array, turning_axis=stood.axis)  # drawn with its arm, in place of a table
    write_comparison(
        path,
        recording,
        array,
        view.before,
        view.after,
        known=_motion(view, stood),
        plots=_plots(view),
        shapes=stood.shapes,
        notes=_notes(diagnosis) + (f"\n\nThe run is long: every {every}th sample is shown." if every > 1 else ""),
        title=f"diagnosis of {view.name}: {diagnosis.verdict.replace('_', ' ')}",
    )


def _thinned(view: RunView) -> tuple[RunView, int]:
    """Keep every k-th sample of a long run, so that the file can be opened; returns k too."""
    every = -(-len(view.t) // _MOST_SAMPLES)
    if every == 1:
        return view, 1
    kept: dict[str, Any] = {
        item.name: value[::every] if isinstance(value := getattr(view, item.name), np.ndarray) else value
        for item in fields(view)
        if item.name not in _PER_CHANNEL
    }
    return replace(view, **kept), every


def _motion(view: RunView, stood: DrawnRig) -> KnownMotion | None:
    """Motion of the array with the drive as estimated, carried by table or carriage; a free body has none."""
    mounting, centre = stood.mounting, np.asarray(stood.centre, dtype=float)
    if view.attitude is not None:
        return KnownMotion("gyro, integrated", view.t, view.attitude, centre)
    if not np.isfinite(view.angle).all():
        return None
    if stood.slide is not None:
        still = np.tile(Rotation.from_rotvec(mounting).as_quat(scalar_first=True), (len(view.t), 1))
        return KnownMotion("drive, estimated", view.t, still, centre + np.outer(view.angle, stood.slide))
    attitude = stood.attitude(view.angle).as_quat(scalar_first=True)
    return KnownMotion("drive, estimated", view.t, attitude, stood.places(view.angle), angle=view.angle)


def _plots(view: RunView) -> list[Plot]:
    reference = np.where(np.isfinite(view.reference), view.reference, np.nan)
    if not np.isfinite(view.angle).all():
        return [
            Plot("gyro, magnitude of its rate, rad/s", [Line("|ω|", view.t, reference, MEASURED)], legend=False),
            Plot(
                "angular acceleration from the gyro, magnitude, rad/s²",
                [Line("|α|", view.t, view.acceleration, COMMAND)],
                legend=False,
            ),
        ]
    rate, acceleration = "rate of the table, rad/s", "angular acceleration, rad/s²"
    if view.linear:
        rate, acceleration = "speed of the carriage, m/s", "acceleration of the carriage, m/s²"
    return [
        Plot(
            "reference that drives the twin",
            [
                Line("measured", view.t, reference, MEASURED, 2.0),
                Line("predicted before", view.t, view.reference_before, BEFORE),
                Line("predicted after", view.t, view.reference_after, AFTER),
            ],
        ),
        Plot(f"{rate}, estimated", [Line("estimated", view.t, view.rate, COMMAND)], legend=False),
        Plot(f"{acceleration}, estimated", [Line("estimated", view.t, view.acceleration, COMMAND)], legend=False),
    ]


def _notes(diagnosis: Diagnosis) -> str:
    lines = [f"# {headline(diagnosis)}", "", story(diagnosis), ""]
    for cause in diagnosis.causes:
        texts = parameter_texts(cause, parameter_units(diagnosis, cause))
        sizes = "; ".join(f"{text.name} {text.value}" for text in texts if text.significant)
        lines.append(f"- **{cause.effect}** {sizes} (probability {percent(cause.probability)})")
    lines += ["", "**Next.**", *[f"- {step}" for step in next_steps(diagnosis)]]
    return "\n".join(lines)
