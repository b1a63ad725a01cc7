"""Calibrations as Kalibr's ``imu.yaml``, model ``scale-misalignment``: one ``imuN`` per chip.

Kalibr (ethz-asl/kalibr, ``kalibr_imu_camera_calibration/IccSensors.py``, class ``IccScaledMisalignedImu``; Rehder et
al., ICRA 2016) predicts a reading as z = M C_ib (a_b − g_b + α × r + ω × (ω × r)) + b, in m/s²:

- M turns the specific force into the reading, so that f = M⁻¹ (z − b); it is a ratio, and lower triangular: x of the
  frame i lies along the sensing axis x, y in the plane of the sensing axes x and y.
- b is added after M. Kalibr estimates it as a spline and has no key for it.
- ``T_i_b`` takes points of the frame b to the frame i: [C_ib, −C_ib r; 0, 1], r being the place of the chip in b. The
  frame b is that of ``imu0``, whose ``T_i_b`` is the identity.
- ``accelerometer_noise_density`` σ (m/s²/√Hz) and ``accelerometer_random_walk`` (m/s³/√Hz) are continuous: a sample at
  the rate ``update_rate`` has the standard deviation σ √rate (``kalibr_common/ConfigReader.py``).

gfimu's M (12 parameters, along the drawing's axes A) becomes L Q with L lower triangular and Q a rotation: L is
Kalibr's M, Q A its C_ib. What Kalibr has no place for stands under ``gfimu``, which Kalibr does not read.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gfimu.calibration.exporting.calibrated_chip import CalibratedChip, number, numbers, text

__all__ = ["calibration_as_kalibr", "lower_form"]

_LOWER = [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)]
_NAMES = [f"M_{'xyz'[i]}{'xyz'[j]}" for i, j in _LOWER] + [f"b_{axis}" for axis in "xyz"] + [f"phi_{a}" for a in "xyz"]


def calibration_as_kalibr(chips: Sequence[CalibratedChip], *, notes: Sequence[str] = ()) -> str:
    """Return the text of Kalibr's file of a set of IMUs.

    Under ``gfimu`` of each ``imuN``: ``chip``, ``lsb_m_s2`` (readings z are counts times it; 1 for readings in m/s²),
    ``bias_m_s2``, ``T_i_array`` (points of the array's body frame to the frame i), ``covariance`` of ``parameters``:
    the six free elements of M, b (m/s²), and the rotation vector phi (rad) by which the true C_ib is exp([phi]×) C_ib.

    Parameters
    ----------
    chips : sequence of CalibratedChip
        The triads.
    notes : sequence of str
        Comment lines at the head.
    """
    lines = [
        "# Model scale-misalignment of Kalibr: z = M * C_ib * f + b, so f_b = C_ib^T * M^-1 * (z - b).",
        "# z: readings in m/s^2; f: specific force (a - g), m/s^2; M: lower triangular, a ratio; b: gfimu.bias_m_s2.",
        "# T_i_b: from the frame of imu0 to that of imuN; gfimu.T_i_array: from the array's body frame.",
        "# A gyro-free unit: add gyroscope_noise_density, gyroscope_random_walk and gyroscopes from elsewhere.",
        *(f"# {' '.join(note.split())}" for note in notes),
    ]
    first: NDArray[np.float64] | None = None
    for index, chip in enumerate(chips):
        lower, rotation, covariance = lower_form(chip)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = rotation, -rotation @ chip.chip.position
        first = pose if first is None else first
        relative = np.eye(4) if index == 0 else pose @ np.linalg.inv(first)
        lines += [f"imu{index}:", "  model: scale-misalignment", f"  T_i_b: {numbers(relative)}", "  time_offset: 0.0"]
        lines += [f"  rostopic: /imu{index}", *_noise(chip)]
        lines += ["  accelerometers:", f"    M: {numbers(lower)}", "  gfimu:", f"    chip: {text(chip.chip.name)}"]
        lines += [f"    lsb_m_s2: {number(chip.scale)}", f"    bias_m_s2: {numbers(chip.bias)}"]
        lines += [f"    T_i_array: {numbers(pose)}", f"    parameters: [{', '.join(_NAMES)}]", "    covariance:"]
        lines += [f"      - {numbers(row)}" for row in covariance]
        if chip.position_covariance is not None:
            lines.append(f"    position_covariance_m2: {numbers(chip.position_covariance)}")
    return "\n".join(lines) + "\n"


def lower_form(chip: CalibratedChip) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return Kalibr's M (3, 3), C_ib (3, 3) from the array's body frame, and the covariance (12, 12) of both and b.

    M = L Q: L lower triangular, Q orthogonal. Sensing axes of a left-handed triad have a negative M_zz, as C_ib is a
    rotation. With X = L⁻¹ dM Qᵀ = L⁻¹ dL + dQ Qᵀ the skew part dQ Qᵀ = [phi]× follows from the elements of X above its
    diagonal, and dL = L (X − [phi]×).
    """
    q, r = np.linalg.qr(chip.sensitivity.T)
    signs = np.sign(np.diag(r))
    lower, turn = (r.T * signs), (q * signs).T
    if np.linalg.det(turn @ chip.chip.axes) < 0.0:
        turn = np.diag([1.0, 1.0, -1.0]) @ turn
        lower = lower * np.array([1.0, 1.0, -1.0])
    inverse = np.linalg.inv(lower)
    jacobian = np.zeros((12, 12))
    for element in range(9):
        change = np.zeros(9)
        change[element] = 1.0
        x = inverse @ change.reshape(3, 3) @ turn.T
        skew = np.triu(x, 1) - np.triu(x, 1).T
        d_lower = lower @ (x - skew)
        jacobian[:6, element] = [d_lower[i, j] for i, j in _LOWER]
        jacobian[9:, element] = [skew[2, 1], skew[0, 2], skew[1, 0]]
    jacobian[6:9, 9:] = np.eye(3)
    return np.tril(lower), turn @ chip.chip.axes, jacobian @ chip.covariance @ jacobian.T


def _noise(chip: CalibratedChip) -> list[str]:
    noise = chip.noise
    if noise is None:
        return [
            "  # update_rate, accelerometer_noise_density, accelerometer_random_walk: unknown; --noise REST finds them"
        ]
    lines = [
        f"  update_rate: {number(noise.rate_hz)}  # Hz",
        f"  accelerometer_noise_density: {number(noise.density)}  # m/s^2/sqrt(Hz), {noise.source}",
    ]
    if noise.walk is None:
        return [*lines, "  # accelerometer_random_walk: unknown; --noise REST finds it"]
    return [*lines, f"  accelerometer_random_walk: {number(noise.walk)}  # m/s^3/sqrt(Hz)"]
