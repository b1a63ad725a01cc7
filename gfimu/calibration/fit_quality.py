"""How well a fit agrees with the covariance it was given, and what follows for its standard deviations."""

from __future__ import annotations

import math

from scipy.special import chdtri

__all__ = ["covariance_scale"]

_SIGNIFICANCE = 1e-3


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
