"""How well a fit agrees with the covariance it was given, and what follows for its standard deviations."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

__all__ = ["covariance_scale", "odd_poses"]

_SIGNIFICANCE = 1e-3
_ODD_RATIO = 5.0


def covariance_scale(variance_factor: float, redundancy: int) -> tuple[float, tuple[str, ...]]:
    """Factor to apply to a covariance after the global model test, and the warning that goes with it.

    The covariance given for the observations is believed unless the chi-squared test of vᵀPv rejects it at 0.1 %;
    then all covariances are multiplied by the variance factor.

    Parameters
    ----------
    variance_factor : float
        vᵀPv / redundancy.
    redundancy : int
        Number of surplus conditions.

    Returns
    -------
    factor : float
        1, or the variance factor.
    warnings : tuple of str
        Empty, or one sentence.
    """
    if redundancy <= 0 or not math.isfinite(variance_factor):
        return 1.0, ()
    if variance_factor <= chdtri(redundancy, _SIGNIFICANCE) / redundancy:
        return 1.0, ()
    text = (
        f"the poses disagree with the model {math.sqrt(variance_factor):.1f} times more than their noise explains "
        "(poses that moved, levelling, temperature, or non-linearity); standard deviations are scaled up by that"
    )
    return variance_factor, (text,)


def odd_poses(misfit: NDArray[np.float64], start_s: NDArray[np.float64]) -> tuple[str, ...]:
    """Name the poses whose weighted misfit is more than five times the median one, such as early ones of a warm-up.

    Parameters
    ----------
    misfit : ndarray, shape (p,)
        Weighted square of each pose's conditions, per condition.
    start_s : ndarray, shape (p,)
        Time at which each pose starts, s.
    """
    odd = np.flatnonzero(misfit > max(_ODD_RATIO * float(np.median(misfit)), _ODD_RATIO))
    if not len(odd):
        return ()
    places = ", ".join(f"{number + 1} ({start_s[number]:.1f} s)" for number in odd)
    return (f"poses that fit far worse than the others: {places}; warm-up or a disturbance, better left out",)
