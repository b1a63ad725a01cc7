"""How a run starts: at rest, in a steady spin, or in a motion, as its first readings show.

A still first block is rest or a steady spin. With the mean null space z̄ of N samples and the biases' covariance B,
z̄ᵀ(B + 1/N)⁻¹z̄ is χ² at rest, and a rate of its own lowers it. The odds of the two follow by Laplace's approximation
with a prior of the rate; the start is the more probable one. A start that moves, or spins, has a rate but for its sign.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from gfimu.array.array import AccelerometerArray
from gfimu.array.kinematics import omega_products
from gfimu.base.short_repr import short_repr
from gfimu.rate.bounds.sample import omega_products_jacobian
from gfimu.rate.channel_sets import ChannelSets
from gfimu.rate.maximum_likelihood import rate_of_null_space
from gfimu.rate.rest_test import RestTest
from gfimu.rate.sensing import SensorErrors

__all__ = ["Start", "StartPolicy", "infer_start", "start_of_still"]


_LARGEST_FALL = 700.0  # numerical: exp of half of it is no infinity


@dataclass(frozen=True)
class StartPolicy:
    """Numbers of the start.

    Parameters
    ----------
    usual_rate : float
        Standard deviation of the rate of a spinning start, per axis, rad/s: a turntable's.
    spinning : float
        Probability that a still start is a spin, before the readings are seen.
    contradiction : float
        Probability at which biases as stated are contradicted.
    """

    usual_rate: float = 5.0
    spinning: float = 0.05
    contradiction: float = 1e-5


@dataclass(frozen=True)
class Start:
    """How a run starts.

    Parameters
    ----------
    kind : {"rest", "spin", "motion", "given"}
        ``motion``: the first block is not still. ``given``: the rate was stated.
    omega : ndarray, shape (3,)
        Rate at the first sample, rad/s, but for its sign with ``spin`` and ``motion``.
    std : ndarray, shape (3,)
        Standard deviation to start a filter with, rad/s: wide, as the null space is measured again from there.
    covariance : ndarray, shape (3, 3)
        Covariance of ``omega`` by the first readings, but for its sign, (rad/s)².
    rest_probability : float
        Probability of rest against a steady spin; 0 where the start is not still, NaN where the array can't tell.
    least_spin : float
        Rate below which a steady spin reads like rest with biases, rad/s.
    bias_factor : float
        By how much the variances of the biases are larger than stated, because no rate explains the first readings
        with them; 1 where they are as stated.
    """

    kind: str
    omega: NDArray[np.float64]
    std: NDArray[np.float64]
    covariance: NDArray[np.float64]
    rest_probability: float = np.nan
    least_spin: float = np.inf
    bias_factor: float = 1.0

    __repr__ = short_repr

    def to_dict(self) -> dict[str, Any]:
        """Return what was inferred, as JSON can hold it."""
        finite = {"rest_probability": self.rest_probability, "least_spin_rad_s": self.least_spin}
        known = {name: value if np.isfinite(value) else None for name, value in finite.items()}
        return {"kind": self.kind, **known, "bias_factor": self.bias_factor}

    @property
    def sign_open(self) -> bool:
        """Whether ω and −ω are equally probable."""
        return self.kind in ("spin", "motion")


def infer_start(
    sets: ChannelSets,
    z: NDArray[np.float64],
    bias_covariance: NDArray[np.float64],
    *,
    still: bool,
    rest_std: float,
    policy: StartPolicy = StartPolicy(),
) -> Start:
    """Infer the start from the first block.

    Parameters
    ----------
    sets : ChannelSets
        The array.
    z : ndarray, shape (k, m)
        Null space of the complete samples of the first block, in units of its noise.
    bias_covariance : ndarray, shape (m, m)
        Covariance of its biases.
    still : bool
        Whether the block is still.
    rest_std : float
        Standard deviation of the rate at rest, rad/s.
    policy : StartPolicy, optional
        Thresholds.
    """
    sensitivity = sets.full.sensitivity
    rest = Start("rest", np.zeros(3), np.full(3, rest_std), rest_std**2 * np.eye(3))
    sees = np.linalg.matrix_rank(sensitivity, tol=1e-9) >= 3
    if not sees or len(z) == 0:
        usual = np.full(3, policy.usual_rate)
        return rest if still or not sees else Start("motion", np.zeros(3), usual, np.diag(usual**2))
    shown = z if still else z[:1]
    factor = 1.0
    for _ in range(2):  # again, where no rate explains still readings with the biases as stated
        spread = factor * bias_covariance + np.eye(len(sensitivity)) / len(shown)
        white = np.linalg.inv(np.linalg.cholesky(spread))
        mean, slope = white @ shown.mean(axis=0), np.ascontiguousarray(white @ sensitivity)
        omega = rate_of_null_space(mean, slope)
        residual = mean - slope @ omega_products(omega)
        freedom = len(sensitivity) - 3
        if still and freedom and residual @ residual > chdtri(freedom, policy.contradiction):
            factor *= float(residual @ residual) / freedom
    squares = sets.full.inverse @ spread @ sets.full.inverse.T
    least = np.sqrt(2.0 * np.sqrt(np.diag(squares)[:3]))  # (3,) rad/s, of which the square is two deviations
    std = np.sqrt(omega @ omega / 9.0 + least**2)  # (3,)
    curvature = slope @ omega_products_jacobian(omega)
    covariance = np.asarray(np.linalg.inv(curvature.T @ curvature + np.eye(3) / policy.usual_rate**2), dtype=float)
    if not still:
        return Start("motion", omega, std, covariance, 0.0, bias_factor=factor)
    fall = float(mean @ mean - residual @ residual)
    shrunk = 2.0 * np.sqrt(np.linalg.det(covariance / policy.usual_rate**2))  # posterior over prior volume, both signs
    odds = policy.spinning / (1.0 - policy.spinning) * shrunk * np.exp(0.5 * min(fall, _LARGEST_FALL))
    probability = 1.0 / (1.0 + odds)
    inferred = rest if probability > 0.5 else Start("spin", omega, std, covariance)
    return replace(inferred, rest_probability=float(probability), least_spin=float(least.max()), bias_factor=factor)


def start_of_still(array: AccelerometerArray, readings: NDArray[np.float64], errors: SensorErrors) -> Start:
    """Infer whether still readings (k, c), m/s², are rest or a steady spin."""
    sets = ChannelSets(array, errors.noise_std)
    complete = readings[(np.abs(readings) < errors.limits).all(axis=1)]
    prior = sets.bias_covariance(np.diag(errors.bias_std**2))
    rest_std = RestTest().rate_std
    return infer_start(sets, complete @ sets.full.product_rows.T, prior[3:, 3:], still=True, rest_std=rest_std)
