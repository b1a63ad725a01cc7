"""What the angular acceleration of a calibrated array follows, and how surely: scale, alignment, gravity, bias.

The array's α is A y, with y the corrected readings of all channels and A the first three rows of J⁺ (GF-IMU paper, step
4). Corrected readings are M₀⁻¹ M θ (p + α × r) for errors of M and r about the calibrated values: α follows
H [α; p], with H = [I | 0] where nothing is wrong. The covariance of the calibration gives that of H.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import GeometryError, InputError
from gfimu.calibration.result import Calibration

__all__ = ["Response", "response"]

Floats = NDArray[np.float64]

_ROUNDING = 1e-12  # numerical: of a ratio


@dataclass(frozen=True)
class Response:
    """Uncertainty of the angular acceleration of a calibrated array, body axes.

    Parameters
    ----------
    alpha_rows : ndarray, shape (3, c)
        A: angular acceleration per reading, rad/s² per m/s².
    array : AccelerometerArray
        With the positions that the calibration fitted.
    response_std : ndarray, shape (3, 6)
        Standard deviation of H: output about x, y, z; by α about x, y, z (a ratio), by p along them (rad/s² per m/s²).
    bias_std : ndarray, shape (3,)
        Of the output at α = p = 0, rad/s².
    rate_squared, rate_squared_std : ndarray, shape (3,)
        Largest output per squared rate about any axis where ω is not corrected for, rad/s² per rad²/s², and the
        standard deviation by the positions, the root of the sum of squares over the six products of ω.
    position_std : ndarray, shape (k, 3)
        Standard deviation of each chip's coordinates, m.
    """

    alpha_rows: Floats
    array: AccelerometerArray
    response_std: Floats
    bias_std: Floats
    rate_squared: Floats
    rate_squared_std: Floats
    position_std: Floats


def response(calibration: Calibration, array: AccelerometerArray, position_std_m: float) -> Response:
    """Carry the covariance of a calibration over to the angular acceleration.

    Parameters
    ----------
    calibration : Calibration
        Of the whole array in one frame (gauge ``array``).
    array : AccelerometerArray
        The drawing.
    position_std_m : float
        Standard deviation of each coordinate of a chip where the calibration did not fit positions, m.

    Raises
    ------
    InputError
        If the calibration is of single chips or of other channels.
    GeometryError
        If the array can't see every angular acceleration.
    """
    if calibration.gauge != "array":
        raise InputError(
            f"a {calibration.method} calibration does not align the chips with each other; an angular sensor needs one "
            "of the whole array: calibrate with the method array"
        )
    if calibration.channels != array.channels:
        raise InputError(f"the calibration is of {', '.join(calibration.channels)}, not of array {array.name!r}")
    placed = calibration.calibrated_array(array)
    j = placed.regression_matrix  # (c, 6)
    if np.linalg.matrix_rank(j) < 6:
        raise GeometryError(f"array {array.name!r} can't see every angular acceleration; it is no angular sensor")
    alpha_rows = np.asarray(np.linalg.pinv(j)[:3], dtype=np.float64)
    count = len(calibration.names)
    moved = [f"{chip.name}_r_{axis}" for chip in placed.chips for axis in "xyz"]
    fitted = moved[0] in calibration.names
    size = count + (0 if fitted else len(moved))
    covariance = np.zeros((size, size))
    covariance[:count, :count] = calibration.covariance
    if not fitted:
        covariance[range(count, size), range(count, size)] = position_std_m**2
    place = {name: row for row, name in enumerate(calibration.names)}
    place |= {} if fitted else {name: count + row for row, name in enumerate(moved)}
    by = np.zeros((size, 3, 13))  # of H, of the bias, and of the six products of ω
    for index, chip in enumerate(placed.chips):
        weights = alpha_rows[:, 3 * index : 3 * index + 3] @ calibration.models[chip.name].inverse  # (3, 3)
        sensed = chip.axes @ np.hstack([-_skew(chip.position), np.eye(3)])  # (3, 6)
        drawn = alpha_rows[:, 3 * index : 3 * index + 3] @ chip.axes
        for row, i in enumerate("xyz"):
            by[place[f"{chip.name}_b_{i}"], :, 6] = weights[:, row]
            unit = np.eye(3)[row]
            by[place[f"{chip.name}_r_{i}"], :, :3] = -drawn @ _skew(unit)
            by[place[f"{chip.name}_r_{i}"], :, 7:] = drawn @ _products(unit)
            for column, axis in enumerate("xyz"):
                by[place[f"{chip.name}_M_{i}{axis}"], :, :6] = np.outer(weights[:, row], sensed[column])
    std = np.sqrt(np.maximum(np.einsum("pai,pq,qai->ai", by, covariance, by), 0.0))
    places = np.array([place[name] for name in moved])
    return Response(
        alpha_rows,
        placed,
        std[:, :6],
        std[:, 6],
        _largest_rate_squared(alpha_rows @ placed.centripetal_matrix),
        np.asarray(np.linalg.norm(std[:, 7:], axis=1), dtype=np.float64),
        np.sqrt(np.diag(covariance)[places]).reshape(-1, 3),
    )


def _skew(r: Floats) -> Floats:
    """Return [r×], (3, 3)."""
    return np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])


def _products(r: Floats) -> Floats:
    """Return what multiplies the six products of ω in ω (ω · r) − |ω|² r, (3, 6)."""
    x, y, z = r
    return np.array([[0.0, -x, -x, y, z, 0.0], [-y, 0.0, -y, x, 0.0, z], [-z, -z, 0.0, 0.0, x, y]])


def _largest_rate_squared(products: Floats) -> Floats:
    """Return the largest |output| per |ω|² over the directions of ω, (3,), from its six products, (3, 6)."""
    xx, yy, zz, xy, xz, yz = (products[:, column] for column in range(6))
    form = np.stack([xx, xy / 2, xz / 2, xy / 2, yy, yz / 2, xz / 2, yz / 2, zz], axis=-1).reshape(3, 3, 3)
    largest = np.abs(np.linalg.eigvalsh(form)).max(axis=1)
    return np.where(largest > _ROUNDING, largest, 0.0)
