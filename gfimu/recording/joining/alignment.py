"""The offset and the rate error between the clocks of two files on one rigid body.

The readings of one file are linear in functions of the other (`gfimu.recording.joining.basis`). For every offset these
functions are fitted to the readings by least squares; the offset of the best fit is the one sought. Correlations by FFT
give all offsets at once, on a grid of rate errors. A nonlinear fit (`gfimu.recording.joining.fit`) refines the best
few, each a hypothesis with its log odds over no relation at all.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from gfimu.base.declared import Declared, figure
from gfimu.recording.joining.basis import Basis, Readings
from gfimu.recording.joining.fit import Fit, leaning, mixed, refined

__all__ = ["Alignment", "align"]

_LEAST_OVERLAP = 0.5  # of the shorter file
_LEAST_SPREAD = 1e-3  # rad²/s², rad/s² or m/s²: a reference whose functions change less carries no time
_MOST_RATES = 61  # of the grid of rate errors
_PER_WIDTH = 8.0  # steps of the search per correlation time of the functions
_MOST_STEPS = 20_000  # of the search, in both files together
_CANDIDATES, _LIKELY = 5, 4  # offsets that are refined, and starts with gravity
_ODDS = 100.0  # nats, by which the best offset has to beat the next, and drifts: foreign files reach 40, own ones 250
_LOST = 0.2  # of the variance, on a quarter that the fit did not see


@dataclass(frozen=True)
class Alignment(Declared):
    """Where a reference lies on the clock of the channels: t = offset + (1 + rate error) · t_reference.

    Parameters
    ----------
    explained : ndarray, shape (c,)
        Share of each channel's variance that the functions of the reference explain.
    independent : ndarray, shape (c,)
        How many independent samples the residuals have.
    coefficients : ndarray, shape (k, c)
        Of the functions, in the order of the `Basis`.
    coefficient_std : ndarray, shape (k, c)
        Their standard deviations.
    lost : float
        Share of the variance of a quarter of the overlap that coefficients of its own explain and those of the other
        quarters don't, in the worst quarter.
    at_bound : bool
        Whether the rate error is at the bound of its search.
    odds_of_motion : float
        Log odds of the fit over one by a motion that any offset explains, with drifts quadratic in time, nats.
    middle_s : float
        Middle of the common time on the channels' clock, s.
    """

    offset: Annotated[
        float,
        figure(
            "Time of the channels' clock at which the reference's reads zero.",
            "s",
            key="offset_s",
            form=".7g",
            head="offset (time of the channels where the reference reads 0)",
        ),
    ]
    offset_std: Annotated[
        float,
        figure(
            "Its standard deviation, in the middle of the common time.",
            "s",
            key="offset_std_s",
            form=".2g",
            head="its standard deviation, in the middle",
        ),
    ]
    rate_error: Annotated[
        float,
        figure(
            "Seconds of the channels' clock per second of the reference's, less one.",
            form=".4g",
            head="rate error of the clocks",
        ),
    ]
    rate_error_std: Annotated[
        float, figure("Its standard deviation.", form=".2g", head="standard deviation of the rate error")
    ]
    overlap_s: Annotated[float, figure("Common time.", "s", form=".5g", head="common time")]
    second_offset: Annotated[
        float,
        figure(
            "Next-best offset apart from this one; null without any.",
            "s",
            key="second_offset_s",
            form=".7g",
            head="next-best offset",
        ),
    ]
    odds_over_second: Annotated[
        float,
        figure(
            "Log odds over the next-best offset.",
            "nats",
            key="log_odds_over_second",
            form=".0f",
            head="log odds over the next-best offset",
        ),
    ]
    explained: NDArray[np.float64]
    independent: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    coefficient_std: NDArray[np.float64]
    lost: float
    at_bound: bool
    odds_of_motion: float
    middle_s: float

    @property
    def largest_std(self) -> float:
        """Standard deviation of the time between the clocks at the ends of the overlap, s."""
        return float(np.hypot(self.offset_std, 0.5 * self.overlap_s * self.rate_error_std))

    @property
    def doubts(self) -> list[str]:
        """Why the two files may not belong together, or another offset may be the true one; empty if nothing is odd."""
        found = []
        if self.odds_over_second < _ODDS:
            found.append(
                f"an offset of {self.second_offset:.6g} s fits nearly as well as {self.offset:.6g} s "
                f"(odds of 1 to e^{max(self.odds_over_second, 0.0):.2g})"
            )
        if self.odds_of_motion < _ODDS:
            found.append("the reference changes too little: its functions hardly show in the channels")
        if self.lost > _LOST:
            found.append(
                "a quarter of the recording has other coefficients than the rest, which miss "
                f"{100 * min(self.lost, 1.0):.0f}% of its variance"
            )
        return found

    def apart(self, t: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """Return by how much the channels' clock is ahead of the reference's at times of the channels, s."""
        return np.asarray(t - (t - self.offset) / (1.0 + self.rate_error))


def align(readings: Readings, basis: Basis, *, most_rate_error: float = 0.02) -> Alignment | None:
    """Find the offset and the rate error of the best fit; None where the reference does not change.

    Parameters
    ----------
    readings : Readings
        What is aligned.
    basis : Basis
        Functions of the other file.
    most_rate_error : float
        Largest rate error that is searched.
    """
    if float(np.std(basis.searched, axis=0).max(initial=0.0)) < _LEAST_SPREAD or len(basis.searched) < 8:
        return None
    width = basis.width
    starts = _candidates(readings, basis, most_rate_error, width)
    fits = [refined(readings, basis, *start, most_rate_error) for start in starts]
    if not fits:
        return None
    if basis.is_table:
        likely = _likeliest([one.settled() for fit in fits for one in leaning(fit, readings)])
        fits = [one.whole() for one in likely[:_LIKELY]]
    fits = _likeliest(fits)

    def is_apart(one: Fit, other: Fit) -> bool:
        u = (other.middle - other.offset) / (1.0 + other.rate_error)
        return abs(one.offset + (1.0 + one.rate_error) * u - other.middle) > width

    lead = fits[0]
    here = [one.like(lead) for one in fits if not is_apart(one, lead)]
    kinds = [one for start in here for one in start.with_larger_walks()]
    best, found = mixed(kinds)
    other = [(one.surprise() - best.surprise(), one.offset) for one in kinds if is_apart(one, best)]
    other += [(best.odds_over(one.explained), one.offset) for one in fits if is_apart(one, best)]
    odds, second = min(other, default=(float("inf"), float("nan")))
    return Alignment(
        best.offset, found.std[0], best.rate_error, found.std[1], best.length, second, odds,
        found.explained, found.independent, found.coefficients, found.coefficient_std, found.lost,
        best.at_bound, found.odds_of_motion, best.middle,
    )  # fmt: skip


def _likeliest(fits: list[Fit]) -> list[Fit]:
    """Return fits in the order of their odds over no relation, the best first.

    The residual of a wrong offset is the signal, which is slow; so all are judged with the most independent residual.
    """
    share = np.max([one.share for one in fits], axis=0)
    return sorted(fits, key=lambda one: -replace(one, share=share).odds_over(0.0))


def _candidates(readings: Readings, basis: Basis, most: float, width: float) -> list[tuple[float, float]]:
    """Return offsets, s, and rate errors at which the fit is best among its neighbours, the best first."""
    spans = [one[-1] - one[0] for one in (readings.t_s, basis.times)]
    step = max(width / _PER_WIDTH, sum(spans) / _MOST_STEPS)
    t, u = (
        one[0] + step * np.arange(int(span / step) + 1)
        for one, span in zip((readings.t_s, basis.times), spans, strict=True)
    )
    y, x = (
        _means(at, old, series)
        for at, old, series in ((t, readings.t_s, readings.searched), (u, basis.times, basis.searched))
    )
    middle = 0.5 * (u[0] + u[-1])
    peaks = []
    for rate_error in _rate_errors(step, min(len(t), len(u)), most, width):
        lags, odds = _curve(y, _stretched(x, rate_error))
        padded = np.concatenate([[-np.inf], odds, [-np.inf]])
        best = np.isfinite(odds) & (odds >= padded[:-2]) & (odds >= padded[2:])
        for lag, height in zip(lags[best], odds[best], strict=True):
            offset = t[0] + lag * step - (1.0 + rate_error) * u[0]
            peaks.append((float(height), float(offset), rate_error, offset + (1.0 + rate_error) * middle))
    chosen: list[tuple[float, float, float, float]] = []
    for peak in sorted(peaks, reverse=True):
        if all(abs(peak[3] - one[3]) > width for one in chosen):
            chosen.append(peak)
        if len(chosen) == _CANDIDATES:
            break
    return [(offset, rate_error) for _, offset, rate_error, _ in chosen]


def _means(at: NDArray[np.float64], t: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return means of series (n, c) around uniform times (m,), s."""
    sums = np.vstack(
        [np.zeros(values.shape[1]), np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(t)[:, None], axis=0)]
    )
    half = 0.5 * (at[1] - at[0])
    ends = np.clip([at - half, at + half], t[0], t[-1])
    low, high = (np.column_stack([np.interp(one, t, whole) for whole in sums.T]) for one in ends)
    return np.asarray((high - low) / (ends[1] - ends[0])[:, None])


def _rate_errors(step: float, rows: int, most: float, width: float) -> Iterator[float]:
    """Yield rate errors so close that the ends of the files stay within half the width."""
    count = min(int(np.ceil(most * step * rows / width)), _MOST_RATES // 2) if most > 0.0 else 0
    for number in range(-count, count + 1):
        yield most * number / max(count, 1)


def _stretched(functions: NDArray[np.float64], rate_error: float) -> NDArray[np.float64]:
    """Return functions of the reference on the channels' clock, (m', k)."""
    old = np.arange(len(functions)) * (1.0 + rate_error)
    new = np.arange(int(old[-1]) + 1)
    return np.column_stack([np.interp(new, old, one) for one in functions.T])


def _curve(y: NDArray[np.float64], x: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return lags, and the log odds of every lag over no relation, of series (n, c) and functions (m, k)."""
    n, (m, k) = len(y), x.shape
    size = next_fast_len(n + m)
    lags = np.arange(-(m - 1), n)  # row of the series at which the functions begin
    y = y - y.mean(axis=0)
    x = (x - x.mean(axis=0)) / np.maximum(x.std(axis=0), 1e-12)

    def correlated(series: NDArray[np.complex128], functions: NDArray[np.complex128]) -> NDArray[np.float64]:
        found = irfft(series * functions.conj(), size, axis=0)
        return np.concatenate([found[size - (m - 1) :], found[:n]]) if m > 1 else found[:n]

    ones, one = (rfft(np.ones((length, 1)), size, axis=0) for length in (n, m))
    spectra_x, spectra_y = rfft(x, size, axis=0), rfft(y, size, axis=0)
    count = np.maximum(np.round(correlated(ones, one)), 1.0)  # (lags, 1)
    means = correlated(ones, spectra_x) / count
    i, j = np.triu_indices(k)
    products = correlated(ones, rfft(x[:, i] * x[:, j], size, axis=0)) - count * means[:, i] * means[:, j]
    gram = np.empty((len(lags), k, k))
    gram[:, i, j] = gram[:, j, i] = products
    gram[:, np.arange(k), np.arange(k)] += 1e-6 * count + 1e-9  # numerical
    mean = correlated(spectra_y, one) / count
    total = correlated(rfft(y**2, size, axis=0), one) - count * mean**2
    cross = np.stack([correlated(spectra_y, spectra_x[:, [place]]) for place in range(k)], axis=1)  # (lags, k, c)
    cross -= count[:, :, None] * means[:, :, None] * mean[:, None, :]
    explained = np.sum(np.linalg.solve(gram, cross) * cross, axis=1) / np.maximum(total, 1e-12)
    odds = -0.5 * count[:, 0] * np.log1p(-np.clip(explained, 0.0, 1.0 - 1e-9)).sum(axis=1)
    odds[count[:, 0] < _LEAST_OVERLAP * min(n, m)] = -np.inf
    return lags, odds
