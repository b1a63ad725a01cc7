"""A recording of a free body: channels and gyro on one uniform grid, and where the body is at rest."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, binary_erosion, uniform_filter1d

from gfimu.diagnosis.data.body.gyro import SmoothGyro, smooth_gyro
from gfimu.diagnosis.data.reference import GYRO_COLUMNS
from gfimu.diagnosis.data.run import Run, possible_values, prepare_run
from gfimu.diagnosis.data.time_grid import time_grid
from gfimu.model.world_model import WorldModel
from gfimu.recording import Recording

__all__ = ["AVERAGING", "REST_FLOOR", "BodyRun", "prepare_body_run"]

REST_FLOOR = 5e-3
"""What rest may leave in the magnitude of the specific force, m/s²."""
AVERAGING = 1.5
"""How long chips or gyro may average, sample periods."""
_BIAS_STD = (0.005, 0.1)  # rad/s: of the gyro's bias after a rest, without one
_REST_WINDOW_S = 0.4
_SHORTEST_REST_S = 1.0
_TURNING = 0.2  # rad/s: faster is no rest, whatever the gyro's bias
_LOUDER = 2.0
_BESIDE_A_GAP = 2  # samples beside a missing gyro value that its interpolation spoils


@dataclass(frozen=True, kw_only=True)
class BodyRun(Run):
    """One recording of a free body; its reference is the magnitude of the gyro, rad/s.

    Parameters
    ----------
    gyro : ndarray, shape (n, 3)
        Gyro less its reading at rest, rad/s; interpolated where it has no value.
    rate : ndarray, shape (n, 3)
        Angular rate that the gyro smoothed gives, rad/s.
    acceleration_error : float
        Error of its derivative, rad/s², as that of white noise of its greatest density.
    smooth : SmoothGyro
        The gyro smoothed, with the spectrum of its error.
    gyro_valid : ndarray of bool, shape (n,)
        Samples whose rate and angular acceleration come from gyro values.
    gyro_bias : ndarray, shape (3,)
        What the gyro read at rest, rad/s; zero where the body never rests.
    rest : ndarray of bool, shape (n,)
        Samples at rest, where the magnitude of the specific force is gravity's.
    """

    gyro: NDArray[np.float64]
    rate: NDArray[np.float64]
    acceleration_error: float
    smooth: SmoothGyro
    gyro_valid: NDArray[np.bool_]
    gyro_bias: NDArray[np.float64]
    rest: NDArray[np.bool_]

    @property
    def gyro_bias_std(self) -> float:
        """How uncertain the bias of the gyro is, rad/s."""
        return _BIAS_STD[0 if self.rest.any() else 1]


def prepare_body_run(recording: Recording, model: WorldModel, *, name: str = "run") -> BodyRun:
    """Put channels and gyro on a uniform grid and find where the body rests.

    Raises
    ------
    InputError
        If the recording is too short or lacks the gyro.
    """
    run = prepare_run(recording, model, name=name)
    recording, _ = possible_values(recording, model)
    place = time_grid(recording.t_s).place
    gyro = np.full((len(run.t), 3), np.nan)
    gyro[place] = np.column_stack([recording.reference[column] for column in GYRO_COLUMNS])
    missing = ~np.isfinite(gyro).all(axis=1)
    for column in gyro.T:
        known = np.isfinite(column)
        column[~known] = np.interp(run.t[~known], run.t[known], column[known])
    valid = ~binary_dilation(missing, iterations=_BESIDE_A_GAP) if missing.any() else ~missing
    rest = _rest(run, gyro, model.expected_noise(run.output_data_rate).white) & valid
    bias = gyro[rest].mean(axis=0) if rest.any() else np.zeros(3)
    smooth = smooth_gyro(gyro - bias, missing, run.sample_period)
    axes = 1.0 if model.array.turning_axis is None else 3.0  # about a known axis all of the error is along that
    return BodyRun(
        **{field.name: getattr(run, field.name) for field in fields(run)},
        gyro=gyro - bias,
        rate=smooth.rate,
        acceleration_error=float(np.sqrt(axes)) * smooth.acceleration_error,
        smooth=smooth,
        gyro_valid=valid,
        gyro_bias=bias,
        rest=rest,
    )


def _rest(run: Run, gyro: NDArray[np.float64], white: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mark stretches in which gyro and readings do no more than their noise."""
    window = max(int(_REST_WINDOW_S / run.sample_period), 5)
    noise = np.median(np.abs(np.diff(gyro, 2, axis=0)), axis=0) / (0.6745 * np.sqrt(6.0))
    still = (_rolling_std(gyro, window) < _LOUDER * noise + 0.005).all(axis=1)
    still &= np.linalg.norm(uniform_filter1d(gyro, window, axis=0), axis=1) < _TURNING
    alive = run.valid.mean(axis=0) > 0.5
    loud = _rolling_std(run.bridged[:, alive], window) / white[alive]
    still &= np.median(loud, axis=1) < _LOUDER
    length = max(int(_SHORTEST_REST_S / run.sample_period), window)
    core = binary_erosion(still, structure=np.ones(length), border_value=1)
    return np.asarray(binary_dilation(core, structure=np.ones(max(length - window, 1))) & still)


def _rolling_std(values: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    centred = values - values.mean(axis=0)
    mean = uniform_filter1d(centred, window, axis=0)
    return np.asarray(np.sqrt(np.maximum(uniform_filter1d(centred**2, window, axis=0) - mean**2, 0.0)))
