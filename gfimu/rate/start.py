"""What the null space of a run's first readings contradicts: a start at rest, or the biases that a calibration states.

A steady spin about the vertical keeps every reading constant, as rest does. The products of its rate tell the two apart
where they exceed what the biases may be. Where no rate explains the null space, the biases are other ones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, chdtri

from gfimu.array.array import AccelerometerArray
from gfimu.array.kinematics import omega_products
from gfimu.rate.maximum_likelihood import rate_of_null_space
from gfimu.rate.rest_test import shown_variance
from gfimu.rate.sensing import ChannelTables, SensorErrors

__all__ = ["CONTRADICTION", "START_S", "contradicts_biases", "contradicts_rest"]

START_S = 0.125
"""Length of the first readings, s: short beside a motion that begins."""

CONTRADICTION = 25.0
"""By how much χ² must fall with a rate of its own, three parameters: once in 7e4 runs at rest."""

_CHANCE = float(chdtrc(3, CONTRADICTION))  # probability that right biases are contradicted: as that of rest


def contradicts_rest(array: AccelerometerArray, readings: NDArray[np.float64], errors: SensorErrors) -> bool:
    """Whether the first readings (k, c), m/s², of a run can't be those of rest.

    False where nothing can be said: no complete reading, or an array that sees fewer than three products of ω.
    """
    at_rest, turning, _ = _squares(array, readings, errors)
    return at_rest - turning > CONTRADICTION


def contradicts_biases(array: AccelerometerArray, readings: NDArray[np.float64], errors: SensorErrors) -> bool:
    """Whether the first readings (k, c), m/s², of a run contradict the stated biases, whatever the rate.

    False where nothing can be said.
    """
    _, turning, freedom = _squares(array, readings, errors)
    return bool(freedom > 0 and turning > chdtri(freedom, _CHANCE))


def _squares(
    array: AccelerometerArray, readings: NDArray[np.float64], errors: SensorErrors
) -> tuple[float, float, int]:
    """Return χ² of the mean null space of readings at rest and at the best rate, and the latter's degrees of freedom.

    Zeros where nothing can be said.
    """
    tables = ChannelTables(array, errors)
    rows = readings[(np.abs(readings) < errors.limits).all(axis=1)]
    if len(rows) == 0 or tables.n_null == 0 or np.linalg.matrix_rank(tables.null_sensitivity[0], tol=1e-9) < 3:
        return 0.0, 0.0, 0
    z = rows @ tables.null_rows[0].T
    noise = shown_variance(z) if len(z) > 3 else 1.0
    spread = tables.bias_covariance(errors.bias_std)[3:, 3:] + noise / len(z) * np.eye(tables.n_null)
    white = np.linalg.inv(np.linalg.cholesky(spread))
    mean, sensitivity = white @ z.mean(axis=0), np.ascontiguousarray(white @ tables.null_sensitivity[0])
    residual = mean - sensitivity @ omega_products(rate_of_null_space(mean, sensitivity))
    return float(mean @ mean), float(residual @ residual), tables.n_null - 3
