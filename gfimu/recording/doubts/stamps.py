"""Times of samples: gaps, scatter, and stamps of a host that reads the samples in bursts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.recording.doubts.doubt import Doubt
from gfimu.recording.policy import StampPolicy

__all__ = ["SteadyClock", "stamp_doubts", "steady_clock"]

_POLICY = StampPolicy()


@dataclass(frozen=True)
class SteadyClock:
    """The steady clock of samples whose time stamps are those of another event, as their transfer to a host.

    Parameters
    ----------
    rate_hz : float
        Samples per second.
    per_burst : float
        Samples that share a transfer, on average; 1 where each stamp is late by itself.
    """

    rate_hz: float
    per_burst: float

    @property
    def sentence(self) -> str:
        """What the stamps are, and what to do."""
        how = f"in bursts of {self.per_burst:.2g} rows" if self.per_burst > 1.5 else "late by a random part of a period"
        return (
            f"come {how}, as stamps of a host and not of the samples: {self.rate_hz:.6g} rows per second, taken as "
            "constant; lost samples don't show"
        )


def steady_clock(t: NDArray[np.float64]) -> SteadyClock | None:
    """Return the steady clock behind times, (n,), whose steps are irregular; None where the steps are the samples' own.

    Stamps of a host deviate from a steady clock by a bounded delay, however long the recording is. Times of samples
    that were taken irregularly deviate as a random walk of their steps does.
    """
    steps = np.diff(t)
    if len(steps) < _POLICY.fewest or not (steps >= 0.0).all():
        return None
    period = _period(t)
    usual = np.abs(steps - period)
    if period <= 0.0 or float(np.mean(np.minimum(usual, period))) < _POLICY.irregular * period:
        return None
    # Between transfers the step is long; only the last row of a burst is as late as all others of its kind.
    last = np.append(np.flatnonzero(steps > period), len(t) - 1)
    if len(last) < _POLICY.fewest // 2:
        return None
    slope = np.polyfit(last.astype(float), t[last], 1)[0]
    late = t - slope * np.arange(len(t))
    walk = float(np.std(steps)) * np.sqrt(len(t) / 15.0)  # of a random walk about its own line, on average
    if float(np.std(late)) > _POLICY.bounded * walk:
        return None
    rate = 1.0 / float(slope)
    whole = float(round(rate))
    if whole and abs(rate / whole - 1.0) < _POLICY.whole:
        rate = whole
    return SteadyClock(float(f"{rate:.6g}"), len(t) / len(last))


def _period(t: NDArray[np.float64]) -> float:
    """Return the period of a steady clock by the median of long spans, s."""
    span = max(len(t) // 4, 1)
    return float(np.median(t[span:] - t[:-span])) / span


def stamp_doubts(t: NDArray[np.float64]) -> list[Doubt]:
    """Return what is odd about the times of samples, (n,), s, which increase."""
    steps = np.diff(t)
    if len(steps) < 2:
        return []
    clock = steady_clock(t)
    if clock is not None:
        remedy = f"read the file with time.rate_hz = {clock.rate_hz:.6g} in place of the column"
        return [Doubt("bursts", f"the times {clock.sentence}; {remedy}")]
    usual = float(np.median(steps))
    gaps = np.flatnonzero(steps > _POLICY.gap * usual)
    found = []
    if len(gaps):
        lost = float(np.sum(steps[gaps] - usual))
        text = f"{len(gaps)} gaps, {lost:.3g} s in all, the first {t[gaps[0]] - t[0]:.4g} s after the start"
        found.append(Doubt("gaps", text, rows=gaps, is_minor=True))
    scatter = float(np.std(np.delete(steps, gaps)) / usual)
    if scatter > _POLICY.scatter:
        found.append(Doubt("scatter", f"the sample period scatters by {100 * scatter:.2g}% of itself", is_minor=True))
    return found
