"""Position error after a time at rest as a weighted trace of the covariance of [alpha; p].

The covariance of the position is linear in the covariance C of [alpha; p] for channels of unit variance, so its trace
is tr(W C) with one matrix W for every array: what a search of arrays for least drift needs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.base.units import STANDARD_GRAVITY
from gfimu.budget.drift.closed_forms import ErrorSources, position_from_bias, position_from_impulse

__all__ = ["drift_weight"]


def drift_weight(time: float, sources: ErrorSources) -> NDArray[np.float64]:
    """Return W, shape (6, 6): tr(W C) is the sum of the three variances of the position of a unit at rest, m².

    First order, without the mean fall by tilt and without the drift of a rate from elsewhere, which no array changes.

    Parameters
    ----------
    time : float
        Time since the start of navigation, s.
    sources : ErrorSources
        Errors of the channels: bias, noise density and random walk of the bias.
    """
    nodes, weights = np.polynomial.legendre.leggauss(8)  # exact for the polynomials at rest, up to t⁸ (degree 15)
    tau, width = 0.5 * time * (nodes + 1.0), 0.5 * time * weights
    constant = position_from_bias(time, 0.0, 0j, STANDARD_GRAVITY)  # (3, 6)
    impulse, step = (
        of(tau, 0.0, 0j, STANDARD_GRAVITY) for of in (position_from_impulse, position_from_bias)
    )  # (m, 3, 6)
    white = np.einsum("m,mij,mik->jk", width, impulse, impulse)
    walking = np.einsum("m,mij,mik->jk", width, step, step)
    return np.asarray(
        sources.bias**2 * constant.T @ constant
        + 0.5 * sources.noise_density**2 * white  # two-sided: variance per channel = density² · sample rate / 2
        + sources.bias_random_walk**2 * walking
    )
