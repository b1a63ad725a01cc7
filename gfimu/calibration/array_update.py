"""Carry the calibration of an array over to a later run: what it was, and biases that moved, from a few poses.

Sensitivities and alignment last; biases change from one power-on to the next and follow a random walk afterwards. The
earlier calibration, with the variance of its biases raised by that of a power-on, is the prior of a Kalman filter whose
measurements are the conditions of each pose, |a_1| = g and a_i = a_1 (`gfimu.calibration.array_static`). Nothing need
be level, and one pose is enough to see what counts at rest: how the chips disagree.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError, UnitError
from gfimu.calibration.array_static import (
    apparent_alpha,
    bias_places,
    body_specific_force,
    disagreement,
    same_specific_force,
    seen_alpha,
)
from gfimu.calibration.nonlinearity import with_quadratic
from gfimu.calibration.observations import Observations
from gfimu.calibration.result import Calibration

__all__ = ["array_update"]

Floats = NDArray[np.float64]

_PER_CHIP = 12
_LINEARISATIONS = 3
_SIGNIFICANCE = 1e-3


def array_update(
    calibration: Calibration,
    observations: Observations,
    array: AccelerometerArray,
    *,
    turn_on_std_m_s2: float = 0.03,
    bias_walk_m_s2_rt_s: float = 0.0,
) -> Calibration:
    """Update the calibration of an array with poses of a later run.

    Parameters
    ----------
    calibration : Calibration
        Result of `array_static` or `calibrate_array`; the body frame stays the one it defines.
    observations : Observations
        Averaged poses of the later run in their order, one or more, in the unit of the calibration.
    array : AccelerometerArray
        The drawing that the calibration was made with.
    turn_on_std_m_s2 : float
        Standard deviation of a bias from one power-on to the next, m/s².
    bias_walk_m_s2_rt_s : float
        Random walk of a bias between poses, m/s²/√s; the biases returned are those at the last pose.

    Returns
    -------
    Calibration
        All parameters with their covariance; positions are carried over. A warning says when the poses disagree with
        the calibration more than the stated changes of the biases allow.

    Raises
    ------
    InputError
        If the calibration is not of a whole array, or not of these channels.
    UnitError
        If the readings are in another unit.
    """
    _check(calibration, observations, array)
    chips = len(array.chips)
    condition = same_specific_force(np.array([chip.axes for chip in array.chips]), calibration.gravity)
    size_of_models = _PER_CHIP * chips
    used = slice(0, size_of_models)
    if f"{array.chips[0].name}_q_x" in calibration.names:  # they follow the models of all chips
        condition = with_quadratic(condition, bias_places(chips))
        used = slice(0, size_of_models + array.n_channels)
    values, covariance = calibration.values[used].copy(), calibration.covariance[used, used].copy()
    per_chip = values[:size_of_models].reshape(chips, _PER_CHIP)
    biases = bias_places(chips)
    # Sensitivity of each chip, reading unit per m/s²: the cube root of its determinant.
    size = np.cbrt(np.abs(np.linalg.det(per_chip[:, :9].reshape(chips, 3, 3)))).repeat(3)
    covariance[biases, biases] += (turn_on_std_m_s2 * size) ** 2
    means = observations.means
    spread = observations.covariance / np.bincount(observations.pose)[:, None, None]
    square, conditions = 0.0, 0
    for pose, reading in enumerate(means):
        if pose:
            elapsed = observations.start_s[pose] - observations.start_s[pose - 1]
            covariance[biases, biases] += (bias_walk_m_s2_rt_s * size) ** 2 * elapsed
        prior = values
        for _ in range(_LINEARISATIONS):  # iterated: each time at the values found last
            f, a, b = (part[0] for part in condition(values, reading[None]))
            innovation = -(f - a @ (values - prior))
            expected = a @ covariance @ a.T + b @ spread[pose] @ b.T
            gain = np.linalg.solve(expected, a @ covariance).T
            values = prior + gain @ innovation
        square += float(innovation @ np.linalg.solve(expected, innovation))
        conditions += len(innovation)
        remaining = np.eye(len(values)) - gain @ a
        covariance = remaining @ covariance @ remaining.T + gain @ (b @ spread[pose] @ b.T) @ gain.T  # Joseph's form
    whole_values, whole_covariance = calibration.values.copy(), calibration.covariance.copy()
    whole_values[used], whole_covariance[used, used] = values, covariance
    result = replace(
        calibration,
        method="array-update",
        values=whole_values,
        covariance=whole_covariance,
        statements=(*calibration.statements, _statement(observations, turn_on_std_m_s2, bias_walk_m_s2_rt_s)),
        warnings=_warnings(square / conditions, conditions),
    )
    return replace(result, statistics=_statistics(calibration, result, array, means, square / conditions))


def _check(calibration: Calibration, observations: Observations, array: AccelerometerArray) -> None:
    if calibration.gauge != "array":
        raise InputError(
            f"a {calibration.method} calibration can't be updated as an array; calibrate with the method array"
        )
    for what, channels in (("calibration is", calibration.channels), ("readings are", observations.channels)):
        if channels != array.channels:
            raise InputError(f"the {what} of {', '.join(channels)}, not of array {array.name!r}")
    if observations.unit != calibration.unit:
        raise UnitError(
            f"the readings are in {observations.unit}, the calibration in {calibration.unit}; give both in one unit"
        )


def _statement(observations: Observations, turn_on_std: float, walk: float) -> str:
    drift = f" and follow a random walk of {walk:.3g} m/s²/√s" if walk else ""
    return (
        f"carried over from an earlier run and updated with {observations.n_poses} poses: biases taken to change by "
        f"{turn_on_std:.3g} m/s² between the runs{drift}"
    )


def _warnings(factor: float, conditions: int) -> tuple[str, ...]:
    if factor <= chdtri(conditions, _SIGNIFICANCE) / conditions:
        return ()
    text = (
        f"the poses disagree with the earlier calibration {np.sqrt(factor):.1f} times more than expected; "
        "the biases change more than stated, or the array must be calibrated anew"
    )
    return (text,)


def _statistics(
    before: Calibration, after: Calibration, array: AccelerometerArray, means: Floats, factor: float
) -> dict[str, float | str]:
    """State what the poses show before and after the update."""
    statistics: dict[str, float | str] = {"poses": float(len(means)), "innovation_variance_factor": factor}
    for when, calibration in (("before", before), ("after", after)):
        body = body_specific_force(calibration, array, means)
        alpha = apparent_alpha(array, body)
        statistics[f"disagreement_rms_{when}_m_s2"] = disagreement(body)
        for axis, value in zip("xyz", np.sqrt(np.mean(alpha**2, axis=0)), strict=True):
            if axis in seen_alpha(array):
                statistics[f"apparent_alpha_{axis}_rms_{when}_rad_s2"] = float(value)
    return statistics
