"""The recursion of the monitor of channels: an extended Kalman filter and the signatures of faults in it.

State x = [ω (3); b (c)], ω in the middle of a block and b the biases of the channels. From the middle of one block to
that of the next, T later,

    ω ← ω + T (A (ȳ_m − b) − L s(ω)),      ȳ_m the mean of the samples between                           (1)

and the null space of the block's mean readings ȳ is the measurement, in whitened rows j,

    z_j = Z_j (ȳ − b) = M_j ⟨s(ω)⟩ + noise of variance 1/B,                                              (2)

with B the samples of a block and ⟨s⟩ the mean of the products of ω over it. By what ω does within the block, δ, which
the samples of α show (`gfimu.integrity.recursion.turning`), ⟨s(ω)⟩ = s(ω + ⟨δ⟩) + ⟨δδ⟩ − s(⟨δ⟩).

A constant fault of one unit on channel i from block k₀ on makes the state wrong by column i of G and the innovations
by h (Willsky and Jones, IEEE Trans. Automatic Control 21, 1976):

    G_ω ← Φ_ω G_ω + T A (e − G_b)      (half of the first block lies behind the onset)
    h = Z − H G,   G ← G + K h,   C ← C + hᵀ S⁻¹ h,   d ← d + hᵀ S⁻¹ ν                                   (3)

C is the information on faults of all channels at once, shape (c, c), and d the score: a set S of channels with that
onset has the most likely sizes f = C_SS⁻¹ d_S and explains T_S = d_Sᵀ f of the sum of squared innovations.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.integrity.recursion.prediction import omega_products
from gfimu.integrity.recursion.signatures import carry_signatures, new_slot, strongest_slot
from gfimu.integrity.recursion.state import MonitorState, MonitorTables, MonitorTuning, Steps

__all__ = ["advance", "model_errors"]

_TINY = 1e-14  # numerical: least variance kept on the diagonal of the covariance


def advance(
    tables: MonitorTables,
    tuning: MonitorTuning,
    state: MonitorState,
    steps: Steps,
    watched: NDArray[np.bool_],
    out: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    base: int,
) -> tuple[int, int]:
    """Take n blocks; stop behind one in which a fault is seen.

    Parameters
    ----------
    tables, tuning, state
        Matrices, numbers that stay the same, and what is carried on.
    steps : Steps
        The n blocks.
    watched : ndarray of bool, shape (c,)
        Channels in use.
    out : tuple of ndarray, shapes (n, 3), (n, 3) and (n,)
        Filled with ω and its standard deviation, rad/s, and the normalised innovation squared.
    base : int
        Number of the first of the n blocks since the start of the run.

    Returns
    -------
    tuple of (int, int)
        The next block, and the slot of the fault; −1 if none was seen.
    """
    omega, std, nis = out
    pending = 0.0
    for k, (mean, turning, place, level) in enumerate(
        zip(steps.means, steps.turning, steps.sets, steps.levels, strict=True)
    ):
        state.keep(base + k)
        _follow_range(state, mean, tuning.forget)
        step = float(steps.since[k]) + pending
        if tables.null_count[place] < 0:  # too few channels: a gap
            pending = step
            omega[k], std[k] = state.omega, np.inf
            state.ages[:] = 0.0
            continue
        pending = 0.0
        if not state.started[0]:  # from the first sample to the middle of the first block
            state.last[:] = mean
            step = 0.5 * tuning.period * (1.0 - 1.0 / tuning.samples)
        transition = _predict(tables, tuning, state, mean, turning, step=step, place=place, level=level)
        if step > 1.5 * tuning.period:
            state.ages[:] = 0.0
        if tuning.follow:
            new_slot(state, tuning.oldest)
            carry_signatures(state, transition, step * tables.alpha[place])
        nis[k] = _update(tables, state, mean, turning, place=place, noise=level / tuning.samples)
        omega[k] = state.omega
        std[k] = np.sqrt(np.maximum(state.covariance.diagonal()[:3], 0.0))
        state.last[:] = mean
        state.started[0] = True
        if tuning.follow and np.isfinite(tuning.threshold):
            slot = strongest_slot(state, tuning, model_errors(state, tuning), watched)
            if slot >= 0:
                return k + 1, slot
    return len(steps.means), -1


def model_errors(state: MonitorState, tuning: MonitorTuning) -> NDArray[np.float64]:
    """Return how large a constant fault the errors of gain, axes and position resemble on each channel, (c,), m/s²."""
    gain = tuning.range_share * tuning.scale_std * (state.high - state.low)
    place = tuning.placement_std * float(state.omega @ state.omega)
    return np.asarray(np.sqrt(gain**2 + place**2 + tuning.floor**2))


def _follow_range(state: MonitorState, mean: NDArray[np.float64], forget: float) -> None:
    """Follow the range of each channel's readings, with a memory."""
    if not state.started[0]:
        state.low[:] = state.high[:] = mean
    state.low[:] = np.minimum(mean, state.low + forget * (mean - state.low))
    state.high[:] = np.maximum(mean, state.high + forget * (mean - state.high))


def _slopes(rows: NDArray[np.float64], omega: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the derivative, shape (d, 3), of ``rows`` (d, 6) s(ω) by ω."""
    x, y, z = omega
    products = np.array([[2 * x, 0, 0], [0, 2 * y, 0], [0, 0, 2 * z], [y, x, 0], [z, 0, x], [0, z, y]])
    return np.asarray(rows @ products)


def _predict(
    tables: MonitorTables,
    tuning: MonitorTuning,
    state: MonitorState,
    mean: NDArray[np.float64],
    turning: NDArray[np.float64],
    *,
    step: float,
    place: int,
    level: float,
) -> NDArray[np.float64]:
    """Carry state and covariance over to the next block, (1); returns Φ_ω, shape (3, 3)."""
    gain, leak = step * tables.alpha[place], tables.leak[place]
    alpha = turning[:3] - tables.alpha[place] @ state.bias
    transition = np.eye(3)
    if leak.any():  # products of ω remain in α: implicit midpoint
        middle = state.omega
        for _ in range(3):
            middle = state.omega + 0.5 * step * (alpha - leak @ omega_products(middle))
        alpha = alpha - leak @ omega_products(middle)
        transition -= step * _slopes(leak, middle)
    state.omega[:] += step * alpha
    p = state.covariance
    rows = transition @ p[:3] - gain @ p[3:]  # of F P, F = [Φ_ω, −T A; 0, 1]; (3, 3 + c)
    block = rows[:, :3] @ transition.T - rows[:, 3:] @ gain.T + level * step**2 / tuning.samples * tables.noise[place]
    p[:3, :3] = 0.5 * (block + block.T)  # an asymmetry would grow
    p[:3, 3:] = rows[:, 3:]
    p[3:, :3] = rows[:, 3:].T
    growth = np.empty(len(p))
    gap = step > 1.5 * tuning.period  # over which α is unknown but for its size
    growth[:3] = (alpha @ alpha + 1.0) * step**2 if gap else 0.0
    growth[3:] = tuning.walk * step
    growth[3:] += 0.5 * tuning.scale_std**2 * np.abs(mean - state.last) * (state.high - state.low)
    p.reshape(-1)[:: len(p) + 1] += growth  # the diagonal
    return transition


def _update(
    tables: MonitorTables,
    state: MonitorState,
    mean: NDArray[np.float64],
    turning: NDArray[np.float64],
    *,
    place: int,
    noise: float,
) -> float:
    """Measure the null space, (2), with all signatures, (3); returns the normalised innovation squared.

    With S = L Lᵀ, H P and the innovations are whitened by L⁻¹, so that all updates are products.
    """
    rows = int(tables.null_count[place])
    null, sensitivity = tables.null[place, :rows], tables.sensitivity[place, :rows]
    p = state.covariance
    average = state.omega + turning[3:6]  # ω over the block
    innovation = null @ (mean - state.bias) - sensitivity @ (omega_products(average) + turning[6:])  # (d,)
    h = np.concatenate([_slopes(sensitivity, average), null], axis=1)  # (d, 3 + c)
    hp = h @ p
    white = np.linalg.inv(np.linalg.cholesky(hp @ h.T + noise * np.eye(rows)))  # (d, d)
    pull, gain = white @ innovation, white @ hp  # (d,), (d, 3 + c)
    change = pull @ gain
    state.omega[:] += change[:3]
    state.bias[:] += change[3:]
    p -= gain.T @ gain
    diagonal = p.reshape(-1)[:: len(p) + 1]
    np.maximum(diagonal, _TINY, out=diagonal)
    used = np.count_nonzero(state.ages)
    if used:
        seen = white @ (null - h @ state.signature[:used])  # (s, d, c)
        state.signature[:used] += gain.T @ seen
        state.information[:used] += seen.transpose(0, 2, 1) @ seen
        state.score[:used] += pull @ seen
    return float(pull @ pull)
