"""From a recording to the input of a fit, with the checks in between: what the calibration methods have in common."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from gfimu.array.parts.part import Part
from gfimu.base.errors import InputError, naming
from gfimu.calibration.array_calibration import update_array_calibration
from gfimu.calibration.combine import combine
from gfimu.calibration.faults import (
    check_gravity,
    repeated_poses,
    scale_warning,
)
from gfimu.calibration.fit_quality import mean_factor
from gfimu.calibration.given import RateTable
from gfimu.calibration.method import CalibrationMethod, CalibrationTask
from gfimu.calibration.observations import Observations, observations_from
from gfimu.calibration.poses import find_poses, table_fit
from gfimu.calibration.rate_table import body_axis, find_plateaus
from gfimu.calibration.result import Calibration
from gfimu.calibration.spin.policy import SpinPolicy
from gfimu.recording import Recording
from gfimu.recording.rest import detect_rest

__all__ = [
    "calibrate_by_spin",
    "calibrate_on_rate_table",
    "calibrate_reference_gyro",
    "calibrate_triads",
    "calibrate_whole_array",
]


def calibrate_triads(method: CalibrationMethod, task: CalibrationTask) -> Calibration:
    """Calibrate every triad of a recording of static poses by itself; the runner of the methods for one triad."""
    recording, gauge = task.recording, _gauge(method, task.n_parameters)
    warnings = list(check_gravity(task.gravity))
    poses = find_poses(recording, task.array, task.gravity, task.poses, method.min_rest_s)
    observations = poses.observations
    warnings += poses.warnings
    options: dict[str, float] = {}
    if task.levelling_std_rad is not None and "levelling_std_rad" in method.options:
        options["levelling_std_rad"] = task.levelling_std_rad
    fit = method.fit

    def fits() -> list[Calibration]:
        each = (observations.of_chip(chip) for chip in observations.chips)
        bound = partial(fit, gravity=task.gravity, gauge=gauge, **options)
        return [table_fit(bound, one, task.poses.row_noise_m_s2) if poses.is_table else bound(one) for one in each]

    results = fits()
    if len(results) > 1 and observations.kind == "averaged":
        observations = replace(observations, variance_factor=_common_factor(results))
        results = fits()
    result = combine(results)
    warnings += repeated_poses(observations.of_chip(observations.chips[0]).means)
    warnings += scale_warning(result, _nominal_scales(recording, observations.chips))
    return replace(
        result,
        warnings=(*warnings, *result.warnings),
        statistics={
            **result.statistics,
            **poses.statistics,
            "noise_correlation_factor": observations.correlation_factor,
            **({} if poses.is_table else _weights(observations)),
        },
    )


def _weights(observations: Observations) -> dict[str, float]:
    """Return what the weights of each chip were made from, by name: its mean noise and the prior of its bends."""
    found: dict[str, float] = {}
    for chip in observations.chips:
        one = observations.of_chip(chip)
        variance = np.einsum("pcc->pc", one.mean_covariance).mean()
        found[f"{chip}_mean_noise_{one.unit}"] = float(np.sqrt(variance))
        if one.bends:
            found[f"{chip}_quadratic_prior_std_per_{one.unit}"] = float(one.quadratic_prior.max())
    return found


def _common_factor(results: list[Calibration]) -> float | None:
    """Learn what does not average out of the rests from the misfits of all chips together; None if nothing shows."""
    freedom = [int(float(result.statistics["redundancy"])) for result in results]
    misfit = [float(result.statistics["variance_factor"]) for result in results]
    if not all(count > 0 for count in freedom):
        return None
    return mean_factor(float(np.average(misfit, weights=freedom)), sum(freedom))


def calibrate_whole_array(method: CalibrationMethod, task: CalibrationTask) -> Calibration:
    """Calibrate all chips of an array together, or carry an earlier calibration over; runner of ``array``."""
    if task.array is None:
        raise InputError(f"calibration method {method.name!r} needs the array; give its name or file")
    if task.update is not None:
        return update_array_calibration(
            task.update,
            task.recording,
            task.array,
            turn_on_std_m_s2=task.turn_on_std_m_s2,
            bias_walk_m_s2_rt_s=task.bias_walk_m_s2_rt_s,
            rest_threshold=task.rest_threshold,
            min_rest_s=_min_rest(method, task),
            rows=task.rows,
            row_noise_m_s2=task.row_noise_m_s2,
        )
    return method.fit(
        task.recording,
        task.array,
        gravity=task.gravity,
        motion=task.motion,
        rest_threshold=task.rest_threshold,
        min_rest_s=_min_rest(method, task),
        rows=task.rows,
        row_noise_m_s2=task.row_noise_m_s2,
        progress=task.progress,
    )


def calibrate_by_spin(method: CalibrationMethod, task: CalibrationTask) -> Calibration:
    """Find the non-linearity of an array on a turntable; runner of ``spin``.

    Raises
    ------
    InputError
        As `gfimu.calibration.spin.spin`; also without the array, or of a standard deviation that is not positive.
    """
    if task.array is None:
        raise InputError(f"calibration method {method.name!r} needs the array; give its name or file")
    given = {"radius_std_m": task.radius_std_m, "stretch_std_s2_rad2": task.stretch_std_s2_rad2}
    changes = {name: value for name, value in given.items() if value is not None}
    for name, value in changes.items():
        if not 0.0 < value < np.inf:
            raise InputError(f"{name} = {value:g}: a standard deviation is positive")
    result = method.fit(
        task.recording,
        task.array,
        start=task.start,
        gravity=task.gravity,
        min_plateau_s=_min_rest(method, task),
        turn_on_std_m_s2=task.turn_on_std_m_s2,
        policy=replace(SpinPolicy(), **changes),
    )
    return replace(result, warnings=(*check_gravity(task.gravity), *result.warnings))


def calibrate_reference_gyro(method: CalibrationMethod, task: CalibrationTask) -> Calibration:
    """Calibrate the reference gyro of a recording at rest against the Earth's rate; runner of ``gyro``.

    Raises
    ------
    InputError
        If the recording has no gyro columns or no rest.
    """
    recording = task.recording
    names = [f"gyro_{axis}_rad_s" for axis in "xyz"]
    missing = [name for name in names if name not in recording.reference]
    if missing:
        raise InputError(f"the recording lacks {', '.join(missing)}; a gyro calibration needs all three")
    rest = detect_rest(recording, threshold=task.rest_threshold, min_duration_s=_min_rest(method, task))
    rates = replace(
        recording,
        readings=np.column_stack([recording.reference[name] for name in names]),
        channels=("gyro1", "gyro2", "gyro3"),
        unit="rad_s",
    )
    return method.fit(observations_from(rates, rest, "averaged"))


def calibrate_on_rate_table(method: CalibrationMethod, task: CalibrationTask) -> Calibration:
    """Calibrate a gyro from one or more recordings on a rate table; runner of ``gyro-rate-table``.

    Raises
    ------
    InputError
        If the number of axes is not that of the recordings, or as `gfimu.calibration.rate_table.find_plateaus`.
    """
    table = task.rate_table or RateTable()
    runs = (task.recording, *table.also)
    if table.axes and len(table.axes) != len(runs):
        raise InputError(f"{len(table.axes)} axes along the table's for {len(runs)} recordings; give one for each")
    axes = [body_axis(name) for name in table.axes] if table.axes else [None] * len(runs)
    mountings = []
    for run, axis, name in zip(runs, axes, table.names or [""] * len(runs), strict=True):
        with naming(name):
            mountings.append(
                find_plateaus(run, axis=axis, threshold=task.rest_threshold, min_duration_s=_min_rest(method, task))
            )
    return method.fit(mountings, latitude_deg=task.latitude_deg, levelling_std_rad=task.levelling_std_rad or 0.0)


def _gauge(method: CalibrationMethod, n_parameters: int | None) -> str:
    """Gauge that goes with a number of parameters per triad."""
    count = next(iter(method.gauges)) if n_parameters is None else n_parameters
    if count not in method.gauges:
        models = {12: "12 (full M)", 9: "9 (triangular M)"}
        valid = " or ".join(models[number] for number in sorted(method.gauges, reverse=True))
        raise InputError(f"{count} parameters: choose {valid}")
    return method.gauges[count]


def _min_rest(method: CalibrationMethod, task: CalibrationTask) -> float:
    """Shortest pose, s."""
    return task.min_rest_s or method.min_rest_s


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
