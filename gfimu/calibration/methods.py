"""One call for every method: from a recording to a calibration, with the checks in between."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gfimu.calibration.faults import (
    check_gravity,
    check_readings,
    repeated_poses,
    scale_warning,
    without_moved_poses,
)
from gfimu.calibration.multi_position import multi_position, multi_position_gyro
from gfimu.calibration.observations import observations_from
from gfimu.calibration.recursive import recursive
from gfimu.calibration.result import Calibration, combine
from gfimu.calibration.six_position import six_position
from gfimu.calibration.twelve_position import twelve_position
from gfimu.errors import InputError, unknown_name
from gfimu.parts.part import Part
from gfimu.recording import Recording
from gfimu.recording.rest import detect_rest
from gfimu.units import STANDARD_GRAVITY

__all__ = ["METHODS", "calibrate", "calibrate_gyro"]

METHODS: dict[str, Callable[..., Calibration]] = {
    "six-position": six_position,
    "recursive": recursive,
    "multi-position": multi_position,
    "twelve-position": twelve_position,
}
"""Methods for one triad by name."""

_GAUGES = {
    12: {"six-position": "poses", "recursive": "poses", "multi-position": "coarse", "twelve-position": "coarse"},
    9: dict.fromkeys(METHODS, "x_axis"),
}
_DEFAULT_PARAMETERS = {"six-position": 12, "recursive": 12, "multi-position": 9, "twelve-position": 12}


def calibrate(
    method: str,
    recording: Recording,
    *,
    gravity: float = STANDARD_GRAVITY,
    n_parameters: int | None = None,
    input_kind: str = "averaged",
    rest_threshold: float | None = None,
    min_rest_s: float = 1.0,
    levelling_std_rad: float | None = None,
) -> Calibration:
    """Calibrate every triad of a recording of static poses.

    Parameters
    ----------
    method : str
        A key of `METHODS`.
    recording : Recording
        Readings of one or more chips, in m/s² or raw counts.
    gravity : float
        Local gravity, m/s²; see `gfimu.geometry.gravity.local_gravity`.
    n_parameters : {9, 12}, optional
        Parameters per triad; 12 by default, 9 for ``multi-position``.
    input_kind : {"averaged", "raw", "wavelet"}
        What the method is given.
    rest_threshold : float, optional
        Threshold of rest, reading unit squared; chosen by the data if not given.
    min_rest_s : float
        Shortest pose, s.
    levelling_std_rad : float, optional
        Standard deviation of the tilt of a pose, rad, for the methods that rely on levelled faces.

    Returns
    -------
    Calibration
        One result for all chips; warnings name what looked wrong.

    Raises
    ------
    InputError
        If the method is unknown, the data are faulty, or the poses don't suffice.
    """
    if method not in METHODS:
        raise unknown_name("calibration method", method, METHODS)
    parameters = n_parameters or _DEFAULT_PARAMETERS[method]
    if parameters not in _GAUGES:
        raise InputError(f"{parameters} parameters: choose 12 (full M) or 9 (triangular M)")
    warnings = list(check_gravity(gravity))
    rest = detect_rest(recording, threshold=rest_threshold, min_duration_s=min_rest_s)
    warnings += check_readings(recording, rest)
    rest, moved = without_moved_poses(recording, rest)
    warnings += moved
    observations = observations_from(recording, rest, input_kind)
    options: dict[str, float] = {}
    if levelling_std_rad is not None and method in {"six-position", "twelve-position"}:
        options["levelling_std_rad"] = levelling_std_rad
    results = [
        METHODS[method](observations.of_chip(chip), gravity=gravity, gauge=_GAUGES[parameters][method], **options)
        for chip in observations.chips
    ]
    result = combine(results)
    warnings += repeated_poses(observations.of_chip(observations.chips[0]).means)
    warnings += scale_warning(result, _nominal_scales(recording, observations.chips))
    return replace(
        result,
        warnings=(*warnings, *result.warnings),
        statistics={
            **result.statistics,
            "rest_threshold": rest.threshold,
            "rest_threshold_chosen_by": "data" if rest.chosen_by_data else "user",
            "poses_found": float(len(rest)),
            "noise_correlation_factor": observations.correlation_factor,
        },
    )


def calibrate_gyro(
    recording: Recording, *, rest_threshold: float | None = None, min_rest_s: float = 1.0
) -> Calibration:
    """Calibrate the reference gyro of a recording at rest against the Earth's rate.

    Raises
    ------
    InputError
        If the recording has no gyro columns or no rest.
    """
    names = [f"gyro_{axis}_rad_s" for axis in "xyz"]
    missing = [name for name in names if name not in recording.reference]
    if missing:
        raise InputError(f"the recording lacks {', '.join(missing)}; a gyro calibration needs all three")
    rest = detect_rest(recording, threshold=rest_threshold, min_duration_s=min_rest_s)
    rates = replace(
        recording,
        readings=np.column_stack([recording.reference[name] for name in names]),
        channels=("gyro1", "gyro2", "gyro3"),
        unit="rad_s",
    )
    return multi_position_gyro(observations_from(rates, rest, "averaged"))


def _nominal_scales(recording: Recording, chips: tuple[str, ...]) -> dict[str, float]:
    """Nominal reading units per m/s² of each chip, where known."""
    if recording.unit == "m_s2":
        return dict.fromkeys(chips, 1.0)
    if "lsb_m_s2" in recording.metadata:
        return dict.fromkeys(chips, 1.0 / float(recording.metadata["lsb_m_s2"]))
    if "part" in recording.metadata:
        part = Part.load(str(recording.metadata["part"]), recording.metadata.get("parts_toml"))
        return dict.fromkeys(chips, 1.0 / part.lsb)
    return {}
