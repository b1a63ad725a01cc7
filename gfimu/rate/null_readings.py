"""The null space of each sample, as the per-sample estimators use it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import GeometryError, InputError
from gfimu.rate.rest_test import RestTest, constant_readings
from gfimu.rate.sensing import ChannelTables, SensorErrors

__all__ = ["NullReadings", "null_readings"]


@dataclass(frozen=True)
class NullReadings:
    """What each sample says about α and about the products of ω, with the biases of the leading rest removed.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Sample times, s.
    alpha : ndarray, shape (n, 3)
        Angular acceleration, rad/s², NaN where channels are missing.
    z : ndarray, shape (n, d)
        Null space in units of its noise, NaN where channels are missing.
    sensitivity : ndarray, shape (d, 6)
        M of z = M s(ω) + noise.
    rest : ndarray of bool, shape (n,)
        The leading rest, from which the biases were taken.
    """

    t: NDArray[np.float64]
    alpha: NDArray[np.float64]
    z: NDArray[np.float64]
    sensitivity: NDArray[np.float64]
    rest: NDArray[np.bool_]


def null_readings(
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    *,
    least_rank: int,
    start_at_rest: bool,
) -> NullReadings:
    """Project readings on α and the null space, and take the mean over the leading rest as bias.

    Parameters
    ----------
    array : AccelerometerArray
        The array, with c channels.
    t : array_like, shape (n,)
        Sample times, s.
    readings : array_like, shape (n, c)
        Specific force, m/s². Rows with a missing or saturated channel give NaN.
    errors : SensorErrors
        Errors of the sensors.
    least_rank : int
        How many products of ω the method needs.
    start_at_rest : bool
        Whether the run starts at rest, so that constant readings at its start are biases (and gravity).

    Raises
    ------
    GeometryError
        If the array sees fewer products.
    InputError
        If the shapes don't fit or time does not increase.
    """
    times = np.asarray(t, dtype=float)
    rows = np.asarray(readings, dtype=float)
    if times.ndim != 1 or len(times) < 2 or rows.shape != (len(times), array.n_channels):
        raise InputError(
            f"times have shape {times.shape} and readings {rows.shape}; array {array.name!r} needs one "
            f"row of {array.n_channels} per time, two at least"
        )
    if not np.isfinite(times).all() or np.any(np.diff(times) <= 0):
        raise InputError("sample times must be finite and increase; drop repeated or reordered samples")
    tables = ChannelTables(array, errors)
    rank = np.linalg.matrix_rank(tables.null_sensitivity[0], tol=1e-9) if tables.n_null else 0
    if rank < least_rank:
        raise GeometryError(
            f"array {array.name!r} sees {rank} of the six products of the rate; this method needs {least_rank}: "
            "use --method filter, or an array with chips out of one plane"
        )
    complete = np.where((np.abs(rows) < errors.limits).all(axis=1, keepdims=True), rows, np.nan)
    alpha = complete @ tables.alpha_rows[0].T
    z = complete @ tables.null_rows[0].T
    rest = np.zeros(len(times), dtype=bool)
    if start_at_rest:
        period = float(np.median(np.diff(times)))
        constant = constant_readings(array, rows, errors.noise_std, period)
        length = len(constant) if constant.all() else int(np.argmin(constant))
        block = RestTest().window(period)
        rest[: length - block if length > block else length] = True  # the last block may be the start of a slow motion
        if rest.any():
            alpha = alpha - alpha[rest].mean(axis=0)
            z = z - z[rest].mean(axis=0)
    return NullReadings(times, alpha, z, tables.null_sensitivity[0], rest)
