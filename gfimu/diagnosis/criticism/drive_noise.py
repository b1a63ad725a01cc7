"""The score that functions of an estimated drive have by its noise alone.

A function φ of the drive x is tested on a series whose residual r = y − f(x) comes from the same estimate: what the
estimate takes of the noise is in both. By Fisher's identity the derivative of the log marginal likelihood by the
coefficient of φ is the mean of the complete-data score over the posterior of the drive,

    E[(y − f(x))ᵀ W φ(x)] = (y − f(m))ᵀ W φ(m) − tr(W J C φ'ᵀ),

with m and C its mean and covariance, J the derivative of f and φ' that of φ. So the score at the mean has the
expectation tr(W J C φ'ᵀ) where the prior of the drive is right. Where the prior is wider than the truth (a table that
turns steadily, below the least roughness) the residual takes less and the expectation lies between that and zero.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.data.table.spins import State
from gfimu.diagnosis.fit.posterior import Posterior
from gfimu.diagnosis.terms.cause import Cause, effects_of
from gfimu.diagnosis.terms.library import cause_columns
from gfimu.diagnosis.terms.spline import DEGREE
from gfimu.model.world_model import Spin, SpinState

__all__ = ["apart_from_noise", "drive_covariance", "expected_score", "expected_score_of_causes"]

_STATE = ("angle", "rate", "acceleration", "jerk")
ValuesOf = Callable[[SpinState, NDArray[np.float64]], NDArray[np.float64]]


def expected_score(stretch: Stretch, at: Posterior, values_of: ValuesOf) -> NDArray[np.float64]:
    """Return the expectation of the score of functions of the drive on each series, by the noise of the drive.

    Slow noise is taken as white here, which makes the figure a little larger.

    Parameters
    ----------
    stretch : Stretch
        The data.
    at : Posterior
        Its drive.
    values_of : callable
        From a spin and its jerk (n,), rad/s³, to the functions (n, k).

    Returns
    -------
    ndarray, shape (c + 1, k)
        tr(W J C φ'ᵀ) of every series and function.
    """
    spin, t = at.drive.spin.at(stretch.run.t), stretch.run.t
    state = (spin.angle, spin.rate, spin.acceleration, np.gradient(spin.acceleration, stretch.run.sample_period))
    shared, std = drive_covariance(at, t)  # (4, n, c + 1), (4, n)
    out = np.zeros((shared.shape[2], values_of(spin, state[3]).shape[1]))
    for order in range(len(_STATE)):
        size = np.maximum(std[order], 1e-12 * (1.0 + np.abs(state[order])))
        ends = []
        for sign in (1.0, -1.0):
            moved = [one + sign * size if index == order else one for index, one in enumerate(state)]
            ends.append(values_of(State(*moved[:3]), moved[3]))
        # The slope over ± one standard deviation: the expected one, also at the kink of |ω|.
        slope = (ends[0] - ends[1]) / (2.0 * size[:, None])  # (n, k)
        out += np.einsum("nc,nk->ck", shared[order] * at.observed.weights, slope)
    return out


class _Moved:
    """A motion whose angle, rate or acceleration is moved by a constant."""

    def __init__(self, spin: Spin, by: Sequence[float]) -> None:
        self._spin, self._by = spin, by

    @property
    def spin(self) -> Spin:
        """The motion itself, as of a drive."""
        return self

    @property
    def is_learnt(self) -> bool:
        """Whether its prior has parameters to learn."""
        return False

    def at(self, t: ArrayLike) -> SpinState:
        """Return the state at times (n,), s."""
        state = self._spin.at(t)
        angle, rate, acceleration = self._by
        return State(state.angle + angle, state.rate + rate, state.acceleration + acceleration)


def expected_score_of_causes(stretch: Stretch, at: Posterior, causes: Sequence[Cause]) -> NDArray[np.float64]:
    """Return the expectation of the score of each unknown of a set of causes, by the noise of the drive, shape (p,).

    A size that is fitted takes it as its own: what is tested beside it has to leave it out by the same projection.

    Parameters
    ----------
    stretch : Stretch
        The data.
    at : Posterior
        Its drive.
    causes : sequence of Cause
        Causes at their sizes; what they do is taken to depend on angle, rate and acceleration of the same instant.
    """
    shared, std = drive_covariance(at, stretch.run.t)
    effects = effects_of(causes, stretch.model.array, stretch.index)
    out = np.zeros(sum(cause.unknowns for cause in causes))
    for order in range(len(_STATE) - 1):
        size = float(np.median(std[order]))
        if size <= 0.0:
            continue
        for sign in (1.0, -1.0):
            moved = _Moved(at.drive.spin, [sign * size if index == order else 0.0 for index in range(len(_STATE) - 1)])
            seen = replace(at.observed, prediction=stretch.predict(effects, moved))
            columns = cause_columns(stretch, seen, moved, causes)
            for c, (places, part) in enumerate(zip(columns.places, columns.parts, strict=True)):
                weighed = shared[order][:, c] * (at.observed.weights[c] * sign / (2.0 * size))
                out[places] += weighed @ part
    return out


def drive_covariance(at: Posterior, t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the posterior covariance of the drive with the predicted observations, and its standard deviation.

    Parameters
    ----------
    at : Posterior
        A drive.
    t : ndarray, shape (n,)
        Times of its samples, s.

    Returns
    -------
    shared : ndarray, shape (4, n, c + 1)
        Covariance of angle, rate, acceleration and jerk with each weighed observation of the same sample.
    std : ndarray, shape (4, n)
        Standard deviation of each, rad, rad/s, rad/s², rad/s³.
    """
    jacobian, covariance = at.jacobian, at.covariance
    shared = np.zeros((len(_STATE), len(t), jacobian.loading.shape[1]))
    std = np.zeros((len(_STATE), len(t)))
    each = [at.drive.spline.rows(t, order) for order in range(len(_STATE))]
    for rows, columns, block in jacobian.blocks:
        moved = np.tensordot(block, covariance[columns], axes=1)  # (R, rows, m)
        for order, (first, values) in enumerate(each):
            places = first[rows, None] + np.arange(DEGREE + 1)
            mine = np.take_along_axis(moved, places[None], axis=2)  # (R, rows, 5)
            shared[order, rows] = np.einsum("rnf,nf->nr", mine, values[rows]) @ jacobian.loading
    for order, (first, values) in enumerate(each):
        places = first[:, None] + np.arange(DEGREE + 1)
        own = covariance[places[:, :, None], places[:, None, :]]
        std[order] = np.sqrt(np.maximum(np.einsum("nf,nfg,ng->n", values, own, values), 0.0))
    return shared, std


def apart_from_noise(
    score: NDArray[np.float64], expected: NDArray[np.float64], gram: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return scores b (p,) less the share λ of the expected ones e (p,) with 0 ≤ λ ≤ 1 that leaves least in bᵀG⁺b.

    One share for all: taken off one by one, the scores of functions that resemble each other would contradict.
    """
    weights = np.linalg.lstsq(gram, expected, rcond=1e-9)[0]  # the functions may depend on each other
    size = float(expected @ weights)
    if not size > 0.0:
        return score
    return np.asarray(score - min(1.0, max(0.0, float(score @ weights) / size)) * expected)
