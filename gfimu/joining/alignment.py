"""The offset and the rate error between the clocks of two files, by what a turning body's accelerometers read.

About a fixed axis a channel reads c₀ + c₁·ω² + c₂·α; on a free body it reads a sum over the six products of ω and the
three components of α. For every offset these functions of the reference are fitted to the channels by least
squares; the offset of the best fit is the one sought. Correlations by FFT give all offsets at once, on a grid of rate
errors; a nonlinear fit refines the best. Channels and functions go through one smoothing window: what a slow or noisy
reference can't show is then missing in both.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from gfimu.joining.refinement import refined
from gfimu.joining.signals import Alignment, Signals

__all__ = ["align"]

_LEAST_OVERLAP = 0.5  # of the shorter file
_LEAST_SPREAD = 1e-3  # rad²/s² or rad/s²: a reference whose functions change less carries no time
_MOST_RATES = 61  # of the grid of rate errors


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
    if float(np.std(signals.functions, axis=0).max()) < _LEAST_SPREAD or len(signals.functions) < 8:
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
    return refined(signals, offset, best[1], (second_offset, second), refine=refine)


def _width(signals: Signals) -> float:
    """Return the correlation time of the functions, s: the inverse of their rms frequency."""
    functions = signals.functions - signals.functions.mean(axis=0)
    slope = np.gradient(functions, signals.step, axis=0)
    spread = np.maximum(functions.std(axis=0), 1e-12)
    return float(1.0 / max(np.max(slope.std(axis=0) / spread), 1e-3))


def _rate_errors(signals: Signals, most: float) -> Iterator[float]:
    """Yield rate errors so close that the ends of the files stay within half the width."""
    length = signals.step * min(len(signals.readings), len(signals.functions))
    step = _width(signals) / max(length, signals.step)
    count = min(int(np.ceil(most / step)), _MOST_RATES // 2) if most > 0.0 else 0
    for number in range(-count, count + 1):
        yield most * number / max(count, 1)


def _stretched(signals: Signals, rate_error: float) -> NDArray[np.float64]:
    """Return the functions of the reference on the channels' clock, (m', k)."""
    functions = signals.functions
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
