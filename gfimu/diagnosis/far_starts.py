"""Starts far from nothing, for effects whose signature at nothing says little about where they are."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.model import Effect
from gfimu.diagnosis.parallel import over_segments
from gfimu.diagnosis.refinement import Fit, refine, refine_each
from gfimu.diagnosis.segment import Segment
from gfimu.diagnosis.signatures import Hypothesis

__all__ = ["every_mode", "from_far", "remembered_mode"]

_ITERATIONS = 14
_FEW_ITERATIONS = 3
_WORTH_STARTING = 1.2
_SPACING = 0.1  # s, twice that of the fit
_MODE_STARTS = 6
_MODE_DAMPING = 0.05
_NEARBY = (0.8, 0.92, 1.08, 1.25)
_REMEMBERED = 2.0  # s
# What the evidence of a mode may be wrong by: it bends the functions that the drive can follow (`signatures`).
_AS_LIKELY = 10.0


def from_far(
    segments: Sequence[Segment],
    hypotheses: Sequence[Hypothesis],
    fixed: Sequence[Sequence[Effect]],
    drives: Sequence[NDArray[np.float64]],
) -> list[Fit]:
    """Fit effects, each alone, from several large sizes, as their signatures at nothing say little about them.

    Which size to start from is found with drives of few knots.
    """
    for segment, drive in zip(segments, drives, strict=True):
        segment.coefficients = drive
    coarse = over_segments(lambda segment: segment.coarser(_SPACING), segments)
    sets = [[one.cause(np.array([start]))] for one in hypotheses for start in one.family.starts]
    nothing, *first = refine_each(coarse, [[], *sets], fixed, [None] * (1 + len(sets)), iterations=0)
    # A start of which anything can come is nearer to the data than nothing, or not much farther.
    sets = [some for some, fit in zip(sets, first, strict=True) if fit.objective < _WORTH_STARTING * nothing.objective]
    fits = refine_each(coarse, sets, fixed, [None] * len(sets), iterations=_FEW_ITERATIONS)
    best: dict[frozenset[str], Fit] = {}
    for fit in fits:
        best[fit.names] = max(best.get(fit.names, fit), fit, key=lambda one: one.log_posterior)
    followed = [
        [
            segment.following(few.spline.spin(drive))
            for segment, few, drive in zip(segments, coarse, fit.drives, strict=True)
        ]
        for fit in best.values()
    ]
    causes = [fit.causes for fit in best.values()]
    return refine_each(segments, causes, fixed, followed, iterations=_ITERATIONS)


def remembered_mode(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> Fit:
    """Fit a mode with a drive that knows how the mode remembers it; returns the better fit.

    What rings on is not told by the drive of the instant: with that derivative a fit may stop far from its optimum, the
    drive bent to do what the mode does.
    """
    place = next(number for number, cause in enumerate(fit.causes) if cause.name == "resonance")
    mode = fit.causes[place]
    remembering = [copy(segment) for segment in segments]
    for segment in remembering:
        segment.memory = _REMEMBERED
    sets = []
    for ratio in _NEARBY:
        shape = {**mode.shape, "frequency_hz": ratio * mode.shape["frequency_hz"], "damping_ratio": _MODE_DAMPING}
        sets.append([*fit.causes[:place], mode.at(mode.coordinates, shape), *fit.causes[place + 1 :]])
    fits = refine_each(remembering, sets, fixed, [fit.drives] * len(sets), iterations=_FEW_ITERATIONS)
    lowest = min(fits, key=lambda one: one.objective)
    lowest = refine(remembering, lowest.causes, fixed, drives=lowest.drives, iterations=_ITERATIONS)
    # Judged as all other fits are, where it is; how well the mode is known, only a drive with memory tells.
    other = replace(refine(segments, lowest.causes, fixed, drives=lowest.drives, iterations=0), causes=lowest.causes)
    return max(fit, other, key=lambda one: one.log_posterior)


def every_mode(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> Fit:
    """Fit a mode that is hardly rung from everywhere; what its frequency could as well be goes into its covariance.

    Far below its frequency a mode only bends the ramps, and many modes bend them alike.
    """
    place = next(number for number, cause in enumerate(fit.causes) if cause.name == "resonance")
    mode = fit.causes[place]
    duration = max(segment.run.duration for segment in segments)
    grid = mode.family.shapes(duration, 1.0 / segments[0].run.sample_period)
    frequencies = sorted({shape["frequency_hz"] for shape in grid})[:: max(len(grid) // (2 * _MODE_STARTS), 1)]
    sets = []
    for frequency in frequencies:
        shape = {**mode.shape, "frequency_hz": frequency, "damping_ratio": _MODE_DAMPING}
        sets.append([*fit.causes[:place], mode.at(mode.coordinates, shape), *fit.causes[place + 1 :]])
    fits = [fit, *refine_each(segments, sets, fixed, [fit.drives] * len(sets), iterations=_ITERATIONS)]
    best = max(fits, key=lambda fit: fit.log_posterior)
    modes = [other.causes[place] for other in fits if other.log_posterior > best.log_posterior - _AS_LIKELY]
    mode = best.causes[place]
    apart = np.mean([np.square(other.coordinates - mode.coordinates) for other in modes], axis=0)
    shape_std = {
        key: float(np.hypot(std, np.sqrt(np.mean([(other.shape[key] - mode.shape[key]) ** 2 for other in modes]))))
        for key, std in mode.shape_std.items()
    }
    wide = replace(mode, covariance=mode.covariance + np.diag(apart), shape_std=shape_std)
    return replace(best, causes=(*best.causes[:place], wide, *best.causes[place + 1 :]))
