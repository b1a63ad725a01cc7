"""Refinement: a set of causes fitted with the full simulation, drive, sizes and shapes together.

Gauss–Newton on the drive-marginalised normal equations; the evidence is Laplace's at the optimum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.causes import Cause, effects_of_run
from gfimu.diagnosis.evidence import SCALES, log_evidence
from gfimu.diagnosis.model import Effect
from gfimu.diagnosis.search import EXTRA_CAUSE
from gfimu.diagnosis.segment import Segment
from gfimu.diagnosis.signatures import cause_columns, shape_moved

__all__ = ["Fit", "refine"]

_SHAPE_LIMIT = 0.3
_SHAPE_PRIOR = 0.7
_TOLERANCE = 0.02
_DRIVE_TOLERANCE = 0.3
_SMALLEST_POSITIVE = 1e-6


@dataclass(frozen=True)
class Fit:
    """A set of causes at its optimum.

    Parameters
    ----------
    causes : tuple of Cause
        With coordinates and covariance.
    log_evidence : float
        Log of the marginal likelihood (up to a constant common to all sets), without the prior of the set.
    log_posterior : float
        The same with the prior of the set.
    objective : float
        Drive-marginalised sum of squares at the optimum.
    drives : tuple of ndarray
        Drive coefficients of every segment.
    gram, score : ndarray
        Normal equations of the coordinates relative to no effect.
    """

    causes: tuple[Cause, ...]
    log_evidence: float
    log_posterior: float
    objective: float
    drives: tuple[NDArray[np.float64], ...]
    gram: NDArray[np.float64]
    score: NDArray[np.float64]

    @property
    def key(self) -> frozenset[tuple[str, str]]:
        """Effects and places, which identify the set."""
        return frozenset(cause.key for cause in self.causes)

    @property
    def names(self) -> frozenset[str]:
        """Names of the effects."""
        return frozenset(cause.name for cause in self.causes)


def refine(
    segments: Sequence[Segment],
    causes: Sequence[Cause],
    fixed: Sequence[Sequence[Effect]],
    *,
    drives: Sequence[NDArray[np.float64]] | None = None,
    iterations: int = 6,
    shapes: bool = True,
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
    """
    if not shapes:
        causes = [replace(cause, frozen=True) for cause in causes]
    array = segments[0].model.array
    kept = [segment.coefficients for segment in segments]
    if drives is not None:
        for segment, drive in zip(segments, drives, strict=True):
            segment.coefficients = drive
    try:
        return _iterate(segments, list(causes), fixed, array, iterations)
    finally:
        for segment, drive in zip(segments, kept, strict=True):
            segment.coefficients = drive


def _iterate(segments, causes, fixed, array, iterations) -> Fit:  # type: ignore[no-untyped-def]
    previous: tuple[float, list[Cause], list[NDArray[np.float64]]] | None = None
    step_scale = 1.0
    pending: tuple[NDArray[np.float64], list] | None = None
    for iteration in range(iterations + 1):
        linear, products = [], []
        for segment, known in zip(segments, fixed, strict=True):
            effects = [*known, *effects_of_run(causes, array, segment.index)]
            line = segment.linearise(effects)
            columns = cause_columns(segment, causes, known, shapes=True)
            linear.append(line)
            products.append(segment.whitened_products(line, columns))
        objective = sum(line.objective for line in linear)
        penalty = _prior_energy(causes)
        if previous is not None and objective + penalty > previous[0] + 1e-3 * abs(previous[0]) + 5.0 and pending:
            # The step went uphill: go back and take a quarter of it.
            step_scale *= 0.25
            if step_scale < 0.01 or iteration == iterations:
                causes = previous[1]
                for segment, drive in zip(segments, previous[2], strict=True):
                    segment.coefficients = drive
                pending = None
                if step_scale < 0.01:
                    iterations = iteration
                continue
            causes = _moved(previous[1], step_scale * pending[0], array)
            for segment, drive, move in zip(segments, previous[2], pending[1], strict=True):
                segment.coefficients = drive + step_scale * move
            continue
        step_scale = min(1.0, 2 * step_scale)
        gram = sum(product[0] for product in products)
        score = sum(product[1] for product in products)
        if iteration == iterations or not segments:
            break
        prior, pull = _prior(causes)
        step = np.linalg.solve(gram + np.diag(prior), score + pull) if len(score) else np.zeros(0)
        step = _limited(causes, step)
        moves: list[NDArray[np.float64]] = []
        before = [segment.coefficients for segment in segments]
        for segment, line, product in zip(segments, linear, products, strict=True):
            segment.move_drive(line, product[2], step)
            moves.append(segment.coefficients - before[len(moves)])
        previous = (objective + penalty, causes, before)
        pending = (step, moves)
        causes = _moved(causes, step, array)
        drive_change = max(float(line.forward @ line.forward) for line in linear)
        gain = float(step @ (gram + np.diag(prior)) @ step) if len(step) else 0.0
        if gain < _TOLERANCE and drive_change < _DRIVE_TOLERANCE:
            break
    return _result(causes, gram, score, objective, segments, array)


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


def _moved(causes, step, array) -> list[Cause]:  # type: ignore[no-untyped-def]
    moved = []
    place = 0
    for cause in causes:
        width = len(cause.coordinates)
        coordinates = cause.coordinates + step[place : place + width]
        coordinates = np.where(cause.positive(array), np.maximum(coordinates, _SMALLEST_POSITIVE), coordinates)
        place += width
        shape = dict(cause.shape)
        for key, value in cause.free_shape.items():
            shape[key] = shape_moved(key, value, float(step[place]))
            place += 1
        moved.append(cause.at(coordinates, shape))
    return moved


def _result(causes, gram, score, objective, segments, array) -> Fit:  # type: ignore[no-untyped-def]
    coordinates, shapes = _places(causes)
    values = np.concatenate([cause.coordinates for cause in causes]) if causes else np.zeros(0)
    information = gram + np.diag(_prior(causes)[0]) if len(gram) else gram
    covariance = np.linalg.inv(information) if len(gram) else gram
    done = []
    for number, cause in enumerate(causes):
        before = sum(len(c.coordinates) for c in causes[:number])
        mine = coordinates[before : before + len(cause.coordinates)]
        stds = {key: float(np.sqrt(covariance[p, p])) for owner, key, p in shapes if owner == number}
        scaled = {key: std if key == "direction_rad" else std * abs(cause.shape[key]) for key, std in stds.items()}
        done.append(replace(cause, covariance=covariance[np.ix_(mine, mine)], shape_std=scaled))
    inner = gram[np.ix_(coordinates, coordinates)] if len(gram) else np.zeros((0, 0))
    total = (score[coordinates] if len(score) else np.zeros(0)) + inner @ values
    positive = np.concatenate([cause.positive(array) for cause in causes]) if causes else np.zeros(0, dtype=bool)
    if causes:
        nothing = objective + 2 * float(score[coordinates] @ values) + float(values @ inner @ values)
        evidence = -0.5 * nothing + log_evidence(inner, total, positive)
    else:
        evidence = -0.5 * objective
    prior = sum(cause.log_prior for cause in causes) + EXTRA_CAUSE * max(len(causes) - 1, 0)
    return Fit(
        tuple(done),
        evidence,
        evidence + prior,
        objective,
        tuple(segment.coefficients for segment in segments),
        inner,
        total,
    )
