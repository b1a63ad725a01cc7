"""How small errors of the readings run through the estimate: linear maps from channel errors to α, ω and position.

The estimate is that of ``gfimu estimate --method integrate``: [α; p] = G a − Λ s(ω), ω by integration of α, attitude
by integration of ω from a levelled start, position by two integrations of R p less gravity. With u = G δa, small
errors obey

  δω̇ = u_α − Λ_α S δω,  φ̇ = R δω,  δv̇ = R (u_p − Λ_p S δω) + φ × R p,  δṙ = δv,

where S = ∂s/∂ω, R turns body into world axes and φ is the attitude error, world axes. Their end values are weighted
sums of u over the samples; the weights are the adjoint solution, integrated backwards from the end. A levelled start
adds φ(0), by which the mean error of p over the first second turns what is taken for up.

Beside it stands the rate from the null space of each sample, Z a = M s(ω) + noise: δω = (M S)⁺ Z δa.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.array.integration import integrate_samples
from gfimu.array.linear_solution import linear_solution
from gfimu.array.parts.part import white_noise_std
from gfimu.base.short_repr import short_repr
from gfimu.budget.tolerances.known_motion import KnownMotion, cross_matrix
from gfimu.motion.attitude import to_rotation
from gfimu.motion.navigation import level
from gfimu.rate.bounds.sample import omega_products_jacobian
from gfimu.rate.channel_sets import ChannelSets

__all__ = ["ErrorMaps", "error_maps", "null_space_maps", "null_space_of"]

Floats = NDArray[np.float64]

_COMB = 8  # numerical: samples between those that are set in one probe of a quadrature; its stencils are shorter
_LEVEL_STEP = 1e-6  # numerical: of the derivative of levelling, relative to gravity
_DETERMINED = 1e-6  # numerical: least singular value over the largest of M S


@dataclass(frozen=True)
class ErrorMaps:
    """Linear maps from errors of the readings to errors of the estimate.

    Parameters
    ----------
    end : ndarray, shape (n, 9, c)
        Weight of the error of each reading in [δω; φ; δr] at the last sample: the sum over samples and channels.
    alpha : ndarray, shape (3, c)
        Error of α per error of the readings of the same sample.
    feedback : ndarray, shape (n, 3, 3)
        Λ_α S: error of α per error of ω, with the sign changed; zero where α is free of ω².
    rate : ndarray, shape (k, 3, c), or None
        Error of ω from the null space at the samples that turn; None where the null space does not determine ω.
    """

    end: Floats
    alpha: Floats
    feedback: Floats
    rate: Floats | None

    __repr__ = short_repr


def error_maps(array: AccelerometerArray, motion: KnownMotion) -> ErrorMaps:
    """Linearise the estimate of an array about a motion.

    Raises
    ------
    GeometryError
        If the array can't see all six motions.
    """
    c = array.n_channels
    solution = linear_solution(array, np.eye(c), np.ones(c))
    inverse, leakage = solution.motion.T, solution.leakage[0]  # (6, c), (6, 6)
    slope = omega_products_jacobian(motion.omega)  # (n, 6, 3)
    feedback, of_p = leakage[:3] @ slope, leakage[3:] @ slope  # (n, 3, 3)
    flow, inputs = _dynamics(motion, feedback, of_p)
    weights = _adjoint(flow, motion.step)  # (n, 9, 12)
    quadrature = _quadrature(motion.t, "trapezoid" if feedback.any() else "runge_kutta")
    by_motion = quadrature[:, None, None] * (weights @ inputs)  # (n, 9, 6)
    count = motion.levelled
    if count:
        per_mean = weights[0][:, 3:6] @ _levelling(motion, count)  # (9, 3)
        by_motion[:count, :, 3:] += per_mean / count
        # The estimate turns each p back by what it takes for turning meanwhile: the mean over these samples of ∬ u_α.
        later = np.arange(count)[::-1]  # samples after this one
        turned = quadrature[:count] * later * (later + 1) * motion.step / (2.0 * count)
        by_motion[:count, :, :3] -= turned[:, None, None] * (per_mean @ cross_matrix(motion.p[0]))
    return ErrorMaps(by_motion @ inverse, inverse[:3], feedback, null_space_maps(array, motion))


def null_space_maps(array: AccelerometerArray, motion: KnownMotion) -> Floats | None:
    """Return (M S)⁺ Z at the samples that turn, shape (k, 3, c); None where that does not determine ω."""
    rows, sensitivity = null_space_of(array, motion)
    turning = motion.turning
    if len(rows) < 3 or not turning.any():
        return None
    slope = sensitivity @ omega_products_jacobian(motion.omega[turning])  # (k, d, 3)
    strengths = np.linalg.svd(slope, compute_uv=False)
    if np.any(strengths[:, -1] < _DETERMINED * strengths[:, 0]):
        return None
    return np.asarray(np.linalg.pinv(slope) @ rows)


def null_space_of(array: AccelerometerArray, motion: KnownMotion) -> tuple[Floats, Floats]:
    """Return Z, shape (d, c), and M, shape (d, 6), whitened with the data sheets' noise as the estimators have it."""
    full = ChannelSets(array, white_noise_std(array, 1.0 / motion.step)).full
    return full.null_rows, full.null_sensitivity


def _dynamics(motion: KnownMotion, feedback: Floats, of_p: Floats) -> tuple[Floats, Floats]:
    """Return the matrices of the error state [δω; φ; δv; δr], (n, 12, 12), and of its input [u_α; u_p], (n, 12, 6)."""
    n = len(motion)
    force = np.einsum("nij,nj->ni", motion.rotation, motion.p)  # world axes
    flow = np.zeros((n, 12, 12))
    flow[:, 0:3, 0:3] = -feedback
    flow[:, 3:6, 0:3] = motion.rotation
    flow[:, 6:9, 0:3] = -motion.rotation @ of_p
    flow[:, 6:9, 3:6] = -cross_matrix(force)  # φ × f = −f × φ
    flow[:, 9:12, 6:9] = np.eye(3)
    inputs = np.zeros((n, 12, 6))
    inputs[:, 0:3, 0:3] = np.eye(3)
    inputs[:, 6:9, 3:6] = motion.rotation
    return flow, inputs


def _adjoint(flow: Floats, step: float) -> Floats:
    """Return the sensitivity of [δω; φ; δr] at the end to the state at each sample, shape (n, 9, 12)."""
    middle = 0.5 * step * (flow[1:] + flow[:-1])
    square = middle @ middle
    transition = np.eye(12) + middle + square / 2.0 + square @ middle / 6.0 + square @ square / 24.0
    weights = np.zeros((len(flow), 9, 12))
    weights[-1, :6, :6], weights[-1, 6:, 9:] = np.eye(6), np.eye(3)
    for place in range(len(flow) - 2, -1, -1):
        weights[place] = weights[place + 1] @ transition[place]
    return weights


def _quadrature(t: Floats, method: str) -> Floats:
    """Return the weight of each sample in the integral from the first to the last, s, shape (n,).

    Probed through the integration that the estimate uses. Those of ``runge_kutta`` alternate: even ones would give the
    integral of white noise a tenth less variance. Where ω feeds back on α they are even (`gfimu.rate.feedback`).
    """
    n = len(t)
    samples = np.arange(n)
    probes = (samples[:, None] % _COMB == np.arange(_COMB)).astype(float)
    parts = np.diff(integrate_samples(t, probes, method=method), axis=0)  # (n − 1, comb)
    weights = np.zeros(n)
    for comb in range(_COMB):
        nearest = np.rint((samples[:-1] + 0.5 - comb) / _COMB).astype(int) * _COMB + comb
        inside = (nearest >= 0) & (nearest < n)
        np.add.at(weights, nearest[inside], parts[inside, comb])
    return weights


def _levelling(motion: KnownMotion, count: int) -> Floats:
    """Return the attitude error at the start per error of the mean of p, body axes, shape (3, 3), rad s²/m."""
    mean = motion.p[:count].mean(axis=0)
    up = to_rotation(level(mean))
    to_world = Rotation.from_matrix(motion.rotation[0]) * up.inv()  # levelling takes heading zero
    step = _LEVEL_STEP * motion.gravity
    columns = [to_world.apply((to_rotation(level(mean + step * unit)) * up.inv()).as_rotvec()) for unit in np.eye(3)]
    return np.array(columns).T / step
