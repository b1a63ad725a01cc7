"""`fit`: a set of causes with the full simulation, drive, sizes and shapes together.

Gauss–Newton on `condition`, which integrates out the drive; the evidence is Laplace's at the optimum. Sets are
compared by

    log p = −½ objective + log volume + log E(G, b) + log prior,

the objective that of no sizes, the volume that of the drive under no cause at the same noise and roughness: a mode
between table and array would else be charged for how it amplifies what the drive may do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.coloured_noise import NoiseLevels
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.evidence import SCALES, inverse, log_evidence
from gfimu.diagnosis.fit.posterior import Posterior, condition, energy
from gfimu.diagnosis.parallel import over_segments
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.cause import Cause, effects_of
from gfimu.diagnosis.terms.drive import Drive
from gfimu.diagnosis.terms.library import cause_columns

__all__ = ["Fit", "Point", "fit", "log_prior"]

_SHARES = (1.0, 0.3, 0.08)  # numerical: of a step that goes uphill
_SHAPE_STEP = 0.3  # numerical: most that a shape moves in a step
_SHAPE_PRIOR = 0.7  # numerical: standard deviation of that step
_NARROW = 10  # numerical: width of a derivative that is cheap to take anew


@dataclass(frozen=True)
class Point:
    """All that a fit changes.

    Parameters
    ----------
    causes : tuple of Cause
        Named causes.
    drives : tuple of Drive
        Drive of every stretch.
    levels : tuple of NoiseLevels
        Noise of every stretch.
    """

    causes: tuple[Cause, ...]
    drives: tuple[Drive, ...]
    levels: tuple[NoiseLevels, ...]


@dataclass(frozen=True)
class Fit:
    """A set of causes at its optimum.

    Parameters
    ----------
    point : Point
        Where.
    log_evidence : float
        Log marginal likelihood up to a constant common to all sets under the same noise.
    log_posterior : float
        The same with the prior of the set.
    objective : float
        Sum of squares with the drive's prior energy, at the optimum.
    gram, score : ndarray
        Normal equations of the coordinates, relative to no sizes.
    """

    point: Point
    log_evidence: float
    log_posterior: float
    objective: float
    gram: NDArray[np.float64] = field(repr=False)
    score: NDArray[np.float64] = field(repr=False)
    volume: float = 0.0
    steps: int = 0

    @property
    def causes(self) -> tuple[Cause, ...]:
        """The causes."""
        return self.point.causes

    @property
    def names(self) -> frozenset[str]:
        """Names of the effects."""
        return frozenset(cause.name for cause in self.causes)

    @property
    def key(self) -> frozenset[tuple[str, str]]:
        """Effects and places, which identify the set."""
        return frozenset(cause.key for cause in self.causes)


@dataclass(frozen=True)
class _Linear:
    """Normal equations of causes, drives integrated out, summed over stretches."""

    gram: NDArray[np.float64]
    score: NDArray[np.float64]
    objective: float
    energy: float
    drive_steps: tuple[NDArray[np.float64], ...]
    responses: tuple[NDArray[np.float64], ...]
    posteriors: tuple[Posterior, ...]


def fit(stretches: Sequence[Stretch], start: Point, policy: Policy) -> Fit:
    """Fit drives, sizes and shapes of a set of causes under the noise and roughness of a point."""
    array = stretches[0].model.array
    point = replace(start, causes=tuple(cause.moved(np.zeros(cause.unknowns), array) for cause in start.causes))
    now = _energy(stretches, point)
    linear = _linear(stretches, point)
    done = 0
    for done in range(policy.steps):
        step, promise = _step(point.causes, linear)
        if promise < policy.settled:
            break
        for share in _SHARES:
            trial = _moved(point, linear, share, step, array)
            there = _energy(stretches, trial)
            if there <= now + policy.settled:
                break
        else:
            break
        stalled = now - there < policy.settled
        kept = linear if done % 2 == 0 else None
        point, now = trial, there
        linear = _linear(stretches, point, kept)
        if stalled:
            break
    return _judged(stretches, point, linear, done)


def log_prior(causes: Sequence[Cause], policy: Policy) -> float:
    """Return the log prior probability of a set."""
    return sum(cause.log_prior for cause in causes) + policy.extra_cause * max(len(causes) - 1, 0)


def _linear(stretches: Sequence[Stretch], point: Point, kept: _Linear | None = None) -> _Linear:
    def one(stretch: Stretch, drive: Drive, levels: NoiseLevels, before: Posterior | None):  # noqa: ANN202
        effects = effects_of(point.causes, stretch.model.array, stretch.index)
        # A derivative with memory is dear: it serves two steps.
        jacobian = before.jacobian if before is not None and before.jacobian.predictions > _NARROW else None
        posterior = condition(stretch, drive, effects, levels, jacobian=jacobian)
        columns = cause_columns(stretch, posterior.observed, drive, point.causes)
        gram, score, across = posterior.products(columns)
        return posterior, gram, score, posterior.response(across)

    before = kept.posteriors if kept is not None else (None,) * len(stretches)
    rows = over_segments(one, stretches, point.drives, point.levels, before)
    posteriors, grams, scores, responses = zip(*rows, strict=True)
    return _Linear(
        np.sum(grams, axis=0),
        np.sum(scores, axis=0),
        sum(one.objective for one in posteriors),
        sum(one.energy for one in posteriors),
        tuple(one.step for one in posteriors),
        tuple(responses),
        tuple(posteriors),
    )


def _energy(stretches: Sequence[Stretch], point: Point) -> float:
    def one(stretch: Stretch, drive: Drive, levels: NoiseLevels) -> float:
        return energy(stretch, drive, effects_of(point.causes, stretch.model.array, stretch.index), levels)

    total = sum(over_segments(one, stretches, point.drives, point.levels)) + _prior_energy(point.causes)
    return total if np.isfinite(total) else np.inf


def _prior_energy(causes: Sequence[Cause]) -> float:
    return float(sum(np.sum(cause.coordinates**2) for cause in causes) / SCALES[-1] ** 2)


def _layout(causes: Sequence[Cause]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the places of the coordinates and of the shapes among the unknowns."""
    kinds = np.concatenate([[0] * len(c.coordinates) + [1] * len(c.free_shape) for c in causes] or [[]])
    return np.flatnonzero(kinds == 0), np.flatnonzero(kinds == 1)


def _precision(causes: Sequence[Cause]) -> NDArray[np.float64]:
    sizes, shapes = _layout(causes)
    precision = np.zeros(len(sizes) + len(shapes))
    precision[sizes], precision[shapes] = 1.0 / SCALES[-1] ** 2, 1.0 / _SHAPE_PRIOR**2
    return precision


def _step(causes: Sequence[Cause], linear: _Linear) -> tuple[NDArray[np.float64], float]:
    """Return the step of the unknowns, and what it promises together with that of the drives."""
    promise = linear.energy - linear.objective
    if not causes:
        return np.zeros(0), promise
    sizes, shapes = _layout(causes)
    pull = np.zeros(len(linear.score))
    pull[sizes] = -np.concatenate([cause.coordinates for cause in causes]) / SCALES[-1] ** 2
    right = linear.score + pull
    step = inverse(linear.gram + np.diag(_precision(causes))) @ right
    step[shapes] = np.clip(step[shapes], -_SHAPE_STEP, _SHAPE_STEP)
    return step, promise + float(step @ right)


def _moved(point: Point, linear: _Linear, share: float, step: NDArray[np.float64], array) -> Point:  # noqa: ANN001
    drives = tuple(
        drive.moved(share * (own + response @ step))
        for drive, own, response in zip(point.drives, linear.drive_steps, linear.responses, strict=True)
    )
    ends = np.cumsum([cause.unknowns for cause in point.causes])[:-1]
    parts = np.split(share * step, ends) if point.causes else []
    causes = tuple(cause.moved(part, array) for cause, part in zip(point.causes, parts, strict=True))
    return replace(point, causes=causes, drives=drives)


def _judged(stretches: Sequence[Stretch], point: Point, linear: _Linear, steps: int) -> Fit:
    """Return the fit at a point: covariances, and Laplace's evidence relative to no sizes."""
    volume = sum(one.log_volume for one in linear.posteriors)
    array, causes = stretches[0].model.array, point.causes
    if not causes:
        value = volume - 0.5 * linear.objective
        return Fit(point, value, value, linear.objective, np.zeros((0, 0)), np.zeros(0), volume, steps)
    sizes, _ = _layout(causes)
    z = np.concatenate([cause.coordinates for cause in causes])
    gram, score = linear.gram[np.ix_(sizes, sizes)], linear.score[sizes]
    high = np.concatenate([cause.limits(array)[1] for cause in causes])
    score = np.where(z >= high, np.minimum(score, 0.0), score)  # at its largest, what would pull it on is not believed
    nothing = linear.objective + 2.0 * float(score @ z) + float(z @ gram @ z)
    positive = np.concatenate([cause.positive(array) for cause in causes])
    total = score + gram @ z
    evidence = volume - 0.5 * nothing + log_evidence(gram, total, positive)
    covariance = inverse(linear.gram + np.diag(_precision(causes)))
    ends = np.cumsum([cause.unknowns for cause in causes])
    done = []
    for cause, mine in zip(causes, np.split(np.arange(ends[-1]), ends[:-1]), strict=True):
        count = len(cause.coordinates)
        stds = {
            key: float(np.sqrt(covariance[p, p])) * (1.0 if key.endswith("_rad") else abs(cause.shape[key]))
            for key, p in zip(cause.free_shape, mine[count:], strict=True)
        }
        done.append(replace(cause, covariance=covariance[np.ix_(mine[:count], mine[:count])], shape_std=stds))
    return Fit(replace(point, causes=tuple(done)), evidence, evidence, linear.objective, gram, total, volume, steps)
