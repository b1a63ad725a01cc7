"""Channels and a reference on grids of one step, and what an alignment of them is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from gfimu.base.declared import Declared, figure

__all__ = ["Alignment", "Signals", "channel_groups", "functions_of", "smooth", "uniform"]


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
    counted : ndarray of bool, shape (n, c)
        Readings that count: no clipped sample is in their smoothing window.
    functions : ndarray, shape (m, k)
        Functions of the reference (`functions_of`), as smooth as the channels.
    rate : ndarray, shape (m, 1) or (m, 3)
        Angular rate, rad/s.
    angle : ndarray, shape (m,), optional
        Angle of a table, rad; None for a free body.
    angle_walk : float
        Random walk of that angle, from the noise of the rates it is integrated from, rad/√s.
    width : int
        Samples of the smoothing window.
    noisy : float
        Share of the variance of α that is noise of the reference.
    """

    step: float
    start: float
    start_reference: float
    readings: NDArray[np.float64]
    counted: NDArray[np.bool_]
    functions: NDArray[np.float64]
    rate: NDArray[np.float64]
    angle: NDArray[np.float64] | None = None
    angle_walk: float = 0.0
    width: int = 1
    noisy: float = 0.0

    @property
    def gravity(self) -> NDArray[np.complex128]:
        """Return exp(iθ) of the table's angle, as smooth as the channels, shape (m,)."""
        if self.angle is None:
            raise ValueError("a free body has no angle")
        wave = smooth(np.column_stack([np.cos(self.angle), np.sin(self.angle)]), self.width)
        return np.asarray(wave[:, 0] + 1j * wave[:, 1])

    def coarser(self, step: float) -> Signals:
        """Return means of as many rows as fit into a step, s; of the readings, of those that count."""
        rows = max(int(step / self.step), 1)
        if rows == 1:
            return self
        late = 0.5 * (rows - 1) * self.step
        sums, counts = (
            np.add.reduceat(one, np.arange(0, len(one) - rows + 1, rows), axis=0)
            for one in (np.where(self.counted, self.readings, 0.0), self.counted.astype(float))
        )
        n, m = len(sums), len(self.functions) // rows
        functions, rate = (one[: m * rows].reshape(m, rows, -1).mean(axis=1) for one in (self.functions, self.rate))
        return replace(
            self,
            step=rows * self.step,
            start=self.start + late,
            start_reference=self.start_reference + late,
            readings=(sums / np.maximum(counts, 1.0))[:n],
            counted=counts > 0.5 * rows,
            functions=functions,
            rate=rate,
            angle=None,
        )


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
        Of the functions, in the order of `functions_of`.
    coefficient_std : ndarray, shape (k, c)
        Their standard deviations.
    second_offset : float
        Next-best offset apart from this one, s; NaN without any.
    second_explained : ndarray, shape (c,)
        What that one explains.
    predicted : float
        Share of the variance of a quarter of the overlap that coefficients from the others explain, the worst quarter.
    at_bound : bool
        Whether the rate error is at the bound of its search.
    odds_of_motion : float
        Log odds of the fit over one by a motion that any offset explains, with drifts quadratic in time, nats.
    """

    offset: Annotated[
        float,
        figure(
            "Time of the channels' clock at which the reference's reads zero.",
            "s",
            key="offset_s",
            form=".6g",
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
    explained: NDArray[np.float64]
    independent: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    coefficient_std: NDArray[np.float64]
    second_offset: float
    second_explained: NDArray[np.float64]
    predicted: float = float("nan")
    at_bound: bool = False
    odds_of_motion: float = float("inf")  # fmt: skip

    @property
    def largest_std(self) -> float:
        """Standard deviation of the time between the clocks at the ends of the overlap, s."""
        return float(np.hypot(self.offset_std, 0.5 * self.overlap_s * self.rate_error_std))

    def odds_over(self, explained: NDArray[np.float64]) -> float:
        """Return the log odds, nats, of this fit over one that explains less of the same channels."""
        rest = np.maximum(1.0 - self.explained, 1e-9)
        other = np.maximum(1.0 - explained, 1e-9)
        return float(np.sum(0.5 * self.independent * np.log(other / rest)))


def uniform(
    t: NDArray[np.float64], values: NDArray[np.float64], step: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return values on a uniform grid, (k, c), and where they are read or lie between two steps that are.

    They are means of what falls into a step, and on a line between where nothing does.
    """
    count = int((t[-1] - t[0]) / step) + 1
    place = np.clip(np.round((t - t[0]) / step).astype(int), 0, count - 1)
    grid = np.zeros((count, values.shape[1]))
    known = np.zeros(grid.shape, dtype=bool)
    for column, series in enumerate(values.T):
        finite = np.isfinite(series)
        sums = np.bincount(place[finite], series[finite], count)
        times = np.bincount(place[finite], t[finite] - t[0], count)
        numbers = np.bincount(place[finite], minlength=count)
        filled = numbers > 0
        if not filled.any():  # a dead channel: constant, as one that is stuck
            continue
        at = times[filled] / numbers[filled]
        grid[:, column] = np.interp(np.arange(count) * step, at, sums[filled] / numbers[filled])
        known[:, column] = filled
        known[1:-1, column] |= filled[:-2] & filled[2:]
    return grid, known


def smooth(values: NDArray[np.float64], width: int) -> NDArray[np.float64]:
    """Return series (n, k) smoothed by a Hann window of some samples, an odd number."""
    window = np.hanning(width + 2)[1:-1]
    window = np.asarray(window / window.sum())
    half = width // 2
    padded = np.pad(values, ((half, half), (0, 0)), mode="edge")
    return np.column_stack([np.convolve(one, window, mode="valid") for one in padded.T])


def functions_of(rate: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Return the functions of a rate that channels show, (m, k): ω², α; or six products and three of α."""
    alpha = np.gradient(rate, step, axis=0)
    if rate.shape[1] == 1:
        return np.column_stack([rate[:, 0] ** 2, alpha[:, 0]])
    x, y, z = rate.T
    return np.column_stack([x * x, y * y, z * z, x * y, x * z, y * z, alpha])


def channel_groups(counted: NDArray[np.bool_]) -> Iterator[tuple[NDArray[np.bool_], NDArray[np.intp]]]:
    """Yield the rows that count, (n,), and the channels of which these count."""
    rows, group = np.unique(counted, axis=1, return_inverse=True)
    for index, mine in enumerate(rows.T):
        yield mine, np.flatnonzero(group.ravel() == index)
