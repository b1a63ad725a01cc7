"""A recording as diagnosis reads it: uniform samples, what is valid, and the reference that drives the twin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.ndimage import gaussian_filter1d

from gfimu.diagnosis.data.conversions import Conversions
from gfimu.diagnosis.data.rounding import between_steps
from gfimu.diagnosis.data.time_grid import TimeGrid, time_grid
from gfimu.errors import InputError
from gfimu.importing.guessing.likely_reference import reference_remedy
from gfimu.recording import Recording
from gfimu.recording.reference_times import reference_times
from gfimu.recording.timing.conversion_times import output_data_rate
from gfimu.units import TIME_COLUMNS
from gfimu.world_model import WorldModel

__all__ = [
    "GYRO_COLUMNS",
    "MINIMUM_SAMPLES",
    "REFERENCE_COLUMNS",
    "Run",
    "difference_noise",
    "possible_values",
    "prepare_run",
    "smooth_rate",
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

MINIMUM_DURATION = 4.0
MINIMUM_SAMPLES = 80
_LONGEST_PERIOD = 0.2  # s
_HELD = 5  # equal values of a reference whose noise shows
_FINE, _FEW_REPEATS = 1e-4, 0.01  # noise to the largest value, and equal neighbours, of such a reference
_JUMP = 20.0  # noise
_REPEATING = 0.3
_DIFFERING = 0.5
_ALONE = 0.5
_BRIDGED = 0.5  # s without a reference
_BRIDGED_SPACINGS = 3.0
_SHORTEST = 2.0  # s between two gaps of the reference
_ONE_STEP = 1.5
_MOVING = 8.0
_WIDEST = 16.0  # times the configured range: the largest factor between two ranges of a part
_FASTEST = 1e3  # rad/s: beyond the range of any gyro on the market, 20 000 °/s, and of any table


@dataclass(frozen=True)
class Run:
    """One recording on a uniform time grid.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Sample times, s; lost samples are there, marked invalid.
    readings : ndarray, shape (n, c)
        Specific force, m/s²; zero where invalid.
    valid : ndarray of bool, shape (n, c)
        Which readings count.
    reference : ndarray, shape (n,)
        Rate (rad/s) or angle (rad) that drives the twin; zero where invalid.
    reference_valid : ndarray of bool, shape (n,)
        Which reference samples count.
    temperature : ndarray or None, shape (n,)
        Board temperature, °C.
    mounting : ndarray, shape (3,)
        Rotation vector by which the array was turned from upright, rad.
    lost : int
        Number of samples missing from the file.
    longest_gap : float
        Longest gap, s.
    name : str
        For people.
    unreferenced : float
        Time that is left out because the reference is missing for long, s.
    resumed : tuple of int
        Samples of a whole run at which the reference is back after that.
    jitter : float
        Rms of the time stamps about the uniform grid, s; 0 where they show none.
    impossible : int
        Number of values left out because no sensor reads them.
    late : ndarray or None, shape (n,)
        How long after its sample each reference value was read, s; None if not at all.
    conversions : Conversions or None
        When the chips converted the samples; None if the recording does not say.
    converts_at : float or None
        Rate at which the chips convert, Hz; None for once a sample.
    """

    t: NDArray[np.float64]
    readings: NDArray[np.float64]
    valid: NDArray[np.bool_]
    reference: NDArray[np.float64]
    reference_valid: NDArray[np.bool_]
    temperature: NDArray[np.float64] | None
    mounting: NDArray[np.float64]
    lost: int
    longest_gap: float
    name: str = "run"
    unreferenced: float = 0.0
    resumed: tuple[int, ...] = ()
    jitter: float = 0.0
    impossible: int = 0
    late: NDArray[np.float64] | None = None
    conversions: Conversions | None = None
    converts_at: float | None = None

    @property
    def output_data_rate(self) -> float:
        """Rate at which the chips convert, Hz: the noise of a reading is that of this rate."""
        return self.converts_at or 1.0 / self.sample_period

    @property
    def sample_period(self) -> float:
        """Sample period, s."""
        return float(self.t[1] - self.t[0])

    @property
    def duration(self) -> float:
        """Length, s."""
        return float(self.t[-1] - self.t[0])

    @property
    def bridged(self) -> NDArray[np.float64]:
        """Readings with a straight line across invalid ones, shape (n, c), m/s²; zero in a channel without any."""
        readings = self.readings.copy()
        for column, valid in zip(readings.T, self.valid.T, strict=True):
            column[~valid] = np.interp(self.t[~valid], self.t[valid], column[valid]) if valid.any() else 0.0
        return readings

    def rows(self, start: int, stop: int) -> Run:
        """Return the samples from ``start`` up to ``stop``."""
        part = slice(start, stop)
        return Run(
            self.t[part],
            self.readings[part],
            self.valid[part],
            self.reference[part],
            self.reference_valid[part],
            None if self.temperature is None else self.temperature[part],
            self.mounting,
            self.lost,
            self.longest_gap,
            self.name,
            self.unreferenced,
            jitter=self.jitter,
            impossible=self.impossible,
            late=None if self.late is None else self.late[part],
            conversions=None if self.conversions is None else self.conversions.rows(part),
            converts_at=self.converts_at,
        )


def prepare_run(recording: Recording, model: WorldModel, *, name: str = "run") -> Run:
    """Put a recording on a uniform grid and pick the reference that drives the twin.

    Raises
    ------
    InputError
        If the recording is too short, lacks the reference that the twin names, or that reference never has a value.
    """
    recording, impossible = possible_values(recording, model)
    readings = recording.for_array(model.array)
    if len(recording) < MINIMUM_SAMPLES or recording.duration < MINIMUM_DURATION:
        raise InputError(
            f"{name}: {len(recording)} samples over {recording.duration:.1f} s are too short to diagnose; "
            f"record at least {MINIMUM_DURATION:.0f} s and {MINIMUM_SAMPLES} samples, better 40 s"
        )
    if not np.isfinite(readings).any():
        raise InputError(f"{name}: no channel has a value; record the channels of array {model.array.name!r}")
    column, drive = _drive(recording, model, name)
    if np.isfinite(drive).sum() < 20:
        raise InputError(f"{name}: column {column} has fewer than 20 values; record the reference with the channels")
    _refuse_dead_reference(readings, drive, column, model, recording.sample_rate, name)
    period = recording.sample_period
    if period > _LONGEST_PERIOD:
        raise InputError(
            f"{name}: one sample every {period:g} s is too slow to diagnose; is column t_s in seconds? "
            f"Record at {1 / _LONGEST_PERIOD:g} Hz at least"
        )
    grid = time_grid(recording.t_s)
    place, n = grid.place, grid.size
    if n > 4 * len(recording):
        raise InputError(
            f"{name}: more samples are missing than present; record again without the long gaps, or, where t_s is when "
            "the host read them in bursts, write the times at which the chips sampled"
        )
    t = grid.t
    full = np.zeros((n, readings.shape[1]))
    full[place] = readings
    valid = np.zeros(full.shape, dtype=bool)
    valid[place] = np.isfinite(readings)
    full[~valid] = 0.0
    reference, reference_valid, late = _on_grid(recording, column, drive, grid)
    unreferenced = _unreferenced(reference_valid, period) if model.drive_source != "gyro" else np.zeros(n, dtype=bool)
    full[unreferenced] = 0.0
    left_out = float((valid & unreferenced[:, None]).any(axis=1).sum()) * period
    valid[unreferenced] = False
    if valid.any(axis=1).sum() < MINIMUM_SAMPLES:
        raise InputError(
            f"{name}: column {column} has no {_SHORTEST:.0f} s without a gap of {_BRIDGED} s or more; record the "
            "reference without interruption"
        )
    temperature = recording.reference.get("temperature_degC")
    warm = None
    if temperature is not None and np.isfinite(temperature).sum() >= 2:
        known = np.isfinite(temperature)
        measured = recording.t_s[known]
        warm = np.interp(t, measured, between_steps(measured, np.asarray(temperature, dtype=float)[known]))
    return Run(
        t,
        full,
        valid,
        reference,
        reference_valid,
        warm,
        recording.mounting_rotvec,
        lost=grid.lost,
        longest_gap=grid.longest_gap,
        name=name,
        unreferenced=left_out,
        resumed=tuple((np.flatnonzero(np.diff(unreferenced.astype(int)) == -1) + 1).tolist()),
        jitter=grid.jitter,
        impossible=impossible,
        late=late,
        conversions=Conversions.of(recording, grid, len(model.array.chips)),
        converts_at=output_data_rate(recording),
    )


def _on_grid(
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


def possible_values(recording: Recording, model: WorldModel) -> tuple[Recording, int]:
    """Leave out values that no sensor reads: corrupt ones, such as 1e19 m/s², and infinite ones.

    Returns
    -------
    recording : Recording
        With NaN in their place.
    count : int
        How many there were, with those that were left out when the recording was read.
    """
    already = sum(recording.corrupt.values())
    most = _WIDEST * model.expected_noise(recording.sample_rate).full_scale if len(recording) > 1 else np.inf
    wrong = ~np.isnan(recording.readings) & ~(np.abs(recording.readings) <= most)
    count = int(wrong.sum())
    reference = dict(recording.reference)
    for name, values in recording.reference.items():
        limit = _FASTEST if name.endswith("_rad_s") else np.finfo(float).max
        beyond = ~np.isnan(values) & ~(np.abs(values) <= limit)
        if beyond.any():
            reference[name] = np.where(beyond, np.nan, values)
            count += int(beyond.sum())
    if not count:
        return recording, already
    readings = np.where(wrong, np.nan, recording.readings) if recording.unit == "m_s2" else recording.readings
    return replace(recording, readings=readings, reference=reference), already + count


def _unreferenced(valid: NDArray[np.bool_], period: float) -> NDArray[np.bool_]:
    """Mark the samples (n,) in gaps of the reference that the channels alone can't be trusted to bridge."""
    known = np.flatnonzero(valid)
    ends = np.concatenate([[-1], known, [len(valid)]])
    longest = max(_BRIDGED / period, _BRIDGED_SPACINGS * float(np.median(np.diff(known))))
    out = np.zeros(len(valid), dtype=bool)
    begin = 0
    for start, stop in pairwise(ends):
        if stop - start > longest:
            # What lies between two gaps has to be long enough for a drive of its own.
            island = start + 1 - begin < _SHORTEST / period and begin > 0
            out[begin if island else start + 1 : stop] = True
            begin = stop
    if out.any() and len(valid) - begin < _SHORTEST / period:
        out[begin:] = True
    return out


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


def _drive(recording: Recording, model: WorldModel, name: str) -> tuple[str, NDArray[np.float64]]:
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


def _speed(t: NDArray[np.float64], acceleration: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the speed (n,), m/s, of a commanded acceleration (n,), m/s², from rest; bridged where it has no value."""
    known = np.isfinite(acceleration)
    if not known.any():
        return acceleration
    bridged = np.interp(t, t[known], acceleration[known])
    return np.where(known, cumulative_trapezoid(bridged, t, initial=0.0), np.nan)


def _refuse_dead_reference(
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


def difference_noise(reference: NDArray[np.float64]) -> float:
    """Return the white noise of a smooth reference from its third differences (robust), rad/s or rad."""
    third = np.diff(reference, n=3)
    if not len(third):
        return 0.0
    return 1.4826 * float(np.median(np.abs(third - np.median(third)))) / np.sqrt(20.0)


def smooth_rate(run: Run, *, is_angle: bool, width: float = 0.1) -> NDArray[np.float64]:
    """Smooth the reference to a rate over a width of time, s: for starting values only, shape (n,), rad/s."""
    known = run.reference_valid
    if not known.any():
        return np.zeros(len(run.t))
    rate = np.interp(run.t, run.t[known], run.reference[known])
    if is_angle:  # before smoothing, which would bend a turning angle at the ends
        rate = np.gradient(rate, run.sample_period)
    return np.asarray(gaussian_filter1d(rate, max(width / run.sample_period / 2.0, 0.5), mode="nearest"))
