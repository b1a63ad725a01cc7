"""Every tuned number of the monitor of channels, with unit, meaning and source."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from gfimu.errors import InputError

__all__ = ["MonitorPolicy"]


@dataclass(frozen=True)
class MonitorPolicy:
    """Settings of the monitor of channels.

    Parameters
    ----------
    block_s : float
        Length of the blocks of which means are taken, s; at least 6 samples. Shorter blocks find large faults sooner
        and cost more time.
    false_alarms_per_hour : float
        How often a sound array may be called faulty.
    tests_per_channel : float
        Independent tests per block and channel that the running search over onsets amounts to. Measured on 30 h of
        sound recordings of ``cube12``: the largest statistic of an hour has the distribution of that many χ²(1).
    isolation : float
        By how much the best explanation must exceed the next one of the same kind, in units of 2 log likelihood:
        10 is odds of 150 to 1.
    unexplained : float
        Largest statistic of another channel that may remain after the exclusion; χ²(1) gives 14 once in 5000.
    relative : float
        The margin of isolation as a share of the explained statistic: linearisation and block means spoil the signature
        of a large fault by about that much. An onset inside a block adds 0.25 over the age in blocks.
    wait_s : float
        A fault that is seen and not isolated for so long is stated as one of several, s.
    slots : int
        Onsets that are followed at once.
    oldest_s : float
        Age of the oldest onset, s.
    bias_std : float
        Least uncertainty of a channel's bias, m/s². A bias that is said to be known better makes the monitor exclude
        sound channels: 0.2 mg for a true 3 mg gave 10 wrong exclusions in 6 min.
    gain_std : float
        Least uncertainty of gains and axes, a ratio: what a calibration of 0.05 % and 0.5 mrad leaves.
    place_std : float
        Least uncertainty of the positions, m.
    bias_walk : float
        Growth of the variance of a bias, (m/s²)²/s: covers an instability of 0.15 mg.
    range_memory_s : float
        Time constant with which the range of a channel's readings is forgotten, s.
    noise_memory_s : float
        Time constant of a channel's noise, s.
    readmission_s : float
        So long an excluded channel must agree with the others before it is used again, s.
    fewest_null : int
        Directions of the null space that must remain after an exclusion: with fewer, no next fault can be isolated.
    """

    block_s: float = 0.1
    false_alarms_per_hour: float = 0.01
    tests_per_channel: float = 0.62
    isolation: float = 10.0
    unexplained: float = 14.0
    relative: float = 0.02
    wait_s: float = 2.0
    slots: int = 8
    oldest_s: float = 20.0
    bias_std: float = 3e-3
    gain_std: float = 9e-4
    place_std: float = 1e-4
    bias_walk: float = 1.5e-6
    range_memory_s: float = 2.0
    noise_memory_s: float = 0.5
    readmission_s: float = 5.0
    fewest_null: int = 3

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{name} = {value!r}: must be a positive number")

    def samples(self, period: float) -> int:
        """Return the samples of a block at this sample period, s."""
        return max(6, round(self.block_s / period))

    def threshold(self, n_channels: int, block_s: float) -> float:
        """Return the statistic from which a fault is believed: χ²(1) at the stated rate of false alarms."""
        tests = self.tests_per_channel * n_channels * 3600.0 / block_s
        return float(chi2.isf(min(0.5, self.false_alarms_per_hour / tests), 1))
