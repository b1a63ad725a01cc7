"""Arrays that the recursion of the monitor of channels works on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["MonitorState", "MonitorTables", "MonitorTuning"]


class MonitorTables(NamedTuple):
    """Matrices per set of channels (`gfimu.rate.channel_sets.ChannelSets`), stacked."""

    alpha: NDArray[np.float64]  # (sets, 3, c)
    leak: NDArray[np.float64]  # (sets, 3, 6)
    null: NDArray[np.float64]  # (sets, d, c)
    sensitivity: NDArray[np.float64]  # (sets, d, 6)
    null_count: NDArray[np.int64]  # (sets,) directions of the null space; −1 where α can't be seen
    noise: NDArray[np.float64]  # (sets, 3, 3) of α, per sample


class MonitorTuning(NamedTuple):
    """Numbers that stay the same over a run."""

    follow: bool  # whether onsets of faults are followed
    samples: int  # per block
    period: float  # of the blocks, s
    threshold: float  # of a fault
    screen: float  # share of it, below which model errors are not taken out
    sharp: float  # statistic of the right onset over that of its neighbours, of a large fault
    oldest: float  # blocks
    walk: float  # (m/s²)²/s
    forget: float  # of the range of readings, per block
    range_share: float  # of the range of a channel's readings, its deviation from their mean
    scale_std: float  # of gains and axes, a ratio
    placement_std: float  # m
    floor: float  # m/s²


class MonitorState(NamedTuple):
    """What is carried from one block to the next."""

    x: NDArray[np.float64]  # (3 + c,) ω, biases
    covariance: NDArray[np.float64]  # (3 + c, 3 + c)
    last: NDArray[np.float64]  # (c,) mean readings of the block before
    low: NDArray[np.float64]  # (c,) range of the readings
    high: NDArray[np.float64]  # (c,)
    ages: NDArray[np.float64]  # (slots,) blocks since the onset, oldest first; 0: unused
    signature: NDArray[np.float64]  # (slots, 3 + c, c) G
    information: NDArray[np.float64]  # (slots, c, c) C
    score: NDArray[np.float64]  # (slots, c) d
    started: NDArray[np.bool_]  # (1,)
    leading: NDArray[np.int64]  # (1,) slot that showed far more than the others in the last block; −1: none
    held: NDArray[np.int64]  # (1,) slot that is kept beside the others for that; −1: none
    largest: NDArray[np.float64]  # (1,) statistic of a channel so far, beyond what model errors explain
    past_x: NDArray[np.float64]  # (h, 3 + c) before each of the last blocks, rings; block k at k mod h
    past_covariance: NDArray[np.float64]  # (h, 3 + c, 3 + c)
    past_means: NDArray[np.float64]  # (h, 3, c) last mean readings, low, high

    def copy(self) -> MonitorState:
        """Return a state that shares nothing with this one."""
        return MonitorState._make(field.copy() for field in self)

    def forget_onsets(self) -> None:
        """Follow no onset for now."""
        self.ages[:] = 0.0
        self.leading[0] = self.held[0] = -1

    def go_back(self, block: int) -> None:
        """Return to the state before a block; it must be one of the last h."""
        place = block % len(self.past_x)
        self.x[:] = self.past_x[place]
        self.covariance[:] = self.past_covariance[place]
        self.last[:], self.low[:], self.high[:] = self.past_means[place]
        self.forget_onsets()
        self.started[0] = block > 0
