"""The board's clock against the host's: where the board's time lies on the host's, with its uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.frames.decoder import Samples, Status
from firmware_bridge.host.clock_track import track_clock
from gfimu.base.declared import Declared, Matrix, figure

__all__ = ["ClockFit", "HostClock", "SampleRate"]

_WINDOW_S = 1.0
_LEAST_LATENCY_S = 1e-3  # one frame of full-speed USB: what a reading takes at least is unknown by about that
_MOST_KNOTS = 200  # of a stored fit
_MOST_FILLED = 16  # points put into a gap, so that the uncertainty grows there


@dataclass(frozen=True)
class ClockFit(Declared):
    """Host time = board time + offset, whose rate walks as that of a crystal does."""

    offset_s: Annotated[float, figure("Host time at the board time mean_board_s, less that board time.", "s")]
    offset_std_s: Annotated[
        float, figure("Its standard deviation, with what is not known of the shortest latency.", "s")
    ]
    rate_error: Annotated[
        float, figure("How much faster the host's clock runs than the board's, relative; mean over the recording.")
    ]
    rate_error_std: Annotated[float, figure("Its standard deviation.")]
    mean_board_s: Annotated[float, figure("Board time in the middle of the fit.", "s")]
    residual_s: Annotated[float, figure("Robust spread of the arrivals.", "s")]
    windows: Annotated[int, figure("Points of the fit.")]
    latency_std_s: Annotated[
        float,
        figure("Part of every standard deviation that all times share: of the shortest latency.", "s"),
    ] = 0.0
    rate_walk: Annotated[
        float, figure("Strength of the random walk of the rate: 1e-6 is about 1 ppm in a second.", "1/√s")
    ] = 0.0
    knots: Annotated[
        tuple[tuple[float, float, float], ...],
        figure("Board time, offset and its standard deviation: the fit is linear in between.", "s", json=Matrix),
    ] = ()

    def to_host(self, board_s: NDArray[np.float64] | float) -> NDArray[np.float64] | float:
        """Host time of a board time, s; beyond the recording with its mean rate."""
        if not self.knots:
            return board_s + self.offset_s + self.rate_error * (board_s - self.mean_board_s)
        times, offsets, _ = np.array(self.knots).T
        inside = np.clip(board_s, times[0], times[-1])
        found = board_s + np.interp(inside, times, offsets) + self.rate_error * (board_s - inside)
        return found if np.ndim(board_s) else float(found)

    def host_std_s(self, board_s: NDArray[np.float64] | float) -> NDArray[np.float64] | float:
        """Return the standard deviation of `to_host`, s."""
        times, _, stds = np.array(self.knots or ((self.mean_board_s, self.offset_s, self.offset_std_s),)).T
        beyond = np.abs(board_s - np.clip(board_s, times[0], times[-1]))
        walked = self.rate_walk**2 * beyond**3 / 3.0
        found = np.sqrt(np.interp(board_s, times, stds) ** 2 + (self.rate_error_std * beyond) ** 2 + walked)
        return found if np.ndim(board_s) else float(found)


class HostClock:
    """Collects arrivals and says where the board's time lies on the host's.

    Bytes arrive late, never early, so of each second only the arrival with the smallest delay is kept: memory grows by
    one point a second. `track_clock` smooths these points with a rate that walks. The shortest latency itself shows in
    no arrival. Where the board answered a command, it lies between zero and the time from the command to the answer
    (`exchange`); otherwise it is unknown by as much as a usual delay exceeds the shortest, at least by a millisecond.
    """

    def __init__(self) -> None:
        self._points: list[tuple[float, float, bool]] = []  # board time, delay, whether the clock was set anew
        self._usual: list[float] = []  # delay of each second's first arrival
        self._window_end: float | None = None
        self._sent: list[tuple[float, float]] = []  # board time of an answer, time of its command less that

    def add(self, board_s: float, host_s: float) -> None:
        """Take one arrival: the board time of the newest sample in it and the host time at which it was read, s."""
        delay = host_s - board_s
        if self._window_end is None or board_s >= self._window_end:
            self._points.append((board_s, delay, self._window_end is None))
            self._usual.append(delay)
            self._window_end = board_s + _WINDOW_S
        elif delay < self._points[-1][1]:
            self._points[-1] = (board_s, delay, self._points[-1][2])

    def exchange(self, board_s: float, sent_host_s: float) -> None:
        """Take an answer: the board's time in it, and the host time before its command was sent, s."""
        self._sent.append((board_s, sent_host_s - board_s))

    def restart(self) -> None:
        """Take note that the board's clock was set anew: its offset may be any from here on, its rate goes on."""
        self._window_end = None

    def fit(self) -> ClockFit | None:
        """Fit the track; None with fewer than three seconds of arrivals.

        Where board times went back, the fit holds for those since then.
        """
        if len(self._points) < 3:
            return None
        board, delay, jump = _filled(self._points)
        steps = np.where(jump, np.diff(board + delay, prepend=board[0] + delay[0]), np.diff(board, prepend=board[0]))
        track = track_clock(np.cumsum(steps), delay, jump)
        newest = slice(int(np.max(np.flatnonzero(np.diff(board) <= 0.0) + 1, initial=0)), None)
        board, jump, shown, std = board[newest], jump[newest], track.offset_s[newest], track.std_s[newest]
        latency, latency_std = self._latency(board, shown)
        offset, std = shown - latency, np.hypot(std, latency_std)
        ways = (_mean_rate(board, shown, track.std_s[newest], jump), (track.rate, track.rate_std))
        rate, rate_std = min(ways, key=lambda way: way[1])  # soon after a restart, the track knows more than its ends
        middle = 0.5 * float(board[0] + board[-1])
        places = np.unique(np.linspace(0, len(board) - 1, min(len(board), _MOST_KNOTS)).round().astype(int))
        return ClockFit(
            float(np.interp(middle, board, offset)),
            float(np.interp(middle, board, std)),
            rate,
            rate_std,
            middle,
            track.residual_s,
            len(self._points),
            latency_std,
            track.rate_walk,
            tuple((float(board[k]), float(offset[k]), float(std[k])) for k in places),
        )

    def _latency(self, board: NDArray[np.float64], offset: NDArray[np.float64]) -> tuple[float, float]:
        """Mean and standard deviation of the shortest latency, s: uniform up to the shortest way there and back."""
        inside = [(at, sent) for at, sent in self._sent if board[0] <= at <= board[-1]]
        ways = [float(np.interp(at, board, offset)) - sent for at, sent in inside]
        if ways and min(ways) > 0.0:
            return min(ways) / 2.0, min(ways) / math.sqrt(12.0)
        usual = float(np.median(np.array(self._usual) - np.array([delay for _, delay, _ in self._points])))
        return 0.0, max(_LEAST_LATENCY_S, usual)


def _mean_rate(
    board: NDArray[np.float64], offset: NDArray[np.float64], std: NDArray[np.float64], jump: NDArray[np.bool_]
) -> tuple[float, float]:
    """Mean rate between the ends of a track, and its standard deviation; infinite for a single point."""
    goes_on = ~jump[1:]
    covered = float(np.diff(board)[goes_on].sum())
    if not covered:
        return 0.0, math.inf
    ends = 1.5 * (std[0] ** 2 + std[-1] ** 2)  # 1.5: the ends of a straight line correlate by -1/2
    return float(np.diff(offset)[goes_on].sum()) / covered, math.sqrt(ends) / covered


def _filled(
    points: list[tuple[float, float, bool]],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Put points without a measurement into gaps, where the uncertainty has to grow."""
    rows: list[tuple[float, float, bool]] = []
    for point in points:
        if rows and not point[2]:
            number = min(int((point[0] - rows[-1][0]) / (2.0 * _WINDOW_S)), _MOST_FILLED)
            begin, step = rows[-1][0], (point[0] - rows[-1][0]) / (number + 1)
            rows += [(begin + step * (k + 1), math.nan, False) for k in range(number)]
        rows.append(point)
    board, delay, jump = zip(*rows, strict=True)
    return np.array(board), np.array(delay), np.array(jump)


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
