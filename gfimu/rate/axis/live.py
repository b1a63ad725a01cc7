"""The rate about a known axis while samples arrive: the filter of `gfimu.rate.axis.recursion`, sample by sample."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.part import white_noise_std
from gfimu.array.turning_axis import TurningAxis
from gfimu.base.errors import InputError
from gfimu.rate.axis.accuracy.bounds import require_visible
from gfimu.rate.axis.channels import AxisChannels
from gfimu.rate.axis.fit import first_settings, first_starts
from gfimu.rate.axis.mirror import MirrorTest
from gfimu.rate.axis.mounting import Mounting
from gfimu.rate.axis.problem import AxisProblem, Settings
from gfimu.rate.axis.recursion import filter_axis
from gfimu.rate.axis.rest import begins_at_rest
from gfimu.rate.stream import LiveSample, SkippedLine, stream_samples

__all__ = ["AxisSample", "LiveAxisFilter", "LiveAxisSettings", "axis_stream"]

_NONE = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class LiveAxisSettings:
    """How a live filter about an axis runs; all by choice.

    Parameters
    ----------
    start_s : float
        Time from whose samples inclination and start are taken, s; estimates of it come when it is over.
    memory_s : float
        Time constant with which the size of the innovations is followed, s: the stated σ grows with it.
    test : MirrorTest
        When the mirrored rate replaces the one that is followed.
    """

    start_s: float = 1.0
    memory_s: float = 5.0
    test: MirrorTest = field(default_factory=MirrorTest)


@dataclass(frozen=True)
class AxisSample:
    """Estimate after one sample.

    Parameters
    ----------
    t_s : float
        Time, s.
    angle, rate, acceleration : float
        θ since the start, rad; Ω, rad/s; α, rad/s².
    rate_std : float
        Standard deviation of the rate, rad/s; that of an uncertain mounting is in it.
    nis, nis_dof : float, int
        Normalised innovation squared, and the number of readings.
    sign : {"decided", "undecided"}
        Whether the sign of the rate is certain.
    """

    t_s: float
    angle: float
    rate: float
    acceleration: float
    rate_std: float
    nis: float
    nis_dof: int
    sign: str

    def to_json(self, direction: NDArray[np.float64]) -> str:
        """Return one JSON line; ``direction`` (3,) is the axis in the body frame."""
        sample = LiveSample(
            t_s=self.t_s,
            omega_rad_s=(self.rate * direction).tolist(),
            omega_std_rad_s=(self.rate_std * np.abs(direction)).tolist(),
            nis=self.nis,
            nis_dof=self.nis_dof,
            sign=self.sign,
            rate_rad_s=self.rate,
            rate_std_rad_s=self.rate_std,
            alpha_rad_s2=self.acceleration,
            angle_rad=self.angle,
        )
        return json.dumps(sample.to_dict())


@dataclass(frozen=True)
class _Hypothesis:
    """One motion that is followed: state, covariance, derivatives by the uncertain constants, log likelihood."""

    state: NDArray[np.float64]
    covariance: NDArray[np.float64]
    by_constants: NDArray[np.float64]
    likelihood: float = 0.0

    def mirrored(self) -> _Hypothesis:
        """Return the motion of the other sign that reads the same at this moment."""
        mirror = np.diag([1.0, -1.0, 1.0])
        return _Hypothesis(mirror @ self.state, mirror @ self.covariance @ mirror, mirror @ self.by_constants)


class LiveAxisFilter:
    """Filter of a rotation about one known axis for a stream of samples.

    An uncertain mounting is not estimated here; what it may be off by, as its priors say, is in the stated σ.

    Parameters
    ----------
    array : AccelerometerArray
        The array, of one chip at least.
    axis : TurningAxis
        The axis.
    rate_hz : float
        Nominal sample rate, Hz.
    at_rest : bool
        Whether the body is at rest at the first sample, else both signs of the rate are followed until one is clear;
        by default whether the first half second is rest (`begins_at_rest`).

    Raises
    ------
    GeometryError
        If the array can't see the rotation.
    """

    def __init__(
        self, array: AccelerometerArray, axis: TurningAxis, rate_hz: float, *, at_rest: bool | None = None
    ) -> None:
        require_visible(array, axis)
        self.array, self.axis, self.settings = array, axis, LiveAxisSettings()
        self._at_rest = at_rest
        self._channels = AxisChannels.of(array, axis)
        self._noise = np.ascontiguousarray(np.broadcast_to(white_noise_std(array, rate_hz), array.n_channels))
        self._waiting: list[tuple[float, NDArray[np.float64]]] = []
        self._numbers: Settings | None = None
        self._followed: list[_Hypothesis] = []
        self._last = -np.inf
        self._spread = 1.0
        self._clear = False
        self._period = 1.0 / rate_hz
        self._sign = "decided" if at_rest else "undecided"

    def push(self, t: float, readings: NDArray[np.float64]) -> list[AxisSample]:
        """Take one sample; returns the estimates that are ready: none while the start is awaited.

        Parameters
        ----------
        t : float
            Time, s, later than all before.
        readings : ndarray, shape (c,)
            Specific force, m/s²; NaN where a channel is missing.

        Raises
        ------
        InputError
            If time does not increase, or the inclination of the axis does not show.
        """
        if self.ended(t):
            raise InputError(f"t_s {t!r} is not after the sample before ({self._last!r})")
        self._last = t
        if self._numbers is not None:
            return [self._step(t, readings)]
        self._waiting.append((t, readings))
        if t - self._waiting[0][0] < self.settings.start_s:
            return []
        return self._begin()

    def ended(self, t: float) -> bool:
        """Return whether a time is not after all samples before, or no time at all."""
        return not t > self._last

    def finish(self) -> list[AxisSample]:
        """Return the estimates of a stream that ends before its start was found."""
        return self._begin() if self._waiting else []

    def _begin(self) -> list[AxisSample]:
        """Choose the start by the samples that waited, and filter these."""
        waiting, self._waiting = self._waiting, []
        t, y = np.array([one for one, _ in waiting]), np.array([one for _, one in waiting])
        if self._at_rest is None:
            self._at_rest = begins_at_rest(y, self.array, self.axis, self._noise, self._period)
            self._sign = "decided" if self._at_rest else "undecided"
        self._numbers, covariance = first_settings(y, self._channels, self.axis, self._noise, at_rest=self._at_rest)
        tilt = self._numbers.inclination
        self._mounting = Mounting.of(self.array, replace(self.axis, inclination=tilt), tilt, free_inclination=False)
        self._slopes = self._mounting.slopes(np.zeros(len(self._mounting.constants)))
        problem = AxisProblem(t, y, self._channels, self._noise)
        starts = list(first_starts(y, self._channels, tilt, at_rest=self._at_rest))
        numbers = self._numbers
        starts.sort(key=lambda one: -problem.likelihood(numbers, one, covariance, len(t)))
        chosen = starts[:1]
        if not self._at_rest:
            chosen += [one for one in starts if one[1] * starts[0][1] < 0.0][:1]
        none = np.zeros((3, len(self._mounting.constants)))
        self._followed = [_Hypothesis(start, covariance, none) for start in chosen]
        self._before = t[0]
        return [self._step(time, row) for time, row in waiting]

    def _step(self, t: float, readings: NDArray[np.float64]) -> AxisSample:
        """Take one sample with every motion that is followed."""
        followed, squares, count = [], 0.0, 0
        for index, one in enumerate(self._followed):
            after, square, seen = self._advanced(one, t, readings)
            followed.append(after)
            if index == 0:
                squares, count = square, seen
        if count:
            share = min((t - self._before) / self.settings.memory_s, 1.0)
            self._spread += share * (squares / count - self._spread)
        self._before = t
        self._followed = followed
        self._decide()
        return self._sample(t, squares, count)

    def _advanced(self, one: _Hypothesis, t: float, readings: NDArray[np.float64]) -> tuple[_Hypothesis, float, int]:
        """Return a motion after a sample, its normalised innovation squared, and the number of readings."""
        assert self._numbers is not None
        times, rows = np.array([self._before, t]), np.vstack([np.full(len(readings), np.nan), readings])
        if t == self._before:  # the first sample of all: nothing to predict
            times, rows = times[1:], rows[1:]
        numbers = self._numbers
        run = filter_axis(
            times, rows, self._channels.coefficients, numbers.gravity, (numbers.noise_scale * self._noise) ** 2,
            numbers.hub**2, np.full(len(times), numbers.jerk), one.state, one.covariance, self._slopes, _NONE,
            one.by_constants,
        )  # fmt: skip
        after = _Hypothesis(run.states[-1], run.covariances[-1], run.by_constants[-1], one.likelihood + run.likelihood)
        return after, run.squares, run.readings

    def _decide(self) -> None:
        """Follow the mirrored motion from where the rate comes clear of zero; keep the better one once it is clear."""
        test = self.settings.test
        first = self._followed[0]
        clear = abs(first.state[1]) > test.clear * np.sqrt(first.covariance[1, 1])
        before, self._clear = self._clear, clear
        if len(self._followed) == 1 and clear and not before:
            self._followed = [replace(first, likelihood=0.0), first.mirrored()]
            return
        if len(self._followed) == 1:
            return
        other = self._followed[1]
        odds = (first.likelihood - other.likelihood) / max(self._spread, 1.0)
        if odds < -test.nats:
            self._followed, self._sign = [other], "decided"
        elif odds > test.nats:
            self._followed, self._sign = [first], "decided"
        elif self._sign == "decided" and not clear:
            self._followed = [first]

    def _sample(self, t: float, squares: float, count: int) -> AxisSample:
        """Return the estimate of the motion that is followed first."""
        first = self._followed[0]
        least = 1.0 if self._numbers is None else min(self._numbers.noise_scale**-2, 1.0)  # noise of the data sheets
        variance = max(self._spread, least) * float(first.covariance[1, 1])
        if len(self._mounting.constants):
            variance += float(np.sum((first.by_constants[1] * self._mounting.prior_std) ** 2))
        angle, rate, acceleration = (float(one) for one in first.state)
        return AxisSample(t, angle, rate, acceleration, float(np.sqrt(variance)), squares, count, self._sign)


def axis_stream(
    lines: Iterable[str], array: AccelerometerArray, axis: TurningAxis, rate_hz: float, *, at_rest: bool | None = None
) -> Iterator[str]:
    """Filter a stream of CSV lines about a known axis, sample by sample: one JSON line each.

    Parameters
    ----------
    lines : iterable of str
        The stream, as `gfimu.rate.stream.filter_stream` takes it.
    array, axis, rate_hz, at_rest
        As those of `LiveAxisFilter`.

    Yields
    ------
    str
        JSON lines: those of `AxisSample.to_json`, or ``{"fault": …}`` for a line that is skipped.

    Raises
    ------
    InputError
        If the first line doesn't name the columns, or the inclination of the axis does not show.
    GeometryError
        If the array can't see the rotation.
    """
    live = LiveAxisFilter(array, axis, rate_hz, at_rest=at_rest)
    for sample in stream_samples(lines, array):
        if isinstance(sample, str):
            yield json.dumps(SkippedLine(sample).to_dict())
            continue
        if live.ended(sample.t_s):
            late = SkippedLine(f"t_s {sample.t_s!r} is not after the sample before; line skipped")
            yield json.dumps(late.to_dict())
            continue
        for found in live.push(sample.t_s, sample.readings):
            yield found.to_json(axis.direction)
    for found in live.finish():
        yield found.to_json(axis.direction)
