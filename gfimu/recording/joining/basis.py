"""What two files on one rigid body have in common: functions of the one that the readings of the other are linear in.

Of a tachometer or an encoder: ω², α and gravity at the table's angle θ, cos θ and sin θ. Of a gyro: the six products
of ω, α, and gravity in axes that turn by the integral of ω; the gyro's drift turns these axes slowly, so gravity there
is quadratic in time. Of a logger: its accelerations, its gyro's rates, their products and α.

Each column of a reference is smoothed first, by the cosine transform of a smoothing spline (D. Garcia, Computational
Statistics & Data Analysis 54, 2010), whose penalty generalised cross-validation chooses; of an angle, its differences
are. So noise does not make the functions' coefficients small.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dctn, idctn
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from gfimu.recording.doubts.rails import rails_of
from gfimu.recording.doubts.samples import least_step

__all__ = ["Basis", "Readings", "by_chip", "smoothed"]

_MOST_ROWS = 20_000  # of a grid
_PER_WIDTH, _PER_RADIAN = 0.1, 0.3  # rows of the fit per correlation time, and of a table's angle per radian
_WEIGHTY = 0.1  # of the largest: series that change less carry little time
_LONGEST_GAP = 1.5  # steps of a grid, from which nothing is read between two rows
_PENALTIES = np.logspace(-4.0, 10.0, 57)  # of the smoothing spline, in units of the sample period to the fourth


@dataclass(frozen=True)
class Basis:
    """Functions of a file's time.

    Parameters
    ----------
    spline : CubicSpline
        Their values (k,) by time, s; of a table the last one is its angle, rad.
    is_table : bool
        Whether the last column is an angle, whose cosine and sine are the functions.
    walk : float
        Random walk of that angle, from the noise of the rates that it is integrated from, rad/√s; 0 of an encoder.
    searched : ndarray, shape (m, q)
        Series at ``times`` by which offsets are searched.
    times : ndarray, shape (m,)
        Uniform times, s.
    """

    spline: CubicSpline
    is_table: bool
    walk: float
    searched: NDArray[np.float64]
    times: NDArray[np.float64]

    @classmethod
    def of_table(cls, t: NDArray[np.float64], values: NDArray[np.float64], *, is_angle: bool) -> Basis:
        """Return the functions of a table's rate (m,), rad/s, or of its angle, rad."""
        if is_angle:
            step = max(float(np.median(np.diff(t))), float(t[-1] - t[0]) / _MOST_ROWS)
            u = t[0] + step * np.arange(int((t[-1] - t[0]) / step) + 1)  # uneven stamps would bias the differences
            t, values = 0.5 * (u[1:] + u[:-1]), np.diff(CubicSpline(t, values)(u)) / step
            u, smooth, noise = smoothed(t, values[:, None])
        else:
            u, smooth, noise = smoothed(t, values[:, None], least_noise=least_step(values) / 12.0**0.5)
        angle = CubicSpline(u, smooth[:, 0]).antiderivative()
        functions = np.column_stack([angle(u, 1) ** 2, angle(u, 2)])
        walk = 0.0 if is_angle else float(noise[0]) * float(u[1] - u[0]) ** 0.5
        wave = np.column_stack([np.cos(angle(u)), np.sin(angle(u))])
        slow = _correlation_time(wave, u) > 0.5 * _correlation_time(functions, u)  # else its phase is lost on a grid
        searched = np.column_stack([functions, wave]) if slow else functions
        return cls(CubicSpline(u, np.column_stack([functions, angle(u)])), True, walk, searched, u)

    @classmethod
    def of_body(
        cls, t: NDArray[np.float64], gyro: NDArray[np.float64] | None, channels: Mapping[str, NDArray[np.float64]]
    ) -> Basis:
        """Return the functions of a gyro's rates (m, 3), rad/s, and of a logger's accelerations (m,), m/s²."""
        known = [*([] if gyro is None else [gyro]), *(one[:, None] for one in channels.values())]
        u, values, _ = smoothed(t, np.column_stack(known))
        columns, searched = [], []
        if gyro is not None:
            rate = CubicSpline(u, values[:, :3])
            x, y, z = rate(u).T
            columns = [np.column_stack([x * x, y * y, z * z, x * y, x * z, y * z]), rate(u, 1)]
            if channels:
                columns.append(values[:, :3])
                searched.append(np.linalg.norm(values[:, :3], axis=1)[:, None])
            else:
                turned = _attitude(values[:, :3], float(u[1] - u[0]))
                searched = [*columns, turned]
                late = np.linspace(-1.0, 1.0, len(u))[:, None]
                columns += [turned, turned * late, turned * late**2]
        if channels:
            accelerations = values[:, -len(channels) :]
            columns.append(accelerations)
            searched.append(by_chip(accelerations, list(channels)))
        return cls(CubicSpline(u, np.column_stack(columns)), False, 0.0, np.column_stack(searched), u)

    @property
    def width(self) -> float:
        """Correlation time of what is searched, s."""
        return _correlation_time(self.searched, self.times)

    @property
    def step(self) -> float:
        """Longest time between rows that show the functions, s."""
        if not self.is_table:
            return _PER_WIDTH * self.width
        return min(_PER_WIDTH * self.width, _PER_RADIAN / max(float(np.abs(self.angle(self.times, 1)).max()), 1e-9))

    def angle(self, u: NDArray[np.float64] | float, order: int = 0) -> NDArray[np.float64]:
        """Return the angle of a table at times (n,), s, or a derivative of it by time."""
        return np.asarray(self.spline(u, order)[..., -1])

    def at(self, u: NDArray[np.float64], turned: NDArray[np.float64], *, leaning: bool) -> NDArray[np.float64]:
        """Return a constant and the functions at times (n,), s, shape (n, k).

        A table's angle is ``turned`` by so much (n,), rad; gravity is zero if it is not ``leaning``.
        """
        values = self.spline(u)
        if not self.is_table:
            return np.column_stack([np.ones(len(u)), values])
        wave = np.exp(1j * (values[:, -1] + turned)) * leaning
        return np.column_stack([np.ones(len(u)), values[:, :-1], wave.real, wave.imag])

    def slopes(
        self, u: NDArray[np.float64], matrix: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the derivatives of the functions, whose values are ``matrix``, by time and by the angle, (n, k)."""
        slopes = np.column_stack([np.zeros(len(u)), self.spline(u, 1)])
        by_angle = np.zeros(matrix.shape)
        if self.is_table:
            by_angle[:, -2], by_angle[:, -1] = -matrix[:, -1], matrix[:, -2]
            slopes = np.column_stack([slopes[:, :-1], by_angle[:, -2:] * slopes[:, -1:]])
        return slopes, by_angle


@dataclass(frozen=True)
class Readings:
    """Readings that are aligned with a basis: means over bins of one length.

    Parameters
    ----------
    t_s : ndarray, shape (n,)
        Mean times of the bins, s.
    values : ndarray, shape (n, c)
        Means; 0 where nothing was read.
    known : ndarray of bool, shape (n, c)
        Whether something was read.
    beyond : ndarray, shape (n, c)
        1 where the true value is above the reading, as it is clipped there, -1 below, else 0.
    searched : ndarray, shape (n, q)
        Series by which offsets are searched, without blanks.
    step : float
        Length of a bin, s.
    """

    t_s: NDArray[np.float64]
    values: NDArray[np.float64]
    known: NDArray[np.bool_]
    beyond: NDArray[np.float64]
    searched: NDArray[np.float64]
    step: float

    @classmethod
    def of(
        cls, t: NDArray[np.float64], values: NDArray[np.float64], step: float, chips: Sequence[str] = ()
    ) -> Readings:
        """Return means of values (n, c) at times (n,), s; searched by their sizes per chip where names are given."""
        period = float(np.median(np.diff(t)))
        step = period * max(int(max(step, float(t[-1] - t[0]) / _MOST_ROWS) / period), 1)
        place = np.round((t - t[0]) / step).astype(int)
        rows, place = np.unique(place, return_inverse=True)
        beyond = np.zeros(values.shape)
        for column, sides in zip(values.T, beyond.T, strict=True):
            for rail in rails_of(column):
                sides[rail.on] = 1.0 if rail.side == "most" else -1.0
        seen = np.isfinite(values)

        def sums(series: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.column_stack([np.bincount(place, one, len(rows)) for one in series.T])

        counts = sums(seen.astype(float))
        means = sums(np.where(seen, values, 0.0)) / np.maximum(counts, 1.0)
        times = np.bincount(place, t) / np.bincount(place)
        filled = np.array(means)
        for column, some in zip(filled.T, (counts > 0.0).T, strict=True):
            column[:] = np.interp(times, times[some], column[some]) if some.any() else 0.0
        searched = by_chip(filled, chips) if chips else filled
        return cls(times, means, counts > 0.0, np.sign(sums(beyond)), searched, step)


def smoothed(
    t: NDArray[np.float64], values: NDArray[np.float64], *, least_noise: float = 0.0
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return uniform times (m,), s, smooth values (m, c) at them, and their noise (c,).

    Cross-validation follows the stairs of slow values in coarse counts, whose errors are not independent; so the noise
    is at least that of the rounding.
    """
    step = max(float(np.median(np.diff(t))), float(t[-1] - t[0]) / _MOST_ROWS)
    u = t[0] + step * np.arange(int((t[-1] - t[0]) / step) + 1)
    place = np.clip(np.round((t - t[0]) / step).astype(int), 0, len(u) - 1)
    place = np.unique(place, return_inverse=True)[1]
    count = np.bincount(place)
    means = [np.bincount(place, one) / count for one in (t, *values.T)]
    grid = CubicSpline(means[0], np.column_stack(means[1:]))(u)
    gap = (
        np.diff(means[0], append=means[0][-1])[np.clip(np.searchsorted(means[0], u) - 1, 0, None)] > _LONGEST_GAP * step
    )
    lines = np.column_stack([np.interp(u, means[0], one) for one in means[1:]])
    grid[gap] = lines[gap]
    line = np.linspace(grid[0], grid[-1], len(u))  # so that the ends, which the transform mirrors, have no step
    waves = dctn(grid - line, axes=[0], norm="ortho")
    squared = 2.0 - 2.0 * np.cos(np.pi * np.arange(len(u)) / len(u))  # frequencies, of differences
    shape = 1.0 / (1.0 + _PENALTIES[:, None] * squared**2)  # (penalties, m)
    freedom = (1.0 - shape).sum(axis=1)[:, None]
    missed = (1.0 - shape) ** 2 @ waves**2  # (penalties, c)
    too_near = missed / freedom < least_noise**2
    best = np.argmin(np.where(too_near & ~too_near.all(axis=0), np.inf, missed / freedom**2), axis=0)
    noise = np.sqrt((missed / freedom)[best, np.arange(len(best))])
    return u, line + idctn(waves * shape[best].T, axes=[0], norm="ortho"), noise


def by_chip(values: NDArray[np.float64], names: Sequence[str]) -> NDArray[np.float64]:
    """Return the size of what each chip reads, which does not depend on its mounting, (n, chips)."""
    chips = list(dict.fromkeys(name[:-1] for name in names))
    places = [[index for index, name in enumerate(names) if name[:-1] == chip] for chip in chips]
    return np.column_stack([np.linalg.norm(values[:, one], axis=1) for one in places])


def _correlation_time(values: NDArray[np.float64], t: NDArray[np.float64]) -> float:
    """Return the correlation time of series (m, c), s: the inverse of its rms frequency, the fastest of them."""
    spread = np.maximum(values.std(axis=0), 1e-12)
    slope = np.gradient(values, t, axis=0).std(axis=0)
    return float(1.0 / max(np.max((slope / spread)[spread > _WEIGHTY * spread.max()]), 1e-3))


def _attitude(rate: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Return the direction cosines, (m, 9), of axes that turn at rates (m, 3), rad/s."""
    turns = Rotation.from_rotvec(0.5 * step * (rate[1:] + rate[:-1])).as_matrix()
    found = np.empty((len(rate), 3, 3))
    found[0] = np.eye(3)
    for row, turn in enumerate(turns):
        found[row + 1] = found[row] @ turn
    return found.reshape(-1, 9)
