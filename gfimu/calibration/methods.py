"""One call for every method: from a recording to a calibration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.calibration.method import CalibrationMethod, CalibrationTask
from gfimu.calibration.registry import METHODS, calibration_method
from gfimu.calibration.result import Calibration
from gfimu.recording import Recording

__all__ = ["METHODS", "CalibrationTask", "calibrate", "run_calibration", "temperature_statistics"]


def calibrate(
    method: str,
    recording: Recording,
    *,
    gravity: float = STANDARD_GRAVITY,
    n_parameters: int | None = None,
    input_kind: str = "averaged",
    rest_threshold: float | None = None,
    min_rest_s: float | None = None,
    levelling_std_rad: float | None = None,
    array: AccelerometerArray | None = None,
) -> Calibration:
    """Calibrate a recording of static poses by a method of `gfimu.calibration.registry.METHODS`.

    Parameters
    ----------
    method : str
        A key of `gfimu.calibration.registry.METHODS`.
    recording : Recording
        Readings of one or more chips, in m/s² or raw counts.
    gravity : float
        Local gravity, m/s²; see `gfimu.array.gravity.local_gravity`.
    n_parameters : {9, 12}, optional
        Parameters per triad; 12 by default, 9 for ``multi-position``.
    input_kind : {"averaged", "raw", "wavelet"}
        Rows that the fit uses.
    rest_threshold : float, optional
        Threshold of rest, reading unit squared; chosen by the data if not given.
    min_rest_s : float, optional
        Shortest pose, s; the method's default if not given.
    levelling_std_rad : float, optional
        Standard deviation of the tilt of a pose, rad, for the methods that rely on levelled faces.
    array : AccelerometerArray, optional
        The drawing, for the methods that calibrate an array as a whole.

    Returns
    -------
    Calibration
        One result for all chips; warnings name what looked wrong.

    Raises
    ------
    InputError
        If the method is unknown, the data are faulty, or the poses don't suffice.
    """
    record = calibration_method(method)
    task = CalibrationTask(
        recording, gravity, n_parameters, input_kind, rest_threshold, min_rest_s, levelling_std_rad, array
    )
    return run_calibration(record, task)


def run_calibration(method: CalibrationMethod, task: CalibrationTask) -> Calibration:
    """Calibrate by the record of a method; raises as `calibrate`."""
    result = method.run(method, task)
    return replace(result, statistics={**result.statistics, **temperature_statistics(task.recording)})


def temperature_statistics(recording: Recording) -> dict[str, float]:
    """Return mean and span of the temperature at which a recording was made; empty if it has none.

    Sensitivity and bias hold at that temperature: a condition of the calibration.
    """
    temperature = recording.reference.get("temperature_degC")
    seen = np.empty(0) if temperature is None else temperature[np.isfinite(temperature)]
    if not len(seen):
        return {}
    return {"temperature_mean_degC": float(seen.mean()), "temperature_span_K": float(np.ptp(seen))}
