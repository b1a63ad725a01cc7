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

from gfimu.array.array import AccelerometerArray
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.evidence import SCALES, inverse, log_evidence
from gfimu.diagnosis.fit.linear import SETTLED, SHARES, Linear, Point, energy_of, linearise, of_causes
from gfimu.diagnosis.fit.posterior import remembers_long
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.cause import Cause, effects_of
from gfimu.diagnosis.terms.jacobian import Jacobian

__all__ = ["FEW", "SETTLED", "Fit", "determined", "fit", "is_rough", "linearly_without", "log_prior", "precision"]

FEW = 3
"""Numerical: steps of a fit whose only other unknown is a drive, or that is only looked at; rounds of such fits."""
_SHAPE_STEP = 0.3  # numerical: most that a shape moves in a step
_SHAPE_PRIOR = 0.7  # numerical: standard deviation of that step
_KEPT = 0.5  # numerical: share of its promise that a step must gain for a derivative to serve another one
_NARROW = 10  # numerical: width of a derivative that is cheap to take anew


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


def fit(stretches: Sequence[Stretch], start: Point, policy: Policy, *, closely: bool = True) -> Fit:
    """Fit drives, sizes and shapes of a set of causes under the noise and roughness of a point.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    start : Point
        Where to start; its noise, roughness and residue are kept.
    policy : Policy
        Thresholds.
    closely : bool
        Whether the exact derivative follows the cheap one where a cause remembers the drive for long.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the start determines no drive.
    """
    array = stretches[0].model.array
    point = replace(start, causes=tuple(cause.moved(np.zeros(cause.unknowns), array) for cause in start.causes))
    point, linear, done = _descend(stretches, replace(point, exact=start.exact and _is_long(stretches, point)), policy)
    if closely and not point.exact and _is_long(stretches, point):
        point, linear, more = _descend(stretches, replace(point, exact=True), policy)
        done += more
    found = _judged(stretches, point, linear, done, policy.least_information)
    return replace(found, log_posterior=found.log_evidence + log_prior(point.causes, policy))


def linearly_without(found: Fit, cause: Cause, policy: Policy) -> Fit:
    """Return what a fit would be without one of its causes, in the linear world about it.

    Parameters
    ----------
    found : Fit
        A fit at its optimum.
    cause : Cause
        One of its causes.
    policy : Policy
        Thresholds.
    """
    others = tuple(one for one in found.causes if one is not cause)
    keep = np.concatenate([np.full(len(one.coordinates), one is not cause) for one in found.causes])
    z = np.concatenate([one.coordinates for one in found.causes])
    nothing = found.objective + 2.0 * float(found.score @ z) - float(z @ found.gram @ z)
    gram, score = found.gram[np.ix_(keep, keep)], found.score[keep]
    covariance = inverse(gram + np.eye(len(score)) / SCALES[-1] ** 2)
    mean = covariance @ score
    ends = np.cumsum([len(one.coordinates) for one in others])[:-1]
    parts = np.split(np.arange(len(mean)), ends) if others else []
    causes = tuple(
        replace(one, coordinates=mean[mine], covariance=covariance[np.ix_(mine, mine)])
        for one, mine in zip(others, parts, strict=True)
    )
    objective = nothing - 2.0 * float(score @ mean) + float(mean @ gram @ mean)
    value = found.volume - 0.5 * nothing + log_evidence(gram, score)
    point = replace(found.point, causes=causes)
    return Fit(point, value, value + log_prior(causes, policy), objective, gram, score, found.volume)


def is_rough(stretches: Sequence[Stretch], found: Fit) -> bool:
    """Whether a fit was made by a derivative that leaves out what a cause of it remembers."""
    return not found.point.exact and _is_long(stretches, found.point)


def _is_long(stretches: Sequence[Stretch], point: Point) -> bool:
    """Whether a cause remembers the drive for so long that the cheap derivative leaves it out."""
    return any(remembers_long(effects_of(point.causes, one.model.array, one.index)) for one in stretches[:1])


def _descend(stretches: Sequence[Stretch], point: Point, policy: Policy) -> tuple[Point, Linear, int]:
    """Take Gauss-Newton steps until they promise no more; returns point, linearisation there and number of steps.

    A step uphill, or to where there is no prediction or the equations have no solution, is rejected and shortened.
    """
    array = stretches[0].model.array
    now = _energy(stretches, point)
    linear = linearise(stretches, point, of_causes(point))
    done = 0
    for _ in range(policy.steps):
        step, promise = _step(point.causes, linear, policy.least_information)
        if promise < SETTLED and (done or not policy.least_information):
            break
        for share in SHARES:
            trial = _moved(point, linear, share, step, array)
            there = _energy(stretches, trial)
            if there > now + SETTLED:
                continue
            kept = _dear(linear) if now - there > _KEPT * promise else None
            try:
                ahead = linearise(stretches, trial, of_causes(trial), jacobians=kept)
            except np.linalg.LinAlgError:  # the equations there have no solution: no step either
                continue
            break
        else:
            break
        stalled = now - there < SETTLED
        point, now, linear, done = trial, there, ahead, done + 1
        if stalled:
            break
    return point, linear, done


def _dear(linear: Linear) -> tuple[Jacobian | None, ...]:
    """Return the derivatives by drives that are dear to take anew: they serve as long as they keep their promise."""
    each = (posterior.jacobian for posterior in linear.posteriors)
    return tuple(jacobian if jacobian.predictions > _NARROW else None for jacobian in each)


def log_prior(causes: Sequence[Cause], policy: Policy) -> float:
    """Return the log prior probability of a set."""
    return sum(cause.log_prior for cause in causes) + policy.extra_cause * max(len(causes) - 1, 0)


def _energy(stretches: Sequence[Stretch], point: Point) -> float:
    return energy_of(stretches, point) + _prior_energy(point.causes)


def _prior_energy(causes: Sequence[Cause]) -> float:
    return float(sum(np.sum(cause.coordinates**2) for cause in causes) / SCALES[-1] ** 2)


def _layout(causes: Sequence[Cause]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the places of the coordinates and of the shapes among the unknowns."""
    kinds = np.concatenate([[0] * len(c.coordinates) + [1] * len(c.free_shape) for c in causes] or [[]])
    return np.flatnonzero(kinds == 0), np.flatnonzero(kinds == 1)


def precision(causes: Sequence[Cause]) -> NDArray[np.float64]:
    """Return the precision of the prior of the unknowns of causes, (P,)."""
    sizes, shapes = _layout(causes)
    precision = np.zeros(len(sizes) + len(shapes))
    precision[sizes], precision[shapes] = 1.0 / SCALES[-1] ** 2, 1.0 / _SHAPE_PRIOR**2
    return precision


def determined(
    gram: NDArray[np.float64], least: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return eigenvalues (k,) and eigenvectors (k, k) of G in units of the prior, and which the data determine."""
    strength, turn = np.linalg.eigh(gram)
    return strength, turn, strength > least


def _split(causes: Sequence[Cause], linear: Linear, least: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return directions of the unknowns that the data determine, and of the sizes that they don't, each (P, k)."""
    sizes, shapes = _layout(causes)
    _, turn, seen = determined(linear.gram[np.ix_(sizes, sizes)], least)
    whole = np.zeros((len(sizes) + len(shapes), len(sizes)))
    whole[sizes] = turn
    return np.hstack([whole[:, seen], np.eye(len(whole))[:, shapes]]), whole[:, ~seen]


def _step(causes: Sequence[Cause], linear: Linear, least: float) -> tuple[NDArray[np.float64], float]:
    """Return the step of the unknowns, and what it promises together with that of the drives.

    Combinations of sizes with less information than ``least`` go to zero, where there is such a threshold.
    """
    promise = linear.energy - linear.objective
    if not causes:
        return np.zeros(0), promise
    sizes, shapes = _layout(causes)
    pull = np.zeros(len(linear.score))
    pull[sizes] = -np.concatenate([cause.coordinates for cause in causes]) / SCALES[-1] ** 2
    right = linear.score + pull
    information = linear.gram + np.diag(precision(causes))
    if least:
        known, unknown = _split(causes, linear, least)
        away = np.zeros(len(right))
        away[sizes] = -np.concatenate([cause.coordinates for cause in causes])
        step = known @ (inverse(known.T @ information @ known) @ (known.T @ right)) + unknown @ (unknown.T @ away)
    else:
        step = inverse(information) @ right
    step[shapes] = np.clip(step[shapes], -_SHAPE_STEP, _SHAPE_STEP)
    return step, promise + float(step @ right)


def _moved(point: Point, linear: Linear, share: float, step: NDArray[np.float64], array: AccelerometerArray) -> Point:
    drives = tuple(
        drive.moved(share * (own + response @ step))
        for drive, own, response in zip(point.drives, linear.drive_steps, linear.responses, strict=True)
    )
    ends = np.cumsum([cause.unknowns for cause in point.causes])[:-1]
    parts = np.split(share * step, ends) if point.causes else []
    causes = tuple(cause.moved(part, array) for cause, part in zip(point.causes, parts, strict=True))
    return replace(point, causes=causes, drives=drives)


def _judged(stretches: Sequence[Stretch], point: Point, linear: Linear, steps: int, least: float) -> Fit:
    """Return the fit at a point: covariances, and Laplace's evidence relative to no sizes."""
    volume = linear.log_volume + linear.log_noise
    # A step that a derivative without memory promises may not come true: what counts is what the simulation leaves.
    linear = replace(linear, objective=linear.energy)
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
    information = linear.gram + np.diag(precision(causes))
    if least:  # what is not determined has the spread of its prior
        known, unknown = _split(causes, linear, least)
        covariance = known @ inverse(known.T @ information @ known) @ known.T + unknown @ unknown.T
    else:
        covariance = inverse(information)
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
