"""What the per-sample estimators have in common once each sample has a rate but for its sign: noise measured, sign."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.compiled import compiled
from gfimu.rate.disagreement import measured_scale
from gfimu.rate.null_readings import NullReadings
from gfimu.rate.residual import bounded_covariance, least_curvature, residual_of
from gfimu.rate.result import DECIDED, RateEstimate, SignDecision, clear_of_zero
from gfimu.rate.sensing import ChannelTables, SensorErrors
from gfimu.rate.sign_chain import SignSteps, sign_probabilities

__all__ = ["UNDECIDABLE", "KnownStart", "decision", "per_sample_estimate", "signed"]

UNDECIDABLE = 0.01
"""Numerical: a probability so near one half says nothing; the sign is carried on."""


class KnownStart(NamedTuple):
    """Rate at the first sample, where it is known."""

    omega: NDArray[np.float64]  # (3,) rad/s
    std: float  # rad/s


def per_sample_estimate(
    method: str,
    null: NullReadings,
    omega: NDArray[np.float64],
    covariance: NDArray[np.float64],
    array: AccelerometerArray,
    errors: SensorErrors,
    start: KnownStart | None,
    *,
    slow_fit: float = 1.0,
) -> RateEstimate:
    """Return the estimate of rates but for their signs: covariance by the measured noise, sign by the chain.

    Parameters
    ----------
    method : str
        Name of the estimator.
    null : NullReadings
        α and the null space of each sample.
    omega : ndarray, shape (n, 3)
        Rates but for their signs, rad/s; NaN where there is none.
    covariance : ndarray, shape (n, 3, 3)
        Their covariance by the stated noise, (rad/s)².
    array, errors : AccelerometerArray, SensorErrors
        The array, and the errors of its sensors.
    start : KnownStart or None
        Rate at the first sample, where it is known and is not the rest that ``null`` recognises.
    slow_fit : float
        How much less than the best fit a method fits slow samples: factor of the curvature in `residual_of`.
    """
    curvature = least_curvature(null.sensitivity)
    residual = residual_of(null.z, null.sensitivity, omega, slow_fit * curvature)
    period = float(np.median(np.diff(null.t)))
    scale = measured_scale(residual.squares, residual.freedom, period)
    tables = ChannelTables(array, errors)
    alpha_bias, null_bias, unseen = _bias_variances(null, tables, errors, curvature)
    information = residual.information if slow_fit == 1.0 else _inverted(covariance)
    spread = bounded_covariance(information, np.sqrt(scale**2 + null_bias), curvature)
    steps = SignSteps(
        null.t,
        null.alpha,
        omega,
        spread,
        tables.alpha_noise[0],
        scale,
        np.sqrt(alpha_bias),
        null.rest,
        unseen,
        None if start is None else start.omega,
        1.0 if start is None else start.std,
    )
    omega, probability = signed(null.t, null.alpha, omega, sign_probabilities(steps))
    found = RateEstimate(
        method,
        null.t,
        omega,
        covariance * (scale**2)[:, None, None],
        residual.squares,
        np.where(np.isfinite(residual.squares), max(null.z.shape[1] - 3, 0), 0),
        null.rest,
        scale=scale,
        sign_probability=probability,
    )
    return replace(found, sign=decision(found, known=bool(null.rest.any()) or start is not None))


def _inverted(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Invert covariances (n, 3, 3); zero where they are not finite."""
    finite = np.isfinite(covariance).all(axis=(1, 2))
    inverse = np.zeros_like(covariance)
    inverse[finite] = np.linalg.inv(covariance[finite])
    return inverse


def _bias_variances(
    null: NullReadings, tables: ChannelTables, errors: SensorErrors, curvature: float
) -> tuple[float, float, float]:
    """Return the variances that constant biases add to α, per axis, and to z, at most, and the std of ω at rest, rad/s.

    Where the biases were read off a rest, a slow departure may have gone unseen in it: up to a rate whose products are
    as large as their noise.
    """
    unseen = curvature**-0.5
    if not null.rest.any():
        biases = tables.bias_covariance(errors.bias_std)
        return float(np.trace(biases[:3, :3])) / 3.0, float(np.linalg.eigvalsh(biases[3:, 3:])[-1]), unseen
    biases = tables.bias_covariance(errors.noise_std / np.sqrt(float(null.rest.sum())))
    length = float(np.ptp(null.t[null.rest])) + float(np.median(np.diff(null.t)))
    drift = unseen / length
    return (
        float(np.trace(biases[:3, :3])) / 3.0 + drift**2, float(np.linalg.eigvalsh(biases[3:, 3:])[-1]), unseen
    )  # fmt: skip


def signed(
    t: NDArray[np.float64], alpha: NDArray[np.float64], omega: NDArray[np.float64], plus: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return rates (n, 3) with the more probable sign, and the probability (n,) of that sign.

    ``plus`` is the probability of the sign that ``omega`` has. Where it says nothing, the sign is the one nearer to the
    integral of α.
    """
    side = _sides(t, alpha, omega, plus)
    return omega * side[:, None], np.where(side > 0, plus, 1.0 - plus)


@compiled
def _sides(t, alpha, omega, plus):  # type: ignore[no-untyped-def]
    """Sign (n,) of each rate: +1 or −1 times ``omega``.

    The integral of α is drawn to the ω so signed within its time constant 1/|ω|, so that it does not drift away.
    """
    n = len(t)
    side = np.ones(n)
    carried = np.zeros(3)
    time = t[0]
    for k in range(n):
        step = t[k] - time
        time = t[k]
        for a in range(3):
            if np.isfinite(alpha[k, a]):
                carried[a] += step * alpha[k, a]
        if not (np.isfinite(omega[k, 0]) and np.isfinite(plus[k])):
            continue
        along = 0.0
        square = 0.0
        for a in range(3):
            along += omega[k, a] * carried[a]
            square += omega[k, a] * omega[k, a]
        decided = plus[k] - 0.5 if abs(plus[k] - 0.5) > UNDECIDABLE else along
        side[k] = 1.0 if decided >= 0.0 else -1.0
        drawn = min(1.0, step * np.sqrt(square))
        for a in range(3):
            carried[a] += drawn * (side[k] * omega[k, a] - carried[a])
    return side


def decision(found: RateEstimate, *, known: bool) -> SignDecision:
    """Sum the probabilities up in one word for the run."""
    probability = found.sign_probability
    assert probability is not None
    clear = clear_of_zero(found.omega, found.std)
    decided = clear & (probability > DECIDED)
    if not clear.any() or not decided.any():
        return SignDecision("known" if known and not clear.any() else "undecided", 0.0)
    if np.array_equal(decided, clear):
        return SignDecision("known") if known else SignDecision("decided", np.inf, float(found.t_s[np.argmax(decided)]))
    return SignDecision("partly", 0.0, float(found.t_s[np.argmax(decided)]))
