"""What a calibration method is, what it works on, and the call that calibrates by one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.calibration.given import CalibrationPoses, RateTable
from gfimu.calibration.result import Calibration
from gfimu.recording import Recording

__all__ = ["CalibrationMethod", "CalibrationTask", "run_calibration"]


@dataclass(frozen=True)
class CalibrationMethod:
    """One calibration method.

    Parameters
    ----------
    name : str
        Name for `calibrate`, and in the result.
    fit : callable
        The fit: it returns a `Calibration`.
    run : callable
        Called with the record and a `CalibrationTask`, it turns the recording into the input of the fit, and returns
        what that finds.
    needs : str
        Poses or motion that the recording must hold.
    estimates : str
        Parameters that come out.
    source : str
        Paper and equations.
    gauges : mapping of int to str
        Number of parameters per triad, with the gauge (`gfimu.calibration.error_model.GAUGES`) that each implies; the
        first is the default. Empty where the method has only one model.
    options : frozenset of str
        Optional fields of the task that the method uses.
    min_rest_s : float
        Default of the shortest pose, s.
    """

    name: str
    fit: Callable[..., Calibration]
    run: Callable[[CalibrationMethod, CalibrationTask], Calibration]
    needs: str
    estimates: str
    source: str
    gauges: Mapping[int, str] = field(default_factory=dict)
    options: frozenset[str] = frozenset()
    min_rest_s: float = 1.0


@dataclass(frozen=True)
class CalibrationTask:
    """What a calibration method works on; each method uses the fields its record lists.

    Parameters
    ----------
    recording : Recording
        Readings in m/s² or raw counts.
    gravity : float
        Local gravity, m/s².
    n_parameters : {9, 12}, optional
        Parameters per triad; the method's default if not given.
    input_kind : {"averaged", "raw", "wavelet"}
        Rows that the fit uses.
    rest_threshold : float, optional
        Threshold of rest, reading unit squared; chosen by the data if not given.
    min_rest_s : float, optional
        Shortest pose, s; the method's default if not given.
    levelling_std_rad : float, optional
        Standard deviation of the tilt of a pose, rad.
    array : AccelerometerArray, optional
        The drawing.
    motion : Recording, optional
        Recording with the motion, if it is another one.
    update : Calibration, optional
        Calibration of an earlier run to carry over.
    start : Calibration, optional
        Calibration that a spin starts from.
    radius_std_m, stretch_std_s2_rad2 : float, optional
        Of a spin: standard deviations of a chip's radius and of the arm stretch; those of its policy if not given.
    turn_on_std_m_s2, bias_walk_m_s2_rt_s : float
        With ``update`` or ``start``: change of a bias between power-ons, m/s²; with ``update`` random walk between
        poses, m/s²/√s.
    latitude_deg : float, optional
        Latitude, degrees, for the Earth's rate.
    rate_table : RateTable, optional
        What a gyro on a rate table needs besides.
    wavelet : mapping
        Options of `gfimu.calibration.observations.denoised_samples`, for the wavelet input.
    rows, row_noise_m_s2
        As in `gfimu.CalibrationPoses`.
    progress : callable, optional
        Called with the share done of a fit that takes long, 0 to 1.
    """

    recording: Recording
    gravity: float = STANDARD_GRAVITY
    n_parameters: int | None = None
    input_kind: str = "averaged"
    rest_threshold: float | None = None
    min_rest_s: float | None = None
    levelling_std_rad: float | None = None
    array: AccelerometerArray | None = None
    motion: Recording | None = None
    update: Calibration | None = None
    start: Calibration | None = None
    radius_std_m: float | None = None
    stretch_std_s2_rad2: float | None = None
    turn_on_std_m_s2: float = 0.03
    bias_walk_m_s2_rt_s: float = 0.0
    latitude_deg: float | None = None
    rate_table: RateTable | None = None
    wavelet: Mapping[str, Any] = field(default_factory=dict)
    rows: str = "auto"
    row_noise_m_s2: float | None = None
    progress: Callable[[float], object] | None = None

    @property
    def poses(self) -> CalibrationPoses:
        """How the poses are found."""
        return CalibrationPoses(**{item.name: getattr(self, item.name) for item in fields(CalibrationPoses)})


def run_calibration(method: CalibrationMethod, task: CalibrationTask) -> Calibration:
    """Calibrate by the record of a method.

    Raises
    ------
    InputError
        If the data are faulty, or the poses don't suffice.
    """
    result = method.run(method, task)
    return replace(result, statistics={**result.statistics, **_temperature_statistics(task.recording)})


def _temperature_statistics(recording: Recording) -> dict[str, float]:
    """Return mean and span of the temperature at which a recording was made; empty if it has none.

    Sensitivity and bias hold at that temperature: a condition of the calibration.
    """
    temperature = recording.reference.get("temperature_degC")
    seen = np.empty(0) if temperature is None else temperature[np.isfinite(temperature)]
    if not len(seen):
        return {}
    return {"temperature_mean_degC": float(seen.mean()), "temperature_span_K": float(np.ptp(seen))}
