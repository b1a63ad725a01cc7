"""Calibration of a whole array from one recording: poses for the chips' models, motion for their positions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.calibration.array_motion import ArrayMotion, array_motion
from gfimu.calibration.array_shake import array_shake
from gfimu.calibration.array_static import array_static
from gfimu.calibration.array_update import array_update
from gfimu.calibration.faults import check_gravity
from gfimu.calibration.given import CalibrationPoses
from gfimu.calibration.motion_reference import has_reference, motion_reference
from gfimu.calibration.poses import find_poses, table_fit
from gfimu.calibration.result import Calibration
from gfimu.recording import Recording
from gfimu.recording.rest import detect_rest

__all__ = ["calibrate_array", "update_array_calibration"]

_AS_DRAWN = (
    "positions are as drawn: they need motion with a reference of the rotation (tacho_rad_s or gyro_x/y/z_rad_s), or "
    "shakes of the array by hand from rest to rest, given as the motion (--motion, which may be the same recording)"
)


def calibrate_array(
    recording: Recording,
    array: AccelerometerArray,
    *,
    gravity: float = STANDARD_GRAVITY,
    motion: Recording | None = None,
    fit_positions: bool | None = None,
    rest_threshold: float | None = None,
    min_rest_s: float = 2.0,
    rows: str = "auto",
    row_noise_m_s2: float | None = None,
    progress: Callable[[float], object] | None = None,
) -> Calibration:
    """Calibrate all chips of an array in one body frame, and their positions where there is motion.

    Parameters
    ----------
    recording : Recording
        Static poses, nine or more of different direction.
    array : AccelerometerArray
        The drawing.
    gravity : float
        Local gravity, m/s².
    motion : Recording, optional
        Recording with the motion; ``recording`` itself if not given. Without a reference it is taken for shakes by hand
        between rests (`gfimu.calibration.array_shake`).
    fit_positions : bool, optional
        Fit positions; by default where ``motion`` is given, or ``recording`` has a reference (tachometer or gyro).
    rest_threshold : float, optional
        Threshold of rest, reading unit squared; chosen by the data if not given.
    min_rest_s : float
        Shortest pose, s.
    rows, row_noise_m_s2
        As in `gfimu.CalibrationPoses`.
    progress : callable, optional
        Called with the share done of a fit to shakes, 0 to 1.

    Returns
    -------
    Calibration
        Twelve parameters per chip (fifteen where the part's axes bend), and positions ``a1_r_x`` … with a note of which
        combinations are not determined; delays ``a1_d`` … from shakes.
        Biases that motion shows are reported but not applied: the ones at rest are far better known.

    Raises
    ------
    InputError
        If the poses or the motion do not suffice, or the data are faulty.

    Examples
    --------
    >>> import gfimu
    >>> poses = gfimu.simulate("calibration_poses", seed=2)
    >>> gfimu.calibrate_array(poses, poses.array)
    Calibration(array, 12 channels in m/s², 60 parameters, 3 directions undetermined)
    """
    warnings = list(check_gravity(gravity))
    ordered = _in_array_order(recording, array)
    poses = find_poses(ordered, array, gravity, _asked(rest_threshold, min_rest_s, rows, row_noise_m_s2))
    fit = partial(array_static, array=array, gravity=gravity)
    result = table_fit(fit, poses.observations, row_noise_m_s2) if poses.is_table else fit(poses.observations)
    result = replace(
        result,
        warnings=(*warnings, *poses.warnings, *result.warnings),
        statistics={**result.statistics, **poses.statistics},
    )
    if poses.is_table and motion is None:
        return replace(result, statements=(*result.statements, _AS_DRAWN))
    moving = result.apply(ordered if motion is None else _in_array_order(motion, array))
    if fit_positions is False:
        return result
    if not has_reference(moving):
        if motion is None and not fit_positions:
            return replace(result, statements=(*result.statements, _AS_DRAWN))
        still = detect_rest(moving)
        return _with_positions(result, array, array_shake(moving, array, result, still, progress=progress))
    try:
        reference = motion_reference(moving)
    except InputError as error:
        if fit_positions or motion is not None:
            raise
        return replace(result, statements=(*result.statements, f"positions are as drawn: {error}"))
    return _with_positions(result, array, array_motion(moving, array, reference))


def update_array_calibration(
    calibration: Calibration,
    recording: Recording,
    array: AccelerometerArray,
    *,
    turn_on_std_m_s2: float = 0.03,
    bias_walk_m_s2_rt_s: float = 0.0,
    rest_threshold: float | None = None,
    min_rest_s: float = 2.0,
    rows: str = "auto",
    row_noise_m_s2: float | None = None,
) -> Calibration:
    """Apply an array's calibration to a later run with new turn-on biases, from a few poses of that run.

    Parameters
    ----------
    calibration : Calibration
        Result of `calibrate_array` on an earlier run.
    recording : Recording
        The later run, with one pose or more at rest; they need not be level.
    array : AccelerometerArray
        The drawing.
    turn_on_std_m_s2 : float
        Standard deviation of a bias from one power-on to the next, m/s².
    bias_walk_m_s2_rt_s : float
        Random walk of a bias between poses, m/s²/√s.
    rest_threshold : float, optional
        Threshold of rest, reading unit squared; chosen by the data if not given.
    min_rest_s : float
        Shortest pose, s.
    rows, row_noise_m_s2
        As in `gfimu.CalibrationPoses`; the rows of a table need their noise stated.

    Returns
    -------
    Calibration
        As `gfimu.calibration.array_update.array_update`.

    Raises
    ------
    InputError
        If the calibration is not of this array, there is no rest, or the data are faulty.
    UnitError
        If the recording is in another unit than the calibration.
    """
    asked = _asked(rest_threshold, min_rest_s, rows, row_noise_m_s2)
    poses = find_poses(_in_array_order(recording, array), array, calibration.gravity, asked)
    if poses.is_table and row_noise_m_s2 is None:
        raise InputError("the poses of an update don't show the noise of a row; state it: --row-noise, m/s²")
    result = array_update(
        calibration,
        poses.observations,
        array,
        turn_on_std_m_s2=turn_on_std_m_s2,
        bias_walk_m_s2_rt_s=bias_walk_m_s2_rt_s,
    )
    return replace(
        result,
        warnings=(*poses.warnings, *result.warnings),
        statistics={**result.statistics, **poses.statistics},
    )


def _asked(threshold: float | None, min_rest_s: float, rows: str, row_noise_m_s2: float | None) -> CalibrationPoses:
    return CalibrationPoses(threshold, min_rest_s, rows=rows, row_noise_m_s2=row_noise_m_s2)


def _in_array_order(recording: Recording, array: AccelerometerArray) -> Recording:
    missing = [channel for channel in array.channels if channel not in recording.channels]
    if missing:
        raise InputError(
            f"the recording lacks {', '.join(missing)} of array {array.name!r}; it has {', '.join(recording.channels)}"
        )
    columns = [recording.channels.index(channel) for channel in array.channels]
    return replace(recording, readings=recording.readings[:, columns], channels=array.channels)


def _with_positions(result: Calibration, array: AccelerometerArray, motion: ArrayMotion) -> Calibration:
    """Add the fitted positions to a static calibration."""
    static, count = len(result.names), motion.positions.size
    delays = np.zeros(0) if motion.delays is None else motion.delays
    names = [f"{chip.name}_r_{axis}" for chip in array.chips for axis in "xyz"]
    names += [f"{chip.name}_d" for chip in array.chips[: len(delays)]]
    fitted = np.concatenate([np.arange(count), np.arange(len(motion.covariance) - len(delays), len(motion.covariance))])
    covariance = np.zeros((static + len(fitted), static + len(fitted)))
    covariance[:static, :static] = result.covariance
    covariance[static:, static:] = motion.covariance[np.ix_(fitted, fitted)]
    undetermined = motion.null_space[:count]
    directions, sizes, _ = np.linalg.svd(undetermined, full_matrices=False)
    undetermined = directions[:, sizes > 1e-6]
    null_space = np.zeros((len(covariance), result.null_space.shape[1] + undetermined.shape[1]))
    null_space[:static, : result.null_space.shape[1]] = result.null_space
    null_space[static : static + count, result.null_space.shape[1] :] = undetermined
    offset = np.linalg.norm(motion.positions - array.chip_positions, axis=1)
    largest = float(np.abs(motion.biases).max())
    statement = (
        f"motion ({motion.reference}) shows residual biases of up to {largest:.3g} m/s²; they are not applied, "
        "as the biases at rest are better known"
    )
    return replace(
        result,
        names=(*result.names, *names),
        values=np.concatenate([result.values, motion.positions.ravel(), delays]),
        covariance=covariance,
        null_space=null_space,
        statements=(*result.statements, *motion.statements, statement),
        statistics={
            **result.statistics,
            "motion_samples": float(motion.samples),
            "motion_reference": motion.reference,
            "motion_residual_rms_before_m_s2": motion.residual_rms_before_m_s2,
            "motion_residual_rms_m_s2": motion.residual_rms_m_s2,
            "largest_position_offset_m": float(offset.max()),
            "largest_motion_bias_m_s2": largest,
        },
    )
