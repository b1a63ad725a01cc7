"""A fault of channels, and the health of all channels over a recording."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.short_repr import short_repr

__all__ = ["ChannelFault", "ChannelHealth", "HealthCode"]


class HealthCode(IntEnum):
    """Health of a channel at a sample, as the columns ``health_a11`` … hold it."""

    USED = 0
    EXCLUDED = 1
    MISSING = 2
    SATURATED = 3
    STUCK = 4
    DOUBTED = 5
    """Used, though a fault lies in it or in others and it can't be said in which."""


@dataclass(frozen=True)
class ChannelFault:
    """One fault: what is wrong, since when, and how surely.

    Parameters
    ----------
    channels : tuple of str
        Channels that are at fault; where ``isolated`` is false, all that may be.
    kind : {"step", "drift", "gain", "noise", "stuck", "spikes", "unknown"}
        What the channel does, judged by its difference from what the others predict.
    isolated : bool
        Whether these channels and no others are at fault.
    onset_s, found_s : float
        Time from which on the readings are wrong, as estimated, and time at which that was known, s.
    end_s : float
        Time from which on the channels are used again, s; infinite if they are not.
    sizes, sizes_std : tuple of float
        Size of the fault of each channel as a constant from the onset on, and its standard deviation, m/s²; NaN for
        noise.
    statistic : float
        Twice the log likelihood ratio of the fault against none.
    alternatives : tuple of tuple of str
        Where it is not isolated: the sets of channels each of which explains it.
    excluded : bool
        Whether the channels were left out. Of a fault that is not isolated all alternatives are left out if the others
        still see all six motions, else none.
    """

    channels: tuple[str, ...]
    kind: str
    isolated: bool
    onset_s: float
    found_s: float
    end_s: float
    sizes: tuple[float, ...]
    sizes_std: tuple[float, ...]
    statistic: float
    alternatives: tuple[tuple[str, ...], ...] = ()
    excluded: bool = True

    __repr__ = short_repr

    def to_dict(self) -> dict[str, Any]:
        """Return the fault as JSON can hold it, with units in the names; None where a figure is not known."""
        return {
            "channels": list(self.channels),
            "kind": self.kind,
            "isolated": self.isolated,
            "onset_s": self.onset_s,
            "found_s": self.found_s,
            "end_s": self.end_s if np.isfinite(self.end_s) else None,
            "sizes_m_s2": [value if np.isfinite(value) else None for value in self.sizes],
            "sizes_std_m_s2": [value if np.isfinite(value) else None for value in self.sizes_std],
            "statistic": self.statistic,
            "alternatives": [list(names) for names in self.alternatives],
            "excluded": self.excluded,
        }

    def entries(self) -> list[dict[str, Any]]:
        """Return an entry for each channel, as JSON can hold it: kind, onset, size and its standard deviation.

        ``excluded`` is whether the channel was left out from the onset to ``end_s`` (None: to the end).
        """
        return [
            {
                "channel": name,
                "kind": self.kind,
                "isolated": self.isolated,
                "onset_s": self.onset_s,
                "detected_s": self.found_s,
                "end_s": self.end_s if np.isfinite(self.end_s) else None,
                "size": size if np.isfinite(size) else None,
                "std": std if np.isfinite(std) else None,
                "unit": "m/s2",
                "excluded": self.excluded,
                "alternatives": [list(names) for names in self.alternatives],
            }
            for name, size, std in zip(self.channels, self.sizes, self.sizes_std, strict=True)
        ]

    def sentence(self) -> str:
        """Return the fault in words."""
        names = ", ".join(self.channels)
        until = f" to {self.end_s:.4g} s" if np.isfinite(self.end_s) else ""
        if not self.isolated:
            sets = self.alternatives or (self.channels,)
            lies = ", or ".join(f"in {' and '.join(one)}" for one in sets)
            use = "none of them is used" if self.excluded else "all of them are used"
            return f"a fault from {self.onset_s:.4g} s{until} lies {lies}, and these can't be separated: {use}"
        size = ""
        if self.kind in {"step", "unknown"} and np.isfinite(self.sizes).all():
            values = ", ".join(
                f"{value:.3g} ± {std:.1g}" for value, std in zip(self.sizes, self.sizes_std, strict=True)
            )
            size = f" of {values} m/s²"
        what = "fault of unknown kind" if self.kind == "unknown" else self.kind
        return f"{names}: {what}{size} from {self.onset_s:.4g} s{until}, not used there"


@dataclass(frozen=True)
class ChannelHealth:
    """Health of every channel at every sample.

    Parameters
    ----------
    channels : tuple of str
        Names of the c channels.
    faults : tuple of ChannelFault
        What was found, in the order in which it was found.
    excluded : ndarray of bool, shape (n, c)
        Readings not to be used.
    doubted : ndarray of bool, shape (n, c)
        Readings of channels of which some are at fault and it can't be said which; they are used.
    unexplained : ndarray of bool, shape (n,)
        Samples at which a fault was seen that no channel, pair or chip explains: nothing is excluded for it.
    largest_statistic : float
        Largest statistic of a channel in the run; a sound array stays below the threshold.
    threshold : float
        The threshold.
    model_factor : float
        By how much the errors of gains, axes and positions had to be taken larger than stated for the channels to
        agree. Above 1, a calibration would let smaller faults be seen.
    """

    channels: tuple[str, ...]
    faults: tuple[ChannelFault, ...]
    excluded: NDArray[np.bool_]
    doubted: NDArray[np.bool_]
    unexplained: NDArray[np.bool_]
    largest_statistic: float
    threshold: float
    model_factor: float = 1.0

    __repr__ = short_repr

    def behind(self, count: int) -> ChannelHealth:
        """Return the same with ``count`` samples before it in which nothing was watched."""

        def longer(marks: NDArray[np.bool_]) -> NDArray[np.bool_]:
            return np.concatenate([np.zeros((count, *marks.shape[1:]), dtype=np.bool_), marks])

        return replace(
            self,
            excluded=longer(self.excluded),
            doubted=longer(self.doubted),
            unexplained=longer(self.unexplained),
        )

    @property
    def sound(self) -> bool:
        """Whether no fault was seen."""
        return not (self.faults or self.unexplained.any())

    def codes(self, t: NDArray[np.float64]) -> NDArray[np.int8]:
        """Return the health of each channel at each sample (`HealthCode`), shape (n, c), at the times (n,), s.

        In doubt are the channels in which a fault may lie, and all of them while they contradict each other and no
        channel, pair or chip explains it.
        """
        doubted = self.unexplained[:, None] | self.doubted
        codes = np.where(doubted, np.int8(HealthCode.DOUBTED), np.int8(HealthCode.USED))
        codes[self.excluded] = HealthCode.EXCLUDED
        for fault in self.faults:
            if fault.kind == "stuck":
                columns = [self.channels.index(name) for name in fault.channels]
                during = self.excluded[:, columns] & ((t <= fault.end_s) & (t >= fault.onset_s))[:, None]
                codes[:, columns] = np.where(during, np.int8(HealthCode.STUCK), codes[:, columns])
        return codes

    def sentences(self) -> list[str]:
        """Return what was found in words, one sentence per finding; empty if nothing was."""
        found = [f"{fault.sentence()}" for fault in self.faults]
        if self.unexplained.any():
            share = float(self.unexplained.mean())
            found.append(
                f"in {share:.1%} of the samples the channels contradict each other, and no channel, pair or chip alone "
                "explains it: nothing was left out for it; calibrate the array (gfimu calibrate)"
            )
        if self.model_factor > 1.0:
            found.append(
                f"the channels disagree as if gains, axes and positions were {self.model_factor:.0f} times less exact "
                "than a good calibration leaves them; smaller faults are not seen: calibrate the array"
            )
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return faults and statistic as JSON can hold them."""
        return {
            "faults": [fault.to_dict() for fault in self.faults],
            "share_unexplained": float(self.unexplained.mean()) if len(self.unexplained) else 0.0,
            "largest_statistic": self.largest_statistic,
            "threshold": self.threshold,
            "model_factor": self.model_factor,
        }
