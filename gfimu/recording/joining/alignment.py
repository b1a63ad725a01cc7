"""The offset and the rate error between the clocks of two files, by what a turning body's accelerometers read.

About a fixed axis a channel reads c₀ + c₁·ω² + c₂·α and, where the axis leans, gravity once per turn,
c₃·cos θ + c₄·sin θ; on a free body it reads a sum over the six products of ω and the three components of α. For every
offset these functions of the reference are fitted to the channels by least squares; the offset of the best fit is the
one sought. Correlations by FFT give all offsets at once, on a grid of rate errors; a nonlinear fit refines the best
few, and only there gravity counts: its phase is lost on a grid that isn't far finer. Channels and functions go through
one smoothing window: what a slow or noisy reference can't show is then missing in both.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from gfimu.recording.joining.refinement import refined
from gfimu.recording.joining.signals import Alignment, Signals, channel_groups

__all__ = ["align"]

_LEAST_OVERLAP = 0.5  # of the shorter file
_LEAST_SPREAD = 1e-3  # rad²/s² or rad/s²: a reference whose functions change less carries no time
_MOST_RATES = 61  # of the grid of rate errors
_PER_WIDTH = 8.0  # steps of the search per correlation time of the functions
_CANDIDATES = 4  # offsets that are refined


def align(signals: Signals, *, most_rate_error: float = 0.02, refine: bool = True) -> Alignment | None:
    """Find the offset and the rate error of the best fit; None where the reference does not change.

    Parameters
    ----------
    signals : Signals
        Channels and reference on uniform grids.
    most_rate_error : float
        Largest rate error that is searched.
    refine : bool
        Whether the best grid points are refined and given standard deviations.
    """
    if float(np.std(signals.functions, axis=0).max()) < _LEAST_SPREAD or len(signals.functions) < 8:
        return None
    width = _width(signals)
    starts = _candidates(signals.coarser(width / _PER_WIDTH), most_rate_error, width, _CANDIDATES if refine else 1)
    if not starts:
        return None
    found = [refined(signals, *start, most_rate_error if refine else None) for start in starts]
    found.sort(key=lambda one: one.odds, reverse=True)
    found[:2] = sorted((one.whole if refine else one for one in found[:2]), key=lambda one: one.odds, reverse=True)
    best = found[0].alignment
    middle = _middle(signals)
    for one in (other.alignment for other in found[1:]):
        if abs(one.offset - best.offset + (one.rate_error - best.rate_error) * middle) > width:
            return replace(best, second_offset=one.offset, second_explained=one.explained)
    return best


def _middle(signals: Signals) -> float:
    """Return the middle of the reference on its own clock, s."""
    return signals.start_reference + 0.5 * signals.step * (len(signals.functions) - 1)


def _width(signals: Signals) -> float:
    """Return the correlation time of the products of the rate, s: the inverse of their rms frequency."""
    products = signals.functions[:, : (1 if signals.rate.shape[1] == 1 else 6)]
    slope = np.gradient(products, signals.step, axis=0)
    spread = np.maximum(products.std(axis=0), 1e-12)
    return float(1.0 / max(np.max(slope.std(axis=0) / spread), 1e-3))


def _candidates(signals: Signals, most: float, width: float, count: int) -> list[tuple[float, float]]:
    """Return offsets, s, and rate errors at which the fit is best among its neighbours, the best first."""
    middle = _middle(signals)
    peaks = []
    for rate_error in _rate_errors(signals, most, width):
        lags, odds = _curve(signals, rate_error)
        padded = np.concatenate([[-np.inf], odds, [-np.inf]])
        best = np.isfinite(odds) & (odds >= padded[:-2]) & (odds >= padded[2:])
        for lag, height in zip(lags[best], odds[best], strict=True):
            offset = signals.start + lag * signals.step - (1.0 + rate_error) * signals.start_reference
            peaks.append((float(height), float(offset), rate_error, offset + (1.0 + rate_error) * middle))
    chosen: list[tuple[float, float, float, float]] = []
    for peak in sorted(peaks, reverse=True):
        if all(abs(peak[3] - one[3]) > width for one in chosen):
            chosen.append(peak)
        if len(chosen) == count:
            break
    return [(offset, rate_error) for _, offset, rate_error, _ in chosen]


def _rate_errors(signals: Signals, most: float, width: float) -> Iterator[float]:
    """Yield rate errors so close that the ends of the files stay within half the width."""
    length = signals.step * min(len(signals.readings), len(signals.functions))
    step = width / max(length, signals.step)
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


def _curve(signals: Signals, rate_error: float) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return lags, and the log odds of every lag over no relation."""
    f = _stretched(signals, rate_error)
    n, m = len(signals.readings), len(f)
    size = next_fast_len(n + m)
    lags = np.arange(-(m - 1), n)  # row of the channels at which the reference begins
    f = (f - f.mean(axis=0)) / np.maximum(f.std(axis=0), 1e-12)
    k = f.shape[1]
    one, spectra_f = rfft(np.ones(m), size), rfft(f, size, axis=0)
    pairs = [(i, j, rfft(f[:, i] * f[:, j], size)) for i in range(k) for j in range(i, k)]

    def correlated(channel: NDArray[np.complex128], reference: NDArray[np.complex128]) -> NDArray[np.float64]:
        found = irfft(channel * reference.conj(), size)
        return np.concatenate([found[size - (m - 1) :], found[:n]]) if m > 1 else found[:n]

    odds = np.zeros(len(lags))
    for rows, channels in channel_groups(signals.counted):
        ones = rfft(rows.astype(float), size)
        count = np.maximum(np.round(correlated(ones, one)), 1.0)
        means = np.array([correlated(ones, spectra_f[:, j]) for j in range(k)]) / count  # (k, lags)
        gram = np.empty((len(lags), k, k))
        for i, j, product in pairs:
            gram[:, i, j] = gram[:, j, i] = correlated(ones, product) - count * means[i] * means[j]
        gram[:, np.arange(k), np.arange(k)] += 1e-6 * count[:, None] + 1e-9
        for channel in channels:
            y = np.where(rows, signals.readings[:, channel], 0.0)
            y = np.where(rows, y - y.sum() / max(rows.sum(), 1), 0.0)
            spectrum = rfft(y, size)
            mean = correlated(spectrum, one) / count
            total = correlated(rfft(y**2, size), one) - count * mean**2
            cross = np.array([correlated(spectrum, spectra_f[:, j]) for j in range(k)]) - count * means * mean
            solved = np.linalg.solve(gram, cross.T[:, :, None])[:, :, 0]
            explained = np.sum(solved * cross.T, axis=1) / np.maximum(total, 1e-12)
            odds -= 0.5 * count * np.log1p(-np.clip(explained, 0.0, 1.0 - 1e-9))
        odds[count < _LEAST_OVERLAP * min(n * float(rows.mean()), m)] = -np.inf
    return lags, odds
