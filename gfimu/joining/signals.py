"""Channels and a reference on grids of one step, and what an alignment of them is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Alignment", "Signals", "functions_of", "uniform"]


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
    functions : ndarray, shape (m, k)
        Functions of the reference (`functions_of`), as smooth as the channels.
    """

    step: float
    start: float
    start_reference: float
    readings: NDArray[np.float64]
    functions: NDArray[np.float64]


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
        if not filled.any():  # a dead channel: constant, as one that is stuck
            grid[:, column] = 0.0
            continue
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
