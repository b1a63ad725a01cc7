"""What the values of a calibration and their covariance have to be: finite, symmetric, positive semi-definite."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.base.units import LARGEST

__all__ = ["require_covariance", "require_finite"]

_ROUNDING = 1e-6
"""Numerical tolerance of the covariance check, as a correlation: asymmetry, and how far below zero an eigenvalue is."""


def require_finite(names: tuple[str, ...], values: NDArray[np.float64]) -> None:
    """Refuse values that are NaN or beyond what can be computed with; the message names the first parameter."""
    bad = np.flatnonzero(~(np.abs(values) <= LARGEST))
    if bad.size:
        raise InputError(f"parameter {names[bad[0]]} is {values[bad[0]]}; calibrate again, with more poses")


def require_covariance(names: tuple[str, ...], covariance: NDArray[np.float64]) -> None:
    """Refuse a matrix that is no covariance: not finite, not symmetric, or not positive semi-definite.

    All three are judged on the correlations, because the parameters have different units and sizes.
    """
    remedy = "calibrate again, with more poses"
    row, column = (int(place[0]) if len(place) else -1 for place in np.nonzero(~(np.abs(covariance) <= LARGEST**2)))
    if row >= 0:
        raise InputError(f"the covariance of {names[row]} and {names[column]} is {covariance[row, column]}; {remedy}")
    variance = np.diag(covariance)
    if (variance < 0.0).any():
        worst = int(np.argmin(variance))
        raise InputError(f"the variance of {names[worst]} is negative ({variance[worst]:.3g}); {remedy}")
    std = np.sqrt(variance)
    unit = np.where(std > 0.0, std, 1.0)
    correlation = covariance / np.outer(unit, unit)
    apart = np.abs(correlation - correlation.T)
    if apart.max(initial=0.0) > _ROUNDING:
        row, column = divmod(int(np.argmax(apart)), len(names))
        raise InputError(f"the covariance matrix is not symmetric at {names[row]} and {names[column]}; {remedy}")
    least = float(np.linalg.eigvalsh(correlation).min(initial=0.0))
    if least < -_ROUNDING * len(names):
        raise InputError(f"the covariance matrix is not positive semi-definite (eigenvalue {least:.3g}); {remedy}")
