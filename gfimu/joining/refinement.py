"""The refinement of an alignment: offset and rate error of the least squares over the overlap, and their errors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft
from scipy.interpolate import CubicSpline

from gfimu.joining.signals import Alignment, Signals

__all__ = ["refined"]

_BLOCKS = 20  # of the overlap, each left out once for the standard deviations
_ITERATIONS = 12
_STEP = 0.25  # of the grid, for derivatives
_FLATTEST = 1e-6  # of a second derivative, in units of its diagonal
_LEAST_FREEDOM = 4.0  # degrees, of a variance from few blocks
_SETTLED = 0.02  # standard deviations of the last step


def refined(
    signals: Signals, offset: float, rate_error: float, second: tuple[float, NDArray[np.float64]], *, refine: bool
) -> Alignment:
    """Refine offset and rate error by least squares over the overlap, and give them standard deviations."""
    t = signals.start + np.arange(len(signals.readings)) * signals.step
    t_reference = signals.start_reference + np.arange(len(signals.functions)) * signals.step
    spline = CubicSpline(t_reference, signals.functions)
    begin = max(t[0], offset + (1.0 + rate_error) * t_reference[0])
    end = min(t[-1], offset + (1.0 + rate_error) * t_reference[-1])
    margin = min(0.02 * (end - begin), 1.0) if refine else 0.0
    rows = (t >= begin + margin) & (t <= end - margin)
    middle = 0.5 * (begin + end)
    seen, y = t[rows], signals.readings[rows]
    scale = np.maximum(y.std(axis=0), 1e-9)

    def fitted(at: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return residuals, the matrix of the functions, and their coefficients for a shift and a rate error."""
        shift, rate = at
        inverse = (seen - middle - shift) / (1.0 + rate) + (middle - offset) / (1.0 + rate_error)
        matrix = np.column_stack([np.ones(len(seen)), spline(np.clip(inverse, t_reference[0], t_reference[-1]))])
        solution = np.linalg.lstsq(matrix, y, rcond=None)[0]
        return y - matrix @ solution, matrix, solution

    steps = np.diag([_STEP * signals.step, _STEP * signals.step / max(end - begin, signals.step)])
    block = np.arange(len(seen)) * _BLOCKS // max(len(seen), 1)

    def pulls(at: NDArray[np.float64], weight: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return half the gradient of the weighted squares of each block, (blocks, 2)."""
        residual = fitted(at)[0]
        slopes = [(fitted(at + step)[0] - fitted(at - step)[0]) / (2.0 * step.max()) for step in steps]
        return np.column_stack(
            [np.bincount(block, np.sum(weight * slope * residual, axis=1), _BLOCKS) for slope in slopes]
        )

    found, spread = np.array([0.0, rate_error]), np.full(2, np.nan)
    for _ in range(_ITERATIONS if refine else 0):
        weight = _weight(fitted(found)[0])
        pull = pulls(found, weight)
        bend = np.stack(
            [(pulls(found + one, weight) - pulls(found - one, weight)) / (2.0 * one.max()) for one in steps]
        )
        bend = 0.5 * (bend + bend.transpose(2, 1, 0)).transpose(1, 0, 2)  # (blocks, 2, 2)
        stationary = _inverse(bend.sum(axis=0))
        # Where few blocks hold the changes of motion, their scatter is small by chance in some recordings.
        spread = np.sqrt(np.maximum(_jackknife(pull, bend).diagonal(), stationary.diagonal()))
        step = -stationary @ pull.sum(axis=0)
        found = found + step
        if np.all(np.abs(step) < _SETTLED * spread):
            break
    residual, matrix, solution = fitted(found)
    variance = np.maximum(residual.var(axis=0), 1e-18)
    share = _share(residual)
    independent = share * len(seen) * _channels_that_differ(residual)
    gram = np.linalg.pinv(matrix.T @ matrix)
    std = np.sqrt(np.diag(gram)[1:, None] * (variance / share)[None, :])
    shift, rate = found
    final = middle + shift - (1.0 + rate) * (middle - offset) / (1.0 + rate_error)
    return Alignment(
        float(final),
        float(rate),
        float(spread[0]),
        float(spread[1]),
        1.0 - variance / scale**2,
        independent,
        solution[1:],
        std,
        second[0],
        second[1],
        float(end - begin),
        _predicted(matrix, y) if refine else float("nan"),
    )


def _predicted(matrix: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Return the share of a quarter's variance that coefficients from the other three explain, the worst quarter."""
    quarters = np.array_split(np.arange(len(y)), 4)
    total = np.sum((y - y.mean(axis=0)) ** 2) / 4.0
    worst = 1.0
    for rows in quarters:
        others = np.setdiff1d(np.arange(len(y)), rows)
        solution = np.linalg.lstsq(matrix[others], y[others], rcond=None)[0]
        missed = np.sum((y[rows] - matrix[rows] @ solution) ** 2)
        worst = min(worst, 1.0 - float(missed / max(total, np.sum((y[rows] - y[rows].mean(axis=0)) ** 2), 1e-18)))
    return worst


def _weight(residual: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the weight of each channel, (c,): independent samples per sample over their variance.

    With it half the second derivatives of the squares are the information on shift and rate error, if the residual is
    as large throughout.
    """
    return _share(residual) / np.maximum(residual.var(axis=0), 1e-18)


def _jackknife(pull: NDArray[np.float64], bend: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the covariance of shift and rate error, (2, 2), by leaving out each block of the overlap.

    Neither the noise of the reference nor what the functions don't describe is independent from sample to sample: both
    are slow, common to all channels, and large where the motion changes, in few of the blocks. Leaving a block out
    counts what it weighs itself (B. Efron, The Jackknife, the Bootstrap and Other Resampling Plans, SIAM 1982, ch. 3).

    Parameters
    ----------
    pull : ndarray, shape (blocks, 2)
        Half the gradient of each block's squares by shift and rate error.
    bend : ndarray, shape (blocks, 2, 2)
        Half their second derivatives. Those of the squares of the slopes alone hold the slope of the reference's noise,
        which no shift makes less: they would be too large.
    """
    whole = bend.sum(axis=0)
    left = np.array([_inverse(whole - one) @ mine for one, mine in zip(bend, pull, strict=True)])
    left -= left.mean(axis=0)
    # Few blocks may hold nearly all of it. Then it is a variance of few degrees of freedom (F. E. Satterthwaite,
    # Biometrics Bulletin 2, 1946; of Gaussian blocks the fourth power is three times the square of the second), and
    # what it divides has the wider spread of Student's t.
    power = np.maximum(np.square(left), 1e-300)
    freedom = np.maximum(3.0 * power.sum(axis=0) ** 2 / np.square(power).sum(axis=0), _LEAST_FREEDOM)
    wider = np.sqrt(freedom / (freedom - 2.0))
    return np.asarray((len(left) - 1.0) / len(left) * (left.T @ left) * np.outer(wider, wider))


def _inverse(bend: NDArray[np.float64]) -> NDArray[np.float64]:
    """Invert second derivatives, (2, 2), by absolute values: far from the best fit a step still goes down."""
    size = 1.0 / np.sqrt(np.maximum(np.abs(bend.diagonal()), 1e-300))
    power, turn = np.linalg.eigh(bend * np.outer(size, size))
    power = np.maximum(np.abs(power), _FLATTEST)
    return np.asarray(np.outer(size, size) * ((turn / power) @ turn.T))


def _channels_that_differ(residual: NDArray[np.float64]) -> float:
    """Return which share of the channels counts: an error of the reference is common to all of them."""
    scaled = residual / np.maximum(residual.std(axis=0), 1e-12)
    correlation = scaled.T @ scaled / len(scaled)
    return float(np.trace(correlation) ** 2 / np.sum(correlation**2) / len(correlation))


def _share(residual: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return which share of the samples of each channel's residual counts as independent, (c,)."""
    return np.array([1.0 / _correlation(one) for one in residual.T])


def _correlation(residual: NDArray[np.float64]) -> float:
    """Return how many samples of a residual count as one: its integrated autocorrelation, at least 1."""
    n = len(residual)
    spectrum = rfft(residual - residual.mean(), next_fast_len(2 * n))
    covariance = irfft(np.abs(spectrum) ** 2, next_fast_len(2 * n))[: n // 2]
    if covariance[0] <= 0.0:
        return 1.0
    normal = covariance / covariance[0]
    below = np.flatnonzero(normal < 0.0)
    stop = int(below[0]) if len(below) else len(normal)
    return float(max(1.0 + 2.0 * normal[1:stop].sum(), 1.0))
