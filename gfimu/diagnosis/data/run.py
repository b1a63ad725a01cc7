"""A recording as diagnosis reads it: uniform samples, what is valid, and the reference that drives the twin."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from gfimu.base.errors import InputError
from gfimu.diagnosis.data.conversions import Conversions
from gfimu.diagnosis.data.reference import (
    BRIDGED_GAP,
    SHORTEST_PIECE,
    driving_reference,
    reference_on_grid,
    refuse_dead_reference,
    unreferenced,
)
from gfimu.diagnosis.data.rounding import between_steps
from gfimu.diagnosis.data.time_grid import time_grid
from gfimu.model.world_model import WorldModel
from gfimu.recording import Recording
from gfimu.recording.timing.conversion_times import output_data_rate

__all__ = [
    "MINIMUM_SAMPLES",
    "Run",
    "possible_values",
    "prepare_run",
    "smooth_rate",
]

MINIMUM_DURATION = 4.0
MINIMUM_SAMPLES = 80
_LONGEST_PERIOD = 0.2  # s
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
    column, drive = driving_reference(recording, model, name)
    if np.isfinite(drive).sum() < 20:
        raise InputError(f"{name}: column {column} has fewer than 20 values; record the reference with the channels")
    refuse_dead_reference(readings, drive, column, model, recording.sample_rate, name)
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
    reference, reference_valid, late = reference_on_grid(recording, column, drive, grid)
    missing = unreferenced(reference_valid, period) if model.drive_source != "gyro" else np.zeros(n, dtype=bool)
    full[missing] = 0.0
    left_out = float((valid & missing[:, None]).any(axis=1).sum()) * period
    valid[missing] = False
    if valid.any(axis=1).sum() < MINIMUM_SAMPLES:
        raise InputError(
            f"{name}: column {column} has no {SHORTEST_PIECE:.0f} s without a gap of {BRIDGED_GAP} s or more; record "
            "the reference without interruption"
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
        resumed=tuple((np.flatnonzero(np.diff(missing.astype(int)) == -1) + 1).tolist()),
        jitter=grid.jitter,
        impossible=impossible,
        late=late,
        conversions=Conversions.of(recording, grid, len(model.array.chips)),
        converts_at=output_data_rate(recording),
    )


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


def smooth_rate(run: Run, *, is_angle: bool, width: float = 0.1) -> NDArray[np.float64]:
    """Smooth the reference to a rate over a width of time, s: for starting values only, shape (n,), rad/s."""
    known = run.reference_valid
    if not known.any():
        return np.zeros(len(run.t))
    rate = np.interp(run.t, run.t[known], run.reference[known])
    if is_angle:  # before smoothing, which would bend a turning angle at the ends
        rate = np.gradient(rate, run.sample_period)
    return np.asarray(gaussian_filter1d(rate, max(width / run.sample_period / 2.0, 0.5), mode="nearest"))
