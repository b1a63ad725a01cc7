"""The offset and the rate error between the clocks of two files, by what a turning body's accelerometers read.

About a fixed axis a channel reads c₀ + c₁·ω² + c₂·α; on a free body it reads a sum over the six products of ω and the
three components of α. For every offset these functions of the reference are fitted to the channels by least
squares; the offset of the best fit is the one sought. Correlations by FFT give all offsets at once, on a grid of rate
errors; a nonlinear fit refines the best.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft
from scipy.interpolate import CubicSpline

__all__ = ["Alignment", "Signals", "align", "functions_of", "uniform"]

_LEAST_OVERLAP = 0.5  # of the shorter file
_BLOCKS = 20  # of the overlap, whose pulls on the offset give its standard deviation
_LEAST_SPREAD = 1e-3  # rad/s: a reference that changes less carries no time
_ITERATIONS = 6
_MOST_RATES = 61  # of the grid of rate errors


@dataclass(frozen=True)
class Signals:
    """Channels and the reference on uniform grids of one step.

    Parameters
    ----------
    step : float
        Step, s.
    start, start_reference : float
        Time of the first row, each on its own clock, s.
    readings : ndarray, shape (n, c)
        Channels, m/s².
    rate : ndarray, shape (m, 1) or (m, 3)
        Angular rate of the reference, rad/s.
    """

    step: float
    start: float
    start_reference: float
    readings: NDArray[np.float64]
    rate: NDArray[np.float64]


@dataclass(frozen=True)
class Alignment:
    """Where a reference lies on the clock of the channels: t = offset + (1 + rate error) · t_reference.

    Parameters
    ----------
    offset : float
        Time of the channels' clock at which the reference's reads zero, s.
    rate_error : float
        Seconds of the channels' clock per second of the reference's, less one.
    offset_std, rate_error_std : float
        Standard deviations; of the offset in the middle of the overlap.
    explained : ndarray, shape (c,)
        Share of each channel's variance that the functions of the reference explain.
    independent : ndarray, shape (c,)
        How many independent samples the residuals have.
    coefficients : ndarray, shape (k, c)
        Of the functions, in the order of `functions_of`.
    coefficient_std : ndarray, shape (k, c)
        Their standard deviations.
    second_offset : float
        Next-best offset apart from this one, s; NaN without any.
    second_explained : ndarray, shape (c,)
        What that one explains.
    overlap_s : float
        Length of the common time, s.
    predicted : float
        Share of the variance of a quarter of the overlap that coefficients from the others explain, the worst quarter.
    """

    offset: float
    rate_error: float
    offset_std: float
    rate_error_std: float
    explained: NDArray[np.float64]
    independent: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    coefficient_std: NDArray[np.float64]
    second_offset: float
    second_explained: NDArray[np.float64]
    overlap_s: float
    predicted: float = float("nan")

    def odds_over(self, explained: NDArray[np.float64]) -> float:
        """Return the log odds, nats, of this fit over one that explains less of the same channels."""
        rest = np.maximum(1.0 - self.explained, 1e-9)
        other = np.maximum(1.0 - explained, 1e-9)
        return float(np.sum(0.5 * self.independent * np.log(other / rest)))


def uniform(
    t: NDArray[np.float64], values: NDArray[np.float64], step: float, start: float | None = None
) -> NDArray[np.float64]:
    """Return values on a uniform grid, (k, c): means of what falls into a step, a line between where nothing does."""
    first = t[0] if start is None else start
    count = int((t[-1] - first) / step) + 1
    place = np.clip(np.round((t - first) / step).astype(int), 0, count - 1)
    grid = np.empty((count, values.shape[1]))
    for column, series in enumerate(values.T):
        known = np.isfinite(series)
        sums = np.bincount(place[known], series[known], count)
        times = np.bincount(place[known], t[known] - first, count)
        numbers = np.bincount(place[known], minlength=count)
        filled = numbers > 0
        at = times[filled] / numbers[filled]
        grid[:, column] = np.interp(np.arange(count) * step, at, sums[filled] / numbers[filled])
    return grid


def functions_of(rate: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Return the functions of a rate that channels show, (m, k): ω², α; or six products and three of α."""
    alpha = np.gradient(rate, step, axis=0)
    if rate.shape[1] == 1:
        return np.column_stack([rate[:, 0] ** 2, alpha[:, 0]])
    x, y, z = rate.T
    return np.column_stack([x * x, y * y, z * z, x * y, x * z, y * z, alpha])


def align(signals: Signals, *, most_rate_error: float = 0.02, refine: bool = True) -> Alignment | None:
    """Find the offset and the rate error of the best fit; None where the reference does not change.

    Parameters
    ----------
    signals : Signals
        Channels and reference on uniform grids.
    most_rate_error : float
        Largest rate error that is searched.
    refine : bool
        Whether the best grid point is refined and given standard deviations.
    """
    if float(np.std(signals.rate, axis=0).max()) < _LEAST_SPREAD or len(signals.rate) < 8:
        return None
    best: tuple[float, float, int, NDArray[np.float64]] | None = None
    curves = []
    for rate_error in _rate_errors(signals, most_rate_error):
        lags, explained, odds = _curve(signals, rate_error)
        curves.append((rate_error, lags, explained, odds))
        place = int(np.argmax(odds))
        if best is None or odds[place] > best[0]:
            best = float(odds[place]), rate_error, int(lags[place]), explained[:, place]
    if best is None or not np.isfinite(best[0]):
        return None
    second_lag, second = _second(curves, best[1], best[2])
    offset = signals.start + best[2] * signals.step - (1.0 + best[1]) * signals.start_reference
    second_offset = signals.start + second_lag * signals.step - (1.0 + best[1]) * signals.start_reference
    return _refined(signals, offset, best[1], (second_offset, second), refine=refine)


def _width(signals: Signals) -> float:
    """Return the correlation time of the functions, s: the inverse of their rms frequency."""
    functions = functions_of(signals.rate, signals.step)
    functions = functions - functions.mean(axis=0)
    slope = np.gradient(functions, signals.step, axis=0)
    spread = np.maximum(functions.std(axis=0), 1e-12)
    return float(1.0 / max(np.max(slope.std(axis=0) / spread), 1e-3))


def _rate_errors(signals: Signals, most: float) -> Iterator[float]:
    """Yield rate errors so close that the ends of the files stay within half the width."""
    length = signals.step * min(len(signals.readings), len(signals.rate))
    step = _width(signals) / max(length, signals.step)
    count = min(int(np.ceil(most / step)), _MOST_RATES // 2) if most > 0.0 else 0
    for number in range(-count, count + 1):
        yield most * number / max(count, 1)


def _stretched(signals: Signals, rate_error: float) -> NDArray[np.float64]:
    """Return the functions of the reference on the channels' clock, (m', k)."""
    functions = functions_of(signals.rate, signals.step)
    if rate_error == 0.0:
        return functions
    old = np.arange(len(functions)) * (1.0 + rate_error)
    new = np.arange(int(old[-1]) + 1)
    return np.column_stack([np.interp(new, old, one) for one in functions.T])


def _curve(signals: Signals, rate_error: float) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
    """Return lags, the share explained of each channel (c, lags), and the log odds of every lag."""
    y, f = signals.readings, _stretched(signals, rate_error)
    n, m = len(y), len(f)
    size = next_fast_len(n + m)
    lags = np.arange(-(m - 1), n)  # row of the channels at which the reference begins
    y = y - y.mean(axis=0)
    f = (f - f.mean(axis=0)) / np.maximum(f.std(axis=0), 1e-12)
    spectra_y, spectra_f = rfft(np.column_stack([np.ones(n), y]), size, axis=0), rfft(f, size, axis=0)
    one = rfft(np.ones(m), size)

    def correlated(channel: NDArray[np.complex128], reference: NDArray[np.complex128]) -> NDArray[np.float64]:
        found = irfft(channel * reference.conj(), size)
        return np.concatenate([found[size - (m - 1) :], found[:n]]) if m > 1 else found[:n]

    ones = spectra_y[:, 0]
    count = np.maximum(np.round(correlated(ones, one)), 1.0)
    k = f.shape[1]
    means = np.array([correlated(ones, spectra_f[:, j]) for j in range(k)]) / count  # (k, lags)
    gram = np.empty((len(lags), k, k))
    for i in range(k):
        for j in range(i, k):
            product = rfft(f[:, i] * f[:, j], size)
            gram[:, i, j] = gram[:, j, i] = correlated(ones, product) - count * means[i] * means[j]
    ridge = 1e-6 * count[:, None] + 1e-9
    gram[:, np.arange(k), np.arange(k)] += ridge
    explained = np.zeros((y.shape[1], len(lags)))
    for channel in range(y.shape[1]):
        mean = correlated(spectra_y[:, channel + 1], one) / count
        total = correlated(rfft(y[:, channel] ** 2, size), one) - count * mean**2
        cross = np.array([correlated(spectra_y[:, channel + 1], spectra_f[:, j]) for j in range(k)])
        cross -= count * means * mean
        solved = np.linalg.solve(gram, cross.T[:, :, None])[:, :, 0]
        explained[channel] = np.sum(solved * cross.T, axis=1) / np.maximum(total, 1e-12)
    explained = np.clip(explained, 0.0, 1.0 - 1e-9)
    usable = count >= _LEAST_OVERLAP * min(n, m)
    odds = np.where(usable, -0.5 * count * np.log1p(-explained).sum(axis=0), -np.inf)
    return lags, explained, odds


def _second(
    curves: list[tuple[float, NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]],
    rate_error: float,
    lag: int,
) -> tuple[float, NDArray[np.float64]]:
    """Return the best lag apart from the slope of the best one, at its rate error, and what it explains."""
    _, lags, explained, odds = min(curves, key=lambda one: abs(one[0] - rate_error))
    place = int(np.argmax(lags == lag))
    left, right = place, place
    while left > 0 and odds[left - 1] < odds[left]:  # down both sides of the peak
        left -= 1
    while right < len(odds) - 1 and odds[right + 1] < odds[right]:
        right += 1
    apart = np.ones(len(odds), dtype=bool)
    apart[left : right + 1] = False
    inner = np.flatnonzero(apart & np.isfinite(odds))
    if not len(inner):
        return float("nan"), np.zeros(len(explained))
    second = int(inner[np.argmax(odds[inner])])
    return float(lags[second]), explained[:, second]


def _refined(
    signals: Signals, offset: float, rate_error: float, second: tuple[float, NDArray[np.float64]], *, refine: bool
) -> Alignment:
    """Refine offset and rate error by least squares over the overlap, and give them standard deviations."""
    t = signals.start + np.arange(len(signals.readings)) * signals.step
    t_reference = signals.start_reference + np.arange(len(signals.rate)) * signals.step
    spline = CubicSpline(t_reference, functions_of(signals.rate, signals.step))
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

    steps = np.array([0.05 * signals.step, 0.05 * signals.step / max(end - begin, signals.step)])
    found, covariance = np.array([0.0, rate_error]), np.full((2, 2), np.nan)
    for _ in range(_ITERATIONS if refine else 0):
        residual = fitted(found)[0]
        weight = _share(residual) / np.maximum(residual.var(axis=0), 1e-18)
        slopes = [(fitted(found + step)[0] - fitted(found - step)[0]) / (2.0 * step.max()) for step in np.diag(steps)]
        information = np.array([[np.sum(weight * np.sum(a * b, axis=0)) for b in slopes] for a in slopes])
        gradient = np.array([np.sum(weight * np.sum(a * residual, axis=0)) for a in slopes])
        found = found - np.linalg.pinv(information) @ gradient
    if refine:
        covariance = _robust(information, slopes, residual, weight)
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
        float(np.sqrt(covariance[0, 0])),
        float(np.sqrt(covariance[1, 1])),
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


def _robust(
    information: NDArray[np.float64],
    slopes: list[NDArray[np.float64]],
    residual: NDArray[np.float64],
    weight: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the covariance of shift and rate error from how differently the blocks of the overlap pull, (2, 2).

    The noise of the reference and what the functions don't describe are slow: samples are far from independent.
    """
    pulls = np.array(
        [
            [np.sum(weight * np.sum(slope[rows] * residual[rows], axis=0)) for slope in slopes]
            for rows in np.array_split(np.arange(len(residual)), _BLOCKS)
        ]
    )  # (blocks, 2)
    inverse = np.linalg.pinv(information)
    spread = inverse @ (pulls.T @ pulls) @ inverse
    return np.asarray(spread if np.trace(spread) > np.trace(inverse) else inverse)


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
