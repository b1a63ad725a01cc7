"""Health of the channels that an estimate is made from: watched, missing, saturated or stuck."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.short_repr import short_repr
from gfimu.rate.health.fault import ChannelFault, ChannelHealth, HealthCode
from gfimu.rate.reduction import stuck_readings
from gfimu.rate.sensing import SensorErrors, step_of_readings

__all__ = ["UsedReadings", "watched_readings"]


@dataclass(frozen=True)
class UsedReadings:
    """Which readings of a recording an estimate can use.

    Parameters
    ----------
    t_s : ndarray, shape (n,)
        Times, s.
    missing, saturated : ndarray of bool, shape (n, c)
        Readings that are not there, and readings at the end of the range.
    stuck : ndarray of bool, shape (n, c), optional
        Readings that repeat the one before too often for the noise, where that was looked for.
    stuck_after : int
        So many equal readings in a row are too many.
    watch : ChannelHealth, optional
        Which channels contradict the others, where they were watched.
    """

    t_s: NDArray[np.float64]
    missing: NDArray[np.bool_]
    saturated: NDArray[np.bool_]
    stuck: NDArray[np.bool_] | None = None
    stuck_after: int = 0
    watch: ChannelHealth | None = None

    __repr__ = short_repr

    @property
    def excluded(self) -> NDArray[np.bool_]:
        """Readings that contradict the others, shape (n, c)."""
        return np.zeros_like(self.missing) if self.watch is None else self.watch.excluded

    def codes(self, array: AccelerometerArray) -> dict[str, NDArray[np.int8]] | None:
        """Return the health (`HealthCode`) of each channel by name; None where none was watched and all are used."""
        stuck = np.zeros_like(self.missing) if self.stuck is None else self.stuck
        if self.watch is None and not (self.missing | self.saturated | stuck).any():
            return None
        used = np.full(self.missing.shape, np.int8(HealthCode.USED))
        codes = used if self.watch is None else self.watch.codes(self.t_s)
        codes[stuck] = HealthCode.STUCK
        codes[self.saturated] = HealthCode.SATURATED
        codes[self.missing] = HealthCode.MISSING
        return dict(zip(array.channels, codes.T, strict=True))

    def faults(self, array: AccelerometerArray) -> list[ChannelFault]:
        """Return the faults that were watched, then the stuck channels that are not among them."""
        found = [] if self.watch is None else list(self.watch.faults)
        return found + self._stuck_faults(array, found)

    def sentences(self, array: AccelerometerArray) -> list[str]:
        """Return what was found in words; empty if nothing was."""
        watched = [] if self.watch is None else self.watch.sentences()
        known = [] if self.watch is None else self.watch.faults
        return watched + [fault.sentence() for fault in self._stuck_faults(array, known)]

    def _stuck_faults(self, array: AccelerometerArray, known: Sequence[ChannelFault]) -> list[ChannelFault]:
        """Return one fault for each run of equal readings that no known fault of the channel covers."""
        if self.stuck is None:
            return []
        found = []
        for column, name in enumerate(array.channels):
            for start, stop in _runs(self.stuck[:, column]):
                onset = float(self.t_s[max(start - self.stuck_after + 1, 0)])
                end = float(self.t_s[stop]) if stop < len(self.t_s) else float("inf")
                if not any(name in one.channels and one.onset_s < end and one.end_s > onset for one in known):
                    found.append(_stuck_fault(name, onset, float(self.t_s[start]), end))
        return found


def watched_readings(
    used: UsedReadings,
    array: AccelerometerArray,
    readings: NDArray[np.float64],
    noise: NDArray[np.float64],
    *,
    omega0: NDArray[np.float64] | None,
    watch: bool,
    calibrated: bool,
) -> UsedReadings:
    """Look for stuck channels, and for channels that contradict the others.

    Parameters
    ----------
    used : UsedReadings
        What is missing or saturated.
    array : AccelerometerArray
        The array, with c channels.
    readings : ndarray, shape (n, c)
        Readings, m/s²; NaN where missing or saturated.
    noise : ndarray, shape (c,)
        White noise of the channels, m/s².
    omega0 : ndarray, shape (3,), or None
        Angular rate at the first sample, rad/s, where it is known.
    watch : bool
        Whether to look for channels that contradict the others.
    calibrated : bool
        Whether the gains and axes were calibrated: otherwise they are as sure as the parts' data sheets say.
    """
    rate = 1.0 / float(np.median(np.diff(used.t_s)))
    errors = SensorErrors.from_parts(array, rate, step=step_of_readings(readings), noise_std=noise)
    if errors.stuck_after == 0:  # steps coarser than the noise: rounding errors last, and look like faults
        return used
    stuck = stuck_readings(readings, errors.stuck_after)
    found = replace(used, stuck=stuck, stuck_after=errors.stuck_after)
    if not watch:
        return found
    if calibrated:
        return replace(found, watch=_watched(array, used.t_s, readings, errors, omega0))
    from gfimu.rate.health.gains import gross_faults, with_learnt_gains

    errors = errors.with_part_gains(array)
    first = _watched(array, used.t_s, readings, errors, omega0)
    bent = stuck if first is None else stuck | gross_faults(first, array, used.t_s, readings, errors)
    corrected, left = with_learnt_gains(array, used.t_s, readings, errors, bent)
    if left is errors:
        return replace(found, watch=first)
    return replace(found, watch=_watched(array, used.t_s, corrected, left, omega0))


def _watched(
    array: AccelerometerArray,
    t: NDArray[np.float64],
    readings: NDArray[np.float64],
    errors: SensorErrors,
    omega0: NDArray[np.float64] | None,
) -> ChannelHealth | None:
    """Return which channels contradict the others, from a first rest or from a start in motion."""
    from gfimu.rate.health.watch import watch_from_rest, watch_in_motion

    health = watch_from_rest(array, t, readings, errors) if omega0 is None or not omega0.any() else None
    return health or watch_in_motion(array, t, readings, errors, omega0=omega0)


def _stuck_fault(name: str, onset: float, found: float, end: float) -> ChannelFault:
    unknown = (float("nan"),)
    return ChannelFault((name,), "stuck", True, onset, found, end, unknown, unknown, float("inf"))


def _runs(marks: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marks, [False]]).astype(np.int8)))
    return [(int(start), int(stop)) for start, stop in zip(edges[::2], edges[1::2], strict=True)]
