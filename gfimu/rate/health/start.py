"""Where the watch of a run that begins in motion can start: once the rate filter has settled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.base.short_repr import short_repr
from gfimu.rate.health.policy import MonitorPolicy
from gfimu.rate.live import LiveRateFilter
from gfimu.rate.result import RateEstimate

__all__ = ["MotionStart", "Settling"]


@dataclass(frozen=True)
class MotionStart:
    """Rate and biases from which the channels can be watched.

    Parameters
    ----------
    omega : ndarray, shape (3,)
        Angular rate, rad/s.
    omega_std : float
        Its largest standard deviation, rad/s.
    bias : ndarray, shape (c,)
        Biases of the channels, m/s²; the least that give those of α and of the null space.
    bias_std : ndarray, shape (c,)
        Their standard deviations, m/s².
    """

    omega: NDArray[np.float64]
    omega_std: float
    bias: NDArray[np.float64]
    bias_std: NDArray[np.float64]

    __repr__ = short_repr


class Settling:
    """Follows a rate filter that began in motion until it has settled.

    It has where the biases of all channels, as far as α and the null space see them, are known to
    ``policy.settled_std``, and the innovations of a second are no longer much smaller than those of the second before:
    while a filter is far from the truth it is surer of its biases than it should be.

    Parameters
    ----------
    period : float
        Sample period, s.
    policy : MonitorPolicy
        When it has settled.
    """

    def __init__(self, period: float, policy: MonitorPolicy) -> None:
        self._second, self._policy = max(1, round(1.0 / period)), policy
        self._sums = np.zeros(3)  # of innovations squared, degrees of freedom, samples since the last whole second
        self._ratios: list[float] = []

    def add(self, found: RateEstimate) -> None:
        """Take the estimates that a filter gave."""
        self._sums += [float(found.nis.sum()), float(found.nis_dof.sum()), len(found)]
        if self._sums[2] >= self._second:
            self._ratios = [*self._ratios[-1:], self._sums[0] / max(1.0, self._sums[1])]
            self._sums[:] = 0.0

    def start(self, live: LiveRateFilter) -> MotionStart | None:
        """Return rate and biases as a filter has them; None while it has not settled, or its sign is undecided."""
        if not live.started or len(live.carried) > 1:
            self._ratios = []
        if len(self._ratios) < 2 or self._ratios[1] < self._policy.settled_ratio * self._ratios[0]:
            return None
        bias, covariance = live.channel_biases()
        std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        if not std.max() < self._policy.settled_std:
            return None
        carried = live.carried[0]
        rate_std = float(np.sqrt(max(0.0, np.linalg.eigvalsh(carried.covariance[:3, :3])[-1])))
        return MotionStart(carried.x[:3].copy(), rate_std, bias, std)
