"""The search for causes: screen linearly, refine with the full simulation, relearn the noise, until nothing changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from gfimu.diagnosis.causes import Cause, effects_of_run
from gfimu.diagnosis.coloured_noise import NoiseLevels, estimate_flicker, white_level
from gfimu.diagnosis.model import Effect, WorldModel
from gfimu.diagnosis.refinement import Fit, refine
from gfimu.diagnosis.run import Run
from gfimu.diagnosis.search import search
from gfimu.diagnosis.segment import Segment
from gfimu.diagnosis.signatures import SignatureSet, hypotheses, plan_signatures, signature_columns

__all__ = ["Explanation", "explain", "make_segments", "screen"]

Report = Callable[[float, str], None]

SEGMENT_DURATION = 64.0
_ROUNDS = 6
_REFINED = 6
_MOST_CAUSES = 4
_CLOSE = 12.0
_GROSS = 150.0
_ITERATIONS = 12


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
        for start, stop in zip(edges[:-1], edges[1:], strict=True):
            segments.append(Segment(model, run.rows(int(start), int(stop)), index, float(run.t[0])))
    return segments


def screen(segments: Sequence[Segment], base: Fit, fixed: Sequence[Sequence[Effect]], runs: int) -> SignatureSet:
    """Compute all signatures about a base and their normal equations relative to no effects."""
    model = segments[0].model
    array = model.array
    for segment, drive in zip(segments, base.drives, strict=True):
        segment.coefficients = drive
    linear = [
        segment.linearise([*known, *effects_of_run(base.causes, array, segment.index)])
        for segment, known in zip(segments, fixed, strict=True)
    ]
    signatures, count = plan_signatures(model.families(), segments, linear, base.causes, runs)
    gram, score = np.zeros((count, count)), np.zeros(count)
    for segment, line, known in zip(segments, linear, fixed, strict=True):
        columns, numbers = signature_columns(segment, signatures, base.causes, known)
        part, part_score, _ = segment.whitened_products(line, columns)
        gram[np.ix_(numbers, numbers)] += part
        score[numbers] += part_score
    at = np.zeros(count)
    for cause in base.causes:
        signature = next(one for one in signatures if one.family.name == cause.name)
        at[signature.columns] = cause.mixing @ cause.coordinates
    return SignatureSet(tuple(signatures), gram, score + gram @ at, tuple(hypotheses(signatures, array, runs)))


def learn_noise(
    segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]], *, walk: float | None = None
) -> float:
    """Re-estimate the noise of every segment from what the fit leaves; returns the largest relative change."""
    array = segments[0].model.array
    change = 0.0
    coefficients, whites = [], []
    for segment, known, drive in zip(segments, fixed, fit.drives, strict=True):
        segment.coefficients = drive
        effects = [*known, *effects_of_run(fit.causes, array, segment.index)]
        line = segment.linearise(effects)
        segment.move_drive(line)
        left = segment.residual(effects)
        coefficients.append(segment.basis.transform(left))
        # Above this frequency the drive has no freedom to follow the noise.
        slowest = 0.6 / segment.spline.spacing
        whites.append(white_level(coefficients[-1], slowest, segment.run.sample_period))
    for index in {segment.index for segment in segments}:
        mine = [place for place, segment in enumerate(segments) if segment.index == index]
        white = np.sqrt(np.mean([whites[place] ** 2 for place in mine], axis=0))
        floor = segments[mine[0]].model.expected_noise(1.0 / segments[mine[0]].run.sample_period).quantum / np.sqrt(12)
        white[:-1] = np.maximum(white[:-1], 0.5 * floor)
        flicker = np.sqrt(
            np.mean(
                [estimate_flicker(coefficients[place], white, segments[place].basis) ** 2 for place in mine], axis=0
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
            segments[place].set_levels(NoiseLevels(white, flicker, old.walk if walk is None else walk))
            segments[place].prepare_weights()
    return change


def tune_drives(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> None:
    """Let the data choose how rough the drive of every segment may be."""
    array = segments[0].model.array
    for segment, known, drive in zip(segments, fixed, fit.drives, strict=True):
        segment.coefficients = drive
        segment.tune_roughness([*known, *effects_of_run(fit.causes, array, segment.index)])


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
    best = refine(segments, start, fixed, iterations=6 if start else 2)
    tried: dict[frozenset[tuple[str, str]], Fit] = {}
    signatures = None
    settled_before = False
    for round_number in range(_ROUNDS):
        tell(0.1 + 0.8 * round_number / _ROUNDS, f"search {round_number + 1}")
        signatures = screen(segments, best, fixed, runs)
        candidates, blocks = search(signatures, most=max(2, min(len(best.causes) + 1, _MOST_CAUSES)), keep=24)
        fits = {best.key: best}
        gross = candidates[0].log_odds > _GROSS
        leading = candidates[:_REFINED]
        if gross and not settled_before:
            # A large effect is far from linear: the right cause may be well down the linear list.
            singles = [candidate for candidate in candidates if len(candidate.members) == 1]
            leading = [*candidates[:3], *(one for one in singles[:_REFINED] if one not in candidates[:3])]
        for candidate in leading:
            causes = [
                signatures.hypotheses[number].cause(coordinates)
                for number, coordinates in zip(candidate.members, blocks.coordinates(candidate.members), strict=True)
            ]
            key = frozenset(cause.key for cause in causes)
            close = candidate.log_odds > candidates[0].log_odds - _CLOSE
            if key in fits or not (close or (gross and len(causes) == 1 and key not in tried)):
                continue
            known = tried.get(key)
            if known is not None:
                causes = list(known.causes)
            fits[key] = refine(segments, causes, fixed, drives=best.drives, iterations=_ITERATIONS)
        tried |= fits
        winner = max(fits.values(), key=lambda fit: fit.log_posterior)
        settled = winner.key == best.key
        best = winner
        change = learn_noise(segments, best, fixed)
        if settled:
            tune_drives(segments, best, fixed)
        best = refine(segments, best.causes, fixed, drives=best.drives, iterations=2)
        if settled and settled_before:
            break
        settled_before = settled
    tell(0.9, "compare")
    nothing = refine(segments, (), fixed, drives=best.drives, iterations=3) if best.causes else best
    rivals = [
        refine(segments, fit.causes, fixed, drives=best.drives, iterations=2)
        for key, fit in tried.items()
        if key != best.key and fit.causes and fit.log_posterior > best.log_posterior - _CLOSE - 10.0
    ]
    rivals.sort(key=_posterior, reverse=True)
    assert signatures is not None
    return Explanation(
        best,
        tuple(rivals),
        nothing,
        tuple(segments),
        tuple(tuple(known) for known in fixed),
        signatures,
    )
