"""How the angular rate changes from block to block and within each, by the samples of α."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gfimu.rate.health.recursion.blocks import Blocks
from gfimu.rate.health.recursion.prediction import omega_products

__all__ = ["turning_of"]


def turning_of(
    blocks: Blocks, rows: slice, alpha_rows: NDArray[np.float64], sets: NDArray[np.int64], period: float
) -> NDArray[np.float64]:
    """Return what the samples of α say of each block's rotation, shape (m, 15).

    Parameters
    ----------
    blocks : Blocks
        The blocks.
    rows : slice
        Those to use, m of them.
    alpha_rows : ndarray, shape (sets, 3, c)
        A of each set of channels.
    sets : ndarray of int, shape (m,) or (m + 1,)
        The set of each block; of the block before the first one too, where there is one.
    period : float
        Sample period, s.

    Returns
    -------
    ndarray, shape (m, 15)
        Mean α from the middle of the block before to that of this one, rad/s²; the mean of δ, the rate less that in the
        middle of the block, rad/s; the mean of δδ less the products of that mean, xx, yy, zz, xy, xz, yz, (rad/s)²; and
        the mean of δ τ, rad, with the time τ from the middle. A first block without another before it, and a block of
        another set than the one before, have the mean α up to the middle. Biases of α are in it, and what remains of
        products of ω in the α of a set without redundancy for them.
    """
    samples = blocks.samples
    before = 1 if rows.start else 0
    part = blocks.readings[rows.start - before : rows.stop]
    places = sets if len(sets) == len(part) else np.concatenate([sets[:1], sets])
    alpha = np.empty((len(part), samples, 3))
    for place in np.unique(places):
        chosen = places == place
        alpha[chosen] = part[chosen] @ alpha_rows[place].T
    early, late, inside = _weights(samples)
    halves = np.tensordot(alpha, np.stack([early, late]), axes=(1, 1))  # (m + before, 3, 2)
    between = halves[..., 0].copy()  # mean of the first half
    alike = np.flatnonzero(np.diff(places) == 0) + 1
    between[alike] = 0.5 * (between[alike] + halves[alike - 1, :, 1])
    delta = period * (inside @ alpha)  # (m + before, B, 3)
    mean = delta.mean(axis=1)
    spread = omega_products(delta.reshape(-1, 3)).reshape(-1, samples, 6).mean(axis=1) - omega_products(mean)
    place = period * (np.arange(samples) - 0.5 * (samples - 1))
    return np.column_stack([between, mean, spread, place @ delta / samples])[before:]


@lru_cache(maxsize=16)
def _weights(samples: int) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the weights (B,) of the means over each half of a block, and the integral (B, B) from its middle, samples.

    Each sample of α holds from half a period before it to half a period behind.
    """
    early = np.clip(0.5 * samples - np.arange(samples), 0.0, 1.0)
    to_sample = np.tri(samples, k=-1) + 0.5 * np.eye(samples)
    return early * 2.0 / samples, early[::-1] * 2.0 / samples, to_sample - early
