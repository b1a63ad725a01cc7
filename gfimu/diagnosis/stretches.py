"""Runs cut into stretches that are short enough for one drive."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy.integrate import cumulative_trapezoid

from gfimu.diagnosis.data.run import Run, difference_noise
from gfimu.diagnosis.drive import smooth_rate
from gfimu.diagnosis.segment import Segment
from gfimu.world_model import WorldModel

__all__ = ["make_segments"]

SEGMENT_DURATION = 64.0  # s, about
_LOST_ANGLE_STD = 3.0  # rad


def make_segments(model: WorldModel, runs: Sequence[Run]) -> list[Segment]:
    """Cut runs into stretches that are short enough for one drive, and where the reference was lost."""
    segments = []
    for index, run in enumerate(runs):
        rate = smooth_rate(run, is_angle=model.drive_source == "angle")
        turned = cumulative_trapezoid(rate, run.t, initial=0.0)
        noise = difference_noise(run.reference[run.reference_valid])
        stretches = []
        for first, end in pairwise([0, *run.resumed, len(run.t)]):
            pieces = max(1, round((end - first) * run.sample_period / SEGMENT_DURATION))
            edges = np.linspace(first, end, pieces + 1).astype(int).tolist()
            stretches += [(start, stop, first > 0) for start, stop in pairwise(edges)]
        for start, stop, lost in stretches:
            drift = noise * np.sqrt(run.sample_period * (run.t[start] - run.t[0]))
            segments.append(
                Segment(
                    model,
                    run.rows(start, stop),
                    index,
                    float(run.t[0]),
                    start_angle=float(turned[start]),
                    start_angle_std=_LOST_ANGLE_STD if lost else float(np.hypot(1e-4, 2.0 * drift)),
                    stretches=len(stretches),
                )
            )
    return segments
