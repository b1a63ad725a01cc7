"""Whether the noise of a fit's residual changes with the motion or with time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import gammaln
from scipy.stats import chi2

from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.free_time import FreeTime
from gfimu.diagnosis.terms.observed import Observed
from gfimu.model.world_model import SpinState

__all__ = ["NOTHING", "SLOWEST_LINE", "LackOfFit", "changing_noise"]

SLOWEST_LINE = 1.0  # numerical: Hz; below it slow noise and the drive are free
_PARTS = 6  # numerical: into which samples are ordered for their noise
_FEWEST_DIFFERENCES = 200  # numerical: in each of them


@dataclass(frozen=True)
class LackOfFit:
    """The strongest term that a fit does not explain.

    Parameters
    ----------
    log_odds : float
        Log odds against chance, all that was looked at accounted for.
    signature : str
        Channels and dependence, in words.
    free : tuple of FreeTime
        Places of an error that is free in time, where it is one, best first.
    noise_odds : float
        Log odds of noise that grows with the motion, which speaks against no cause.
    """

    log_odds: float
    signature: str
    free: tuple[FreeTime, ...] = ()
    noise_odds: float = -np.inf


NOTHING = LackOfFit(-np.inf, "")
"""What a test that shows nothing returns."""


def changing_noise(
    stretches: Sequence[Stretch], seen: Sequence[Observed], states: Sequence[SpinState], policy: Policy = Policy()
) -> LackOfFit:
    """Test whether the noise level depends on the rate, the acceleration or time, by second differences.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    seen : sequence of Observed
        Their residuals.
    states : sequence of SpinState
        The table's motion at their samples.
    policy : Policy
        Threshold ``sizeable``.
    """
    best = NOTHING
    for stretch, mine, state in zip(stretches, seen, states, strict=True):
        left = np.diff((mine.residual / mine.levels.white)[:, :-1], n=2, axis=0) / np.sqrt(6.0)
        mask = stretch.mask[:, :-1]
        use = mask[1:-1] & mask[:-2] & mask[2:]  # a second difference needs three samples
        power, count = np.where(use, left**2, 0.0).sum(axis=1), use.sum(axis=1)
        for name, value in (
            ("the rate", np.abs(state.rate[1:-1])),
            ("the angular acceleration", np.abs(state.acceleration[1:-1])),
            ("time", stretch.run.t[1:-1]),
        ):
            parts = np.array_split(np.argsort(value, kind="stable"), _PARTS)
            counts = np.array([count[part].sum() for part in parts])
            if counts.min() < _FEWEST_DIFFERENCES:
                continue
            means = np.array([power[part].sum() for part in parts]) / counts
            spread = means / means.mean()
            if np.ptp(spread) <= policy.sizeable:
                continue
            # The mean square of second differences of white noise has about n/1.8 degrees of freedom per channel.
            statistic = float(np.sum(counts / 1.8 / 2 * (spread - 1) ** 2))
            odds = -_log_tail(statistic, _PARTS - 1) - float(np.log(3.0 * len(stretches)))
            if odds > best.log_odds:
                best = LackOfFit(odds, f"the noise of all channels changes with {name}")
    return best


def _log_tail(value: float, freedom: int) -> float:
    """Return the log of the probability that χ² exceeds a value, also where the probability underflows."""
    tail = float(chi2.logsf(value, freedom))
    if np.isfinite(tail):
        return tail
    half, x = 0.5 * freedom, 0.5 * value
    # Γ(a, x) ~ x^(a−1) e^(−x) (1 + (a − 1)/x), Abramowitz and Stegun 6.5.32.
    return float((half - 1.0) * np.log(x) - x + np.log1p((half - 1.0) / x) - gammaln(half))
