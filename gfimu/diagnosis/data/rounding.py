"""Coarse rounding: what a reading determines when one count is larger than the noise.

A reading y in steps of q says only that the value before rounding lay within y ± q/2. Its likelihood

    p(y | x) = Φ((y + q/2 − x)/σ) − Φ((y − q/2 − x)/σ)

is log-concave in the prediction x; score and curvature give each sample a working residual and a weight, so that the
same least squares serves (iteratively reweighted, McCullagh and Nelder 1989, §2.5). In the middle of a step a sample
says next to nothing, at the edges nearly as much as an unrounded one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.special import log_ndtr, ndtr

__all__ = [
    "COARSE",
    "NO_STEPS",
    "Steps",
    "WorkingResidual",
    "between_steps",
    "common_step",
    "rounded_likelihood",
    "rounding_noise",
]

COARSE = 1.5
"""Steps per standard deviation of the noise from which rounding is no longer like noise."""
_LEAST_WEIGHT = 0.02
_LEAST_STEP = 1e-9
_OFF_GRID = 0.05
_NEAR = 30.0  # standard deviations, within which probabilities don't underflow
_FAR = 1e4  # standard deviations
_LEAST_NOISE = 0.03  # of a reference's step: finer edges would be more exact than the steps of real parts keep to
_NOISE_FACTORS = np.geomspace(0.5, 6.0, 26)
_MOST_CHANGES = 0.1  # to and fro, of the samples; where there are more the noise shows between the steps
_ONE_CHANGE = 0.5  # of the usual time from one value to the next, within which there and back is one change
_LEAST_CHANGES = 4


@dataclass(frozen=True)
class WorkingResidual:
    """Least-squares equivalent of rounded readings about a prediction.

    Parameters
    ----------
    residual : ndarray, shape (n, c)
        Weighted working residual, m/s²: weight × (working response − prediction).
    weight : ndarray, shape (n, c)
        Share of an unrounded sample's amplitude, 0 to 1; derivatives are multiplied by it.
    deviance : ndarray, shape (n, c)
        −2 log p(y | x).
    """

    residual: NDArray[np.float64]
    weight: NDArray[np.float64]
    deviance: NDArray[np.float64]


@dataclass(frozen=True)
class Steps:
    """Steps that observations are rounded to where these are coarse, 0 where they are finer than the noise.

    Parameters
    ----------
    channels : float
        Of the c channels, m/s².
    reference : float
        Of the reference, rad/s or rad.
    """

    channels: float = 0.0
    reference: float = 0.0

    def weigh(
        self, residual: NDArray[np.float64], white: NDArray[np.float64], valid: NDArray[np.bool_]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
        """Return working residuals and weights, each (n, c + 1), and what the residuals' squares lack of the deviance.

        Parameters
        ----------
        residual : ndarray, shape (n, c + 1)
            Measured minus predicted.
        white : ndarray, shape (c + 1,)
            White noise before rounding.
        valid : ndarray of bool, shape (n, c + 1)
            Which observations count.
        """
        working, weight, lacking = residual.copy(), valid.astype(float), 0.0
        for columns, step in self._coarse:
            rounded = rounded_likelihood(residual[:, columns], step, white[columns])
            working[:, columns] = rounded.residual * valid[:, columns]
            weight[:, columns] *= rounded.weight
            lacking += float(((rounded.deviance - (rounded.residual / white[columns]) ** 2) * valid[:, columns]).sum())
        return working, weight, lacking

    def noise_before(
        self, error: NDArray[np.float64], white: NDArray[np.float64], level: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Replace levels (c + 1,) by the white noise before rounding, which ``white`` is near, where steps are coarse.

        ``error``, shape (n, c + 1), is measured minus predicted, NaN where invalid.
        """
        found = level.copy()
        for columns, step in self._coarse:
            found[columns] = rounding_noise(error[:, columns], step, white[columns])
        found[-1] = max(found[-1], _LEAST_NOISE * self.reference)
        return found

    def reference_noise(self, white: float) -> float:
        """Return the noise of the reference, rounding included, from the white noise before it."""
        return float(np.hypot(white, self.reference / np.sqrt(12.0)))

    @property
    def coarse(self) -> bool:
        """Whether any observation is rounded coarsely."""
        return bool(self.channels or self.reference)

    @property
    def _coarse(self) -> list[tuple[slice, float]]:
        both = ((slice(None, -1), self.channels), (slice(-1, None), self.reference))
        return [(columns, step) for columns, step in both if step]

    @classmethod
    def of_reference(cls, values: NDArray[np.float64], noise: float) -> tuple[Steps, float]:
        """Return the steps that a reference's values (n,) are in, if coarse, and its white noise before rounding."""
        step = common_step(values)
        if step is None:
            return cls(), noise
        before = max(np.sqrt(max(noise**2 - step**2 / 12.0, 0.0)), _LEAST_NOISE * step)
        return (cls(reference=step), float(before)) if step > COARSE * before else (cls(), noise)


NO_STEPS = Steps()
"""Observations whose steps are finer than their noise."""


def common_step(values: NDArray[np.float64]) -> float | None:
    """Return the step that values (n,) are multiples of; None where there is none."""
    different = np.unique(values)
    gaps = np.diff(different)
    gaps = gaps[gaps > _LEAST_STEP]
    if len(gaps) < 2:
        return None
    step = float(gaps.min())
    ratio = gaps / step
    return step if np.max(np.abs(ratio - np.round(ratio))) < _OFF_GRID else None


def rounded_likelihood(
    error: NDArray[np.float64], quantum: float, sigma: NDArray[np.float64] | float
) -> WorkingResidual:
    """Expand the likelihood of rounded readings about a prediction.

    Parameters
    ----------
    error : ndarray, shape (n, c)
        Reading minus prediction, m/s².
    quantum : float
        Rounding step q, m/s².
    sigma : ndarray, shape (c,), or float
        White noise before rounding, m/s².
    """
    # By symmetry the prediction lies below the reading: both limits are then well inside the range of Φ's logarithm.
    side = np.where(error < 0, -1.0, 1.0)
    true_lower = (np.abs(error) - 0.5 * quantum) / sigma
    # Farther off, the squares of the limits lose all digits of their difference; there only the nearer limit counts.
    lower = np.minimum(true_lower, _FAR)
    upper = lower + quantum / sigma
    if lower.max(initial=0.0) < _NEAR:
        probability = ndtr(-lower) - ndtr(-upper)
        log_p = np.log(probability)
        density_upper = np.exp(-0.5 * upper**2) / (np.sqrt(2 * np.pi) * probability)
        density_lower = np.exp(-0.5 * lower**2) / (np.sqrt(2 * np.pi) * probability)
    else:
        log_outer, log_inner = log_ndtr(-upper), log_ndtr(-lower)
        log_p = log_inner + np.log1p(-np.exp(log_outer - log_inner))
        density_upper = np.exp(-0.5 * upper**2 - log_p) / np.sqrt(2 * np.pi)
        density_lower = np.exp(-0.5 * lower**2 - log_p) / np.sqrt(2 * np.pi)
    beyond = true_lower - lower
    score = density_lower - density_upper + beyond  # σ d log p/dx
    curvature = (score - beyond) ** 2 - (lower * density_lower - upper * density_upper)  # −σ² d² log p/dx²
    weight = np.sqrt(np.clip(curvature, _LEAST_WEIGHT**2, 1.0))
    return WorkingResidual(side * sigma * score / weight, weight, beyond * (true_lower + lower) - 2.0 * log_p)


def rounding_noise(error: NDArray[np.float64], quantum: float, sigma: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the white noise before rounding that makes rounded readings most likely, shape (c,).

    Parameters
    ----------
    error : ndarray, shape (n, c)
        Reading minus prediction, m/s²; NaN where invalid.
    quantum : float
        Rounding step, m/s².
    sigma : ndarray, shape (c,)
        Noise to search around, m/s².
    """
    values = [np.nansum(rounded_likelihood(error, quantum, factor * sigma).deviance) for factor in _NOISE_FACTORS]
    return np.asarray(_NOISE_FACTORS[int(np.argmin(values))] * sigma)


def between_steps(t: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what passes through the steps of rounded readings of something slow; others are returned as they are.

    Where a reading changes from one value to the next, what it rounds is half way between them. A board's temperature
    in sixteenths of a degree would otherwise leave a strong dependence on it half a step off.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times, s.
    values : ndarray, shape (n,)
        Readings.
    """
    step = common_step(values)
    after = np.flatnonzero(np.diff(values)) + 1
    if step is None:
        return values
    back = np.count_nonzero(np.diff(np.sign(values[after] - values[after - 1])))
    if back > _MOST_CHANGES * len(values):
        return values
    times, levels = 0.5 * (t[after - 1] + t[after]), 0.5 * (values[after - 1] + values[after])
    onward = np.diff(levels) != 0.0
    if onward.sum() < _LEAST_CHANGES:
        return values
    apart = np.diff(times)
    change = np.concatenate([[0], np.cumsum(onward | (apart > _ONE_CHANGE * np.median(apart[onward])))])
    count = np.bincount(change)
    times, levels = np.bincount(change, times) / count, np.bincount(change, levels) / count
    through = CubicSpline(times, levels, bc_type="natural")
    inside = np.clip(t, times[0], times[-1])
    straight_on = through(inside) + through(inside, 1) * (t - inside)
    return np.asarray(np.clip(straight_on, values - 0.5 * step, values + 0.5 * step))
