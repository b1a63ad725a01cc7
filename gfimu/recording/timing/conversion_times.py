"""When the chips converted what a row of a recording holds.

Chips convert by clocks of their own. A reading is older than its row's time by up to a period of the chip's output
data rate, and where a board keeps pace with chips of the same rate, that age grows from row to row until the chip is a
whole conversion ahead. Such a recording states in its metadata ``output_data_rate_hz``, the time from reading one chip
to the next (``read_spacing_s``), and in ``paced_status_bits`` the bit of its column ``status``, for each chip, that
marks a row whose reading is the mean of several conversions. Each mark says when the chip's clock passed the board's,
so that all conversions between two marks are known. The slowest chip has none: the board waits for it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.base.short_repr import short_repr
from gfimu.recording.recording import Recording

__all__ = ["ConversionTimes", "conversion_times", "output_data_rate"]

_WAITED = 1.5e-6  # s: a step that is longer by more than the rounding of a stamp waited for a chip
_UNIFORM = 12.0**-0.5  # standard deviation of what is equally likely anywhere in an interval of one


@dataclass(frozen=True)
class ConversionTimes:
    """When each of k chips converted the readings of n rows, on the clock of ``t_s``.

    Parameters
    ----------
    times : ndarray, shape (n, k)
        The times, s.
    unknown : ndarray, shape (2, n, k)
        What one standard deviation of a chip's phase, and one of its rate, would add, s; 0 where the marks show both.
    """

    times: NDArray[np.float64]
    unknown: NDArray[np.float64]

    __repr__ = short_repr


def output_data_rate(recording: Recording) -> float | None:
    """Return the rate at which the chips convert, Hz, where the recording states one."""
    return _positive(recording, "output_data_rate_hz")


def conversion_times(recording: Recording, chips: int) -> ConversionTimes | None:
    """Return when each chip converted the reading of each row.

    Where no mark can be read, that is half an output period before the chip is read.

    Parameters
    ----------
    recording : Recording
        The recording, n rows.
    chips : int
        Number k of chips of its array.

    Returns
    -------
    ConversionTimes or None
        None where the recording states no output data rate.
    """
    stated = output_data_rate(recording)
    if stated is None or len(recording) < 2:
        return None
    period = 1.0 / stated
    read = recording.t_s[:, None] + (_positive(recording, "read_spacing_s") or 0.0) * np.arange(chips)  # (n, k)
    several = _marked(recording, chips)
    if several is None:
        return ConversionTimes(read - 0.5 * period, np.zeros((2, *read.shape)))
    steps = np.maximum(np.rint(np.diff(recording.t_s, prepend=read[0, 0]) / recording.sample_period).astype(int), 1)
    ahead = several & (steps == 1)[:, None]  # after a lost sample several are no more than were due
    waited = _waited(recording.t_s, steps, 1.0 / (_positive(recording, "sample_rate_hz") or stated))
    unmarked = np.flatnonzero(~ahead.any(axis=0))
    if len(unmarked):
        read[:, unmarked[0] :] += waited[:, None]  # the slowest chip and those behind it are read after the wait
    place, times, unknown = np.cumsum(steps), np.empty_like(read), np.zeros((2, *read.shape))
    for chip in range(chips):
        if chip in unmarked:
            found = _without_marks(read[:, chip], place, waited > 0.0, period, alone=len(unmarked) == 1)
        else:
            found = _between_marks(read[:, chip], place, ahead[:, chip])
        count = np.where(several[:, chip], np.maximum(steps, 2), 1)
        times[:, chip] = found.newest - 0.5 * (count - 1) * found.period
        unknown[0, :, chip], unknown[1, :, chip] = found.phase, found.rate
    return ConversionTimes(times, unknown)


def _positive(recording: Recording, key: str) -> float | None:
    """Return a positive number that the metadata state; None where they do not."""
    value = recording.metadata.get(key)
    return float(value) if isinstance(value, int | float) and value > 0.0 else None


def _marked(recording: Recording, chips: int) -> NDArray[np.bool_] | None:
    """Return the rows that hold the mean of several conversions, for each chip (n, k); None where no column says so."""
    bits, status = recording.metadata.get("paced_status_bits"), recording.extra.get("status")
    if status is None or not isinstance(bits, list) or len(bits) != chips or {*map(type, bits)} != {int}:
        return None
    flags = np.nan_to_num(np.asarray(status, dtype=float)).astype(int)
    return np.asarray((flags[:, None] >> np.array(bits) & 1) == 1)


def _waited(t: NDArray[np.float64], steps: NDArray[np.intp], asked: float) -> NDArray[np.float64]:
    """Return how long each sample (n,) waited for the slowest chip, s: so much later than asked for comes the next."""
    excess = np.append(np.where(steps[1:] == 1, np.diff(t) - asked, 0.0), 0.0)
    return np.where(excess > _WAITED, excess, 0.0)


@dataclass(frozen=True)
class _Clock:
    """The newest conversion of each row (n,) and the period of a chip, s, with what its phase and rate may add (n,)."""

    newest: NDArray[np.float64]
    period: float
    phase: NDArray[np.float64] | float = 0.0
    rate: NDArray[np.float64] | float = 0.0


def _between_marks(read: NDArray[np.float64], place: NDArray[np.intp], ahead: NDArray[np.bool_]) -> _Clock:
    """Return the clock of a chip read at times (n,), s, from the rows in which it was one conversion ahead.

    In such a row the newest conversion came just before: the one before it had not come a row earlier.
    """
    marks, number = np.flatnonzero(ahead), place + np.cumsum(ahead)  # number of the newest conversion
    sampled = float(read[-1] - read[0]) / float(place[-1] - place[0])
    if len(marks) > 1:
        period, spread = float(np.ptp(read[marks])) / float(np.ptp(number[marks])), 0.0
    else:
        period, spread = _possible_periods(read - read[marks[0]], number - number[marks[0]])
    at = read[marks] - 0.5 * (sampled - period)
    newest = np.interp(number, number[marks], at)
    since, until = number - number[marks[0]], number - number[marks[-1]]
    newest = np.where(since < 0, at[0] + period * since, newest)
    newest = np.where(until > 0, at[-1] + period * until, newest)
    return _Clock(newest, period, rate=spread * since)


def _possible_periods(read: NDArray[np.float64], number: NDArray[np.intp]) -> tuple[float, float]:
    """Return mean and standard deviation, s, of the periods with which every row holds the newest conversion.

    ``read`` and ``number`` (n,) count from a row whose conversion came just before it was read: conversion m came by
    the time of its row, and the one after it had not.
    """
    later, earlier, before = number > 0, number < 0, number < -1
    most = np.concatenate([read[later] / number[later], read[before] / (number[before] + 1)])
    least = np.concatenate([read[later] / (number[later] + 1), read[earlier] / number[earlier]])
    low, high = sorted((float(least.max()), float(most.min())))
    return 0.5 * (low + high), _UNIFORM * (high - low)


def _without_marks(
    read: NDArray[np.float64], place: NDArray[np.intp], waited: NDArray[np.bool_], period: float, *, alone: bool
) -> _Clock:
    """Return the clock of a chip read at times (n,), s, that is never ahead.

    Where the board has waited, and the chip is ``alone`` in that, it is the slowest, and converts when it is read from
    then on. Otherwise its clock is as fast as the board's, and nothing shows its phase.
    """
    since = int(np.argmax(waited))
    if alone and waited.any() and place[-1] > place[since]:
        period = float(read[-1] - read[since]) / float(place[-1] - place[since])
        return _Clock(np.where(place < place[since], read[since] - period * (place[since] - place), read), period)
    along = 2.0 * (place - place[0]) / max(int(place[-1] - place[0]), 1) - 1.0
    spread = _UNIFORM * period
    return _Clock(read - 0.5 * period, period, np.full(len(read), spread), spread * along)
