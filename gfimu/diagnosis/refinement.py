"""Refinement: a set of causes fitted with the full simulation, drive, sizes and shapes together.

Gauss–Newton on the drive-marginalised normal equations; the evidence is Laplace's at the optimum.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.causes import LEVEL_ERROR, Cause, effects_of_run
from gfimu.diagnosis.evidence import SCALES, inverse, log_evidence
from gfimu.diagnosis.fit import SMALLEST_POSITIVE, Fit, Start
from gfimu.diagnosis.parallel import each_apart, over_segments
from gfimu.diagnosis.search import EXTRA_CAUSE
from gfimu.diagnosis.segment import Segment
from gfimu.diagnosis.signatures import ANGLES, cause_columns, shape_moved
from gfimu.geometry.array import AccelerometerArray
from gfimu.world_model import Effect

__all__ = ["FAIR_FIT", "refine", "refine_each"]

_SHAPE_LIMIT = 0.3
_SHAPE_PRIOR = 0.7
_TOLERANCE = 0.3
_DRIVE_SHARE = 0.1
_UPHILL = 0.5
_STALLED = 0.5
_SHARES = (1.0, 0.3, 0.08)
FAIR_FIT = 1.6
"""Misfit per observation, in variances, above which something large is still missing."""


def refine(
    segments: Sequence[Segment],
    causes: Sequence[Cause],
    fixed: Sequence[Sequence[Effect]],
    *,
    drives: Sequence[NDArray[np.float64]] | None = None,
    iterations: int = 6,
    shapes: bool = True,
    other: Start | None = None,
    rippling: bool = False,
) -> Fit:
    """Fit a set of causes with the full simulation.

    Parameters
    ----------
    segments : sequence of Segment
        The data; their drives are used as start and left as they were.
    causes : sequence of Cause
        The set, at starting coordinates.
    fixed : sequence of sequence of Effect
        Effects of each segment's run that are not fitted.
    drives : sequence of ndarray, optional
        Starting drives.
    iterations : int
        Most Gauss–Newton steps.
    shapes : bool
        Whether shape parameters are fitted too.
    other : Start, optional
        Another start of the same set, taken if the simulation comes closer to the data there.
    rippling : bool
        Whether the drive's derivative knows how a torque ripple answers the drive, which takes several times as long.
    """
    kept = [segment.coefficients for segment in segments]
    ringing = [segment.ringing for segment in segments]
    try:
        array = segments[0].model.array
        start = _State(_allowed(causes, array), tuple(kept if drives is None else drives))
        if other is not None:
            second = _State(_allowed(other.causes, array), tuple(other.drives))
            start = min(start, second, key=partial(_energy, segments, fixed))
        if not shapes:
            start = replace(start, causes=tuple(replace(cause, frozen=True) for cause in start.causes))
        if iterations and _is_held(segments, fixed, start) and _is_far(segments, fixed, start):
            # Far off, what a play holds is of the wrong instants: as if it held nothing comes nearer, and is cheaper.
            for segment in segments:
                segment.holding = False
            start = _descend(segments, fixed, start, iterations).state
            for segment in segments:
                segment.holding = True
        for segment in segments:
            segment.rippling = rippling
        point = _descend(segments, fixed, start, iterations)
        if rippling or (any(ringing) and _rings(segments, fixed, point.state)):
            # A mode leaves less freedom to a drive that it rings for, which a prior learnt with that mode would give
            # back: the volumes that sets are compared by are those of a derivative that does not know.
            for segment in segments:
                segment.ringing = segment.rippling = False
            point = replace(point, log_volume=_evaluate(segments, fixed, point.state).log_volume)
        return _result(segments, point)
    finally:
        for segment, drive, told in zip(segments, kept, ringing, strict=True):
            segment.coefficients, segment.ringing = drive, told
            segment.holding, segment.rippling = True, False


def refine_each(
    segments: Sequence[Segment],
    sets: Sequence[Sequence[Cause]],
    fixed: Sequence[Sequence[Effect]],
    drives: Sequence[Sequence[NDArray[np.float64]] | None],
    *,
    iterations: int = 6,
    shapes: bool = True,
    others: Sequence[Start | None] = (),
) -> list[Fit]:
    """Fit several sets of causes, each from its own drives, at once."""

    def fitted(task: tuple[Sequence[Cause], Sequence[NDArray[np.float64]] | None, Start | None]) -> Fit:
        causes, start, other = task
        # A fit moves the drives of its segments while it goes.
        mine = [copy(segment) for segment in segments]
        return refine(mine, causes, fixed, drives=start, iterations=iterations, shapes=shapes, other=other)

    tasks = list(zip(sets, drives, others or [None] * len(sets), strict=True))
    return each_apart(fitted, tasks)


@dataclass(frozen=True)
class _State:
    """Causes and drives of every segment."""

    causes: tuple[Cause, ...]
    drives: tuple[NDArray[np.float64], ...]


@dataclass(frozen=True)
class _Point:
    """A state with its normal equations, the Gauss–Newton step from it, and its energy with the drives held."""

    state: _State
    objective: float
    gram: NDArray[np.float64]
    score: NDArray[np.float64]
    step: NDArray[np.float64]
    moves: tuple[NDArray[np.float64], ...]
    expected: float
    log_volume: float
    responses: tuple[NDArray[np.float64], ...]
    energy: float

    @property
    def value(self) -> float:
        """Misfit and prior energy, the drives at their best in a linear world."""
        return self.objective + _prior_energy(self.state.causes)

    def moved(self, scale: float, array: AccelerometerArray, *, held: bool = False) -> _State:
        """Return the state after a share of the step, its drives held where asked."""
        drives = self.state.drives
        if not held:
            drives = tuple(drive + scale * move for drive, move in zip(drives, self.moves, strict=True))
        return _State(_moved(self.state.causes, scale * self.step, array), drives)


@dataclass(frozen=True)
class _Stretch:
    """What a step needs of a linearised segment; the rest of it would fill the memory in long recordings.

    Parameters
    ----------
    gram, score : ndarray, shape (P, P) and (P,)
        Normal equations of the causes' columns, drive marginalised.
    objective, log_volume, distance : float
        As of `DriveElimination`.
    drive_step : ndarray, shape (m,)
        The step of the drive, the causes held.
    response : ndarray, shape (m, P)
        How the drive follows each column.
    """

    gram: NDArray[np.float64]
    score: NDArray[np.float64]
    objective: float
    log_volume: float
    distance: float
    drive_step: NDArray[np.float64]
    response: NDArray[np.float64]


def _rings(segments: Sequence[Segment], fixed: Sequence[Sequence[Effect]], state: _State) -> bool:
    """Tell whether anything rings between the table and the array."""
    array = segments[0].model.array
    return any(
        segment.felt_modes([*known, *effects_of_run(state.causes, array, segment.index)])
        for segment, known in zip(segments, fixed, strict=True)
    )


def _is_held(segments: Sequence[Segment], fixed: Sequence[Sequence[Effect]], state: _State) -> bool:
    """Tell whether a play holds a share of any readings."""
    array = segments[0].model.array
    return any(
        segment.felt_play([*known, *effects_of_run(state.causes, array, segment.index)]) is not None
        for segment, known in zip(segments, fixed, strict=True)
    )


def _is_far(segments: Sequence[Segment], fixed: Sequence[Sequence[Effect]], state: _State) -> bool:
    """Tell whether a state leaves more than noise."""
    observations = sum(int(segment.weight_mask.sum()) for segment in segments)
    return _energy(segments, fixed, state) > FAIR_FIT * observations


def _descend(segments: Sequence[Segment], fixed: Sequence[Sequence[Effect]], start: _State, iterations: int) -> _Point:
    """Take Gauss–Newton steps, shortened where they go uphill, until nothing is gained.

    Up or down is told by the energy with the drives held: values at different drives are of different tangents.
    """
    array = segments[0].model.array
    point = _evaluate(segments, fixed, start)
    for _ in range(iterations):
        if point.expected < _TOLERANCE:
            return _stepped(point, array)
        trials = [point.moved(share, array) for share in _SHARES]
        # A derivative that does not see what the past does (play, a servo) errs in the drive first.
        trials += [point.moved(share, array, held=True) for share in _SHARES if len(point.step)]
        downhill = (one for one in trials if _energy(segments, fixed, one) <= point.energy + _UPHILL)
        trial = next(downhill, None)
        try:
            following = _evaluate(segments, fixed, trials[0] if trial is None else trial)
        except np.linalg.LinAlgError:  # so far off that the prediction overflows
            break
        # Where the drive has yet to follow, a step may be right that is uphill with the drive held.
        if trial is None and following.value > point.value + _UPHILL:
            break
        stalled = point.energy - following.energy < _TOLERANCE and following.expected > _STALLED * point.expected
        point = following
        if stalled:
            break
    return point


def _stepped(point: _Point, array: AccelerometerArray) -> _Point:
    """Return the point after its step in a linear world, which it is so near to the optimum."""
    score = point.score - point.gram @ point.step
    objective = point.objective - float(point.step @ (point.score + score))
    return replace(point, state=point.moved(1.0, array), objective=objective, score=score)


def _energy(segments: Sequence[Segment], fixed: Sequence[Sequence[Effect]], state: _State) -> float:
    """Return misfit and prior energy of a state, its drives held."""

    def energy(segment: Segment, known: Sequence[Effect], drive: NDArray[np.float64]) -> float:
        segment.coefficients = drive
        return segment.energy([*known, *effects_of_run(state.causes, segment.model.array, segment.index)])

    total = _prior_energy(state.causes) + sum(over_segments(energy, segments, fixed, state.drives))
    return total if np.isfinite(total) else np.inf


def _evaluate(segments: Sequence[Segment], fixed: Sequence[Sequence[Effect]], state: _State) -> _Point:
    """Linearise every segment about a state and solve for the step of causes and drives."""
    coordinates = _places(state.causes)[0]

    def linearised(segment: Segment, known: Sequence[Effect], drive: NDArray[np.float64]) -> _Stretch:
        segment.coefficients = drive
        line = segment.linearise([*known, *effects_of_run(state.causes, segment.model.array, segment.index)])
        columns = cause_columns(segment, state.causes, known, line.prediction, shapes=True)
        gram, score, eliminated = segment.whitened_products(line, columns)
        drive_step, _ = line.drive.alone()
        return _Stretch(
            gram,
            score,
            line.drive.objective,
            line.drive.log_volume(),
            line.drive.distance(),
            drive_step,
            line.drive.response(eliminated),
        )

    done = each_apart(lambda row: linearised(*row), list(zip(segments, fixed, state.drives, strict=True)))
    gram = np.sum([one.gram for one in done], axis=0)
    score = np.sum([one.score for one in done], axis=0)
    precision, pull = _prior(state.causes)
    information = gram + np.diag(precision)
    step = inverse(information) @ (score + pull) if len(score) else np.zeros(0)
    step = _limited(state.causes, step)
    objective, distance = sum(one.objective for one in done), sum(one.distance for one in done)
    return _Point(
        state,
        objective,
        gram,
        score,
        step,
        tuple(one.drive_step + one.response @ step for one in done),
        # What the step promises, and how far the drives still are from their best.
        float(step @ information @ step) + _DRIVE_SHARE * distance,
        sum(one.log_volume for one in done),
        tuple(one.response[:, coordinates] for one in done),
        objective + distance + _prior_energy(state.causes),
    )


def _places(causes: Sequence[Cause]) -> tuple[NDArray[np.intp], list[tuple[int, str, int]]]:
    """Return the places of the coordinates, and (cause, key, place) of the shapes, in the columns."""
    coordinates: list[int] = []
    shapes: list[tuple[int, str, int]] = []
    place = 0
    for number, cause in enumerate(causes):
        coordinates += range(place, place + len(cause.coordinates))
        place += len(cause.coordinates)
        for key in cause.free_shape:
            shapes.append((number, key, place))
            place += 1
    return np.array(coordinates, dtype=np.intp), shapes


def _prior(causes: Sequence[Cause]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Prior precision of each column and its pull towards zero (shapes are held near where they are)."""
    precision, pull = [], []
    for cause in causes:
        precision += [1.0 / SCALES[-1] ** 2] * len(cause.coordinates)
        pull += list(-cause.coordinates / SCALES[-1] ** 2)
        precision += [1.0 / _SHAPE_PRIOR**2] * len(cause.free_shape)
        pull += [0.0] * len(cause.free_shape)
    return np.array(precision), np.array(pull)


def _prior_energy(causes: Sequence[Cause]) -> float:
    return float(sum(np.sum(cause.coordinates**2) for cause in causes) / SCALES[-1] ** 2)


def _limited(causes: Sequence[Cause], step: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shorten the step of the shapes to what a linear form can be trusted for."""
    limited = step.copy()
    for _, _, place in _places(causes)[1]:
        limited[place] = np.clip(step[place], -_SHAPE_LIMIT, _SHAPE_LIMIT)
    return limited


def _allowed(causes: Sequence[Cause], array: AccelerometerArray) -> tuple[Cause, ...]:
    """Return causes no larger than physics allows; a linear form may have asked for more."""
    return tuple(cause.at(np.minimum(cause.coordinates, cause.most(array))) for cause in causes)


def _moved(causes: Sequence[Cause], step: NDArray[np.float64], array: AccelerometerArray) -> tuple[Cause, ...]:
    moved = []
    place = 0
    for cause in causes:
        width = len(cause.coordinates)
        coordinates = cause.coordinates + step[place : place + width]
        coordinates = np.where(cause.positive(array), np.maximum(coordinates, SMALLEST_POSITIVE), coordinates)
        coordinates = np.minimum(coordinates, cause.most(array))
        place += width
        shape = dict(cause.shape)
        for key, value in cause.free_shape.items():
            shape[key] = shape_moved(key, value, float(step[place]))
            place += 1
        moved.append(cause.at(coordinates, shape))
    return tuple(moved)


def _result(segments: Sequence[Segment], point: _Point) -> Fit:
    """Return the fit at a point: covariances, and Laplace's evidence relative to no effect."""
    array = segments[0].model.array
    causes, gram, score = point.state.causes, point.gram, point.score.copy()
    prior = sum(cause.log_prior for cause in causes) + EXTRA_CAUSE * max(len(causes) - 1, 0)
    if not causes:
        evidence = point.log_volume - 0.5 * point.objective
        empty = np.zeros((0, 0))
        return Fit(
            (), evidence, evidence + prior, point.objective, point.state.drives, empty, np.zeros(0), point.responses
        )
    coordinates, shapes = _places(causes)
    values = np.concatenate([cause.coordinates for cause in causes])
    covariance = inverse(gram + np.diag(_prior(causes)[0]))
    inner = gram[np.ix_(coordinates, coordinates)]
    # At the largest size that physics allows, what would pull it on is not believed.
    at_most = values >= np.concatenate([cause.most(array) for cause in causes])
    score[coordinates[at_most]] = np.minimum(score[coordinates[at_most]], 0.0)
    total = score[coordinates] + inner @ values
    positive = np.concatenate([cause.positive(array) for cause in causes])
    nothing = point.objective + 2 * float(score[coordinates] @ values) + float(values @ inner @ values)
    # A cause that reshapes what the drive can do, as a mode does, is charged for it by the volume.
    evidence = point.log_volume - 0.5 * nothing + log_evidence(inner, total, positive)
    noise = segments[0].levels.of_reading
    done = []
    ends = np.cumsum([len(cause.coordinates) for cause in causes])
    for number, (cause, mine) in enumerate(zip(causes, np.split(coordinates, ends[:-1]), strict=True)):
        stds = {key: float(np.sqrt(covariance[p, p])) for owner, key, p in shapes if owner == number}
        scaled = {key: std if key in ANGLES else std * abs(cause.shape[key]) for key, std in stds.items()}
        scaled |= {key: float(np.hypot(scaled[key], LEVEL_ERROR * noise)) for key in cause.levels if key in scaled}
        done.append(replace(cause, covariance=covariance[np.ix_(mine, mine)], shape_std=scaled))
    drives = point.state.drives
    return Fit(tuple(done), evidence, evidence + prior, point.objective, drives, inner, total, point.responses)
