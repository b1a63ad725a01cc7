"""Parameters of one chip in a calibration, with their derivatives by all parameters of that calibration.

Every stated quantity is a function of M, b and the non-linearity of the chip. Its Jacobian follows from the slopes here
by the chain rule, so that the full covariance of the calibration is carried over whatever its gauge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.calibration.error_model import GAUGES, free_elements
from gfimu.calibration.result import Calibration

__all__ = ["ChipParameters", "chip_parameters"]

Floats = NDArray[np.float64]

_IN_SPAN = 1e-6  # numerical: relative distance of a direction from the null space that holds it
_AXES = "xyz"


@dataclass(frozen=True)
class ChipParameters:
    """M, b, q and c of l = b + y + q y² + c y³, y = M a, and their slopes.

    Parameters
    ----------
    chip : str
        Name.
    channels : tuple of str
        Its three channels.
    unit : str
        Unit of the readings.
    frame, frame_meaning : str
        Reference axes of M, as a key of `GAUGES`, and in words.
    sensitivity : ndarray, shape (3, 3)
        M, reading unit per m/s².
    bias, quadratic, cubic : ndarray, shape (3,)
        b, reading unit; q, 1 per reading unit; c, 1 per reading unit squared.
    slopes : tuple of ndarray
        Derivatives of these four by the p parameters of the calibration, (p, 3, 3) and three of (p, 3).
    has_quadratic, has_cubic : bool
        Whether the calibration has these coefficients.
    undetermined : ndarray, shape (p, k)
        Directions of its parameters that the data did not determine, rotations of the frame apart.
    """

    chip: str
    channels: tuple[str, ...]
    unit: str
    frame: str
    frame_meaning: str
    sensitivity: Floats
    bias: Floats
    quadratic: Floats
    cubic: Floats
    slopes: tuple[Floats, Floats, Floats, Floats]
    has_quadratic: bool
    has_cubic: bool
    undetermined: Floats


def chip_parameters(calibration: Calibration) -> tuple[ChipParameters, ...]:
    """Take the parameters of every chip out of a calibration of accelerometers.

    Where magnitudes alone were used, the rotation of the three sensing axes against the case was not determined. The
    frame is then that of the sensing axes themselves (gauge ``x_axis``), in which everything is determined.
    """
    return tuple(_of_chip(calibration, index, chip) for index, chip in enumerate(calibration.chips))


def _of_chip(calibration: Calibration, number: int, chip: str) -> ChipParameters:
    names, count = calibration.names, len(calibration.names)
    place = {name: row for row, name in enumerate(names)}
    values = [np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.zeros(3)]
    slopes = [np.zeros((count, *value.shape)) for value in values]
    for kind, letter in enumerate("Mbqc"):
        for index in np.ndindex(values[kind].shape):
            row = place.get(f"{chip}_{letter}_{''.join(_AXES[i] for i in index)}")
            if row is not None:
                values[kind][index] = calibration.values[row]
                slopes[kind][(row, *index)] = 1.0
    found = ChipParameters(
        chip,
        calibration.channels[3 * number : 3 * number + 3],
        calibration.unit,
        calibration.gauge,
        GAUGES[calibration.gauge],
        values[0],
        values[1],
        values[2],
        values[3],
        (slopes[0], slopes[1], slopes[2], slopes[3]),
        has_quadratic=f"{chip}_q_x" in place,
        has_cubic=f"{chip}_c_x" in place,
        undetermined=np.empty((count, 0)),
    )
    found = replace(found, undetermined=_undetermined(calibration, found))
    return _in_own_frame(found) if _rotation_is_open(calibration, found) else found


def _rotation_is_open(calibration: Calibration, chip: ChipParameters) -> bool:
    """Whether a rotation of this chip alone against the reference axes was not determined."""
    null_space = calibration.null_space
    if not null_space.size or any(key.endswith("levelling_std_rad") for key in calibration.statistics):
        return False
    basis, turns = np.linalg.qr(null_space)[0], _rotations(chip)
    return bool(np.linalg.norm(turns - basis @ (basis.T @ turns)) < _IN_SPAN)


def _rotations(chip: ChipParameters) -> Floats:
    """Return how the parameters change by small rotations of the frame, M [e_k ×], orthonormal, (p, 3)."""
    turned = chip.sensitivity @ np.cross(np.eye(3), np.eye(3)[:, None])  # (3, 3, 3)
    return np.asarray(np.linalg.qr(np.einsum("pij,kij->pk", chip.slopes[0], turned))[0], dtype=np.float64)


def _undetermined(calibration: Calibration, chip: ChipParameters) -> Floats:
    """Return the null space within the parameters of this chip, without its rotations: those only choose the frame."""
    own = np.array([name.startswith(f"{chip.chip}_") for name in calibration.names])  # (p,)
    part = calibration.null_space * own[:, None]
    beside = part
    if len(free_elements(calibration.gauge)) == 9:
        turns = _rotations(chip)
        beside = part - turns @ (turns.T @ part)
    _, size, columns = np.linalg.svd(beside, full_matrices=False)
    return np.asarray(part @ columns[size > _IN_SPAN].T, dtype=np.float64)


def _in_own_frame(chip: ChipParameters) -> ChipParameters:
    """Express a chip in the frame of its sensing axes: M becomes the lower Cholesky factor L of M Mᵀ.

    With dG = dM Mᵀ + M dMᵀ, dL = L Φ(L⁻¹ dG L⁻ᵀ), where Φ keeps the lower triangle and half of the diagonal.
    """
    m, by = chip.sensitivity, chip.slopes[0]
    lower = np.linalg.cholesky(m @ m.T)
    inverse = np.linalg.inv(lower)
    change = by @ m.T
    change = inverse @ (change + change.swapaxes(1, 2)) @ inverse.T  # (p, 3, 3)
    half = np.tril(change, -1) + 0.5 * change * np.eye(3)
    return replace(
        chip,
        frame="x_axis",
        frame_meaning=GAUGES["x_axis"],
        sensitivity=np.asarray(lower, dtype=np.float64),
        slopes=(lower @ half, *chip.slopes[1:]),
    )
