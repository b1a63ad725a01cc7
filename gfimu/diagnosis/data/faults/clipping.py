"""Clipping: one limit at which the readings of all channels end, unless single channels have rails of their own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gfimu.base.difference_noise import difference_noise
from gfimu.diagnosis.data.faults.rails import PILE, Rail, find_rails
from gfimu.diagnosis.data.run import Run
from gfimu.recording.policy import SamplePolicy

__all__ = ["clipping_level", "own_rails"]

_CAUGHT = 0.8  # of the samples that should be beyond a limit
_SURELY_MISSING = 15.0  # samples above the largest value of several channels, of which none is there
_ONE_CHIP = 3  # channels that may read more than a limit


def clipping_level(
    run: Run, prediction: NDArray[np.float64], steps: NDArray[np.float64], white: NDArray[np.float64]
) -> float | None:
    """Return the level at which readings pile up, m/s²; step and white noise per channel (c,)."""
    levels, piles = [], []
    lacking: list[tuple[float, float]] = []
    for channel, (quantum, sigma) in enumerate(zip(steps, white, strict=True)):
        mine = run.readings[run.valid[:, channel], channel]
        if len(mine) < 50 or np.ptp(mine) < 2 * quantum:
            continue  # a channel that holds one value is dead, not clipped
        noise = min(sigma, difference_noise(mine))
        for sign in (1.0, -1.0):
            top = float((sign * mine).max())
            if top <= 0.0:
                continue  # the other sign's extreme
            at_top = np.abs(sign * mine - top) < 0.3 * quantum
            below = np.abs(sign * mine - (top - quantum)) < 0.3 * quantum
            # Coarse rounding shows the top for anything within half a step of it.
            clear = max(1.5 * sigma, 0.5 * quantum + sigma)
            beyond = sign * prediction[run.valid[:, channel], channel] > top + clear
            # Nothing beyond it is read though it should be, even where a plateau is just below.
            caught = sigma > 0.5 * quantum and (beyond & at_top).sum() > max(_CAUGHT * beyond.sum(), PILE)
            if sigma > 0.5 * quantum:
                lacking.append((top, _missing_above(int(at_top.sum()), int(below.sum()), noise / quantum)))
            if at_top.sum() < 8 or not (caught or at_top.sum() > 3 * below.sum() + 4):
                continue
            if caught or (beyond & at_top).sum() > 0.5 * at_top.sum():
                levels.append(top)
            elif at_top.sum() >= PILE and sigma > 0.5 * quantum:
                piles.append(top)  # a steady signal at the limit: its noise would go beyond
    levels = levels or (piles if len(piles) > 1 else []) or _cut_off(lacking, float(steps.min()))
    if not levels:
        return None
    limit = float(np.median(levels))
    close = np.abs(np.array(levels) - limit) < 1.5 * float(steps.min())
    beyond_it = np.abs(np.where(run.valid, run.readings, 0.0)) > limit + np.maximum(0.6 * steps, 4.0 * white)
    # One chip in another range may read more, and single samples may be garbage.
    contradicted = np.sum(beyond_it.sum(axis=0) > SamplePolicy.garbage) > _ONE_CHIP
    return limit if close.sum() >= max(1, len(levels) // 2) and not contradicted else None


def own_rails(
    run: Run,
    prediction: NDArray[np.float64],
    limit: float | None,
    steps: NDArray[np.float64],
    white: NDArray[np.float64],
) -> list[Rail]:
    """Return the rails of channels that clip otherwise than at one limit for all of them, above and below alike."""
    rails = find_rails(run, prediction, steps, white)
    if limit is None or not rails:
        return rails
    other = any(abs(abs(rail.level) - limit) > 1.5 * steps[rail.channel] for rail in rails)
    beyond = np.abs(np.where(run.valid, run.readings, 0.0)) > limit + np.maximum(0.6 * steps, 4.0 * white)
    return rails if other or (beyond.sum(axis=0) > SamplePolicy.garbage).any() else []


def _cut_off(lacking: Sequence[tuple[float, float]], step: float) -> list[float]:
    """Return the largest values of channels that end at one level, above which many samples are missing in all."""
    tops, missing = np.array(lacking).reshape(-1, 2).T
    for top in np.unique(tops):
        here = np.abs(tops - top) < 0.6 * step
        if here.sum() > 1 and missing[here].sum() > _SURELY_MISSING:
            return [float(one) for one in tops[here]]
    return []


def _missing_above(at_top: int, below: int, noise: float) -> float:
    """Return how many samples are missing above the largest value, at least.

    What is read is the signal plus Gaussian noise of σ steps, whatever the signal. The density of any such sum, over
    the Gaussian's own, is log-convex, so the counts of three neighbouring steps keep n₊ n₋ ≥ n₀² exp(−1/σ²).
    """
    if noise <= 0.0:
        return 0.0
    fewest, most = max(at_top - 2.0 * at_top**0.5, 0.0), below + 2.0 * below**0.5 + 1.0
    return float(fewest**2 / most * np.exp(-1.0 / noise**2))
