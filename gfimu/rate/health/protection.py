"""How well an array protects against a fault of one channel: the least fault found, and what a smaller one does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.declared import Declared, figure
from gfimu.base.errors import InputError
from gfimu.base.short_repr import short_repr
from gfimu.rate.health.detectable import DetectableFaults, detectable_faults
from gfimu.rate.sensing import SensorErrors

__all__ = ["ChannelLeastFault", "FaultProtection", "LeastFaults", "fault_protection", "protection_remark"]


@dataclass(frozen=True)
class LeastFaults(Declared):
    """Least faults that are found, of the worst channel."""

    detected_m_s2: Annotated[float, figure("Least fault that is seen; null: never.", "m/s²")]
    isolated_m_s2: Annotated[float, figure("Least fault that is assigned to its channel.", "m/s²")]
    detected_without_rate_m_s2: Annotated[
        float, figure("Least fault that is seen by single samples, ω unknown.", "m/s²")
    ]
    isolated_without_rate_m_s2: Annotated[
        float, figure("Least fault that is assigned by single samples, ω unknown.", "m/s²")
    ]
    unseen_alpha_rad_s2: Annotated[float, figure("Error of α by a fault that is just not seen.", "rad/s²")]


@dataclass(frozen=True)
class ChannelLeastFault(Declared):
    """Least fault of one channel that is found."""

    channel: Annotated[str, figure("The channel.", head="channel")]
    least: Annotated[LeastFaults, figure("The faults.", flat=True)]
    rival: Annotated[str | None, figure("Channel with which it is confused first; null or empty: none.")]


@dataclass(frozen=True)
class FaultProtection(Declared):
    """Least constant fault of a channel that is found within a time, with 95 % probability.

    Parameters
    ----------
    followed : DetectableFaults
        With the angular rate known, as a filter follows it.
    single : DetectableFaults
        With the angular rate unknown in every sample: what the parity space of single samples finds.
    per_channel : bool
        Whether `to_dict` lists every channel.
    """

    noise_m_s2: Annotated[float, figure("White noise of every channel.", "m/s²")]
    sample_rate_hz: Annotated[float, figure("Sample rate.", "Hz")]
    duration_s: Annotated[float, figure("Time since the onset.", "s")]
    followed: DetectableFaults
    single: DetectableFaults
    per_channel: bool = False

    __repr__ = short_repr

    @property
    def unseen_alpha(self) -> NDArray[np.float64]:
        """Error of α by a fault on each channel that is just not seen, shape (c,), rad/s²; ∞ where none is seen."""
        return np.asarray(self.followed.detected * self.followed.alpha_error)

    @property
    def each(self) -> list[ChannelLeastFault]:
        """The least faults of every channel."""
        rows = zip(self.followed.channels, *self._figures, self.followed.rivals, strict=True)
        return [ChannelLeastFault(name, LeastFaults(*faults), rival) for name, *faults, rival in rows]

    @property
    def worst(self) -> Annotated[LeastFaults, figure("Of the worst channel.", flat=True)]:
        """The largest figures of all channels."""
        return LeastFaults(*(float(one.max()) for one in self._figures))

    @property
    def _figures(self) -> tuple[NDArray[np.float64], ...]:
        both = (self.followed, self.single)
        return (*(one for faults in both for one in (faults.detected, faults.isolated)), self.unseen_alpha)

    @property
    def channels(
        self,
    ) -> Annotated[list[ChannelLeastFault] | None, figure("Of every channel, with --per-channel.", absent=True)]:
        """The least faults of every channel where they were asked for."""
        return self.each if self.per_channel else None


def fault_protection(
    array: AccelerometerArray,
    *,
    noise_m_s2: float,
    sample_rate_hz: float = 100.0,
    duration_s: float = 1.0,
    per_channel: bool = False,
) -> FaultProtection:
    """Return the least fault of each channel of an array, with the same white noise on all of them.

    The parameters are the fields of `FaultProtection`.

    Raises
    ------
    GeometryError
        If the array can't see all six motions.
    InputError
        If a figure is not positive.
    """
    if not (np.isfinite(duration_s) and duration_s > 0):
        raise InputError(f"fault time {duration_s!r} s: must be positive")
    errors = SensorErrors.uniform(array, noise_m_s2)
    followed, single = (
        detectable_faults(array, errors, sample_rate_hz, duration=duration_s, unknown_rate=unknown)
        for unknown in (False, True)
    )
    return FaultProtection(noise_m_s2, sample_rate_hz, duration_s, followed, single, per_channel)


def protection_remark(protections: Mapping[str, FaultProtection]) -> str:
    """Return which of several arrays, by name, protects best; empty for fewer than two.

    The best is the one whose worst channel must be wrong by least before the fault is seen and assigned to it; and the
    one in which a fault that is just not seen makes the least error of α.
    """
    if len(protections) < 2:
        return ""
    isolated = {name: float(one.followed.isolated.max()) for name, one in protections.items()}
    unseen = {name: float(one.unseen_alpha.max()) for name, one in protections.items()}
    found, harmless = min(isolated, key=lambda name: isolated[name]), min(unseen, key=lambda name: unseen[name])
    if not np.isfinite(isolated[found]):
        return "None of these arrays assigns a fault to its channel on every channel."
    if found == harmless:
        return f"{found} protects best: it finds the smallest faults, and one that is not seen does least to α."
    return f"{found} finds the smallest faults; in {harmless} a fault that is not seen does least to α."
