"""Adequacy: whether anything is left after the named causes, and what it depends on.

A generic basis of the motion, the angle and time, per channel, is tested by the same evidence as the named effects,
with the drive and the named causes projected out; what the generic basis is blind to has tests of its own
(`gfimu.diagnosis.residual_tests`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.causes import Cause, effects_of_run
from gfimu.diagnosis.evidence import log_evidence, log_evidence_each
from gfimu.diagnosis.fit import Fit
from gfimu.diagnosis.linearisation import Linearisation
from gfimu.diagnosis.parallel import each_apart, over_segments
from gfimu.diagnosis.residual_tests import (
    REFERENCE,
    LeftOver,
    changing_noise,
    judges_reference,
    jumps,
    lines,
    one_curve,
)
from gfimu.diagnosis.segment import Segment
from gfimu.diagnosis.signatures import cause_columns
from gfimu.generic_basis import FUNCTIONS, Motion
from gfimu.world_model import BasisUnits, Effect, SpinState

__all__ = ["LEFT_OVER_ODDS", "dependence_left", "generic_basis", "left_over", "series_products"]

LEFT_OVER_ODDS = 10.0
"""Log odds from which what is left is called significant; one in 320 runs with nothing hidden reached it."""
_UNIT = 0.03


def generic_basis(segment: Segment, state: SpinState) -> tuple[list[str], NDArray[np.float64]]:
    """Return names and values (n, k) of smooth functions of rate, acceleration, angle and time, of unit rms."""
    units = BasisUnits(
        max(float(np.abs(state.rate).max()), 1e-6),
        max(float(np.abs(state.acceleration).max()), 1e-6),
        max(segment.run.duration, 1e-9),
    )
    motion = Motion.of(state, segment.run.t - segment.run.t[0], units)
    columns = {name: function(motion) for name, function in FUNCTIONS.items()}
    columns["jerk"] = np.gradient(motion.acceleration)
    values = np.column_stack(list(columns.values()))
    values = values - values.mean(axis=0)
    size = np.sqrt(np.mean(values**2, axis=0))
    least = np.where(np.array(list(columns)) == "jerk", 1e-12, 1e-6)
    return list(columns), values * (_UNIT / np.maximum(size, least)) * (size > least)


def left_over(
    segments: Sequence[Segment],
    fit: Fit,
    fixed: Sequence[Sequence[Effect]],
    spikes: int,
    *,
    rounded: bool = False,
    smooth: bool = True,
) -> LeftOver:
    """Find the strongest thing that the named causes leave unexplained.

    Parameters
    ----------
    segments : sequence of Segment
        The data, drives at the fit.
    fit : Fit
        The named causes.
    fixed : sequence of sequence of Effect
        Effects known beforehand, per segment.
    spikes : int
        Isolated samples that the integrity check took out.
    rounded : bool
        Whether readings are clipped or so coarse that their rounding follows the motion.
    smooth : bool
        Whether smooth functions are looked at too, which takes the most time.
    """
    channels = segments[0].model.array.channels
    candidates = [dependence_left(segments, fit, fixed), one_curve(segments, fit, fixed, channels)] if smooth else []
    # The quickest part of a walk over coarse steps is cut from its modes, and is nothing but jumps.
    cut_short = any(segment.rounding.channels and segment.levels.walk > 0.0 for segment in segments)
    for test in (lines,) if cut_short else (lines, jumps):
        each = over_segments(partial(test, fit=fit, channels=channels), segments, fixed)
        # Each stretch is one more place to find something by chance.
        candidates += [replace(one, log_odds=one.log_odds - np.log(len(segments))) for one in each]
    if not rounded:
        candidates.append(changing_noise(segments, fit, fixed))
    if spikes > max(3, 1e-4 * sum(segment.weight_mask.size for segment in segments)):
        candidates.append(LeftOver(10.0 * spikes, f"{spikes} isolated samples far off their neighbours", {}))
    return max(candidates, key=lambda found: found.log_odds)


def dependence_left(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> LeftOver:
    """Score every basis function on every channel and the reference, on all channels, and each of them on all.

    What rings on the table pushes it back. A drive held for smoother than that is too smooth by a share of its jerk,
    which the reference shows: beside a mode whose ringing the drive knows, that is no sign of anything else.
    """
    channels = segments[0].model.array.channels

    def products(
        segment: Segment, known: Sequence[Effect]
    ) -> tuple[list[str], NDArray[np.float64], NDArray[np.float64]]:
        line = segment.linearise([*known, *effects_of_run(fit.causes, segment.model.array, segment.index)])
        names, basis = generic_basis(segment, line.state)
        return names, *series_products(segment, line, basis, fit.causes, known)

    each = each_apart(lambda row: products(*row), list(zip(segments, fixed, strict=True)))
    names = each[0][0]
    gram = np.sum([part for _, part, _ in each], axis=0)
    score = np.sum([right for _, _, right in each], axis=0)
    count = len(names)
    observed = len(channels)
    series = [f"channel {name}" for name in channels]
    if all(judges_reference(segment) for segment in segments):
        series.append(REFERENCE)
    total = count * len(series)
    gram, score = gram[:total, :total], score[:total]
    present = [*fixed[0], *effects_of_run(fit.causes, segments[0].model.array, segments[0].index)]
    if segments[0].ringing and segments[0].felt_modes(present) and series[-1] == REFERENCE:
        jerk = (len(series) - 1) * count + names.index("jerk")
        gram[jerk], gram[:, jerk], score[jerk] = 0.0, 0.0, 0.0
    diagonal = np.maximum(gram.diagonal(), 0.0)
    usable = diagonal > 1e-9
    single = log_evidence_each(diagonal, score, np.zeros(total, dtype=bool)) - np.log(total)
    single[~usable] = -np.inf
    best = int(np.argmax(single))
    followed = names[best % count]
    found = LeftOver(float(single[best]), f"{series[best // count]} depends on {followed}", {}, dependence=followed)
    chosen = [best]
    for function in range(count):
        places = np.arange(observed) * count + function
        value = log_evidence(gram[np.ix_(places, places)], score[places]) - np.log(count)
        if value > found.log_odds + 2.0:
            strong = [channels[c] for c in np.argsort(-np.abs(score[places] / np.sqrt(diagonal[places] + 1e-9)))[:4]]
            told = f"several channels (strongest {', '.join(strong)}) depend on {names[function]}"
            found = LeftOver(float(value), told, {}, dependence=names[function])
            chosen = list(places)
    for number, told in enumerate(series):
        places = np.arange(number * count, (number + 1) * count)
        value = log_evidence(gram[np.ix_(places, places)], score[places]) - np.log(len(series))
        if value > found.log_odds + 5.0:
            top = places[int(np.argmax(single[places]))]
            found = LeftOver(
                float(value),
                f"{told} depends on the motion or time in a way nothing in the library has "
                f"(strongest: {names[top % count]})",
                {},
            )
            chosen = list(places)
    inner = gram[np.ix_(chosen, chosen)] + np.eye(len(chosen)) * 1e-2
    values = np.linalg.solve(inner, score[chosen])
    surrogate = {
        f"{series[place // count].removeprefix('channel ')}: {names[place % count]}": float(value * _UNIT)
        for place, value in zip(chosen, values, strict=True)
        if abs(value) > 1e-3
    }
    return replace(found, surrogate=surrogate)


def series_products(
    segment: Segment,
    line: Linearisation,
    basis: NDArray[np.float64],
    causes: Sequence[Cause],
    known: Sequence[Effect],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return G and b of functions on each series, drive and causes projected out.

    Parameters
    ----------
    segment : Segment
        The data.
    line : Linearisation
        Linearised about the causes.
    basis : ndarray, shape (n, k) or (c + 1, n, k)
        The functions, the same for each channel and the reference or each its own.
    causes : sequence of Cause
        What is there already.
    known : sequence of Effect
        Effects known beforehand.

    Returns
    -------
    gram : ndarray, shape ((c + 1) k, (c + 1) k)
        G, series by series.
    score : ndarray, shape ((c + 1) k,)
        b.
    """
    each = np.broadcast_to(basis, (line.jacobian.observations, *basis.shape[-2:]))
    masked = _masked(segment, each)
    gram, score, cross = _channelwise(segment, line, masked)
    named = cause_columns(segment, causes, known, line.prediction, shapes=True)
    if named.shape[1]:
        gram, score = _project_out(segment, line, masked, cross, gram, score, named)
    return gram, score


_Masked = list[tuple[NDArray[np.float64], NDArray[np.float64]]]


def _masked(segment: Segment, basis: NDArray[np.float64]) -> _Masked:
    """Return basis functions (c + 1, n, k) by series as its samples weigh them, (n, k) and in the slow modes (K, k).

    What is the same for several series, as for most channels, is the same object.
    """
    same = basis.strides[0] == 0  # broadcast: the same functions for every series
    found: _Masked = []
    for series, functions in enumerate(basis):
        mask = segment.row_weight[:, series]
        if not (found and same and np.array_equal(mask, segment.row_weight[:, series - 1])):
            part = functions * mask[:, None]
            found.append((part, segment.modes.of(part.T, series).T))
        else:
            found.append(found[-1])
    return found


def _channelwise(
    segment: Segment, line: Linearisation, masked: _Masked
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return G, b and X of basis functions on each channel and the reference, drive marginalised."""
    count = masked[0][0].shape[1]
    observed = line.jacobian.observations
    gram = np.zeros((count * observed, count * observed))
    score = np.zeros(count * observed)
    cross = np.zeros((segment.spline.size, count * observed))
    for channel, (part, slow) in enumerate(masked):
        if channel == 0 or part is not masked[channel - 1][0]:
            square = part.T @ part
            through = [matrix.T @ part for matrix in line.jacobian.parts]
        weight, loading = segment.inverse_variance[channel], line.jacobian.loading[:, channel]
        damped = segment.modes.share[:, [channel]] * slow
        places = slice(channel * count, (channel + 1) * count)
        gram[places, places] = weight * (square - slow.T @ damped)
        score[places] = weight * (part.T @ line.residual[:, channel] - damped.T @ line.slow_residual[:, channel])
        used = np.flatnonzero(loading)
        if len(used):
            cross[:, places] = weight * (sum(loading[r] * through[r] for r in used) - line.slow.of(channel) @ damped)
    eliminated = line.drive.eliminate(cross)
    gram -= eliminated.T @ eliminated
    score -= eliminated.T @ line.drive.forward
    return gram, score, eliminated


def _project_out(
    segment: Segment,
    line: Linearisation,
    masked: _Masked,
    eliminated: NDArray[np.float64],
    gram: NDArray[np.float64],
    score: NDArray[np.float64],
    named: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Make the basis orthogonal to the named causes' columns."""
    inner, right, crossed = segment.whitened_products(line, named)
    count = masked[0][0].shape[1]
    mixed = np.zeros((named.shape[1], gram.shape[0]))
    for channel, (part, slow) in enumerate(masked):
        reaching = np.flatnonzero(named[channel].any(axis=1))
        if not len(reaching):
            continue
        places = slice(channel * count, (channel + 1) * count)
        columns = named[channel, reaching]  # (P, n)
        mixed[reaching, places] = segment.inverse_variance[channel] * (
            columns @ part - segment.modes.of(columns, channel) @ (segment.modes.share[:, [channel]] * slow)
        )
    mixed -= crossed.T @ eliminated
    gain = np.linalg.solve(inner + np.eye(len(right)) * 1e-6 * (1 + inner.diagonal().mean()), mixed)
    return gram - mixed.T @ gain, score - gain.T @ right
