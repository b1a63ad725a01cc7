"""How well the channels of a stream agree in motion, found while it arrives."""

from __future__ import annotations

from gfimu.rate.health.monitor import ChannelMonitor
from gfimu.rate.health.policy import MonitorPolicy
from gfimu.rate.health.residue import agree, larger_errors, moving_seconds, without_noisy_channel
from gfimu.rate.sensing import SensorErrors

__all__ = ["Agreement"]


class Agreement:
    """By how much errors of gains, axes and positions are larger than a good calibration leaves them.

    The factor is large until enough seconds of motion have been seen; then it is the least power of two with which the
    innovations of the last seconds are explained, and is found anew from time to time.

    Parameters
    ----------
    errors : SensorErrors
        Errors that a good calibration leaves.
    policy : MonitorPolicy
        The first factor, and the seconds.

    Attributes
    ----------
    factor : float
        That factor.
    """

    def __init__(self, errors: SensorErrors, policy: MonitorPolicy) -> None:
        self._stated, self._policy = errors, policy
        self.factor = float(policy.unproven_factor)
        self._next = policy.fewest_seconds  # seconds of motion at which it is judged next
        self._moving = 0
        self._seen = 0.0  # s of the run whose seconds are counted

    @property
    def errors(self) -> SensorErrors:
        """Errors to reckon with now."""
        return larger_errors(self._stated, self.factor)

    def judge(self, monitor: ChannelMonitor) -> None:
        """Find the factor, where enough seconds of motion have passed since it was found."""
        policy, follower = self._policy, monitor.follower
        per_second = max(1, round(1.0 / monitor.block_s))
        while monitor.total_blocks >= (self._seen + 1.0) * per_second:
            self._seen += 1.0
            last = len(monitor.blocks) - (monitor.total_blocks - round(self._seen * per_second))
            second = monitor.blocks.rows(slice(max(0, last - per_second), last))
            self._moving += int(moving_seconds(follower, second, policy).any())
        if self._moving < self._next:
            return
        recent = monitor.blocks.rows(slice(max(0, len(monitor.blocks) - follower.history + 1), None))
        fewest = policy.fewest_seconds
        if moving_seconds(follower, recent, policy).sum() < fewest:
            return
        self._next = self._moving + policy.fewest_seconds
        monitor.noise_in_motion = True
        factor, agrees = 0.5, False
        judged = without_noisy_channel(follower, recent, monitor.watched, policy)
        while factor < policy.largest_factor and not agrees:
            factor *= 2.0
            blocks, innovations = monitor.recent_innovations(larger_errors(self._stated, factor))
            agrees = agree(follower, blocks, innovations, policy, judged=judged, fewest=fewest)
        monitor.refuse(not agrees)
        if factor != self.factor:
            self.factor = factor
            follower.reckon_with(self.errors)
