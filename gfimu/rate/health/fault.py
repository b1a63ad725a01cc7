"""A fault of channels, and the health of all channels over a recording."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.declared import Declared, figure
from gfimu.base.short_repr import short_repr

__all__ = ["ChannelFault", "ChannelHealth", "FaultEntry", "HealthCode"]


class HealthCode(IntEnum):
    """Health of a channel at a sample, as the columns ``health_a11`` … hold it."""

    USED = 0
    EXCLUDED = 1
    MISSING = 2
    SATURATED = 3
    STUCK = 4
    DOUBTED = 5
    """Used, though a fault lies in it or in others and it can't be said in which."""


_KINDS = "step, drift, gain, noise, stuck, spikes or unknown, judged by the difference from what the others predict."
_ALTERNATIVES = "Where it is not isolated: the sets of channels each of which explains it."


@dataclass(frozen=True)
class FaultEntry(Declared):
    """A fault as it is of one channel."""

    channel: Annotated[str, figure("The channel.")]
    kind: Annotated[str, figure(_KINDS)]
    isolated: Annotated[bool, figure("Whether the fault is certain to be on this channel.")]
    onset_s: Annotated[float, figure("When it began.", "s")]
    detected_s: Annotated[float, figure("When it was found.", "s")]
    end_s: Annotated[float, figure("When it ended; null: not before the end.", "s")]
    size: Annotated[float, figure("Its size.", "m/s²")]
    std: Annotated[float, figure("Standard deviation of the size.", "m/s²")]
    unit: Annotated[str, figure("Unit of size and std.")]
    excluded: Annotated[bool, figure("Whether the channel was left out from the onset to the end.")]
    alternatives: Annotated[tuple[tuple[str, ...], ...], figure(_ALTERNATIVES)]


@dataclass(frozen=True)
class ChannelFault(Declared):
    """One fault with all channels that it is on: what is wrong, since when, and how surely.

    Of a fault that is not isolated all alternatives are left out if the others can still check each other, else none.
    """

    channels: Annotated[tuple[str, ...], figure("The channels; where it is not isolated, all that may be at fault.")]
    kind: Annotated[str, figure(_KINDS)]
    isolated: Annotated[bool, figure("Whether these channels and no others are at fault.")]
    onset_s: Annotated[float, figure("Time from which on the readings are wrong, as estimated.", "s")]
    found_s: Annotated[float, figure("When that was known.", "s")]
    end_s: Annotated[float, figure("Time from which on the channels are used again; null: they are not.", "s")]
    sizes: Annotated[
        tuple[float, ...],
        figure("Size on each channel, a constant from the onset on; null for noise.", "m/s²", key="sizes_m_s2"),
    ]
    sizes_std: Annotated[tuple[float, ...], figure("Standard deviations of the sizes.", "m/s²", key="sizes_std_m_s2")]
    statistic: Annotated[float, figure("Twice the log likelihood ratio of the fault against none.")]
    alternatives: Annotated[tuple[tuple[str, ...], ...], figure(_ALTERNATIVES)] = ()
    excluded: Annotated[bool, figure("Whether the channels were left out.")] = True

    __repr__ = short_repr

    def entries(self) -> list[dict[str, Any]]:
        """Return a `FaultEntry` for each channel, as JSON can hold it; ``end_s`` is None where it lasts to the end."""
        times = self.onset_s, self.found_s, self.end_s
        last = "m/s2", self.excluded, self.alternatives
        rows = zip(self.channels, self.sizes, self.sizes_std, strict=True)
        return [
            FaultEntry(name, self.kind, self.isolated, *times, size, std, *last).to_dict() for name, size, std in rows
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
class ChannelHealth(Declared):
    """Health of every channel at every sample.

    Parameters
    ----------
    channels : tuple of str
        Names of the c channels.
    excluded : ndarray of bool, shape (n, c)
        Readings not to be used.
    doubted : ndarray of bool, shape (n, c)
        Readings of channels of which some are at fault and it can't be said which; they are used.
    unexplained : ndarray of bool, shape (n,)
        Samples at which a fault was seen that no channel, pair or chip explains: nothing is excluded for it.
    """

    channels: tuple[str, ...]
    faults: Annotated[tuple[ChannelFault, ...], figure("Faults, in the order in which they were found.")]
    excluded: NDArray[np.bool_]
    doubted: NDArray[np.bool_]
    unexplained: NDArray[np.bool_]
    largest_statistic: Annotated[float, figure("Largest statistic of a channel in the run.")]
    threshold: Annotated[float, figure("Threshold above which it counts as a fault.")]
    model_factor: Annotated[
        float,
        figure(
            "Factor on the stated errors of gains, axes and positions at which the channels agree; above 1, a "
            "calibration would let smaller faults be seen."
        ),
    ] = 1.0

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
        found = [fault.sentence() for fault in self.faults]
        if self.unexplained.any():
            found.append(
                f"in {self.share_unexplained:.1%} of the samples the channels contradict each other, and no channel, "
                "pair or chip alone explains it: nothing was left out for it; calibrate the array (gfimu calibrate)"
            )
        if self.model_factor > 1.0:
            found.append(
                f"the channels disagree as if gains, axes and positions were {self.model_factor:.0f} times less exact "
                "than a good calibration leaves them; smaller faults are not seen: calibrate the array"
            )
        return found

    @property
    def share_unexplained(
        self,
    ) -> Annotated[float, figure("Share of the samples that no fault explains.", before="largest_statistic")]:
        """Share of the samples at which channels contradict each other and no fault explains it."""
        return float(self.unexplained.mean()) if len(self.unexplained) else 0.0
