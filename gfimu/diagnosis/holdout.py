"""Held-out data: whether the extension predicts what the fit never saw, and what it is worth there.

With a second recording the causes are fitted to the first and judged on the second. With one, it is cut into blocks of
some seconds, and the odd and the even blocks are predicted from each other. The drive of the held-out stretch is
always unknown and marginalised.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from gfimu.diagnosis.causes import Cause, effects_of_run
from gfimu.diagnosis.drive import smooth_rate
from gfimu.diagnosis.fit import Fit
from gfimu.diagnosis.model import Effect
from gfimu.diagnosis.refinement import refine, refine_each
from gfimu.diagnosis.segment import Segment
from gfimu.diagnosis.verdict import Gain

__all__ = ["BLOCK_DURATION", "Holdout", "gate_gains", "held_out_gain", "split_segments"]

BLOCK_DURATION = 8.0
"""About how long a held-out block is, s."""
_ITERATIONS = 8


@dataclass(frozen=True)
class Holdout:
    """Pairs of (fitted stretches, held-out stretches) with the effects known beforehand in each."""

    train: list[Segment]
    train_fixed: list[list[Effect]]
    test: list[Segment]
    test_fixed: list[list[Effect]]


def split_segments(
    segments: Sequence[Segment],
    fixed: Sequence[Sequence[Effect]],
    causes: Sequence[Cause] = (),
    *,
    duration: float = BLOCK_DURATION,
) -> list[Holdout]:
    """Split every segment into an even number of blocks, alternately of one part and of the other; pair them both ways.

    Parameters
    ----------
    segments : sequence of Segment
        The data.
    fixed : sequence of sequence of Effect
        Effects known beforehand, per segment.
    causes : sequence of Cause
        What was found; a slow clock asks for the motion beyond the ends of a block.
    duration : float
        About how long a block is, s; infinite for halves.
    """
    parts: list[list[Segment]] = [[], []]
    known: list[list[list[Effect]]] = [[], []]
    for segment, effects in zip(segments, fixed, strict=True):
        present = [*effects, *effects_of_run(causes, segment.model.array, segment.index)]
        pairs = max(1, round(segment.run.duration / (2 * duration)))
        edges = np.linspace(0, len(segment.run.t), 2 * pairs + 1).astype(int)
        for place, (start, stop) in enumerate(pairwise(edges)):
            rows = segment.run.rows(int(start), int(stop))
            block = Segment(segment.model, rows, segment.index, segment.start, stretches=segment.stretches)
            block.adopt(segment, present)
            parts[place % 2].append(block)
            known[place % 2].append(list(effects))
    return [Holdout(parts[0], known[0], parts[1], known[1]), Holdout(parts[1], known[1], parts[0], known[0])]


def gate_gains(
    fit: Fit, without: dict[str, Fit], pairs: Sequence[Holdout], *, other_recording: bool = False
) -> dict[str, float]:
    """Return the log predictive gain of each cause on held-out data, the other causes kept.

    That of both parts together less that of the fitted part. The halves of one run are whitened as one block for the
    joint evidence, so that slow noise common to both does not count as a repetition; many short blocks would each
    count it anew.

    Parameters
    ----------
    fit : Fit
        The causes, fitted to all that is not another recording.
    without : dict of str to Fit
        The best fit without each.
    pairs : sequence of Holdout
        The halves both ways, or the runs fitted and the runs kept.
    other_recording : bool
        Whether the held-out data are other recordings.
    """
    if not without:
        return {}
    gains: dict[str, list[float]] = {name: [] for name in without}
    for pair in pairs:
        every, known = [*pair.train, *pair.test], [*pair.train_fixed, *pair.test_fixed]
        fits = [fit, *without.values()]
        full, *rest = _evidence_of(pair.train, fits, pair.train_fixed)
        joint, *both = _evidence_of(every, fits, known) if other_recording else [other.log_evidence for other in fits]
        for name, part, whole in zip(without, rest, both, strict=True):
            gains[name].append((joint - whole) - (full - part))
    return {name: float(np.mean(values)) for name, values in gains.items()}


def _evidence_of(segments: Sequence[Segment], fits: Sequence[Fit], fixed: Sequence[Sequence[Effect]]) -> list[float]:
    """Return the evidence of each set of causes on some data, shapes held."""
    sets = [fit.causes for fit in fits]
    refined = refine_each(segments, sets, fixed, [None] * len(sets), iterations=_ITERATIONS, shapes=False)
    return [fit.log_evidence for fit in refined]


def held_out_gain(causes: Sequence[Cause], pairs: Sequence[Holdout], constant: Sequence[Effect], *, label: str) -> Gain:
    """Measure what the causes, fitted on one part, are worth on the other.

    Parameters
    ----------
    causes : sequence of Cause
        The causes; their shapes are kept, their sizes refitted on each training part.
    pairs : sequence of Holdout
        Which part is fitted and which is predicted.
    constant : sequence of Effect
        Causes that are not refitted (wiring, ranges).
    label : str
        What was held out.
    """
    before, after, count = 0.0, 0.0, 0
    scaled_before, scaled_after, floor = 0.0, 0.0, 0.0
    likelihoods: list[NDArray[np.float64]] = []
    rates: list[tuple[float, float]] = []
    drifts: list[tuple[float, float]] = []
    for pair in pairs:
        trained = refine(pair.train, causes, pair.train_fixed, iterations=4, shapes=False)
        for segment, known in zip(pair.test, pair.test_fixed, strict=True):
            array = segment.model.array
            effects = [*known, *effects_of_run(trained.causes, array, segment.index)]
            nominal = [effect for effect in known if not any(_same(effect, other) for other in constant)]
            plain = segment.residual(nominal)[:, :-1]
            kept = segment.coefficients
            plain_likelihood = _scaled(segment, nominal)
            segment.coefficients = kept
            extended_likelihood = _scaled(segment, effects)
            left = segment.residual(effects)[:, :-1]
            use = segment.weight_mask[:, :-1]
            before += float(np.sum(plain[use] ** 2))
            after += float(np.sum(left[use] ** 2))
            scaled_before += float(plain_likelihood.sum())
            scaled_after += float(extended_likelihood.sum())
            ratio = 1.0 + 0.6 * (segment.levels.flicker / segment.levels.white) ** 2
            floor += float(np.sum(segment.weight_mask * ratio))
            count += int(use.sum())
            likelihoods.append(0.5 * _blocks(plain_likelihood - extended_likelihood, segment))
            rate, drift = _motion_errors(segment, nominal, effects)
            rates.append(rate)
            drifts.append(drift)
            segment.coefficients = kept
    if count == 0:
        return Gain()
    # In units of the noise, channels and reference together: a wrong reference shows in the channels only through
    # the drive, which each model fits as well as it can.
    excess = scaled_before - floor
    share = 1.0 - max(scaled_after - floor, 0.0) / excess if excess > 0.02 * floor else float("nan")
    blocks = np.concatenate(likelihoods)
    return Gain(
        label,
        float(np.sqrt(before / count)),
        float(np.sqrt(after / count)),
        float(min(share, 1.0)),
        float(blocks.mean()),
        float(blocks.std(ddof=1) / np.sqrt(len(blocks))) if len(blocks) > 1 else float("nan"),
        *(float(np.sqrt(np.mean(np.square(column)))) for column in zip(*rates, strict=True)),
        *(float(np.mean(column)) for column in zip(*drifts, strict=True)),
    )


def _same(one: Effect, other: Effect) -> bool:
    """Tell whether an effect is another, or the same fault found in another recording."""
    return one is other or (one.place == "data" and one.name == other.name)


def _scaled(segment: Segment, effects: Sequence[Effect]) -> NDArray[np.float64]:
    """Move the drive to its posterior under these effects; return the summed squares per sample in white noise."""
    segment.coefficients = refine([segment], (), [effects], iterations=_ITERATIONS).drives[0]
    scaled = segment.working_residual(effects) / segment.levels.white
    return np.asarray(np.sum(scaled**2, axis=1))


def _blocks(values: NDArray[np.float64], segment: Segment) -> NDArray[np.float64]:
    """Return means over blocks of a second."""
    size = max(int(1.0 / segment.run.sample_period), 1)
    whole = len(values) // size * size
    return np.asarray(values[:whole].reshape(-1, size).mean(axis=1)) if whole else values[:1]


def _motion_errors(
    segment: Segment, nominal: Sequence[Effect], effects: Sequence[Effect]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Rate against the reference and position drift, with readings as they are and corrected by the extension."""
    run = segment.run
    pseudo_inverse = np.linalg.pinv(segment.model.array.regression_matrix)
    reference = smooth_rate(run, is_angle=segment.is_angle)
    believed = segment.predict(nominal)[:, :-1]
    correction = segment.predict(effects)[:, :-1] - believed
    measured = np.where(run.valid, run.readings, believed + correction)
    truth = segment.motion(effects).at(run.t)
    results = []
    for readings in (measured, measured - correction):
        alpha = (readings - believed) @ pseudo_inverse.T
        rate = reference[0] + cumulative_trapezoid(alpha[:, 2] + truth.acceleration, run.t, initial=0.0)
        error = alpha[:, 3:]
        cos, sin = np.cos(truth.angle), np.sin(truth.angle)
        world = np.column_stack(
            [cos * error[:, 0] - sin * error[:, 1], sin * error[:, 0] + cos * error[:, 1], error[:, 2]]
        )
        velocity = cumulative_trapezoid(world, run.t, axis=0, initial=0.0)
        position = cumulative_trapezoid(velocity, run.t, axis=0, initial=0.0)
        results.append((float(np.sqrt(np.mean((rate - reference) ** 2))), float(np.linalg.norm(position[-1]))))
    return (results[0][0], results[1][0]), (results[0][1], results[1][1])
