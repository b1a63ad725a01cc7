"""The board's clock against the host's: a robust straight line through the arrivals, with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.frames import Samples, Status

__all__ = ["ClockFit", "HostClock", "SampleRate"]

_WINDOW_S = 1.0
_HUBER = 1.345  # 95 % efficient for normal errors
_ITERATIONS = 30
_MAD_TO_STD = 1.4826


@dataclass(frozen=True)
class ClockFit:
    """Straight line host time = offset + (1 + rate_error) · board time.

    Parameters
    ----------
    offset_s, offset_std_s : float
        Host time at the mean board time of the fit, less that board time, s.
    rate_error, rate_error_std : float
        How much faster the host's clock runs than the board's, relative.
    mean_board_s : float
        Board time at which the offset holds, s.
    residual_s : float
        Robust spread of the arrivals about the line, s.
    windows : int
        Points of the fit.
    """

    offset_s: float
    offset_std_s: float
    rate_error: float
    rate_error_std: float
    mean_board_s: float
    residual_s: float
    windows: int

    def to_host(self, board_s: NDArray[np.float64] | float) -> NDArray[np.float64] | float:
        """Host time of a board time, s."""
        return board_s + self.offset_s + self.rate_error * (board_s - self.mean_board_s)


class HostClock:
    """Collects arrivals and fits the line.

    Bytes arrive late, never early, so of each second only the arrival with the smallest delay is kept: memory grows by
    one point a second. The line through these points is fitted by iteratively reweighted least squares with Huber's
    weights (Huber, Robust Statistics, 1981, chapter 7); its covariance is that of the weighted fit.
    """

    def __init__(self) -> None:
        self._points: list[tuple[float, float]] = []
        self._window_end: float | None = None

    def add(self, board_s: float, host_s: float) -> None:
        """Take one arrival: the board time of the newest sample in it and the host time at which it was read, s."""
        point = board_s, host_s - board_s
        if self._window_end is None or board_s >= self._window_end:
            self._window_end = board_s + _WINDOW_S
            self._points.append(point)
        elif point[1] < self._points[-1][1]:
            self._points[-1] = point

    def restart(self) -> None:
        """Forget everything: the board's clock started anew."""
        self._points.clear()
        self._window_end = None

    def fit(self) -> ClockFit | None:
        """Fit the line; None with fewer than three seconds of arrivals."""
        if len(self._points) < 3:
            return None
        board, delay = np.array(self._points).T
        mean = float(board.mean())
        design = np.column_stack([np.ones(len(board)), board - mean])  # (n, 2)
        weights = np.ones(len(board))
        spread = 0.0
        for _ in range(_ITERATIONS):
            solution = np.linalg.lstsq(design * np.sqrt(weights)[:, None], delay * np.sqrt(weights), rcond=None)[0]
            residual = delay - design @ solution
            spread = max(float(np.median(np.abs(residual))) * _MAD_TO_STD, 1e-9)
            fresh = np.minimum(1.0, _HUBER * spread / np.maximum(np.abs(residual), 1e-300))
            if np.allclose(fresh, weights, atol=1e-6):
                break
            weights = fresh
        variance = float((weights * residual**2).sum()) / max(float(weights.sum()) - 2.0, 1.0)
        covariance = variance * np.linalg.inv(design.T @ (design * weights[:, None]))
        std = np.sqrt(np.diag(covariance))
        return ClockFit(
            float(solution[0]), float(std[0]), float(solution[1]), float(std[1]), mean, spread, len(self._points)
        )


class SampleRate:
    """The sample rate by the board's own time stamps, over everything that was sampled without a new start.

    Lost samples count, as time went on without them; the step to the first sample after a start does not.
    """

    def __init__(self, tick_hz: float) -> None:
        self._tick_hz = tick_hz
        self._segment: int | None = None
        self._last = 0
        self._periods = 0
        self._ticks = 0

    def add(self, samples: Samples) -> None:
        """Take the next samples of a stream."""
        if not len(samples):
            return
        before = int(samples.segment[0]) - 1 if self._segment is None else self._segment
        goes_on = (np.diff(samples.segment, prepend=before) == 0) & ((samples.status & Status.FIRST) == 0)
        self._periods += int((1 + samples.lost_before)[goes_on].sum())
        self._ticks += int(np.diff(samples.ticks, prepend=self._last)[goes_on].sum())
        self._segment, self._last = int(samples.segment[-1]), int(samples.ticks[-1])

    def metadata(self, fit: ClockFit | None = None) -> dict[str, str | float]:
        """Return what a recording states about its time stamps: the clock they come from and the rate they show.

        Parameters
        ----------
        fit : ClockFit, optional
            The board's clock against the host's: gives the rate in the host's seconds, too.
        """
        stated: dict[str, str | float] = {"time_stamp_clock": "board", "time_stamp_tick_hz": self._tick_hz}
        if self._ticks:
            rate = self._periods * self._tick_hz / self._ticks
            stated["time_stamp_rate_hz"] = rate
            stated["time_stamp_rate_from"] = (
                f"board clock, ticks of {self._tick_hz:.0f} Hz; not corrected by the host's"
            )
            if fit is not None:
                stated["host_clock_rate_hz"] = rate / (1.0 + fit.rate_error)
                stated["host_clock_rate_std_hz"] = rate * fit.rate_error_std
                stated["host_clock_rate_from"] = f"line through {fit.windows} arrivals, host clock against board clock"
        return stated
