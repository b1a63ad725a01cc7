"""How well a fit agrees with the covariance it was given, and what follows for its standard deviations."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

__all__ = ["covariance_scale", "mean_factor", "odd_poses"]

_SIGNIFICANCE = 1e-3
_ODD_RATIO = 5.0
_CLEAN = 0.7  # prior probability that nothing but noise is in the means
_LOWEST_ORDER = -1.0  # κ of 0.1 widens a standard deviation by 5 %; less does not matter


def covariance_scale(
    variance_factor: float, redundancy: int, learned: float | None = None
) -> tuple[float, tuple[str, ...]]:
    """Factor to apply to a covariance whose rests may have errors that do not average out, and a warning.

    Each mean of a rest has the variance that its samples give it, times 1 + κ: κ is what does not average out (bias
    instability between the rests, temperature, a pose that creeps). The misfit vᵀPv is (1 + κ) times χ² of
    ``redundancy`` degrees of freedom. κ is zero with a probability of 0.7, else of unknown order of magnitude (0.1 to
    ten times what the misfit shows). The factor is the mean of 1 + κ after the data: few degrees of freedom give wider
    standard deviations, as Student's t does, and many hardly touch those of clean data.

    Parameters
    ----------
    variance_factor : float
        vᵀPv / redundancy, on the means of the rests.
    redundancy : int
        Number of surplus conditions.
    learned : float, optional
        Factor learned from more data (the other chips of the recording), used in place of that of these alone.

    Returns
    -------
    factor : float
        Mean of 1 + κ.
    warnings : tuple of str
        Empty, or one sentence where a χ² test at 0.1 % rejects κ = 0.
    """
    if redundancy <= 0 or not math.isfinite(variance_factor):
        return learned or 1.0, ()
    factor = mean_factor(variance_factor, redundancy) if learned is None else learned
    if variance_factor <= chdtri(redundancy, _SIGNIFICANCE) / redundancy:
        return factor, ()
    text = (
        f"the poses disagree with the model {math.sqrt(variance_factor):.1f} times more than their noise explains "
        "(poses that moved, levelling, temperature, or bias instability); standard deviations are scaled up by that"
    )
    return factor, (text,)


def mean_factor(variance_factor: float, redundancy: int, explained: float = 0.0) -> float:
    """Mean of 1 + κ after a misfit of vᵀPv = ``variance_factor`` · ``redundancy``, as in `covariance_scale`.

    Where known errors leave a misfit of ``explained`` · ``redundancy`` by themselves, on average, the misfit is
    (1 + κ + explained) times χ².
    """
    highest = math.log10(max(variance_factor, 1.0)) + 1.0
    kappa = np.concatenate([[0.0], np.logspace(_LOWEST_ORDER, highest, 41)])
    prior = np.concatenate([[_CLEAN], np.full(41, (1.0 - _CLEAN) / 41)])
    expected = 1.0 + kappa + explained
    likelihood = -0.5 * redundancy * (np.log(expected) + variance_factor / expected)
    weight = prior * np.exp(likelihood - likelihood.max())
    return float(weight @ (1.0 + kappa) / weight.sum())


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
