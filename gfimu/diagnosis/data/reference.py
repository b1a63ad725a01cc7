"""The reference that drives the twin: which column, what of it counts, where it is missing, its noise."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from gfimu.base.difference_noise import difference_noise
from gfimu.base.errors import InputError
from gfimu.diagnosis.data.time_grid import TimeGrid
from gfimu.model.world_model import WorldModel
from gfimu.recording import Recording
from gfimu.recording.importing.guessing.likely_reference import reference_remedy
from gfimu.recording.quantities import TIME_COLUMNS
from gfimu.recording.timing.conversion_times import output_data_rate
from gfimu.recording.timing.reference_times import reference_times

__all__ = [
    "BRIDGED_GAP",
    "GYRO_COLUMNS",
    "REFERENCE_COLUMNS",
    "SHORTEST_PIECE",
    "driving_reference",
    "reference_on_grid",
    "refuse_dead_reference",
    "unreferenced",
]

GYRO_COLUMNS = ("gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s")
"""Columns of the gyro that drives the twin of a free body."""
REFERENCE_COLUMNS: Mapping[str, str] = {
    "tacho": "tacho_rad_s",
    "angle": "angle_rad",
    "command": "command_rad_s",
    "carriage": "carriage_m",
    "carriage_speed": "carriage_speed_m_s",
    "carriage_acceleration": "carriage_acceleration_m_s2",
}
"""Column of the reference of a table or a linear axis, by the drive source of the twin."""

_HELD = 5  # equal values of a reference whose noise shows
_FINE, _FEW_REPEATS = 1e-4, 0.01  # noise to the largest value, and equal neighbours, of such a reference
_JUMP = 20.0  # noise
_REPEATING = 0.3
_DIFFERING = 0.5
_ALONE = 0.5
BRIDGED_GAP = 0.5  # s without a reference
_BRIDGED_SPACINGS = 3.0
SHORTEST_PIECE = 2.0  # s between two gaps of the reference
_ONE_STEP = 1.5
_MOVING = 8.0


def driving_reference(recording: Recording, model: WorldModel, name: str) -> tuple[str, NDArray[np.float64]]:
    """Return the column that drives the twin and its values: the rate or angle, or the magnitude of a gyro's rate."""
    have = recording.reference
    if model.drive_source == "gyro":
        for column in GYRO_COLUMNS:
            if column not in have:
                remedy = reference_remedy(recording.extra, column) or "record the gyro with the channels"
                raise InputError(f"{name}: column {column} is missing, but the twin's drive source is 'gyro'; {remedy}")
        return "gyro", np.linalg.norm(np.column_stack([have[column] for column in GYRO_COLUMNS]), axis=1)
    column = REFERENCE_COLUMNS[model.drive_source]
    if column not in have:
        remedies = [reference_remedy({**recording.extra, **have}, column)]
        remedies += [
            f"set source = {key!r} in the twin's [drive]" for key, one in REFERENCE_COLUMNS.items() if one in have
        ]
        remedies = [one for one in remedies if one][:2]
        raise InputError(
            f"{name}: column {column} is missing, but the twin's drive source is {model.drive_source!r}; "
            + (
                ", or ".join(remedies)
                or "record a tachometer, angle or command, or of a linear axis its commanded place or speed"
            )
        )
    if model.drive_source == "carriage_acceleration":
        return column, _speed(recording.t_s, np.asarray(have[column], dtype=float))
    reference = _without_repeats(np.asarray(have[column], dtype=float))
    return column, _without_holds(reference) if model.drive_source == "tacho" else reference


def _without_repeats(reference: NDArray[np.float64]) -> NDArray[np.float64]:
    """Leave out values that a slower reference repeats until its next reading comes.

    Repeats differ from a table at rest by their being the rule, and from a coarse reference by how many different
    values there are and by their differing by more than one step.
    """
    known = np.flatnonzero(np.isfinite(reference))
    values = reference[known]
    if len(values) < 2:
        return reference
    repeated = np.concatenate([[False], np.diff(values) == 0.0])
    fresh = values[~repeated]
    changes = np.abs(np.diff(fresh))
    if len(changes) == 0 or np.median(changes) < _ONE_STEP * changes.min():
        return reference
    alone = np.diff(np.flatnonzero(np.append(~repeated, True))) == 1
    if repeated.mean() < _REPEATING or alone.mean() > _ALONE or len(np.unique(fresh)) < _DIFFERING * len(fresh):
        return reference
    out = reference.copy()
    out[known[repeated]] = np.nan
    return out


def _without_holds(reference: NDArray[np.float64]) -> NDArray[np.float64]:
    """Leave out stretches in which a noisy reference holds one value: it has stopped, or lost its pulses.

    A table at rest may be reported as zero to the last digit; zero that the reference jumps to is no rest.
    """
    known = np.flatnonzero(np.isfinite(reference))
    values = reference[known]
    edges = np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1, [len(values)]])
    lengths = np.diff(edges)
    held = np.repeat(lengths >= _HELD, lengths)
    moving = values[~held]
    noise = difference_noise(moving)
    repeats = lengths[lengths < _HELD] - 1
    if not held.any() or not noise > _FINE * np.abs(values).max() or repeats.sum() > _FEW_REPEATS * len(moving):
        return reference
    out = reference.copy()
    for start, stop in zip(edges[:-1][lengths >= _HELD], edges[1:][lengths >= _HELD], strict=True):
        around = np.abs(values[[max(start - 1, 0), min(stop, len(values) - 1)]] - values[start])
        if values[start] != 0.0 or around.max() > _JUMP * noise:
            out[known[start:stop]] = np.nan
    return out


def _speed(t: NDArray[np.float64], acceleration: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the speed (n,), m/s, of a commanded acceleration (n,), m/s², from rest; bridged where it has no value."""
    known = np.isfinite(acceleration)
    if not known.any():
        return acceleration
    bridged = np.interp(t, t[known], acceleration[known])
    return np.where(known, cumulative_trapezoid(bridged, t, initial=0.0), np.nan)


def refuse_dead_reference(
    readings: NDArray[np.float64],
    drive: NDArray[np.float64],
    column: str,
    model: WorldModel,
    sample_rate: float,
    name: str,
) -> None:
    """Refuse a reference that stands still to the last digit while most channels move far beyond their noise."""
    known = drive[np.isfinite(drive)]
    if np.ptp(known) > 0.0:
        return
    white = model.expected_noise(sample_rate).white
    spread = [float(np.nanstd(column)) if np.isfinite(column).any() else 0.0 for column in readings.T]
    if np.median(np.array(spread) / white) > _MOVING:
        raise InputError(
            f"{name}: column {column} is {known[0]:g} throughout although the channels move; "
            "check that the reference was connected"
        )


def reference_on_grid(
    recording: Recording, column: str, drive: NDArray[np.float64], grid: TimeGrid
) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.float64] | None]:
    """Return the reference on the grid (n,), where it counts, and how long after its sample each value was read, s."""
    values, valid, known = np.zeros(grid.size), np.zeros(grid.size, dtype=bool), np.isfinite(drive)
    if TIME_COLUMNS.get(column) not in recording.reference:
        place = grid.place[known]
        values[place], valid[place] = drive[known], True
        if output_data_rate(recording) is None:
            return values, valid, None
        late = np.zeros(grid.size)
        late[place] = recording.t_s[known] - grid.t[place]  # stamps of a clock that follows the chips' are no jitter
        return values, valid, late
    t, read_at = grid.t, reference_times(recording, column)
    place = np.rint((read_at - t[0]) / grid.period).astype(int)
    known &= (place >= 0) & (place < grid.size)
    place, late = place[known], np.zeros(grid.size)
    values[place], valid[place], late[place] = drive[known], True, read_at[known] - t[place]
    return values, valid, late


def unreferenced(valid: NDArray[np.bool_], period: float) -> NDArray[np.bool_]:
    """Mark the samples (n,) in gaps of the reference that the channels alone can't be trusted to bridge."""
    known = np.flatnonzero(valid)
    ends = np.concatenate([[-1], known, [len(valid)]])
    longest = max(BRIDGED_GAP / period, _BRIDGED_SPACINGS * float(np.median(np.diff(known))))
    out = np.zeros(len(valid), dtype=bool)
    begin = 0
    for start, stop in pairwise(ends):
        if stop - start > longest:
            # What lies between two gaps has to be long enough for a drive of its own.
            island = start + 1 - begin < SHORTEST_PIECE / period and begin > 0
            out[begin if island else start + 1 : stop] = True
            begin = stop
    if out.any() and len(valid) - begin < SHORTEST_PIECE / period:
        out[begin:] = True
    return out
