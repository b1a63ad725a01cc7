"""The constant error of p, or of the rate, that would explain a position error: the field's figures of merit."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.base.errors import InputError
from gfimu.base.units import STANDARD_GRAVITY

__all__ = ["equivalent_p_bias", "equivalent_rate_drift"]

_DEG_H = math.degrees(1.0) * 3600.0


def equivalent_p_bias(position_error: ArrayLike, time: float) -> NDArray[np.float64]:
    """Compute the constant bias of p that explains a position error of a unit at rest, b = 2 δr / t², m/s².

    Parameters
    ----------
    position_error : array_like
        Position error, m, of any shape.
    time : float
        Time since the start of navigation, s.

    Raises
    ------
    InputError
        If ``time`` is not positive.

    Examples
    --------
    >>> import gfimu
    >>> print(f"{gfimu.equivalent_p_bias(4.5, 30.0):.3f} m/s²")
    0.010 m/s²
    """
    _require_time(time)
    return 2.0 * np.asarray(position_error, dtype=float) / time**2  # GF-IMU paper, eq. 30 without drift


def equivalent_rate_drift(
    position_error: ArrayLike, time: float, *, p_bias: ArrayLike = 0.0, gravity: float = STANDARD_GRAVITY
) -> NDArray[np.float64]:
    """Compute the constant rate error that explains a horizontal position error of a unit at rest, in °/h.

    Parameters
    ----------
    position_error : array_like
        Horizontal position error, m, of any shape.
    time : float
        Time since the start of navigation, s.
    p_bias : array_like
        Known bias of p along the same axis, m/s²; its ½bt² is taken off first.
    gravity : float
        Magnitude of gravity, m/s².

    Returns
    -------
    ndarray
        Drift d with error = ½bt² + g d t³/6, degrees per hour. An error along x stands for a drift about +y, an
        error along y for one about −x.

    Raises
    ------
    InputError
        If ``time`` is not positive.

    Notes
    -----
    The GF-IMU paper's inversion of its eq. 30 on the position error measured after 30 s (about 30 °/h). The result
    is in the field's unit, degrees per hour, as its name for a figure of merit; everything else here is SI.

    Examples
    --------
    >>> import gfimu
    >>> print(f"{gfimu.equivalent_rate_drift(6.4, 30.0):.1f} °/h")
    29.9 °/h
    """
    _require_time(time)
    from_drift = np.asarray(position_error, dtype=float) - 0.5 * np.asarray(p_bias, dtype=float) * time**2
    return from_drift * 6.0 / (gravity * time**3) * _DEG_H


def _require_time(time: float) -> None:
    if not (math.isfinite(time) and time > 0):
        raise InputError(f"time is {time} s; it must be above zero")
