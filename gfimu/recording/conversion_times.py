"""When the chips converted what a row of a recording holds.

Chips convert by clocks of their own. A reading is older than its row's time by up to a period of the chip's output data
rate, and where a board keeps pace with chips of the same rate, that age grows from row to row until the chip is a whole
conversion ahead. Such a recording states in its metadata ``output_data_rate_hz``, the time from reading one chip to the next
(``read_spacing_s``), and in ``paced_status_bits`` the bit of its column ``status``, for each chip, that marks a row whose
reading is the mean of several conversions. Each mark says when the chip's clock passed the board's, so that all
conversions between two marks are known.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.recording.recording import Recording

__all__ = ["conversion_times", "output_data_rate"]

_WAITED = 1.5e-6  # s: a step that is longer by more than the rounding of a stamp waited for a chip


def output_data_rate(recording: Recording) -> float | None:
    """Return the rate at which the chips convert, Hz, where the recording states one."""
    stated = recording.metadata.get("output_data_rate_hz")
    return float(stated) if isinstance(stated, int | float) and stated > 0.0 else None


def conversion_times(recording: Recording, chips: int) -> NDArray[np.float64] | None:
    """Return when each chip converted the reading of each row, on the clock of ``t_s``, s.

    Where no mark can be read, that is half an output period before the chip is read.

    Parameters
    ----------
    recording : Recording
        The recording, n rows.
    chips : int
        Number k of chips of its array.

    Returns
    -------
    ndarray, shape (n, k), or None
        The times; None where the recording states no output data rate.
    """
    stated = output_data_rate(recording)
    if stated is None or len(recording) < 2:
        return None
    metadata, period = recording.metadata, 1.0 / stated
    read = recording.t_s[:, None] + float(metadata.get("read_spacing_s", 0.0)) * np.arange(chips)  # (n, k)
    bits, status = metadata.get("paced_status_bits", []), recording.extra.get("status")
    if status is None or len(bits) != chips:
        return read - 0.5 * period
    steps = np.maximum(np.rint(np.diff(recording.t_s, prepend=read[0, 0]) / recording.sample_period).astype(int), 1)
    flags, asked = np.asarray(status).astype(int), 1.0 / float(metadata.get("sample_rate_hz", stated))
    several = (flags[:, None] >> np.array(bits) & 1) == 1  # (n, k)
    columns = zip(read.T, several.T, strict=True)
    return np.column_stack([_of_chip(t, steps, marked, period, asked) for t, marked in columns])


def _of_chip(
    t: NDArray[np.float64], steps: NDArray[np.intp], several: NDArray[np.bool_], period: float, asked: float
) -> NDArray[np.float64]:
    """Return the conversion times (n,) of one chip, s.

    Parameters
    ----------
    t : ndarray, shape (n,)
        When the chip was read, s.
    steps : ndarray of int, shape (n,)
        Sample periods since the row before.
    several : ndarray of bool, shape (n,)
        Which rows hold the mean of several conversions.
    period, asked : float
        Output period by the data sheet, and the sample period asked for, s.
    """
    place = np.cumsum(steps)
    marks = np.flatnonzero(several & (steps == 1))  # after a lost sample several are no more than were due
    if len(marks):
        newest, period = _between_marks(t, place, several & (steps == 1), marks)
    else:
        newest, period = _without_marks(t, place, period, asked)
    count = np.where(several, np.maximum(steps, 2), 1)
    return newest - 0.5 * (count - 1) * period


def _between_marks(
    t: NDArray[np.float64], place: NDArray[np.intp], ahead: NDArray[np.bool_], marks: NDArray[np.intp]
) -> tuple[NDArray[np.float64], float]:
    """Return the newest conversion of each row (n,), s, and the chip's period, s, from rows that were one ahead.

    In such a row the newest conversion came just before: the one before it had not come a row earlier.
    """
    number = place + np.cumsum(ahead)  # of the newest conversion
    sampled = float(t[-1] - t[0]) / float(place[-1] - place[0])
    if len(marks) > 1:
        period = float(t[marks[-1]] - t[marks[0]]) / float(number[marks[-1]] - number[marks[0]])
    else:  # by how much it is faster is known from how long it took to be one ahead, at least
        longest = max(int(place[-1] - place[marks[0]]), int(place[marks[0]] - place[0]), 1)
        period = sampled * (1.0 - 0.5 / longest)
    at = t[marks] - 0.5 * (sampled - period)
    newest = np.interp(number, number[marks], at)
    before, after = number < number[marks[0]], number > number[marks[-1]]
    newest[before] = at[0] - period * (number[marks[0]] - number[before])
    newest[after] = at[-1] + period * (number[after] - number[marks[-1]])
    return newest, period


def _without_marks(
    t: NDArray[np.float64], place: NDArray[np.intp], period: float, asked: float
) -> tuple[NDArray[np.float64], float]:
    """Return the newest conversion of each row (n,), s, and the chip's period, s, of a chip that is never ahead.

    Where the board has waited, it is the slowest, and converts at the time of the row from then on. Otherwise its clock
    is as fast as the board's, and nothing shows its phase: half a period before the row.
    """
    waited = np.flatnonzero((np.diff(t) > asked + _WAITED) & (np.diff(place) == 1))
    if not len(waited) or place[-1] == place[waited[0]]:
        return t - 0.5 * period, period
    since = int(waited[0])
    period = float(t[-1] - t[since]) / float(place[-1] - place[since])
    return np.where(place < place[since], t[since] - period * (place[since] - place), t), period
