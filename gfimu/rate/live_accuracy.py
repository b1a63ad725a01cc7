"""How accurate the estimates of a stream are: the noise as measured and the sign as a probability, sample by sample.

What `gfimu.rate.refinement` does for a recording, with the samples so far alone. Combinations of the readings that no
motion changes show the noise before the filter uses a sample, so that it reckons with it. In an array without them the
innovations show it, and the covariance is multiplied by s̃². While the channels disagree, or the sign of the run is
undecided, the chain of the single samples gives each rate its more probable sign.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.rate.disagreement import POLICY, MeasuredNoise, ScaleSoFar
from gfimu.rate.kalman import KalmanRateFilter
from gfimu.rate.maximum_likelihood import rates_of_null_space
from gfimu.rate.per_sample import UNDECIDABLE
from gfimu.rate.refinement import parity_rows, same_sign
from gfimu.rate.residual import bounded_covariance, least_curvature, residual_of
from gfimu.rate.result import RateEstimate
from gfimu.rate.sensing import ChannelTables, SensorErrors
from gfimu.rate.sign_chain import SignChain, SignSteps

__all__ = ["LiveAccuracy"]

_FEWEST_PRODUCTS = 3  # of ω that the null space must see for a single sample to have a rate
_DOUBT_S = 5.0  # numerical: of the stream, over which the share of samples in disagreement is counted


class LiveAccuracy:
    """Measures the noise of a stream and the sign of its rates.

    Parameters
    ----------
    array, errors : AccelerometerArray, SensorErrors
        The array, with c channels, and the errors of its sensors.
    period : float
        Sample period, s.
    """

    def __init__(self, array: AccelerometerArray, errors: SensorErrors, period: float) -> None:
        self._errors, self._period = errors, period
        self._tables = ChannelTables(array, errors)
        self._parity = parity_rows(self._tables) if errors.white_only else None
        self._scale = ScaleSoFar(period, lasting=self._parity is None)
        self._sum, self._count = np.zeros(0 if self._parity is None else len(self._parity)), 0
        self._readings = np.zeros((0, array.n_channels))  # samples without an estimate yet, and their s̃
        self._waiting = np.zeros(0)
        sensitivity = self._tables.null_sensitivity[0]
        self._has_sign = np.linalg.matrix_rank(sensitivity, tol=1e-9) >= _FEWEST_PRODUCTS
        self._curvature = least_curvature(sensitivity) if self._has_sign else np.inf
        self._disagreeing = 0.0  # share of the last samples with a notable s̃
        self._chain: SignChain | None = None
        self._last = 0.5

    def take(self, t: NDArray[np.float64], readings: NDArray[np.float64]) -> MeasuredNoise | None:
        """Take samples (n, c) before the filter does; return their noise where the readings alone show it."""
        scale = np.ones(len(t))
        if self._parity is not None:
            usable = np.asarray((np.abs(readings) < self._errors.limits).all(axis=1))
            parity = np.where(usable[:, None], readings, 0.0) @ self._parity.T  # (n, d)
            sums = self._sum + np.cumsum(parity, axis=0)
            counts = self._count + np.cumsum(usable)
            if len(t):
                self._sum, self._count = sums[-1], int(counts[-1])
            parity = parity - sums / np.maximum(counts, 1)[:, None]
            squares = np.where(usable, np.sum(parity**2, axis=1), np.nan)
            scale = self._scale.push(squares, np.where(usable, float(len(self._parity)), 0.0))
        self._readings = np.concatenate([self._readings, readings])
        self._waiting = np.concatenate([self._waiting, scale])
        return None if self._parity is None else MeasuredNoise(t, scale)

    def describe(self, found: RateEstimate, current: KalmanRateFilter | None) -> RateEstimate:
        """Return the estimates with ``scale`` and ``sign_probability``; ``current`` is the filter that gave them."""
        n = len(found)
        readings, scale = self._readings[:n], self._waiting[:n]
        self._readings, self._waiting = self._readings[n:], self._waiting[n:]
        if self._parity is None:
            scale = self._scale.push(found.nis, found.nis_dof.astype(float))
            found = replace(found, covariance=found.covariance * (scale**2)[:, None, None])
        found = replace(found, scale=scale)
        for large in scale > POLICY.notable_ratio:
            self._disagreeing += (large - self._disagreeing) * self._period / _DOUBT_S
        return self._with_sign(found, readings, current)

    def _with_sign(
        self, found: RateEstimate, readings: NDArray[np.float64], current: KalmanRateFilter | None
    ) -> RateEstimate:
        """Give each rate its more probable sign, and the probability."""
        undecided = found.sign.state == "undecided"
        doubt = undecided or self._disagreeing >= POLICY.notable_share
        if not doubt and found.rest.any():  # behind a rest the sign is known again
            self._chain = None
        if current is None or not self._has_sign or not (doubt or self._chain is not None):
            return replace(found, sign_probability=np.full(len(found), 0.5 if undecided else 1.0))
        if self._chain is None:
            self._chain = SignChain(self._period)
        steps, covariance = self._steps(found, readings, current, known=not undecided)
        chance = self._chain.push(steps)
        alike = same_sign(steps.omega, covariance, found)
        probability = alike * chance + (1.0 - alike) * (1.0 - chance)
        for k in range(len(probability)):  # a sample without one has that of the sample before
            self._last = probability[k] = probability[k] if np.isfinite(probability[k]) else self._last
        wrong = probability < 0.5 - UNDECIDABLE
        return replace(
            found,
            omega=np.where(wrong[:, None], -found.omega, found.omega),
            sign_probability=np.where(wrong, 1.0 - probability, probability),
        )

    def _steps(
        self, found: RateEstimate, readings: NDArray[np.float64], current: KalmanRateFilter, *, known: bool
    ) -> tuple[SignSteps, NDArray[np.float64]]:
        """Return what the chain is given of these samples, and the covariance of their single rates (n, 3, 3)."""
        tables, scale = self._tables, found.scale
        assert scale is not None
        seen = slice(6, 6 + tables.n_null)  # biases of the null space in the filter's state, behind those of α
        bias, spread = current.state.x, current.state.covariance
        complete = np.where((np.abs(readings) < self._errors.limits).all(axis=1, keepdims=True), readings, np.nan)
        alpha = complete @ tables.alpha_rows[0].T - bias[3:6]
        z = complete @ tables.null_rows[0].T - bias[seen]
        omega, covariance = rates_of_null_space(z, tables.null_sensitivity[0])
        residual = residual_of(z, tables.null_sensitivity[0], omega, self._curvature)
        doubt = np.sqrt(scale**2 + float(np.linalg.eigvalsh(spread[seen, seen])[-1]))
        steps = SignSteps(
            found.t_s, alpha, omega, bounded_covariance(residual.information, doubt, self._curvature),
            tables.alpha_noise[0], scale, float(np.sqrt(np.trace(spread[3:6, 3:6]) / 3.0)), found.rest,
            self._curvature**-0.5, found.omega[0] if known and len(found) else None,
            float(found.std[0].max()) if len(found) else 1.0,
        )  # fmt: skip
        return steps, covariance * (scale**2)[:, None, None]
