"""Every tuned number of the monitor of channels, with unit, meaning and source."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from gfimu.base.errors import InputError

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
    range_share : float
        Share of the range of a channel's readings by which they deviate from their mean: times the error of its gain, a
        constant fault that this error resembles.
    range_memory_s : float
        Time constant with which the range of a channel's readings is forgotten, s.
    noise_memory_s : float
        Time constant of a channel's noise, s.
    noise_spread : float
        Standard deviation of the logarithm of a channel's noise variance from part to part. Measured on a board of
        eight chips (MIMU4444), at rest, against the data sheet: 0.4.
    largest_noise : float
        Ratio of a sound channel's noise to the data sheet's that is not exceeded.
    noise_span_s : float
        Readings from which that noise is measured before the watch begins, s.
    readmission_s : float
        So long an excluded channel must agree with the others before it is used again, s.
    longest_readmission_s : float
        That time doubles with each time that the channel is used again, up to this, s.
    sound_scatter : float
        Variance within blocks over the stated one, up to which an excluded channel counts as quiet again.
    fewest_null : int
        Directions of the null space that must remain after an exclusion: with fewer, no next fault can be isolated.
    screen : float
        Share of the threshold below which errors of gains and positions are not taken out of a statistic, as they only
        lower it; saves time.
    sharp : float
        An onset whose statistic is larger than that of all others by this factor is kept: a fault is so large that the
        neighbouring onsets do not show it. Chosen between two equal faults of 20 mg, which must not be kept, and the
        one recorded step of 1.5 m/s² that was missed, whose ratio is 5.1.
    tried : int
        Sets of each kind (channels, pairs, chips) of which it is tried whether they explain a fault.
    least_age : int
        Age in blocks from which an onset is used for isolation: a younger one may really be later.
    first_block : float
        Share of one block's evidence that an onset in the middle of the block spoils at most.
    margin : int
        Blocks before the onset of a fault from which on its channels are not used.
    largest_scatter : float
        Ratio to the stated variance up to which one block's scatter counts: a step within a block is no noise.
    noise_settled_s : float
        Time from the first block on before a channel is called noisy, s.
    calm : float
        Quantile of the scatter that all channels share in one block, above which it counts for that block at once.
    quiet : float
        Quantile of a sound channel's scatter in one block, above which the block is loud.
    kind_decided : float
        By how much the best kind of fault must exceed a step in 2 log likelihood: 6 is odds of 20 to 1.
    spike_share : float
        Share of the samples that hold most of the squares, for spikes.
    noisy_kind : float
        Ratio to the stated variance from which noise is part of a fault.
    kind_span_s : float
        Time before the onset that shows a channel's bias, and after the finding that shows what the fault does, s.
    agreeing_share : float
        Share of the seconds of a recording that must be free of faults for the errors of the model to be measured.
    moving : float
        Range of a channel's block means within a second, in their noise, from which the array moves.
    fewest_seconds : int
        Seconds of motion, or of rest, from which they are judged by themselves.
    largest_factor : int
        Factor on the errors of gains, axes and positions that is not exceeded, a power of two.
    unproven_factor : int
        That factor in a stream until `fewest_seconds` of motion were seen, a power of two.
    least_rest_s : float
        Shortest rest that shows the biases well enough, s.
    settled_std : float
        In a run that begins in motion: standard deviation of the biases from which on the channels are watched, m/s².
    settled_ratio : float
        In such a run: innovations squared of a second over those of the second before, from which they no longer fall.
    live_rest_s : float
        Rest from which a stream's biases are taken, if it lasts so long, s.
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
    range_share: float = 0.5
    range_memory_s: float = 2.0
    noise_memory_s: float = 0.5
    noise_spread: float = 0.4
    largest_noise: float = 2.0
    noise_span_s: float = 10.0
    readmission_s: float = 5.0
    longest_readmission_s: float = 40.0
    sound_scatter: float = 2.0
    fewest_null: int = 3
    screen: float = 0.6
    sharp: float = 4.5
    tried: int = 4
    least_age: int = 3
    first_block: float = 0.25
    margin: int = 2
    largest_scatter: float = 9.0
    noise_settled_s: float = 0.3
    calm: float = 0.999
    quiet: float = 0.99
    kind_decided: float = 6.0
    spike_share: float = 0.1
    noisy_kind: float = 1.5
    kind_span_s: float = 2.0
    agreeing_share: float = 0.25
    moving: float = 15.0
    fewest_seconds: int = 8
    largest_factor: int = 64
    unproven_factor: int = 8
    least_rest_s: float = 1.0
    settled_std: float = 1.5e-3
    settled_ratio: float = 0.8
    live_rest_s: float = 3.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{name} = {value!r}: must be a positive number")

    def samples(self, period: float) -> int:
        """Return the samples of a block at this sample period, s."""
        return max(6, round(self.block_s / period))

    def threshold(self, n_channels: int, block_s: float) -> float:
        """Return the statistic from which a fault counts as detected: χ²(1) at the stated rate of false alarms."""
        tests = self.tests_per_channel * n_channels * 3600.0 / block_s
        share = min(0.5, self.false_alarms_per_hour / tests)
        return NormalDist().inv_cdf(0.5 * share) ** 2  # quantile of χ²(1)
