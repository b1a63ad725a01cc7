"""A reference that stands in a recording at times of another clock: seconds before or after its channels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import null_space

from gfimu.recording.joining.alignment import Alignment
from gfimu.recording.joining.join import FAR, Joined, aligned, join_reference
from gfimu.recording.joining.series import TABLE_COLUMNS, ReferenceSeries
from gfimu.recording.recording import Recording

__all__ = ["displaced_reference", "own_alignment"]

_FEWEST = 20  # values of a reference


def displaced_reference(recording: Recording, *, rates: bool = False) -> Joined | None:
    """Return the recording with its reference moved, where that is more than `FAR` from its channels.

    Parameters
    ----------
    recording : Recording
        Channels, m/s², with a tachometer, an angle or a command.
    rates : bool
        Whether a rate error alone is reason enough, as for a free body, whose model has none.

    Returns
    -------
    Joined or None
        None where the reference is near its channels, or nothing shows where it belongs.
    """
    series = _own_reference(recording)
    rough = own_alignment(recording, rates=rates)
    if series is None or rough is None or (abs(rough.apart(recording.t_s[0])) <= FAR and not rates):
        return None
    found = join_reference(recording, series, force=True, seen=_without_hub(recording) if rates else None)
    is_far = found.is_far or (rates and found.has_rate_error)
    return found if is_far and not found.doubts else None


def own_alignment(recording: Recording, *, rates: bool = False) -> Alignment | None:
    """Return how the clock of a recording's own reference is aligned with its channels, with standard deviations.

    Parameters
    ----------
    recording : Recording
        Channels, m/s², with a tachometer, an angle or a command.
    rates : bool
        Whether the body is a free one, whose hub moves.

    Returns
    -------
    Alignment or None
        None without such a reference, or where it does not change. Its ``doubts`` say whether it is sure.
    """
    series = _own_reference(recording)
    return None if series is None else aligned(_without_hub(recording) if rates else recording, series)


def _own_reference(recording: Recording) -> ReferenceSeries | None:
    """Return the table's reference in a recording; None without one."""
    columns = {name: recording.reference[name] for name in TABLE_COLUMNS if name in recording.reference}
    known = np.isfinite(list(columns.values())).any(axis=0) if columns else np.zeros(len(recording), dtype=bool)
    usable = np.isfinite(recording.readings).any(axis=0)
    if known.sum() < _FEWEST or not usable.any() or recording.unit != "m_s2":
        return None
    return ReferenceSeries("the reference", recording.t_s[known], {name: one[known] for name, one in columns.items()})


def _without_hub(recording: Recording) -> Recording:
    """Return the combinations of a recording's channels in which the specific force of its hub cancels.

    The recording itself where it has no array or too few chips for that.
    """
    array = recording.array
    if array is None or array.channels != recording.channels:
        return recording
    combinations = null_space(array.axes.T)  # (c, c − rank)
    if not combinations.shape[1]:
        return recording
    names = tuple(f"{index}d" for index in range(combinations.shape[1]))
    return replace(recording, readings=recording.readings @ combinations, channels=names)
