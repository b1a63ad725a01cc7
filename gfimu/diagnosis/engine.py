"""The search for causes: screen linearly, refine with the full simulation, relearn the noise, until nothing changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from gfimu.diagnosis.causes import Cause, effects_of_run
from gfimu.diagnosis.coloured_noise import NoiseLevels, estimate_flicker, white_level
from gfimu.diagnosis.drive import smooth_rate
from gfimu.diagnosis.model import Effect, WorldModel
from gfimu.diagnosis.refinement import Fit, refine
from gfimu.diagnosis.run import Run
from gfimu.diagnosis.search import search
from gfimu.diagnosis.segment import Linearisation, Segment, difference_noise, over_segments
from gfimu.diagnosis.signatures import Hypothesis, SignatureSet, hypotheses, plan_signatures, signature_columns

__all__ = [
    "RIVALS",
    "Explanation",
    "Report",
    "explain",
    "learn_noise",
    "make_segments",
    "prune",
    "screen",
    "tune_drives",
]

Report = Callable[[float, str], None]

SEGMENT_DURATION = 64.0
_ROUNDS = 6
_REFINED = 6
_MOST_CAUSES = 4
_CLOSE = 12.0
_GROSS = 150.0
_FAIR_FIT = 1.6
_WORTH_REFINING = -6.0
RIVALS = 6
"""How many other sets are judged beside the best."""
LEAST_ODDS = 9.0
"""Log odds that a single cause needs against nothing; provisional until a study of null runs fixes it."""
LEAST_EXTRA_ODDS = 7.0
"""Log odds that a further cause needs against the set without it."""
_ITERATIONS = 7
_FEW_ITERATIONS = 3
_STEADY_NOISE = 0.1
_FAINT = 500.0  # log odds of a mode whose frequency may not be settled
_MODE_STARTS = 6
_MODE_DAMPING = 0.05
# What the evidence of a mode may be wrong by: it bends the functions that the drive can follow (`signatures`).
_AS_LIKELY = 10.0
_LEAST_VALID = 0.01


@dataclass(frozen=True)
class Explanation:
    """What the search ended with.

    Parameters
    ----------
    fit : Fit
        The best set of causes.
    rivals : tuple of Fit
        Every other refined set, best first, under the same noise.
    nothing : Fit
        No cause at all, under the same noise.
    without : dict of str to Fit
        The best fit without each cause.
    segments : tuple of Segment
        The data with their drives at the best set.
    fixed : tuple of tuple of Effect
        Effects of each segment's run found beforehand (integrity).
    signatures : SignatureSet
        The last screening, about the best set.
    """

    fit: Fit
    rivals: tuple[Fit, ...]
    nothing: Fit
    without: dict[str, Fit]
    segments: tuple[Segment, ...]
    fixed: tuple[tuple[Effect, ...], ...]
    signatures: SignatureSet


def _posterior(fit: Fit) -> float:
    return fit.log_posterior


def make_segments(model: WorldModel, runs: Sequence[Run]) -> list[Segment]:
    """Cut runs into stretches that are short enough for one drive."""
    segments = []
    for index, run in enumerate(runs):
        pieces = max(1, round(run.duration / SEGMENT_DURATION))
        edges = np.linspace(0, len(run.t), pieces + 1).astype(int)
        rate = smooth_rate(run, is_angle=model.drive_source == "angle")
        turned = cumulative_trapezoid(rate, run.t, initial=0.0)
        noise = difference_noise(run.reference[run.reference_valid])
        for start, stop in pairwise(edges):
            drift = noise * np.sqrt(run.sample_period * (run.t[start] - run.t[0]))
            segments.append(
                Segment(
                    model,
                    run.rows(int(start), int(stop)),
                    index,
                    float(run.t[0]),
                    start_angle=float(turned[start]),
                    start_angle_std=float(np.hypot(1e-4, 2.0 * drift)),
                )
            )
    return segments


def screen(segments: Sequence[Segment], base: Fit, fixed: Sequence[Sequence[Effect]], runs: int) -> SignatureSet:
    """Compute all signatures about a base and their normal equations relative to no effects."""
    model = segments[0].model
    array = model.array
    for segment, drive in zip(segments, base.drives, strict=True):
        segment.coefficients = drive
    linear = over_segments(
        lambda segment, known: segment.linearise([*known, *effects_of_run(base.causes, array, segment.index)]),
        segments,
        fixed,
    )
    signatures, count = plan_signatures(model.families(), segments, linear, base.causes, runs)
    gram, score = np.zeros((count, count)), np.zeros(count)

    def products(
        segment: Segment, line: Linearisation, known: Sequence[Effect]
    ) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
        columns, numbers = signature_columns(segment, signatures, base.causes, known)
        part, part_score, _ = segment.whitened_products(line, columns)
        return numbers, part, part_score

    for numbers, part, part_score in over_segments(products, segments, linear, fixed):
        gram[np.ix_(numbers, numbers)] += part
        score[numbers] += part_score
    at = np.zeros(count)
    for cause in base.causes:
        signature = next(one for one in signatures if one.family.name == cause.name)
        at[signature.columns] = cause.mixing @ cause.coordinates
    return SignatureSet(tuple(signatures), gram, score + gram @ at, tuple(hypotheses(signatures, array, runs)))


def learn_noise(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> float:
    """Re-estimate the noise of every segment from what the fit leaves; returns the largest relative change."""
    array = segments[0].model.array
    change = 0.0
    coefficients, whites = [], []
    for segment, known, drive in zip(segments, fixed, fit.drives, strict=True):
        segment.coefficients = drive
        effects = [*known, *effects_of_run(fit.causes, array, segment.index)]
        line = segment.linearise(effects)
        segment.move_drive(line)
        left = segment.working_residual(effects)
        coefficients.append(segment.basis.transform(left))
        # Above this frequency the drive has no freedom to follow the noise.
        slowest = 0.6 / segment.spline.spacing
        level = white_level(coefficients[-1], slowest, segment.run.sample_period)
        # Missing samples stand as zeros, as where the reference comes at a lower rate.
        level = level / np.sqrt(np.maximum(segment.weight_mask.mean(axis=0), _LEAST_VALID))
        whites.append(segment.noise_before_rounding(effects, level))
    for index in {segment.index for segment in segments}:
        mine = [place for place, segment in enumerate(segments) if segment.index == index]
        white = np.sqrt(np.mean([whites[place] ** 2 for place in mine], axis=0))
        floor = segments[mine[0]].model.expected_noise(1.0 / segments[mine[0]].run.sample_period).quantum / np.sqrt(12)
        white[:-1] = np.maximum(white[:-1], 0.5 * floor)
        walk = segments[mine[0]].levels.walk
        flicker = np.sqrt(
            np.mean(
                [estimate_flicker(coefficients[place], white, segments[place].basis, walk) ** 2 for place in mine],
                axis=0,
            )
        )
        flicker[-1] = 0.0
        for place in mine:
            old = segments[place].levels
            change = max(
                change,
                float(np.max(np.abs(white / old.white - 1))),
                float(np.max(np.abs(flicker[:-1] - old.flicker[:-1]) / (old.flicker[:-1] + 1e-3))),
            )
            segments[place].set_levels(NoiseLevels(white, flicker, walk))
            segments[place].prepare_weights()
    return change


def tune_drives(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> None:
    """Let the data choose how rough the drive of every segment may be."""
    array = segments[0].model.array

    def tune(segment: Segment, known: Sequence[Effect], drive: NDArray[np.float64]) -> None:
        segment.coefficients = drive
        segment.learn_roughness()
        segment.tune_roughness([*known, *effects_of_run(fit.causes, array, segment.index)])

    over_segments(tune, segments, fixed, fit.drives)


def explain(
    segments: Sequence[Segment],
    fixed: Sequence[Sequence[Effect]],
    runs: int,
    *,
    start: Sequence[Cause] = (),
    report: Report | None = None,
) -> Explanation:
    """Find the most probable set of causes.

    Parameters
    ----------
    segments : sequence of Segment
        The data.
    fixed : sequence of sequence of Effect
        Effects known beforehand, per segment.
    runs : int
        Number of runs.
    start : sequence of Cause
        Causes to start from.
    report : callable, optional
        Called with the share done and a line of text.
    """
    tell = report or (lambda share, text: None)
    for segment in segments:
        segment.prepare_weights()
    best = refine(segments, start, fixed, iterations=6 if start else 0)
    fitted = refine(segments, start, fixed, iterations=8)
    observations = sum(int(segment.weight_mask.sum()) for segment in segments)
    if fitted.objective < _FAIR_FIT * observations:
        # The channels sharpen the drive unless something gross twists it.
        tune_drives(segments, fitted, fixed)
        best = fitted = refine(segments, start, fixed, drives=fitted.drives, iterations=8)
    tried: dict[frozenset[tuple[str, str]], Fit] = {}
    settled_before = False
    for round_number in range(_ROUNDS):
        tell(0.1 + 0.8 * round_number / _ROUNDS, f"search {round_number + 1}")
        signatures, screened = screen(segments, best, fixed, runs), best.key
        candidates, singles, blocks = search(signatures, most=max(2, min(len(best.causes) + 1, _MOST_CAUSES)))
        fits = {best.key: best}
        gross = candidates[0].log_odds > _GROSS
        leading = candidates[:_REFINED]
        if gross and not settled_before:
            # A large effect is far from linear: the right cause may be well down the linear list.
            leading = [*candidates[:3], *(one for one in singles[:_REFINED] if one not in candidates[:3])]
        for candidate in leading:
            causes = [
                signatures.hypotheses[number].cause(coordinates)
                for number, coordinates in zip(candidate.members, blocks.coordinates(candidate.members), strict=True)
            ]
            key = frozenset(cause.key for cause in causes)
            close = candidate.log_odds > max(candidates[0].log_odds - _CLOSE, _WORTH_REFINING)
            if key in fits or not (close or (gross and len(causes) == 1 and key not in tried)):
                continue
            known = tried.get(key)
            if known is not None:
                causes = list(known.causes)
            fits[key] = refine(segments, causes, fixed, drives=best.drives, iterations=_ITERATIONS)
            if key not in tried and any("order" in cause.shape for cause in causes):
                # Ripples locked to the angle lose their phase where the drive's angle has drifted.
                other = refine(segments, causes, fixed, drives=fitted.drives, iterations=_ITERATIONS)
                fits[key] = max(fits[key], other, key=_posterior)
        if round_number == 0 and min(fit.objective for fit in fits.values()) > _FAIR_FIT * observations:
            for hypothesis in signatures.hypotheses:
                if hypothesis.family.starts:
                    tell(0.1, f"large sizes of {hypothesis.name}")
                    large = _from_far(segments, hypothesis, fixed, best.drives)
                    fits[large.key] = max(fits.get(large.key, large), large, key=_posterior)
        tried |= fits
        winner = max(fits.values(), key=lambda fit: fit.log_posterior)
        settled = winner.key == best.key
        best = winner
        change = learn_noise(segments, best, fixed)
        tune_drives(segments, best, fixed)
        best = refine(segments, best.causes, fixed, drives=best.drives, iterations=6)
        if settled and (settled_before or change < _STEADY_NOISE):
            break
        settled_before = settled
    tell(0.85, "prune")
    best, without = prune(segments, best, fixed)
    near = [
        fit
        for fit in sorted(tried.values(), key=_posterior, reverse=True)
        if fit.key != best.key and fit.causes and fit.log_posterior > best.log_posterior - _CLOSE - 10.0
    ]
    rivals = [refine(segments, fit.causes, fixed, drives=best.drives, iterations=6) for fit in near[:RIVALS]]
    rivals = [prune(segments, rival, fixed)[0] for rival in rivals if len(rival.causes) <= len(best.causes) + 1]
    unique = {rival.key: rival for rival in rivals if rival.causes and rival.key != best.key}
    better = max(unique.values(), key=_posterior, default=best)
    if better.log_posterior > best.log_posterior:
        unique[best.key] = best
        best, without = prune(segments, better, fixed)
        unique.pop(best.key, None)
    if "resonance" in without and best.log_posterior - without["resonance"].log_posterior < _FAINT:
        best = _every_mode(segments, best, fixed)
    tell(0.9, "compare")
    nothing = refine(segments, (), fixed, drives=best.drives, iterations=8) if best.causes else best
    for segment, drive in zip(segments, best.drives, strict=True):
        segment.coefficients = drive
    if best.key != screened:
        signatures = screen(segments, best, fixed, runs)
    return Explanation(
        best,
        tuple(sorted(unique.values(), key=_posterior, reverse=True)),
        nothing,
        without,
        tuple(segments),
        tuple(tuple(known) for known in fixed),
        signatures,
    )


def _from_far(
    segments: Sequence[Segment],
    hypothesis: Hypothesis,
    fixed: Sequence[Sequence[Effect]],
    drives: Sequence[NDArray[np.float64]],
) -> Fit:
    """Fit one effect from several large sizes, as its signature at nothing says little about them."""
    fits = [
        refine(segments, [hypothesis.cause(np.array([start]))], fixed, drives=drives, iterations=_FEW_ITERATIONS)
        for start in hypothesis.family.starts
    ]
    best = max(fits, key=_posterior)
    return refine(segments, best.causes, fixed, drives=best.drives, iterations=2 * _ITERATIONS)


def _every_mode(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> Fit:
    """Fit a mode that is hardly rung from everywhere; what its frequency could as well be goes into its covariance.

    Far below its frequency a mode only bends the ramps, and many modes bend them alike.
    """
    place = next(number for number, cause in enumerate(fit.causes) if cause.name == "resonance")
    mode = fit.causes[place]
    duration = max(segment.run.duration for segment in segments)
    grid = mode.family.shapes(duration, 1.0 / segments[0].run.sample_period)
    frequencies = sorted({shape["frequency_hz"] for shape in grid})[:: max(len(grid) // (2 * _MODE_STARTS), 1)]
    fits = [fit]
    for frequency in frequencies:
        shape = {**mode.shape, "frequency_hz": frequency, "damping_ratio": _MODE_DAMPING}
        causes = [*fit.causes[:place], mode.at(mode.coordinates, shape), *fit.causes[place + 1 :]]
        fits.append(refine(segments, causes, fixed, drives=fit.drives, iterations=2 * _ITERATIONS))
    best = max(fits, key=_posterior)
    modes = [other.causes[place] for other in fits if other.log_posterior > best.log_posterior - _AS_LIKELY]
    mode = best.causes[place]
    apart = np.mean([np.square(other.coordinates - mode.coordinates) for other in modes], axis=0)
    shape_std = {
        key: float(np.hypot(std, np.sqrt(np.mean([(other.shape[key] - mode.shape[key]) ** 2 for other in modes]))))
        for key, std in mode.shape_std.items()
    }
    wide = replace(mode, covariance=mode.covariance + np.diag(apart), shape_std=shape_std)
    return replace(best, causes=(*best.causes[:place], wide, *best.causes[place + 1 :]))


def prune(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> tuple[Fit, dict[str, Fit]]:
    """Drop causes that the data hardly ask for; returns the fit and, by cause, the best fit without it."""
    while True:
        without = {
            cause.name: refine(
                segments,
                [other for other in fit.causes if other.name != cause.name],
                fixed,
                drives=fit.drives,
                iterations=8,
            )
            for cause in fit.causes
        }
        if not without:
            return fit, without
        weakest = max(without, key=lambda name: without[name].log_posterior)
        needed = LEAST_ODDS if len(fit.causes) == 1 else LEAST_EXTRA_ODDS
        if fit.log_posterior - without[weakest].log_posterior >= needed:
            return fit, without
        fit = without[weakest]
