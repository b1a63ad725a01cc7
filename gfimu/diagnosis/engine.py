"""The search for causes: screen linearly, refine with the full simulation, relearn the noise, until nothing changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from gfimu.diagnosis.causes import Cause, effects_of_run
from gfimu.diagnosis.drive import smooth_rate
from gfimu.diagnosis.far_starts import every_mode, from_far
from gfimu.diagnosis.linearisation import Linearisation
from gfimu.diagnosis.model import Effect, WorldModel
from gfimu.diagnosis.nuisances import learn_noise, sharpen_drives, tune_drives
from gfimu.diagnosis.refinement import Fit, refine
from gfimu.diagnosis.run import Run
from gfimu.diagnosis.search import search
from gfimu.diagnosis.segment import Segment, difference_noise, over_segments
from gfimu.diagnosis.signatures import SignatureSet, hypotheses, plan_signatures, signature_columns

__all__ = [
    "FAIR_FIT",
    "RIVALS",
    "Explanation",
    "Report",
    "explain",
    "make_segments",
    "prune",
    "screen",
]

Report = Callable[[float, str], None]

SEGMENT_DURATION = 64.0
_ROUNDS = 6
_REFINED = 6
_MOST_CAUSES = 4
_CLOSE = 12.0
_GROSS = 150.0
_WORTH_REFINING = -6.0
_WORTH_PRUNING = 40.0
FAIR_FIT = 1.6
"""Misfit per observation, in variances, above which something large is still missing."""
RIVALS = 6
"""How many other sets are judged beside the best."""
LEAST_ODDS = 4.0
"""Log odds that a single cause needs against nothing.

Wide of what chance does: in 240 runs with nothing hidden (`threshold_nulls` of `sim.study`, not those that the false
alarms are counted on) two reached even odds and none e against one.
"""
LEAST_EXTRA_ODDS = 7.0
"""Log odds that a further cause, beside others or a fault of the data, needs against the set without it."""
_ITERATIONS = 7
_STEADY_NOISE = 0.1
_FAINT = 500.0  # log odds of a mode whose frequency may not be settled


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
    fair = fitted.objective < FAIR_FIT * observations
    if fair:
        # The channels sharpen the drive unless something gross twists it.
        tune_drives(segments, fitted, fixed)
        fitted = sharpen_drives(segments, fitted, fixed)
        best = fitted = refine(segments, start, fixed, drives=fitted.drives, iterations=8)
    tried: dict[frozenset[tuple[str, str]], Fit] = {}
    behind: dict[frozenset[tuple[str, str]], float] = {}  # how far, under the noise that both were judged by
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
        # A start has been through this.
        if round_number == 0 and not start and min(fit.objective for fit in fits.values()) > FAIR_FIT * observations:
            for hypothesis in signatures.hypotheses:
                if hypothesis.family.starts:
                    tell(0.1, f"large sizes of {hypothesis.name}")
                    large = from_far(segments, hypothesis, fixed, best.drives)
                    fits[large.key] = max(fits.get(large.key, large), large, key=_posterior)
        tried |= fits
        winner = max(fits.values(), key=_posterior)
        was_fair, fair = fair, fair or winner.objective < FAIR_FIT * observations
        behind |= {key: winner.log_posterior - fit.log_posterior for key, fit in fits.items()}
        settled = winner.key == best.key
        best = winner
        change = learn_noise(segments, best, fixed)
        tune_drives(segments, best, fixed)
        best = refine(segments, best.causes, fixed, drives=best.drives, iterations=6)
        if fair and not was_fair:
            best = sharpen_drives(segments, best, fixed)
            fitted = refine(segments, start, fixed, drives=best.drives, iterations=8)  # on the same knots
        if settled and (settled_before or change < _STEADY_NOISE):
            break
        settled_before = settled
    tell(0.85, "prune")
    done: dict[frozenset[tuple[str, str]], Fit] = {}
    best, without = prune(segments, best, fixed, done)
    near = [
        tried[key]
        for key in sorted(behind, key=behind.__getitem__)
        if best.causes and key != best.key and tried[key].causes and behind[key] < _CLOSE + 10.0
    ]
    rivals = _rivals(segments, best, near[:RIVALS], fixed, done)
    unique = {rival.key: rival for rival in rivals if rival.causes and rival.key != best.key}
    better = max(unique.values(), key=_posterior, default=best)
    if better.log_posterior > best.log_posterior:
        unique[best.key] = best
        best, without = prune(segments, better, fixed, done)
        unique.pop(best.key, None)
    if "resonance" in without and best.log_posterior - without["resonance"].log_posterior < _FAINT:
        best = every_mode(segments, best, fixed)
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


def _rivals(
    segments: Sequence[Segment],
    best: Fit,
    near: Sequence[Fit],
    fixed: Sequence[Sequence[Effect]],
    done: dict[frozenset[tuple[str, str]], Fit],
) -> list[Fit]:
    """Refine other sets under the noise and drive prior of the best one; those that come close are pruned too."""
    rivals = []
    for fit in near:
        if len(fit.causes) > len(best.causes) + 1:
            continue
        rival = refine(segments, fit.causes, fixed, drives=best.drives, iterations=6)
        if rival.key > best.key and rival.log_posterior < best.log_posterior:
            continue  # the best set with something superfluous
        if rival.log_posterior > best.log_posterior - _WORTH_PRUNING:
            rival = prune(segments, rival, fixed, done)[0]
        rivals.append(rival)
    return rivals


def prune(
    segments: Sequence[Segment],
    fit: Fit,
    fixed: Sequence[Sequence[Effect]],
    done: dict[frozenset[tuple[str, str]], Fit] | None = None,
) -> tuple[Fit, dict[str, Fit]]:
    """Drop causes that the data hardly ask for.

    Parameters
    ----------
    segments : sequence of Segment
        The data.
    fit : Fit
        What to prune.
    fixed : sequence of sequence of Effect
        Effects known beforehand, per segment.
    done : dict, optional
        Sets refined before under the same noise; those refined here are added.

    Returns
    -------
    fit : Fit
        What the data ask for.
    without : dict of str to Fit
        By cause, the best fit without it.
    """
    known = {} if done is None else done
    faults = any(effect.place == "data" for effects in fixed for effect in effects)
    faults |= any(segment.rounding > 0 for segment in segments)
    while True:
        without = {}
        for cause in fit.causes:
            others = [other for other in fit.causes if other.name != cause.name]
            key = frozenset(other.key for other in others)
            if key not in known:
                known[key] = refine(segments, others, fixed, drives=fit.drives, iterations=8)
            without[cause.name] = known[key]
        if not without:
            return fit, without
        lost = {name: fit.log_posterior - other.log_posterior for name, other in without.items()}
        weakest = min(lost, key=lost.__getitem__)
        needed = LEAST_ODDS if len(fit.causes) == 1 and not faults else LEAST_EXTRA_ODDS
        needed += sum(cause.family.inexactness * lost[cause.name] for cause in fit.causes if cause.name != weakest)
        if lost[weakest] >= needed:
            return fit, without
        fit = without[weakest]
