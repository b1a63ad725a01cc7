"""Held-out data: whether the extension predicts what the fit never saw, and what it is worth there.

With a second recording the causes are fitted to the first and judged on the second. With one, it is cut into blocks of
some seconds, and the odd and the even blocks are predicted from each other. The drive of the held-out stretch is
always unknown and marginalised; what came before a block is simulated with the drive of the whole run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from gfimu.diagnosis.causes import Cause, effects_of_run
from gfimu.diagnosis.coloured_noise import NoiseLevels
from gfimu.diagnosis.drive import smooth_rate
from gfimu.diagnosis.evidence import SCALES, inverse, likeliest_scale
from gfimu.diagnosis.fit import SMALLEST_POSITIVE, Fit
from gfimu.diagnosis.refinement import refine, refine_each
from gfimu.diagnosis.segment import Segment
from gfimu.diagnosis.verdict.verdict import Gain
from gfimu.geometry.array import AccelerometerArray
from gfimu.world_model import Effect, is_of_one_recording

__all__ = ["BLOCK_DURATION", "Holdout", "gate_gains", "held_out_gain", "split_segments"]

BLOCK_DURATION = 8.0
"""About how long a held-out block is, s."""
_ITERATIONS = 8
_FOLLOWED = 0.6  # over the spacing of the knots, Hz: what is faster the drive does not follow
_CLIP = 9.0  # squares in variances, 3 σ
_CLIPPED = 0.995007  # expectation of a squared standard normal that is clipped there
_SIGNIFICANT = 4.0  # standard errors of the floor from which an excess counts
_SLACK = 3.0  # standard errors that the floor may be raised by
_LEAST_EXCESS = 0.01  # of the floor: what the spectrum of slow noise may be wrong by


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

    Errors are compared in the metric of the fit: squares whitened by the learnt noise, white, slow and a random walk
    where one was found, the drive marginalised. Their expectation is the number of observations times the white noise
    that the held-out data themselves show at frequencies which the drive can't follow, so that slow noise and an error
    of its learnt level are no excess.

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
    measured: list[_Measured] = []
    for pair in pairs:
        trained = refine(pair.train, causes, pair.train_fixed, iterations=4, shapes=False)
        expected = _expected(trained, pair.train[0].model.array)
        left = trained.objective / max(sum(int(segment.weight_mask.sum()) for segment in pair.train), 1)
        for segment, known in zip(pair.test, pair.test_fixed, strict=True):
            nominal = [effect for effect in known if not any(_same(effect, other) for other in constant)]
            measured.append(_measured(segment, nominal, known, expected, left))
    samples = sum(one.samples for one in measured)
    if samples == 0:
        return Gain()
    before, after, carried = (
        float(sum(getattr(one, name) for one in measured)) for name in ("before", "after", "carried")
    )
    floor, fitted = (float(sum(getattr(one, name) for one in measured)) for name in ("floor", "fitted"))
    error = float(np.sqrt(sum(one.floor_variance for one in measured)))
    # What the fitted part leaves within the error of the floor is noise that was learnt too low.
    floor += float(np.clip(fitted - floor, 0.0, _SLACK * error))
    share, std = _share(before - floor, after - floor, error, floor)
    blocks = np.concatenate([one.blocks for one in measured])
    rms = np.sqrt(np.sum([one.squares for one in measured], axis=0) / samples)
    rates = np.sqrt(np.mean(np.square([one.rates for one in measured]), axis=0))
    drifts = np.mean([one.drifts for one in measured], axis=0)
    return Gain(
        held_out=label,
        rms_before=float(rms[0]),
        rms_after=float(rms[1]),
        share_of_excess_removed=share,
        log_likelihood_per_sample=0.5 * (before - after) / sum(one.rows for one in measured),
        log_likelihood_std=float(blocks.std(ddof=1) / np.sqrt(len(blocks))) if len(blocks) > 1 else float("nan"),
        rate_rmse_before=float(rates[0]),
        rate_rmse_after=float(rates[1]),
        drift_before=float(drifts[0]),
        drift_after=float(drifts[1]),
        share_std=std,
        share_in_any_recording=_share(before - floor, carried - floor, error, floor)[0],
    )


@dataclass(frozen=True)
class _Measured:
    """A held-out stretch: misfits of the given and the extended simulation, and what noise alone would leave.

    Parameters
    ----------
    before, after, carried : float
        Whitened squares, the drive marginalised: as given, extended, and extended without what belongs to one
        recording.
    floor, floor_variance : float
        What noise leaves of them, and its variance.
    fitted : float
        What as many observations of the fitted part leave.
    squares : tuple of float
        Sums of squares of the channels before and after, (m/s²)².
    samples, rows : int
        Readings in them, and samples.
    blocks : ndarray, shape (b,)
        Gain of log-likelihood per sample in blocks of a second.
    rates, drifts : tuple of float
        Errors of rate, rad/s, and drift, m, before and after.
    """

    before: float
    after: float
    carried: float
    floor: float
    floor_variance: float
    fitted: float
    squares: tuple[float, float]
    samples: int
    rows: int
    blocks: NDArray[np.float64]
    rates: tuple[float, float]
    drifts: tuple[float, float]


def _expected(fit: Fit, array: AccelerometerArray) -> tuple[Cause, ...]:
    """Return causes with the sizes to expect after a fit: the posterior mean under a prior of the likeliest scale.

    A size that one part of a recording leaves open comes out of its fit as anything, and would be extrapolated to the
    other part. The prior of the fit is wide enough for a gross error; how large a cause's sizes are, those of them
    that are seen tell.
    """
    if not fit.causes:
        return fit.causes
    ends = np.cumsum([len(cause.coordinates) for cause in fit.causes])
    places = np.split(np.arange(ends[-1]), ends[:-1])
    precision = np.empty(ends[-1])
    for mine in places:
        others = np.setdiff1d(np.arange(ends[-1]), mine)
        free = fit.gram[np.ix_(others, others)] + np.eye(len(others)) / SCALES[-1] ** 2
        taken = np.linalg.solve(free, fit.gram[np.ix_(others, mine)]).T  # of the others', as they follow
        gram = fit.gram[np.ix_(mine, mine)] - taken @ fit.gram[np.ix_(others, mine)]
        precision[mine] = likeliest_scale(gram, fit.score[mine] - taken @ fit.score[others]) ** -2
    mean = inverse(fit.gram + np.diag(precision)) @ fit.score
    causes = []
    for cause, mine in zip(fit.causes, places, strict=True):
        sizes = np.where(cause.positive(array), np.maximum(mean[mine], SMALLEST_POSITIVE), mean[mine])
        causes.append(cause.at(np.minimum(sizes, cause.most(array))))
    return tuple(causes)


def _measured(
    segment: Segment, nominal: Sequence[Effect], known: Sequence[Effect], causes: Sequence[Cause], left: float
) -> _Measured:
    """Measure causes on a stretch that they were not fitted to.

    ``left`` is what they leave per observation on the fitted part: the floor where readings are coarse, whose
    likelihood is no sum of squares.
    """
    array, kept = segment.model.array, segment.coefficients
    effects = [*known, *effects_of_run(causes, array, segment.index)]
    carried = [cause for cause in causes if not is_of_one_recording(cause.family)]
    squares, misfits, whites = [], [], []
    use = segment.weight_mask[:, :-1]
    for chosen in (nominal, effects):
        segment.coefficients = kept
        misfits.append(_misfit(segment, chosen))
        whites.append(segment.basis.whitened(segment.working_residual(chosen), segment.levels) / segment.levels.white)
        squares.append(float(np.sum(_without_walk(segment, chosen)[use] ** 2)))
    rates, drifts = _motion_errors(segment, nominal, effects)
    other = misfits[1]
    if len(carried) < len(causes):
        segment.coefficients = kept
        other = _misfit(segment, [*known, *effects_of_run(carried, array, segment.index)])
    segment.coefficients = kept
    floor, variance = min(_floor(segment, white) for white in whites)
    fitted = left * float(segment.weight_mask.sum())
    if segment.rounding.coarse:
        floor = fitted
    return _Measured(
        before=misfits[0],
        after=misfits[1],
        carried=other,
        floor=floor,
        floor_variance=variance,
        fitted=fitted,
        squares=(squares[0], squares[1]),
        samples=int(use.sum()),
        rows=len(segment.run.t),
        blocks=_blocks(0.5 * np.sum(whites[0] ** 2 - whites[1] ** 2, axis=1), segment),
        rates=rates,
        drifts=drifts,
    )


def _misfit(segment: Segment, effects: Sequence[Effect]) -> float:
    """Move the drive to its posterior under these effects; return the whitened squares with it marginalised."""
    fit = refine([segment], (), [effects], iterations=_ITERATIONS)
    segment.coefficients = fit.drives[0]
    return fit.objective


def _without_walk(segment: Segment, effects: Sequence[Effect]) -> NDArray[np.float64]:
    """Return the residual of the channels (n, c), m/s², without the excess of a random walk that was found."""
    levels = segment.levels
    residual = segment.residual(effects)
    if levels.walk > 0.0:
        residual = segment.basis.whitened(residual, NoiseLevels(levels.white, np.zeros(len(levels.white)), levels.walk))
    return residual[:, :-1]


def _floor(segment: Segment, white: NDArray[np.float64]) -> tuple[float, float]:
    """Return what noise leaves of whitened residuals (n, c + 1), and its variance.

    The white noise is that of the fast half, which the drive does not follow; squares are clipped, so that a line does
    not count as noise.
    """
    count = len(white)
    first = min(int(2 * count * segment.run.sample_period * _FOLLOWED / segment.spline.spacing), count // 2)
    fast = np.minimum(segment.basis.transform(white)[first:] ** 2 / segment.weight_mask.mean(axis=0).clip(1e-3), _CLIP)
    level = fast.mean(axis=0) / _CLIPPED
    valid = segment.weight_mask.sum(axis=0)
    slow = valid * first / count
    return float(valid @ level), float(np.sum(2.0 * slow * (1.0 + slow / (valid - slow).clip(1.0))))


def _share(before: float, after: float, error: float, floor: float) -> tuple[float, float]:
    """Return the share of an excess that is removed and its standard error; NaN where there is no excess.

    ``error`` is the standard error of the floor, which both excesses share.
    """
    if before < max(_SIGNIFICANT * error, _LEAST_EXCESS * floor):
        return float("nan"), float("nan")
    share = 1.0 - max(after, 0.0) / before
    # Beside the floor, the noise correlates with what is there to be removed and with what is left.
    variance = (share * error) ** 2 + 4.0 * max(after, 0.0) + 4.0 * before * (1.0 - share) ** 2
    return share, float(np.sqrt(variance)) / before


def _same(one: Effect, other: Effect) -> bool:
    """Tell whether an effect is another, or the same fault found in another recording."""
    return one is other or (one.place == "data" and one.name == other.name)


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
