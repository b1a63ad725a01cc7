"""Kalman filter for the rate: angular acceleration integrated, the null space of J as measurement.

The filter knows its biases' uncertainty, recognises rest (`gfimu.rate.rest_test`), widens its uncertainty with the
scale-factor and placement errors that are stated, leaves out channels that are missing, saturated or stuck, and bridges
gaps. It takes samples one at a time or in blocks, with the same answer.

Over an interval the angular acceleration is integrated as the polynomial through the neighbouring samples. The default
takes three on each side: the estimate for a sample appears when two more have come (`KalmanRateFilter.lag`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.quadrature import STENCILS, even_weights
from gfimu.base.errors import InputError, check_name
from gfimu.rate.backward import backward
from gfimu.rate.disagreement import MeasuredNoise
from gfimu.rate.guard import GUARD_S, Guard
from gfimu.rate.preparation import prepare
from gfimu.rate.recursion import forward
from gfimu.rate.recursion_data import (
    BLOCK,
    RETURN,
    SAMPLES,
    Record,
    RecursionInput,
    RecursionOutput,
    RecursionState,
    Tables,
    Tuning,
)
from gfimu.rate.rest_test import HISTORY_BLOCKS, KEPT_BLOCKS, RUN_BLOCKS, RestTest
from gfimu.rate.result import ChannelReport, RateEstimate, SignDecision, full_covariance
from gfimu.rate.sensing import ChannelTables, SensorErrors
from gfimu.rate.start import START_S, contradicts_rest

__all__ = [
    "QUADRATURES",
    "FilterOutput",
    "FilterSettings",
    "KalmanRateFilter",
    "join",
    "plausible_start",
    "spread_rest",
    "unknown_std",
]

QUADRATURES = {
    name: (stencil.points, -stencil.before[0]) for name, stencil in STENCILS.items() if not stencil.alternates
}
"""Samples of the stencil and the interval of it that is integrated; what lies behind it is the filter's lag."""

_CHUNK = 4096
_SMOOTHER_BLOCK = 512
_MOST_CHANNELS = 62
_UNKNOWN_STD = 3.0  # of an unknown start, in units of the rate found there
_LEAST_STD = 3.0  # rad/s
_SIGNED = 10.0  # innovations squared by which the other sign must fit better: odds of 150 to 1
_FORWARD_SHARE = 0.3  # of the smoother's time, for its progress


@dataclass(frozen=True)
class FilterSettings:
    """How the filter starts and what it relies on.

    Parameters
    ----------
    start_omega : ndarray, shape (3,), or None
        Rate at the first sample, rad/s; None if it isn't known (a start while spinning).
    start_std : float
        Its uncertainty, rad/s. The default is a start at rest.
    quadrature : {"centred6", "centred4", "adams_moulton4", "trapezoid"}
        Integration of α: two samples late and of sixth order, one late, not late, of second order.
    rest : RestTest or None
        Recognition of rest; None to never use it.
    noise : MeasuredNoise or None
        How much larger than stated the noise was found to be, sample by sample.
    """

    start_omega: NDArray[np.float64] | None = field(default_factory=lambda: np.zeros(3))
    start_std: float = 1e-3
    quadrature: str = "centred6"
    rest: RestTest | None = field(default_factory=RestTest)
    noise: MeasuredNoise | None = None

    def __post_init__(self) -> None:
        check_name("quadrature", self.quadrature, QUADRATURES)
        start = self.start_omega
        if start is not None and (np.shape(start) != (3,) or not np.isfinite(start).all()):
            raise InputError("start_omega must hold three numbers, rad/s, or be None for an unknown start")
        if not (np.isfinite(self.start_std) and self.start_std > 0):
            raise InputError(f"start_std = {self.start_std!r}: must be a positive number, rad/s")


class FilterOutput(NamedTuple):
    """Estimates of consecutive samples, as arrays."""

    t: NDArray[np.float64]  # (n,) s
    columns: RecursionOutput

    def rows(self, part: slice) -> FilterOutput:
        """Return some of the samples, as views."""
        return FilterOutput(self.t[part], RecursionOutput._make(column[part] for column in self.columns))


def join(parts: Sequence[FilterOutput]) -> FilterOutput:
    """Join outputs of consecutive samples."""
    if len(parts) == 1:
        return parts[0]
    columns = zip(*(part.columns for part in parts), strict=True)
    return FilterOutput(
        np.concatenate([part.t for part in parts]), RecursionOutput._make(np.concatenate(column) for column in columns)
    )


def plausible_start(
    array: AccelerometerArray,
    t: NDArray[np.float64],
    readings: NDArray[np.float64],
    errors: SensorErrors,
    settings: FilterSettings,
) -> FilterSettings:
    """Return the settings, with an unknown start where they say rest and the first readings can't be those of rest."""
    fits = t.ndim == 1 and len(t) > 0 and readings.shape == (len(t), array.n_channels)  # else the method says so
    at_rest = settings.rest is not None and settings.start_omega is not None and not np.any(settings.start_omega)
    if not (fits and at_rest and contradicts_rest(array, readings[t < t[0] + START_S], errors)):
        return settings
    return replace(settings, start_omega=None)


def unknown_std(omega: NDArray[np.float64]) -> float:
    """Return the standard deviation, rad/s, to start with from a rate (3,), rad/s, that a single sample showed."""
    return max(_UNKNOWN_STD * float(np.linalg.norm(omega)), _LEAST_STD)


class KalmanRateFilter:
    """The filter as a process: takes samples, gives estimates `lag` samples later.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions.
    errors : SensorErrors
        Errors of its sensors.
    period : float
        Nominal sample period, s.
    settings : FilterSettings, optional
        Start, quadrature, rest.
    gyro : bool
        Whether a gyro is fused.

    Raises
    ------
    GeometryError
        If the array can't see all six motions.
    """

    def __init__(
        self,
        array: AccelerometerArray,
        errors: SensorErrors,
        period: float,
        settings: FilterSettings | None = None,
        *,
        gyro: bool = False,
        likelihood: bool = False,
        capacity: int = _CHUNK,
    ) -> None:
        if not (np.isfinite(period) and period > 0):
            raise InputError(f"sample period {period!r} s: must be a positive number")
        if array.n_channels > _MOST_CHANNELS:
            raise InputError(f"array {array.name!r} has {array.n_channels} channels; at most {_MOST_CHANNELS}")
        self.array = array
        self.errors = errors
        self.period = period
        self.settings = settings or FilterSettings()
        self.noise = self.settings.noise  # of the samples to come
        self.tables = ChannelTables(array, errors)
        points, position = QUADRATURES[self.settings.quadrature]
        weights = even_weights(points)
        self.lag = points - 2 - position
        self._gyro = gyro
        c, d = array.n_channels, self.tables.n_null
        self._sizes = (9 + d + 3 * gyro, d, 3 * gyro)  # of the state, the null space and the gyro
        rest = self.settings.rest
        self._tuning = Tuning(
            period,
            weights,
            position,
            2.0 * float(np.sum(weights[position] ** 2)) - 1.0,
            1.0 / errors.noise_std,
            errors.scale_std**2,
            errors.placement_std**2 * float(np.mean(1.0 / errors.noise_std**2)),
            errors.timing_std**2,
            errors.gyro_noise_std**2,
            rest.window(period) if rest else 0,
            rest.rate_std**2 if rest else 1.0,
            *(rest.entry_blocks(period) if rest else (1, 1)),
            rest.all_limits(c, d, period) if rest else np.zeros((3, 8)),
            likelihood,
            True,
        )
        self.state = self._start()
        self._compiled_tables = self._tables()
        self._guard = Guard(self.tables, errors)
        self.guarded = self._guard.possible and not likelihood  # of two mirrored filters one is wrong
        self._window = max(4, round(GUARD_S / period))
        self._history = points + 2 + max(HISTORY_BLOCKS * self._tuning.rest_window, self._window)
        self._buffer = _buffer(capacity + self._history + points, c, d)
        self._received = 0  # rows of the buffer that hold samples
        self._done = 0  # rows of the buffer that are estimated
        self._limits = errors.limits
        self._stuck_after = errors.stuck_after or np.iinfo(np.int64).max
        self._held = np.full(c, np.nan)
        self._run = np.zeros(c, dtype=np.int64)
        self._tally = np.zeros((3, c), dtype=np.int64)
        self._blind = 0
        self._gaps = 0
        self._rates = np.zeros((self._window, 3))  # of the samples of the guard's window so far
        self._watched = 0  # how many these are
        self._squares, self._freedom = 0.0, 0  # their innovations squared, and degrees of freedom of those
        self._lost = False  # whether the last window's single samples showed no rate
        self._unusable = 0
        self.restarts = 0
        self._restarted = -1  # row of the buffer
        self.contradicted: list[tuple[float, float]] = []  # first and last time of samples with a wrong rate or none, s
        self._record = empty_record(0, *self._sizes)
        self._kept: list[tuple[int, RecursionState, bool]] = []  # first sample, state before it, whether it starts anew
        self._taken_back: list[tuple[int, int]] = []  # rows of the buffer, from behind the last rest to its end's block
        self._last_time = -np.inf
        self.progress: Callable[[float], object] | None = None  # called with the share of a block done so far

    def _start(self) -> RecursionState:
        """State before the first sample."""
        if self.settings.start_omega is None:
            raise InputError("a single filter needs a start; use LiveRateFilter or filter_rate for an unknown one")
        return self._state_of(self.settings.start_omega, self.settings.start_std)

    def _state_of(self, omega: NDArray[np.float64], std: float) -> RecursionState:
        """State of a rate (3,) of this standard deviation, rad/s, with biases as uncertain as before the run."""
        c, d, n = self.array.n_channels, self.tables.n_null, self._sizes[0]
        x = np.zeros(n)
        x[:3] = omega
        covariance = np.zeros((n, n))
        covariance[:3, :3] = np.eye(3) * std**2
        covariance[3 : 6 + d, 3 : 6 + d] = self.tables.bias_covariance(self.errors.bias_std)
        covariance[6 + d : n - 3, 6 + d : n - 3] = np.eye(n - 9 - d) * self.errors.gyro_bias_std**2
        rest = self.settings.rest
        rests = rest is not None and not x.any() and std <= rest.largest_rate_std
        counts = np.array([0, 0, 0, 0, 0, int(rests), 0, 0, 0, 0, 0, 0])  # a start at rest is rest to begin with
        return RecursionState(
            x, covariance, np.zeros(5), np.zeros(3), counts, np.zeros(d), x.copy(), covariance.copy(),
            np.zeros(c), np.zeros((RUN_BLOCKS, 3)), np.zeros((RUN_BLOCKS, 3)), np.zeros((RUN_BLOCKS, 3, 3)),
            np.zeros((KEPT_BLOCKS, n)), np.zeros((KEPT_BLOCKS, n, n)), np.zeros((KEPT_BLOCKS, 5)),
            np.zeros(KEPT_BLOCKS, dtype=np.int64),
        )  # fmt: skip

    def _tables(self) -> Tables:
        tables = self.tables
        return Tables(
            tables.alpha_bias, tables.alpha_leak, tables.alpha_noise, tables.null_sensitivity, tables.null_bias,
            tables.null_count, tables.plain, tables.alpha_rows, tables.null_rows, tables.products, tables.square_seen,
            tables.null_size,
        )  # fmt: skip

    @property
    def omega(self) -> NDArray[np.float64]:
        """Latest estimate, shape (3,), rad/s."""
        return self.state.x[:3].copy()

    @property
    def report(self) -> ChannelReport:
        """What was wrong with the channels so far."""
        others = self._blind, self._gaps, self.restarts, self._unusable
        if not self._tally.any():
            return ChannelReport({}, {}, {}, *others)
        missing, saturated, stuck = (
            {name: int(count) for name, count in zip(self.array.channels, row, strict=True) if count}
            for row in self._tally
        )
        return ChannelReport(missing, saturated, stuck, *others)

    def push(self, t: ArrayLike, readings: ArrayLike, gyro: ArrayLike | None = None) -> FilterOutput:
        """Take one sample or a block and return the estimates that are ready.

        Parameters
        ----------
        t : array_like, shape (n,) or scalar
            Sample times, s, later than all before.
        readings : array_like, shape (n, c) or (c,)
            Specific force, m/s²; NaN where a channel is missing.
        gyro : array_like, shape (n, 3) or (3,), optional
            Gyro readings in body axes, rad/s; NaN where saturated or missing.

        Raises
        ------
        InputError
            If the shapes don't fit or time does not increase.
        """
        times = np.atleast_1d(np.asarray(t, dtype=float))
        rows = np.atleast_2d(np.asarray(readings, dtype=float))
        if rows.shape != (len(times), self.array.n_channels):
            raise InputError(
                f"readings have shape {rows.shape}; {len(times)} times of array {self.array.name!r} need "
                f"({len(times)}, {self.array.n_channels})"
            )
        turning = None if gyro is None else np.atleast_2d(np.asarray(gyro, dtype=float))
        if turning is not None and (not self._gyro or turning.shape != (len(times), 3)):
            raise InputError("gyro needs one row of three per sample, and a filter made with gyro=True")
        self._check_times(times)
        out, stamps = self._empty(len(times) + self._received - self._done)
        filled = 0
        for start in range(0, len(times), _CHUNK):
            part = slice(start, start + _CHUNK)
            self._take(times[part], rows[part], None if turning is None else turning[part])
            filled = self._advance(self._received - self.lag, out, stamps, filled)
            if self.progress is not None:
                self.progress(min(1.0, (start + _CHUNK) / len(times)))
        return FilterOutput(stamps, out).rows(slice(0, filled))

    def finish(self) -> FilterOutput:
        """Return the estimates of the last samples, for which no more neighbours will come."""
        out, stamps = self._empty(self._received - self._done)
        self._advance(self._received, out, stamps, 0, closing=True)
        return FilterOutput(stamps, out)

    def record_run(self, t: ArrayLike, readings: ArrayLike, gyro: ArrayLike | None = None) -> FilterOutput:
        """Filter a whole recording at once, keeping what `run_back` needs; the filter's capacity must hold it."""
        times = np.asarray(t, dtype=float)
        rows = np.asarray(readings, dtype=float)
        if rows.shape != (len(times), self.array.n_channels):
            raise InputError(
                f"readings have shape {rows.shape}; {len(times)} times of array {self.array.name!r} need "
                f"({len(times)}, {self.array.n_channels})"
            )
        self._check_times(times)
        self._take(times, rows, None if gyro is None else np.asarray(gyro, dtype=float))
        self._tuning = self._tuning._replace(live=False)
        out, stamps = self._empty(len(times))
        while True:
            self._kept, self._taken_back = [], []
            self._watched, self._squares, self._freedom, self._lost = 0, 0.0, 0, False
            self._unusable, self.restarts, self._restarted = 0, 0, -1
            self.contradicted = []
            for start in range(0, len(times), _SMOOTHER_BLOCK):
                self._kept.append((start, self.state.copy(), False))
                self._advance(min(start + _SMOOTHER_BLOCK, len(times)), out, stamps, start, closing=True)
                if self.progress is not None:
                    self.progress(_FORWARD_SHARE * min(1.0, (start + _SMOOTHER_BLOCK) / len(times)))
            if not self._taken_back:
                return FilterOutput(stamps, out)
            for first, last in self._taken_back:  # again, without the blocks that turned out not to be rest
                self._buffer.vetoed[first:last] = True
            self.state, self._done = self._start(), 0

    def run_back(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Smooth the recording of `record_run`: rates (n, 3) and covariances (n, 3, 3)."""
        n = self._done
        omega, covariance = np.empty((n, 3)), np.empty((n, 6))
        size = self._sizes[0]
        adjoint, curvature = np.zeros(size), np.zeros((size, size))
        record = empty_record(_SMOOTHER_BLOCK, *self._sizes)
        ignored = empty_output(_SMOOTHER_BLOCK)
        last = n
        for first, state, anew in reversed(self._kept):
            forward(
                self._buffer, first, last, n, self._compiled_tables, self._tuning, state.copy(), ignored, -first, record
            )
            backward(record, last - first, self._tuning.overshoot, adjoint, curvature, omega, covariance, first)
            if anew:  # nothing of what was before goes on
                adjoint[:], curvature[:] = 0.0, 0.0
            last = first
        for begin, end in self.contradicted:
            rows = (self._buffer.t[:n] >= begin) & (self._buffer.t[:n] <= end)
            omega[rows], covariance[rows] = np.nan, np.nan
        return omega, full_covariance(covariance)

    def _check_times(self, times: NDArray[np.float64]) -> None:
        if len(times) == 0:
            return
        if len(times) == 1 and self._last_time < times[0] < math.inf:  # one sample at a time: no array operations
            self._last_time = float(times[0])
            return
        if not np.isfinite(times).all() or times[0] <= self._last_time or np.any(times[1:] <= times[:-1]):
            raise InputError("sample times must be finite and increase; drop repeated or reordered samples")
        self._last_time = float(times[-1])

    def _take(self, t: NDArray[np.float64], readings: NDArray[np.float64], gyro: NDArray[np.float64] | None) -> None:
        """Append samples to the buffer and reduce them to α and z."""
        data = self._buffer
        first = self._received
        if first + len(t) > len(data.t):
            moved = max(self._done - self._history, 0)
            for column in data:
                column[: first - moved] = column[moved:first].copy()
            first -= moved
            self._done -= moved
        last = first + len(t)
        data.t[first:last] = t
        data.y[first:last] = readings
        data.gyro[first:last] = np.nan if gyro is None else gyro
        data.excess[first:last] = 0.0 if self.noise is None else self.noise.excess(t)
        self._received = last
        self._prepare(first, last)

    def _prepare(self, first: int, last: int) -> None:
        data = self._buffer
        reached = first
        while True:
            reached = prepare(
                reached, last, self.period, self.tables.masks, self._compiled_tables, self._limits,
                self._stuck_after, self._held, self._run, self._tally, data,
            )  # fmt: skip
            if reached == last:
                break
            self.tables.index(self._missing(data.y[reached]))
            self._compiled_tables = self._tables()
        if last - first == 1:
            self._blind += int(data.channel_set[first] < 0)
            self._gaps += int(first > 0 and data.t[first] - data.t[first - 1] > 1.5 * self.period)
        else:
            self._blind += int(np.count_nonzero(data.channel_set[first:last] < 0))
            self._gaps += int(np.count_nonzero(np.diff(data.t[max(first - 1, 0) : last]) > 1.5 * self.period))

    def _missing(self, row: NDArray[np.float64]) -> int:
        """Bits of the channels that can't be used in a sample."""
        bad = ~(np.abs(row) < self._limits) | ((row == self._held) & (self._run + 1 >= self._stuck_after))
        return sum(1 << int(channel) for channel in np.flatnonzero(bad))

    def _advance(
        self, until: int, out: RecursionOutput, stamps: NDArray[np.float64], filled: int, *, closing: bool = False
    ) -> int:
        """Estimate the samples up to row ``until`` of the buffer; returns how many are in ``out`` now."""
        if until <= self._done or (not closing and self._received < self._tuning.weights.shape[1]):
            return filled
        first, self._done = self._done, until
        place = filled
        while first < until:
            reached = first
            while reached < until:
                reached = forward(
                    self._buffer, reached, until, self._received, self._compiled_tables, self._tuning, self.state, out,
                    place - first, self._record,
                )  # fmt: skip
                if self.state.counts[RETURN]:
                    self._take_back(reached, out, place + reached - first - 1)
            end = self._watch(first, until, out, place) if self.guarded else until
            place, first = place + end - first, end
        count = place - filled
        stamps[filled : filled + count] = self._buffer.t[until - count : until]
        return filled + count

    def _watch(self, first: int, until: int, out: RecursionOutput, place: int) -> int:
        """Judge the windows that end in rows ``first`` to ``until`` of the buffer, whose estimates begin at ``place``.

        Returns the row up to which the estimates stand: from there on the filter has started anew.
        """
        row = first
        while row < until:
            part = slice(place + row - first, place + min(until, row + self._window - self._watched) - first)
            count = part.stop - part.start
            self._rates[self._watched : self._watched + count] = out.omega[part]
            if count == 1:  # one sample at a time: no array operations
                self._squares += out.nis[part.start]
                self._freedom += out.dof[part.start]
            else:
                self._squares += out.nis[part].sum()
                self._freedom += out.dof[part].sum()
            if self._lost:
                out.omega[part], out.covariance[part] = np.nan, np.nan
                self._mark(row, row + count)
            row += count
            self._watched += count
            if self._watched < self._window:
                break
            again = self._judge(row, out, place + row - first - 1)
            if again is not None:
                return again
        return until

    def _judge(self, end: int, out: RecursionOutput, place: int) -> int | None:
        """Judge the window before row ``end``, whose last estimate is at ``place``, and start anew where it must be.

        Returns the row to go on from; None to go on as before.
        """
        begin = end - self._window
        nis, freedom = float(self._squares), int(self._freedom)
        self._watched, self._squares, self._freedom = 0, 0.0, 0
        if not (self._lost or self._guard.suspects(nis, freedom)):
            return None
        data = self._buffer
        found = self._guard.judge(
            data.z[begin:end], data.channel_set[begin:end] == 0, self._rates, nis / max(freedom, 1)
        )
        if found is None:
            return None
        if not found.contradicted:
            self._lost = False
            return None
        anew = found.first >= 0 and (self._tuning.live or begin + found.first > self._restarted)
        first = begin + max(found.first, 0)
        if self._lost and not anew:
            return None
        self._lost = not anew
        self.restarts += anew
        self._mark(begin, (end - 1 if anew else end) if self._tuning.live else (first if anew else end))
        if anew:
            self.state = self._state_of(self._signed(found.omega, first, end), unknown_std(found.omega))
        if not self._tuning.live:
            if not anew:
                omega = np.nan_to_num(self._rates[0])
                self.state = self._state_of(omega, unknown_std(omega))
            self._restarted = first
            self._kept = [kept for kept in self._kept if kept[0] < begin]
            for row in sorted({begin, first}):  # what is between them joins neither side
                self._kept.append((row, self.state.copy(), True))
            return first
        if anew:
            self._filter_again(first, end, out, place)
        return end if anew else None

    def _signed(self, omega: NDArray[np.float64], first: int, end: int) -> NDArray[np.float64]:
        """Return a rate (3,) at row ``first`` with the sign that fits the rows up to ``end`` better, or as before."""
        sides = (1.0, -1.0) if not omega @ self._rates[0] < 0.0 else (-1.0, 1.0)
        squares = []
        for side in sides:
            again = empty_output(end - first)
            forward(
                self._buffer, first, end, self._received, self._compiled_tables,
                self._tuning._replace(rest_window=0), self._state_of(side * omega, unknown_std(omega)), again, -first,
                self._record,
            )  # fmt: skip
            squares.append(float(again.nis.sum()))
        return omega * sides[0 if squares[0] < squares[1] + _SIGNED else 1]

    def _mark(self, first: int, last: int) -> None:
        """Note that rows ``first`` to ``last − 1`` have no usable rate."""
        if last > first:
            self._unusable += last - first
            self.contradicted.append((float(self._buffer.t[first]), float(self._buffer.t[last - 1])))

    def _take_back(self, reached: int, out: RecursionOutput, place: int) -> None:
        """Return to the state before the blocks in doubt and filter up to row ``reached`` again, without rest."""
        state = self.state
        kept = int(state.counts[RETURN]) - 1
        first = reached - int(state.counts[SAMPLES] - state.past_samples[kept])
        state.x[:] = state.past_x[kept]
        state.covariance[:] = state.past_covariance[kept]
        state.scalars[:] = state.past_scalars[kept]
        state.counts[SAMPLES] = state.past_samples[kept]
        state.counts[RETURN] = 0
        self._filter_again(first, reached, out, place)
        if not self._tuning.live:
            self._taken_back.append((first, reached))

    def _filter_again(self, first: int, last: int, out: RecursionOutput, place: int) -> None:
        """Filter rows ``first`` to ``last − 1`` again, without rest; the last estimate goes to ``place``."""
        state = self.state
        again = empty_output(last - first)
        forward(
            self._buffer, first, last, self._received, self._compiled_tables,
            self._tuning._replace(rest_window=0, likelihood=False), state, again, -first, self._record,
        )  # fmt: skip
        state.counts[BLOCK] = 0
        state.block_x[:] = state.x
        state.block_covariance[:] = state.covariance
        out.omega[place] = again.omega[-1]
        out.covariance[place] = again.covariance[-1]

    def _empty(self, n: int) -> tuple[RecursionOutput, NDArray[np.float64]]:
        return empty_output(n), np.empty(n)

    def estimate(
        self,
        output: FilterOutput,
        method: str = "filter",
        sign: SignDecision | None = None,
        mirrored: RateEstimate | None = None,
    ) -> RateEstimate:
        """Turn output into a result, with the state as it is now."""
        columns = output.columns
        return RateEstimate(
            method,
            output.t,
            columns.omega,
            full_covariance(columns.covariance),
            columns.nis,
            columns.dof,
            columns.rest,
            sign or (SignDecision("undecided", 0.0) if self.restarts else SignDecision()),
            mirrored,
            bias=self.state.x[3:-3].copy(),
            bias_covariance=self.state.covariance[3:-3, 3:-3].copy(),
            channels=self.report,
        )


def empty_output(n: int) -> RecursionOutput:
    """Arrays for the estimates of n samples."""
    return RecursionOutput(
        np.empty((n, 3)), np.empty((n, 6)), np.empty(n), np.empty(n, dtype=np.int64), np.empty(n),
        np.zeros(n, dtype=np.bool_), np.empty(n),
    )  # fmt: skip


def empty_record(length: int, n: int, null_axes: int, gyro_axes: int) -> Record:
    """Record for the backward pass over ``length`` samples of a state of size ``n``."""
    updates = 2 * null_axes + gyro_axes + 6
    return Record(
        np.empty((length, 3)), np.empty((length, 3, n)), np.empty((length, 3, n)), np.empty(length, dtype=np.int64),
        np.empty((length, updates, n)), np.empty((length, updates, n)), np.empty((length, updates)),
        np.empty((length, updates)),
    )  # fmt: skip


def _buffer(rows: int, n_channels: int, n_null: int) -> RecursionInput:
    return RecursionInput(
        np.zeros(rows), np.zeros((rows, n_channels)), np.zeros((rows, 3)), np.zeros((rows, n_null)),
        np.zeros(rows, dtype=np.int64), np.full((rows, 3), np.nan), np.zeros(rows, dtype=np.int64),
        np.zeros(rows, dtype=np.int64), np.zeros((rows, 3)), np.zeros(rows, dtype=np.bool_),
        np.zeros(rows),
    )  # fmt: skip


def spread_rest(ends: NDArray[np.bool_], window: int) -> NDArray[np.bool_]:
    """Mark every sample of the blocks of rest of ``window`` samples that end at ``ends``, shape (n,)."""
    rest = np.zeros(len(ends), dtype=bool)
    for end in np.flatnonzero(ends):
        rest[max(end - window + 1, 0) : end + 1] = True
    return rest
