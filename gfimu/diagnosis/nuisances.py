"""What is not asked for but has to be known: the noise of the sensors and how rough the drive may be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.causes import Cause, effects_of_run
from gfimu.diagnosis.coloured_noise import NoiseLevels, estimate_flicker, likeliest_flicker, white_level
from gfimu.diagnosis.fit import Fit
from gfimu.diagnosis.parallel import over_segments
from gfimu.diagnosis.refinement import refine
from gfimu.diagnosis.segment import Segment
from gfimu.diagnosis.slow_modes import WeighedPowers
from gfimu.world_model import Effect

__all__ = [
    "STEADY_NOISE",
    "learn_noise",
    "settle_noise",
    "sharpen_drives",
    "tune_drives",
    "uncut_drives",
    "widen_drives",
]

STEADY_NOISE = 0.1
"""Relative change of the noise below which it is known."""

_ITERATIONS = 6
_MOST_CUTS = 3
_LEAST_VALID = 0.01


def learn_noise(
    segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]], *, slow: bool = True
) -> float:
    """Re-estimate the noise of every segment from what the fit leaves; returns the largest relative change.

    Without ``slow`` the bias instability stays what it is.
    """
    array = segments[0].model.array
    change = 0.0

    def level_left(
        segment: Segment, known: Sequence[Effect], drive: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        segment.coefficients = drive
        effects = [*known, *effects_of_run(fit.causes, array, segment.index)]
        line = segment.linearise(effects)
        segment.move_drive(line)
        left = segment.working_residual(effects) - segment.residue_readings(line)
        coefficients = segment.basis.transform(left)
        # Above this frequency the drive has no freedom to follow the noise.
        slowest = 0.6 / segment.spline.spacing
        level = white_level(coefficients, slowest, segment.run.sample_period)
        # Missing samples stand as zeros, as where the reference comes at a lower rate.
        level = level / np.sqrt(np.maximum(segment.weight_mask.mean(axis=0), _LEAST_VALID))
        return left, coefficients, segment.noise_before_rounding(effects, level)

    lefts, coefficients, whites = zip(*over_segments(level_left, segments, fixed, fit.drives), strict=True)
    for index in {segment.index for segment in segments}:
        mine = [place for place, segment in enumerate(segments) if segment.index == index]
        shares = np.array([segments[place].weight_mask.sum(axis=0) for place in mine], dtype=float)  # (segments, c + 1)
        shares = np.maximum(shares, 1e-9) / np.maximum(shares, 1e-9).sum(axis=0)  # one may be without data
        white = np.sqrt(np.sum([share * whites[place] ** 2 for share, place in zip(shares, mine, strict=True)], axis=0))
        floor = segments[mine[0]].model.expected_noise(1.0 / segments[mine[0]].run.sample_period).quantum / np.sqrt(12)
        white[:-1] = np.maximum(white[:-1], 0.5 * floor)
        white[-1] = max(white[-1], segments[mine[0]].finest)
        walk = segments[mine[0]].levels.walk
        flickers = [_flicker(segments[place], lefts[place], coefficients[place], white, walk) for place in mine]
        flicker = np.sqrt(np.sum([share * one**2 for share, one in zip(shares, flickers, strict=True)], axis=0))
        flicker[-1] = 0.0
        for place in mine:
            old = segments[place].levels
            flicker = flicker if slow else old.flicker
            change = max(
                change,
                float(np.max(np.abs(white / old.white - 1))),
                float(np.max(np.abs(flicker[:-1] - old.flicker[:-1]) / (old.flicker[:-1] + 1e-3))),
            )
            segments[place].set_levels(NoiseLevels(white, flicker, walk))
            segments[place].prepare_weights()
    return change


def _flicker(
    segment: Segment,
    left: NDArray[np.float64],
    coefficients: NDArray[np.float64],
    white: NDArray[np.float64],
    walk: float,
) -> NDArray[np.float64]:
    """Return the bias instability of channels and reference, given what is left of them and its cosines."""
    if not segment.rounding.channels:
        return estimate_flicker(coefficients, white, segment.basis, walk)
    slow = WeighedPowers.of(segment.basis, left, segment.row_weight)
    return likeliest_flicker(slow.power, white, slow.flicker, slow.walk * walk**2)


def settle_noise(segments: Sequence[Segment], causes: Sequence[Cause], fixed: Sequence[Sequence[Effect]]) -> None:
    """Learn the noise that causes leave again and again until it stays the same."""
    for _ in range(_ITERATIONS):
        if learn_noise(segments, refine(segments, causes, fixed), fixed) < STEADY_NOISE:
            break


def sharpen_drives(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> Fit:
    """Give the drives finer knots where they bend sharply; returns the fit with its drives on them."""
    before = fit
    for _ in range(_MOST_CUTS):
        for segment, drive in zip(segments, fit.drives, strict=True):
            segment.coefficients = drive
            if fit is not before:
                segment.learn_roughness()
        if not any(over_segments(Segment.sharpen, segments)):
            break
        drives = tuple(segment.coefficients for segment in segments)
        fit = refine(segments, fit.causes, fixed, drives=drives, iterations=_ITERATIONS)
    for segment in segments:
        segment.knots_chosen = True
    if fit is not before:
        tune_drives(segments, fit, fixed)
    return fit


def uncut_drives(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> Fit:
    """Give the drives their usual knots again; returns the fit with its drives on them."""
    for segment, drive in zip(segments, fit.drives, strict=True):
        segment.coefficients = drive
        segment.uncut()
    fit = refine(segments, fit.causes, fixed, iterations=_ITERATIONS)
    tune_drives(segments, fit, fixed)
    return refine(segments, fit.causes, fixed, drives=fit.drives, iterations=_ITERATIONS)


def widen_drives(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> Fit:
    """Let the drives reach as far beyond the ends as the causes ask for; returns the fit with such drives."""
    array = segments[0].model.array

    def widen(segment: Segment, known: Sequence[Effect], drive: NDArray[np.float64]) -> bool:
        segment.coefficients = drive
        return segment.reach_out([*known, *effects_of_run(fit.causes, array, segment.index)])

    if not any(over_segments(widen, segments, fixed, fit.drives)):
        return fit
    drives = tuple(segment.coefficients for segment in segments)
    return refine(segments, fit.causes, fixed, drives=drives, iterations=_ITERATIONS)


def tune_drives(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> None:
    """Let the data choose how rough the drive of every segment may be."""
    array = segments[0].model.array

    def tune(segment: Segment, known: Sequence[Effect], drive: NDArray[np.float64]) -> None:
        segment.coefficients = drive
        segment.learn_roughness()
        segment.tune_roughness([*known, *effects_of_run(fit.causes, array, segment.index)])

    over_segments(tune, segments, fixed, fit.drives)
