"""Calibrations as the YAML of the ROS package imu_calib, with covariances as in `sensor_msgs/Imu`.

imu_calib (dpkoch/imu_calib, ``src/accel_calib/accel_calib.cpp``) reads ``SM`` (nine numbers, row by row) and ``bias``
(three) and publishes corrected = SM · raw − bias: SM is the inverse of a sensitivity matrix, and bias is taken off
*after* it. Both topics are `sensor_msgs/Imu`: m/s², specific force (+g upwards at rest), in the sensor's own frame
(REP 145). So SM = M⁻¹ and bias = M⁻¹ b of gfimu's z = M f + b, along the drawing's sensing axes of the chip.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.base.errors import InputError
from gfimu.calibration.exporting.calibrated_chip import CalibratedChip, number, numbers, text

__all__ = ["calibration_as_ros", "inverse_form"]

_NAMES = [f"SM_{row}{column}" for row in "xyz" for column in "xyz"] + [f"bias_{axis}" for axis in "xyz"]


def calibration_as_ros(chips: Sequence[CalibratedChip], *, notes: Sequence[str] = ()) -> str:
    """Return the text of imu_calib's file: its keys at the top for one chip, below the name of each for several.

    Besides ``SM`` and ``bias``: ``lsb_m_s2`` (raw is counts times it; 1 for readings in m/s²), ``frame_id``,
    ``covariance`` (12 × 12) of SM row by row (a ratio) and bias (m/s²), ``linear_acceleration_covariance`` (nine
    numbers row by row, (m/s²)²) of a corrected sample by the noise alone, and ``transform`` from the frame of the chip
    to the array's body frame.

    Parameters
    ----------
    chips : sequence of CalibratedChip
        The triads.
    notes : sequence of str
        Comment lines at the head.

    Raises
    ------
    InputError
        If the sensing axes of a chip are left-handed, which no frame of ROS is.
    """
    lines = [
        "# corrected = SM * raw - bias, as imu_calib has it; both m/s^2, specific force, in the sensor's frame.",
        *(f"# {' '.join(note.split())}" for note in notes),
    ]
    if len(chips) > 1:
        lines.append("# imu_calib reads the keys of one chip at the top of a file: export one with --chip NAME.")
    for chip in chips:
        if np.linalg.det(chip.chip.axes) < 0.0:
            raise InputError(
                f"chip {chip.chip.name}: its axes are left-handed, and a frame of ROS is right-handed; "
                "exchange two axes in the array file"
            )
        body = _one(chip)
        lines += body if len(chips) == 1 else [f"{chip.chip.name}:", *(f"  {line}" for line in body)]
    return "\n".join(lines) + "\n"


def inverse_form(
    chip: CalibratedChip,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return SM (3, 3), bias (3,), m/s², and the covariance (12, 12) of SM row by row and bias.

    dSM = −SM dM SM, and d(SM b) = dSM b + SM db.
    """
    inverse = np.asarray(np.linalg.inv(chip.sensitivity), dtype=np.float64)
    of_inverse = -np.kron(inverse, inverse.T)  # (9, 9), rows of SM by rows of M
    jacobian = np.zeros((12, 12))
    jacobian[:9, :9] = of_inverse
    jacobian[9:, :9] = np.kron(np.eye(3), chip.bias) @ of_inverse
    jacobian[9:, 9:] = inverse
    return inverse, inverse @ chip.bias, jacobian @ chip.covariance @ jacobian.T


def _one(chip: CalibratedChip) -> list[str]:
    matrix, bias, covariance = inverse_form(chip)
    turn = Rotation.from_matrix(chip.chip.axes.T).as_quat()  # x, y, z, w: from the chip's frame to the body's
    lines = [
        f"SM: {numbers(matrix.ravel())}",
        f"bias: {numbers(bias)}",
        f"lsb_m_s2: {number(chip.scale)}",
        f"frame_id: {text(chip.chip.name)}",
        f"parameters: [{', '.join(_NAMES)}]",
        "covariance:",
        *(f"  - {numbers(row)}" for row in covariance),
    ]
    if chip.noise is None:
        lines.append("# linear_acceleration_covariance: unknown; --noise REST finds it")
    else:
        each = matrix @ matrix.T * chip.noise.std**2
        lines += [
            f"# {chip.noise.source}",
            f"linear_acceleration_covariance: {numbers(each.ravel())}",
        ]
    lines += ["transform:", f"  translation_m: {numbers(chip.chip.position)}", f"  rotation_xyzw: {numbers(turn)}"]
    if chip.position_covariance is not None:
        lines.append(f"  translation_covariance_m2: {numbers(chip.position_covariance)}")
    return lines
