"""The rate filter as data arrive: known or unknown start, one sample at a time or in blocks, with the same answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.rate.kalman import FilterOutput, FilterSettings, KalmanRateFilter, empty_output, join, unknown_std
from gfimu.rate.live_accuracy import LiveAccuracy
from gfimu.rate.result import ChannelReport, RateEstimate, SignDecision, full_covariance
from gfimu.rate.sensing import SensorErrors
from gfimu.rate.sign import InitialRate, SignTest
from gfimu.rate.start import START_S, contradicts_rest

__all__ = ["LiveRateFilter"]


class _Samples(NamedTuple):
    """Samples as they came."""

    t: NDArray[np.float64]  # (n,)
    readings: NDArray[np.float64]  # (n, c)
    gyro: NDArray[np.float64] | None  # (n, 3)

    @classmethod
    def joined(cls, parts: list[_Samples]) -> _Samples:
        """Join consecutive ones."""
        gyro = None if parts[0].gyro is None else np.concatenate([part.gyro for part in parts if part.gyro is not None])
        return cls(np.concatenate([part.t for part in parts]), np.concatenate([part.readings for part in parts]), gyro)


class LiveRateFilter:
    """Rate filter for a stream of samples.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions.
    errors : SensorErrors
        Errors of its sensors.
    period : float
        Nominal sample period, s.
    settings : FilterSettings, optional
        Start, quadrature, rest. With ``start_omega=None`` two filters follow ω and −ω until the sign is decided.
    gyro : bool
        Whether gyro readings come along.
    progress : callable, optional
        Called with the share of each block of samples that is filtered, 0 to 1.

    Raises
    ------
    GeometryError
        If the array can't see all six motions, or can't find an unknown start.

    Examples
    --------
    >>> live = LiveRateFilter(array, SensorErrors.from_parts(array, 100.0), 0.01)  # doctest: +SKIP
    >>> for t, reading in stream:  # doctest: +SKIP
    ...     estimate = live.push(t, reading)
    """

    def __init__(
        self,
        array: AccelerometerArray,
        errors: SensorErrors,
        period: float,
        settings: FilterSettings | None = None,
        *,
        gyro: bool = False,
        progress: Callable[[float], object] | None = None,
    ) -> None:
        self.array = array
        self.errors = errors
        self.period = period
        self.settings = settings or FilterSettings()
        self._gyro = gyro
        self._progress = progress
        self._sign = SignDecision()
        self._test = SignTest()
        self.hypotheses: list[KalmanRateFilter] = []
        self._limit = np.inf
        self._last_time = -np.inf
        self.started_at_s = np.nan
        # A start at rest that doesn't look like rest leaves the sign in doubt: the bias of α was not learned.
        self._unproven = 0
        self._first: list[_Samples] = []  # of a start at rest, until they show whether it is one
        self._tried = True
        if self.settings.start_omega is not None:
            rest = self.settings.rest
            if rest is not None and not np.any(self.settings.start_omega):
                self._unproven, self._tried = rest.window(period), False
            self.hypotheses = [KalmanRateFilter(array, errors, period, self.settings, gyro=gyro)]
            self.hypotheses[0].progress = progress
        else:
            self._sign = SignDecision("undecided", 0.0)
            self._initial = InitialRate(array, errors)

    @property
    def sign(self) -> SignDecision:
        """Whether the sign of ω is certain."""
        return self._sign

    @property
    def current(self) -> KalmanRateFilter:
        """The filter whose estimates are returned, the winner, or while undecided the first of the two."""
        if not self.hypotheses:
            raise InputError("the rate has not stood clear of the biases yet; an unknown start needs that")
        return self.hypotheses[0]

    @property
    def winner(self) -> int:
        """Which hypothesis won, 0 or 1; 0 while undecided."""
        return self._test.winner or 0

    @property
    def report(self) -> ChannelReport:
        """What was wrong with the channels so far."""
        return self.current.report if self.hypotheses else ChannelReport()

    def push(self, t: ArrayLike, readings: ArrayLike, gyro: ArrayLike | None = None) -> RateEstimate:
        """Take one sample or a block; returns the estimates that are ready (the last ones need two more samples).

        Parameters
        ----------
        t : array_like, shape (n,) or scalar
            Sample times, s, later than all before.
        readings : array_like, shape (n, c) or (c,)
            Specific force, m/s²; NaN where a channel is missing.
        gyro : array_like, shape (n, 3) or (3,), optional
            Gyro readings in body axes, rad/s; NaN where saturated or missing.

        Returns
        -------
        RateEstimate
            With the measured noise and the probability of the sign of each sample, by the samples so far
            (`gfimu.rate.live_accuracy`).

        Raises
        ------
        InputError
            If the shapes don't fit or time does not increase.
        """
        times, rows = np.atleast_1d(np.asarray(t, dtype=float)), np.atleast_2d(np.asarray(readings, dtype=float))
        if rows.shape == (len(times), self.array.n_channels):
            if not (np.isfinite(times).all() and np.all(np.diff(times, prepend=self._last_time) > 0)):
                raise InputError("sample times must be finite and increase; drop repeated or reordered samples")
            self._last_time = float(times[-1]) if len(times) else self._last_time
            noise = self._accuracy.take(times, rows)
            for hypothesis in self.hypotheses:
                hypothesis.noise = noise
        return self._accurate(self._result(*self.push_raw(times, rows, gyro)))

    def finish(self) -> RateEstimate:
        """Return the estimates of the last samples, for which no more neighbours will come."""
        return self._accurate(self._result(*self.finish_raw()))

    @cached_property
    def _accuracy(self) -> LiveAccuracy:
        return LiveAccuracy(self.array, self.errors, self.period)

    def _accurate(self, found: RateEstimate) -> RateEstimate:
        """Add the measured noise and the probability of the sign."""
        return self._accuracy.describe(found, self.current if self.hypotheses else None) if len(found) else found

    def push_raw(
        self, t: ArrayLike, readings: ArrayLike, gyro: ArrayLike | None = None
    ) -> tuple[list[FilterOutput], int | None]:
        """Like `push`, with the outputs of all hypotheses, and the sample that decided if one did."""
        times = np.atleast_1d(np.asarray(t, dtype=float))
        rows = np.atleast_2d(np.asarray(readings, dtype=float))
        turning = None if gyro is None else np.atleast_2d(np.asarray(gyro, dtype=float))
        if not self._tried and len(times) and rows.shape == (len(times), self.array.n_channels):
            emitted = self._try(times, rows, turning)
            if emitted is not None:
                times, rows, turning = _Samples.joined(self._first)
                outputs, place = self.push_raw(times, rows, turning)
                shown = [output.rows(slice(emitted, None)) for output in outputs]
                return shown, None if place is None else max(0, place - emitted)
        if self.hypotheses:
            return self._judge([hypothesis.push(times, rows, turning) for hypothesis in self.hypotheses])
        waiting, first = self._wait(times, rows)
        outputs = [
            join([waiting, hypothesis.push(times[first:], rows[first:], None if turning is None else turning[first:])])
            for hypothesis in self.hypotheses
        ]
        return self._judge(outputs) if outputs else ([waiting], None)

    def _try(self, t: NDArray[np.float64], rows: NDArray[np.float64], gyro: NDArray[np.float64] | None) -> int | None:
        """See by the first readings whether a start at rest can be one.

        If it can't, the filter starts anew, in the dark: returned is of how many samples estimates were given before.
        """
        before = sum(len(part.t) for part in self._first)
        self._first.append(_Samples(t, rows, gyro))
        started = self._first[0].t[0]
        if t[-1] < started + START_S:
            return None
        self._tried = True
        first = _Samples.joined(self._first)
        if not contradicts_rest(self.array, first.readings[first.t < started + START_S], self.errors):
            self._first = []
            return None
        lag = self.hypotheses[0].lag
        self.settings, self.hypotheses, self._unproven = replace(self.settings, start_omega=None), [], 0
        self._sign, self._initial = SignDecision("undecided", 0.0), InitialRate(self.array, self.errors)
        return max(0, before - lag)

    def finish_raw(self) -> tuple[list[FilterOutput], int | None]:
        """Like `finish`, with the outputs of all hypotheses, and the sample that decided if one did."""
        if not self.hypotheses:
            return [FilterOutput(np.empty(0), empty_output(0))], None
        return self._judge([hypothesis.finish() for hypothesis in self.hypotheses])

    def _wait(self, t: NDArray[np.float64], rows: NDArray[np.float64]) -> tuple[FilterOutput, int]:
        """Wait for a sample to start from; returns what is known until then, and the place of that sample."""
        if rows.shape != (len(t), self.array.n_channels):
            raise InputError(
                f"readings have shape {rows.shape}; {len(t)} times of array {self.array.name!r} need "
                f"({len(t)}, {self.array.n_channels})"
            )
        columns = empty_output(len(t))
        for column in (columns.omega, columns.covariance, columns.nis, columns.dof, columns.likelihood,
                       columns.manoeuvre):  # fmt: skip
            column[:] = 0
        complete = np.all(np.abs(rows) < self.errors.limits, axis=1)
        for index in range(len(t)):
            if complete[index]:
                found, clear = self._initial.find(rows[index])
                if clear:
                    self._begin(found)
                    self.started_at_s = float(t[index])
                    return FilterOutput(t, columns).rows(slice(0, index)), index
                self._limit = self._initial.limit(found)
            columns.covariance[index, :3] = self._limit**2
        return FilterOutput(t, columns), len(t)

    def _begin(self, found: NDArray[np.float64]) -> None:
        """Start both hypotheses."""
        std = unknown_std(found)
        for sign in (1.0, -1.0):
            start = replace(self.settings, start_omega=sign * found, start_std=std)
            self.hypotheses.append(
                KalmanRateFilter(self.array, self.errors, self.period, start, gyro=self._gyro, likelihood=True)
            )
            self.hypotheses[-1].progress = self._progress

    def _judge(self, outputs: list[FilterOutput]) -> tuple[list[FilterOutput], int | None]:
        """Compare the hypotheses; once decided, drop the loser."""
        if len(outputs) < 2:
            self._prove(outputs[0].columns.rest)
            if self.current.restarts:
                self._sign = SignDecision("undecided", 0.0)
            return outputs, None
        place = self._test.update(outputs[0].columns, outputs[1].columns)
        ratio = self._test.log_likelihood_ratio
        if place is None:
            self._sign = SignDecision("undecided", ratio)
        else:
            self._sign = SignDecision("decided", abs(ratio), float(outputs[0].t[place]))
            self.hypotheses = [self.hypotheses[self.winner]]
            self.hypotheses[0].guarded = True
        return outputs, place

    def _prove(self, rest: NDArray[np.bool_]) -> None:
        """See whether the first block of a start at rest is rest."""
        if self._unproven > 0:
            first = rest[: self._unproven]
            self._unproven = 0 if first.any() else self._unproven - len(first)
            if self._unproven == 0 and not first.any() and len(first):
                self._sign = SignDecision("undecided", 0.0)

    def _result(self, outputs: list[FilterOutput], place: int | None) -> RateEstimate:
        if not self.hypotheses:
            return self.describe(outputs[0])
        if len(outputs) == 1:
            return self.current.estimate(outputs[0], sign=self._sign)
        if place is not None:
            parts = [outputs[0].rows(slice(0, place)), outputs[self.winner].rows(slice(place, None))]
            return self.current.estimate(join(parts), sign=self._sign)
        mirrored = self.hypotheses[1].estimate(outputs[1], sign=self._sign)
        return self.current.estimate(outputs[0], sign=self._sign, mirrored=mirrored)

    def describe(self, waiting: FilterOutput) -> RateEstimate:
        """Turn output from before the start into a result."""
        columns = waiting.columns
        return RateEstimate(
            "filter", waiting.t, columns.omega, full_covariance(columns.covariance), columns.nis, columns.dof,
            columns.rest, self._sign,
        )  # fmt: skip
