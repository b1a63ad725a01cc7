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
    several = (np.asarray(status).astype(int)[:, None] >> np.array(bits) & 1) == 1  # (n, k)
    ahead = several & (steps == 1)[:, None]  # after a lost sample several are no more than were due
    waited = _waited(recording.t_s, steps, 1.0 / float(metadata.get("sample_rate_hz", stated)))
    slowest = int(np.argmin(ahead.any(axis=0)))  # the first that is never ahead
    read[:, slowest:] += waited[:, None]  # the chips behind it are read after the wait
    columns = zip(read.T, several.T, ahead.T, strict=True)
    return np.column_stack([_of_chip(t, steps, *marks, waited > 0.0, period) for t, *marks in columns])


def _waited(t: NDArray[np.float64], steps: NDArray[np.intp], asked: float) -> NDArray[np.float64]:
    """Return how long each sample (n,) waited for the slowest chip, s: so much later than asked for comes the next."""
    excess = np.append(np.where(steps[1:] == 1, np.diff(t) - asked, 0.0), 0.0)
    return np.where(excess > _WAITED, excess, 0.0)


def _of_chip(
    read: NDArray[np.float64],
    steps: NDArray[np.intp],
    several: NDArray[np.bool_],
    ahead: NDArray[np.bool_],
    waited: NDArray[np.bool_],
    period: float,
) -> NDArray[np.float64]:
    """Return the conversion times (n,) of one chip, s.

    Parameters
    ----------
    read : ndarray, shape (n,)
        When the chip was read, s.
    steps : ndarray of int, shape (n,)
        Sample periods since the row before.
    several, ahead : ndarray of bool, shape (n,)
        Which rows hold the mean of several conversions, and of one more than was due.
    waited : ndarray of bool, shape (n,)
        Which samples waited for the slowest chip.
    period : float
        Output period by the data sheet, s.
    """
    place = np.cumsum(steps)
    if ahead.any():
        newest, period = _between_marks(read, place, ahead)
    else:
        newest, period = _without_marks(read, place, waited, period)
    count = np.where(several, np.maximum(steps, 2), 1)
    return newest - 0.5 * (count - 1) * period


def _between_marks(
    read: NDArray[np.float64], place: NDArray[np.intp], ahead: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], float]:
    """Return the newest conversion of each row (n,), s, and the chip's period, s, from rows that were one ahead.

    In such a row the newest conversion came just before: the one before it had not come a row earlier.
    """
    marks, number = np.flatnonzero(ahead), place + np.cumsum(ahead)  # number of the newest conversion
    sampled = float(read[-1] - read[0]) / float(place[-1] - place[0])
    if len(marks) > 1:
        period = float(read[marks[-1]] - read[marks[0]]) / float(number[marks[-1]] - number[marks[0]])
    else:  # how long it took at least to be one ahead bounds by how much it is faster
        longest = max(int(place[-1] - place[marks[0]]), int(place[marks[0]] - place[0]), 1)
        period = sampled * (1.0 - 0.5 / longest)
    at = read[marks] - 0.5 * (sampled - period)
    newest = np.interp(number, number[marks], at)
    before, after = number < number[marks[0]], number > number[marks[-1]]
    newest[before] = at[0] - period * (number[marks[0]] - number[before])
    newest[after] = at[-1] + period * (number[after] - number[marks[-1]])
    return newest, period


def _without_marks(
    read: NDArray[np.float64], place: NDArray[np.intp], waited: NDArray[np.bool_], period: float
) -> tuple[NDArray[np.float64], float]:
    """Return the newest conversion of each row (n,), s, and the chip's period, s, of a chip that is never ahead.

    Where the board has waited, it is the slowest, and converts when it is read from then on. Otherwise its clock is as
    fast as the board's, and nothing shows its phase: half a period before.
    """
    since = int(np.argmax(waited))
    if not waited.any() or place[-1] == place[since]:
        return read - 0.5 * period, period
    period = float(read[-1] - read[since]) / float(place[-1] - place[since])
    return np.where(place < place[since], read[since] - period * (place[since] - place), read), period
