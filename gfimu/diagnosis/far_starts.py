"""Starts far from nothing, for effects whose signature at nothing says little about where they are."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.causes import Cause
from gfimu.diagnosis.fit import Fit
from gfimu.diagnosis.parallel import over_segments
from gfimu.diagnosis.refinement import refine, refine_each
from gfimu.diagnosis.segment import Segment
from gfimu.diagnosis.signatures import Hypothesis
from gfimu.world_model import Effect

__all__ = ["every_mode", "from_far", "with_honest_mode"]

_ITERATIONS = 14
_FEW_ITERATIONS = 3
_WORTH_STARTING = 1.2
_SPACING = 0.1  # s, twice that of the fit
_MODE_STARTS = 6
_MODE_DAMPING = 0.05
_WIDE_DAMPING = 0.1  # comes near from farther off
_NEAREST = 2
_UNSETTLED = 0.4  # of frequency and damping
_DOUBT = 3.0  # times the standard deviation: what modes that were followed were off by, rms, in eight worlds
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


def every_mode(
    segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]], *, misfit: bool = False
) -> Fit:
    """Fit a mode from everywhere; what its frequency could as well be goes into its covariance.

    Far below its frequency a mode only bends the ramps, and many modes bend them alike. One that was fitted and leaves
    something (``misfit``) may be at a wrong frequency, to which the drive was bent; then all are tried with a drive
    that knows how they ring on, and with the whole inertia behind the spring.
    """
    place = next(number for number, cause in enumerate(fit.causes) if cause.name == "resonance")
    mode = fit.causes[place]
    duration = max(segment.run.duration for segment in segments)
    grid = mode.family.shapes(duration, 1.0 / segments[0].run.sample_period)
    frequencies = sorted({shape["frequency_hz"] for shape in grid})[:: max(len(grid) // (2 * _MODE_STARTS), 1)]
    whole = 1.0 / np.array([mode.family.sizes(segments[0].model.array)[0].prior_std])
    damping, iterations, starting = _WIDE_DAMPING, _FEW_ITERATIONS, segments
    if not misfit:
        damping, iterations = _MODE_DAMPING, _ITERATIONS
        # A drive that does not know how a mode rings on comes near for less.
        starting = [copy(segment) for segment in segments]
        for segment in starting:
            segment.ringing = False
    sets = []
    for frequency in frequencies:
        shape = {**mode.shape, "frequency_hz": frequency, "damping_ratio": damping}
        # Far below its frequency the twist is -α gain/ω².
        alike = mode.coordinates * (frequency / mode.shape["frequency_hz"]) ** 2
        coordinates = whole if misfit else np.minimum(alike, whole)
        sets.append([*fit.causes[:place], mode.at(coordinates, shape), *fit.causes[place + 1 :]])
    near = refine_each(starting, sets, fixed, [fit.drives] * len(sets), iterations=iterations)
    near.sort(key=lambda one: one.log_posterior, reverse=True)
    leading = near[:_NEAREST]
    drives = [one.drives for one in leading]
    full = refine_each(segments, [one.causes for one in leading], fixed, drives, iterations=_ITERATIONS)
    fits = [fit, *full, *near[_NEAREST:]]
    best = max([fit, *full], key=lambda one: one.log_posterior)
    modes = [other.causes[place] for other in fits if other.log_posterior > best.log_posterior - _AS_LIKELY]
    found = _widened(best, place, modes)
    return found if misfit else _unsettled(found, place)


def with_honest_mode(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> Fit:
    """Widen what is said of a mode by how much it depends on what the drive knows of its ringing.

    The prior of the drive is learnt from a drive that may ring itself, and what rings, drive or mode, is told apart by
    that prior: the covariance alone is too small. Where the drive was never told of the ringing, only gain/ω² is known.
    """
    place = next(number for number, cause in enumerate(fit.causes) if cause.name == "resonance")
    otherwise = [copy(segment) for segment in segments]
    for segment in otherwise:
        segment.ringing = not segment.ringing
    other = refine(otherwise, fit.causes, fixed, drives=fit.drives, iterations=_ITERATIONS)
    wide = _widened(fit, place, [other.causes[place]])
    return _doubted(wide, place) if segments[0].ringing else _unsettled(wide, place)


def _doubted(fit: Fit, place: int) -> Fit:
    """Widen what is said of a mode whose ringing was followed by as much as the errors of such fits ask for."""
    mode = fit.causes[place]
    shape_std = {key: _DOUBT * std for key, std in mode.shape_std.items()}
    wide = replace(mode, covariance=_DOUBT**2 * mode.covariance, shape_std=shape_std)
    return replace(fit, causes=(*fit.causes[:place], wide, *fit.causes[place + 1 :]))


def _unsettled(fit: Fit, place: int) -> Fit:
    """Widen what is said of a mode that is hardly rung: of gain, frequency and damping only gain/ω² is well known."""
    mode = fit.causes[place]
    shape_std = {key: max(std, _UNSETTLED * mode.shape[key]) for key, std in mode.shape_std.items()}
    # In units of the prior, which is all that is known of the gain then.
    least = np.diag(np.maximum(1.0 - mode.covariance.diagonal(), 0.0))
    wide = replace(mode, covariance=mode.covariance + least, shape_std=shape_std)
    return replace(fit, causes=(*fit.causes[:place], wide, *fit.causes[place + 1 :]))


def _widened(fit: Fit, place: int, modes: Sequence[Cause]) -> Fit:
    """Let the covariance of a mode hold other modes that it may as well be."""
    mode = fit.causes[place]
    apart = np.mean([np.square(other.coordinates - mode.coordinates) for other in modes], axis=0)
    shape_std = {
        key: float(np.hypot(std, np.sqrt(np.mean([(other.shape[key] - mode.shape[key]) ** 2 for other in modes]))))
        for key, std in mode.shape_std.items()
    }
    wide = replace(mode, covariance=mode.covariance + np.diag(apart), shape_std=shape_std)
    return replace(fit, causes=(*fit.causes[:place], wide, *fit.causes[place + 1 :]))
