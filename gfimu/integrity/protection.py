"""How well an array protects against a fault of one channel: the least fault found, and what a smaller one does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.errors import InputError
from gfimu.geometry.array import AccelerometerArray
from gfimu.integrity.detectable import DetectableFaults, detectable_faults
from gfimu.rate.sensing import SensorErrors
from gfimu.short_repr import short_repr

__all__ = ["FaultProtection", "fault_protection", "protection_remark"]


@dataclass(frozen=True)
class FaultProtection:
    """Least constant fault of a channel that is found within a time, with 95 % probability.

    Parameters
    ----------
    noise_m_s2, sample_rate_hz, duration_s : float
        White noise of every channel, m/s², sample rate, Hz, and time since the onset, s, for which it holds.
    followed : DetectableFaults
        With the angular rate known, as a filter follows it.
    single : DetectableFaults
        With the angular rate unknown in every sample: what the parity space of single samples finds.
    per_channel : bool
        Whether `to_dict` lists every channel.
    """

    noise_m_s2: float
    sample_rate_hz: float
    duration_s: float
    followed: DetectableFaults
    single: DetectableFaults
    per_channel: bool = False

    __repr__ = short_repr

    @property
    def unseen_alpha(self) -> NDArray[np.float64]:
        """Error of α by a fault on each channel that is just not seen, shape (c,), rad/s²; ∞ where none is seen."""
        return np.asarray(self.followed.detected * self.followed.alpha_error)

    def to_dict(self) -> dict[str, Any]:
        """Return the largest figures of all channels, and those of each where asked for, with units in the names."""
        figures: dict[str, Any] = {
            "noise_m_s2": self.noise_m_s2,
            "sample_rate_hz": self.sample_rate_hz,
            "duration_s": self.duration_s,
            "detected_m_s2": self.followed.detected.max(),
            "isolated_m_s2": self.followed.isolated.max(),
            "detected_without_rate_m_s2": self.single.detected.max(),
            "isolated_without_rate_m_s2": self.single.isolated.max(),
            "unseen_alpha_rad_s2": self.unseen_alpha.max(),
        }
        if self.per_channel:
            figures["channels"] = [
                {
                    "channel": name,
                    "detected_m_s2": self.followed.detected[i],
                    "isolated_m_s2": self.followed.isolated[i],
                    "detected_without_rate_m_s2": self.single.detected[i],
                    "isolated_without_rate_m_s2": self.single.isolated[i],
                    "unseen_alpha_rad_s2": self.unseen_alpha[i],
                    "rival": self.followed.rivals[i],
                }
                for i, name in enumerate(self.followed.channels)
            ]
        return figures


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
