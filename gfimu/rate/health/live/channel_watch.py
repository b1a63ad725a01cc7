"""The channels of a stream, watched while it arrives: exclusions and re-admissions as they happen."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.declared import Declared, figure
from gfimu.base.short_repr import short_repr
from gfimu.rate.health.fault import ChannelFault, FaultEntry, HealthCode
from gfimu.rate.health.kinds import name_kinds
from gfimu.rate.health.live.agreement import Agreement
from gfimu.rate.health.monitor import ChannelMonitor
from gfimu.rate.health.policy import MonitorPolicy
from gfimu.rate.health.recursion.blocks import block_means
from gfimu.rate.health.residue import with_residue
from gfimu.rate.health.rest import leading_rest, rest_bias, with_measured_noise
from gfimu.rate.health.start import MotionStart
from gfimu.rate.sensing import SensorErrors

__all__ = ["HealthEvent", "LiveWatch"]

_LEAST_RATE_STD = 1e-3  # numerical: rad/s


@dataclass(frozen=True)
class HealthEvent(Declared):
    """Something that changed in the health of the channels; ``fault`` is the fault that it is about, if it is."""

    t_s: Annotated[float, figure("Time of the newest sample when it was found.", "s")]
    event: Annotated[
        str,
        figure(
            "excluded or readmitted (a channel); measured: kind and size of a fault from the seconds since it was "
            "found; undecided: a fault lies in channels that can't be separated; watched or unwatched: whether "
            "channels are from now on."
        ),
    ]
    fault: ChannelFault | None
    text: Annotated[str, figure("The event in words.")]

    __repr__ = short_repr

    @property
    def faults(
        self,
    ) -> Annotated[
        list[dict[str, Any]] | None,
        figure("The fault, an entry for each channel.", absent=True, before="text", json=list[FaultEntry]),
    ]:
        """Entries of the fault; None without one."""
        return None if self.fault is None else self.fault.entries()


class LiveWatch:
    """Watches the channels of a stream of samples.

    If the stream begins with a rest, that shows the biases; else the watch begins where it is given rate and biases
    (`begin_in_motion`). Until the channels were seen to agree in motion, larger
    errors of gains, axes and positions are reckoned with, and only faults beyond those are excluded in motion.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions, with c channels.
    errors : SensorErrors
        Errors of its channels.
    period : float
        Sample period, s.
    at_rest : bool
        Whether the stream may begin with a rest.

    Attributes
    ----------
    in_motion : bool
        Whether the stream does not begin with a rest.

    Raises
    ------
    GeometryError
        If the array can't see all six motions.
    """

    def __init__(self, array: AccelerometerArray, errors: SensorErrors, period: float, *, at_rest: bool = True) -> None:
        self.array, self.policy, self._period = array, MonitorPolicy(), period
        self._errors = errors
        self._monitor: ChannelMonitor | None = None
        self._agreement: Agreement | None = None
        self._bias = np.zeros(array.n_channels)
        self._times: list[NDArray[np.float64]] = []  # samples that wait for a block to be full, or for the biases
        self._rows: list[NDArray[np.float64]] = []
        self._waiting = 0
        self._looked = 0
        self._reported: list[ChannelFault] = []
        self._unnamed: set[int] = set()  # faults whose kind is not final
        self._doubts = 0
        self.in_motion = not at_rest
        self._over = ""
        if array.n_channels - 7 < self.policy.fewest_null:
            self._over = f"array {array.name!r} has too few channels for a fault to be isolated"

    @property
    def watched(self) -> NDArray[np.bool_]:
        """Channels to be used, shape (c,)."""
        if self._monitor is None:
            return np.ones(self.array.n_channels, dtype=np.bool_)
        return self._monitor.watched

    @property
    def possible(self) -> bool:
        """Whether the channels are watched now, or may be later."""
        return not self._over

    @property
    def margin_s(self) -> float:
        """Time before the onset of a fault from which on its channels are not used, s."""
        block_s = self._period * self.policy.samples(self._period)
        return (self.policy.margin + 0.5) * block_s

    @property
    def active(self) -> bool:
        """Whether the channels are watched now."""
        return self._monitor is not None and not self._over

    @property
    def codes(self) -> NDArray[np.int8] | None:
        """Health of each channel now (`HealthCode`), shape (c,); None while nothing is watched."""
        if self._monitor is None or self._over:
            return None
        monitor = self._monitor
        doubt = np.full(self.array.n_channels, len(monitor.unexplained) > 0 and bool(monitor.unexplained[-1]))
        for fault in monitor.doubtful:
            if not np.isfinite(fault.end_s):
                doubt[[self.array.channels.index(name) for name in fault.channels]] = True
        used = np.where(doubt, np.int8(HealthCode.DOUBTED), np.int8(HealthCode.USED))
        codes = np.where(monitor.watched, used, np.int8(HealthCode.EXCLUDED))
        for fault in self._reported:
            if fault.kind == "stuck" and not np.isfinite(fault.end_s):
                codes[[self.array.channels.index(name) for name in fault.channels]] = HealthCode.STUCK
        return codes

    @property
    def faults(self) -> tuple[ChannelFault, ...]:
        """What was found so far."""
        return tuple(self._reported)

    def push(self, t: ArrayLike, readings: ArrayLike) -> list[HealthEvent]:
        """Take samples t (n,), s, and readings (n, c), m/s², NaN where missing; returns what changed."""
        if self._over or (self.in_motion and self._monitor is None):
            return []
        times, rows = np.atleast_1d(np.asarray(t, dtype=float)), np.atleast_2d(np.asarray(readings, dtype=float))
        self._times.append(times)
        self._rows.append(rows)
        self._waiting += len(times)
        if self._monitor is None:
            window = max(1, round(self.policy.least_rest_s / self._period))
            if self._waiting < self._looked + window:
                return []
            self._looked = self._waiting
            if not self._begin():
                return [self._give_up()] if self.in_motion else []
        monitor = self._monitor
        if monitor is None or self._waiting < monitor.samples:
            return []
        return self._watch(monitor)

    def _begin(self) -> bool:
        """Take the biases from the rest at the start, once it has lasted long enough or is over."""
        rows = np.concatenate(self._rows)
        errors = with_measured_noise(self._period, rows, self._errors, self.policy)
        count, over = leading_rest(self.array, self._period, rows, errors)
        seconds = count * self._period
        if over and seconds < self.policy.least_rest_s:
            self.in_motion = True
            return False
        if not over and seconds < self.policy.live_rest_s:
            return False
        self._errors = errors
        self._bias = rest_bias(self.array, rows[:count])
        self._agreement = Agreement(with_residue(self.array, errors, self.policy), self.policy)
        self._monitor = ChannelMonitor(self.array, self._agreement.errors, self._period, policy=self.policy)
        self._monitor.noise_in_motion = False  # until the channels were seen to agree
        return True

    def begin_in_motion(self, start: MotionStart, t_s: float, readings: NDArray[np.float64]) -> HealthEvent:
        """Begin with the next sample, behind one at ``t_s`` with this rate and these biases.

        ``readings`` (n, c), m/s², are those before it, from which the noise of the channels is measured.
        """
        self._errors = with_measured_noise(self._period, readings, self._errors, self.policy)
        left = with_residue(self.array, self._errors, self.policy)
        left = replace(left, bias_std=np.maximum(left.bias_std, start.bias_std))
        self._bias = start.bias
        self._agreement = Agreement(left, self.policy)
        self._monitor = ChannelMonitor(
            self.array, self._agreement.errors, self._period, omega0=start.omega,
            omega0_std=max(start.omega_std, _LEAST_RATE_STD), policy=self.policy,
        )  # fmt: skip
        self._monitor.noise_in_motion = False
        return HealthEvent(t_s, "watched", None, f"channels are watched from {t_s:.4g} s on")

    def _watch(self, monitor: ChannelMonitor) -> list[HealthEvent]:
        """Give the monitor all whole blocks that wait."""
        times, rows = np.concatenate(self._times), np.concatenate(self._rows)
        whole = len(times) // monitor.samples * monitor.samples
        self._times, self._rows, self._waiting = [times[whole:]], [rows[whole:]], len(times) - whole
        blocks = block_means(times[:whole], rows[:whole] - self._bias, self._errors.limits, monitor.samples)
        monitor.extend(blocks)
        now = float(times[whole - 1])
        if monitor.lost:
            self._over = "too few channels agree for the rate to be followed"
            return [self._give_up(now)]
        if self._agreement is not None:
            self._agreement.judge(monitor)
        events = self._changes(monitor, now)
        monitor.forget()
        return events

    def _changes(self, monitor: ChannelMonitor, now: float) -> list[HealthEvent]:
        """Compare the faults with those that were reported."""
        events = []
        for index, fault in enumerate(monitor.faults):
            if index == len(self._reported):
                named = self._named(monitor, fault, early=True)
                self._reported.append(named)
                self._unnamed.add(index)
                events.append(HealthEvent(now, "excluded", named, named.sentence()))
                continue
            before = self._reported[index]
            if np.isfinite(fault.end_s) and not np.isfinite(before.end_s):
                self._reported[index] = replace(before, end_s=fault.end_s)
                names = ", ".join(fault.channels)
                events.append(
                    HealthEvent(
                        now, "readmitted", self._reported[index],
                        f"{names}: used again from {fault.end_s:.4g} s on",
                    )
                )  # fmt: skip
            elif index in self._unnamed and now >= before.found_s + self.policy.kind_span_s:
                self._unnamed.discard(index)
                named = self._named(monitor, replace(fault, end_s=before.end_s))
                self._reported[index] = named
                events.append(HealthEvent(now, "measured", named, named.sentence()))
        doubts = monitor.doubtful
        if len(doubts) > self._doubts:
            events.append(HealthEvent(now, "undecided", doubts[-1], doubts[-1].sentence()))
        self._doubts = len(doubts)
        return events

    def _named(self, monitor: ChannelMonitor, fault: ChannelFault, *, early: bool = False) -> ChannelFault:
        """Name the kind of a fault from the blocks that are kept."""
        if fault.kind == "noise":
            return fault
        start = fault.onset_s - self.policy.kind_span_s - monitor.block_s
        first = int(np.searchsorted(monitor.blocks.t, start))
        part = monitor.blocks.rows(slice(first, None))
        times, rows = part.samples_of(self._period)
        rate = np.repeat(monitor.omega[first:], monitor.samples, axis=0)
        others = [other for other in monitor.faults if other.onset_s != fault.onset_s]
        faults = [fault, *others]
        return name_kinds(self.array, self._errors, times, rows, rate, faults, policy=self.policy, early=early)[0]

    def _give_up(self, now: float | None = None) -> HealthEvent:
        time = float(self._times[-1][-1]) if now is None else now
        self._times, self._rows, self._waiting = [], [], 0
        why = self._over or "the run does not begin with a rest; they will be once the rate has settled"
        return HealthEvent(time, "unwatched", None, f"channels are not watched: {why}")
