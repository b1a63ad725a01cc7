"""A motion of the turntable made of holds and smooth ramps, within limits of rate and acceleration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PPoly

from gfimu.diagnosis.data.table.spins import State
from gfimu.geometry.smooth_ramp import PEAK_OF_RAMP, smooth_ramp

__all__ = ["Leg", "TableProfile"]


@dataclass(frozen=True)
class Leg:
    """A piece of a profile: a ramp to a rate, or a hold where the rate is that of the piece before.

    Parameters
    ----------
    to : float
        Rate at the end, rad/s.
    duration : float
        Length, s.
    """

    to: float
    duration: float


@dataclass(frozen=True)
class TableProfile:
    """Spin of the table from rest through legs in a row.

    Parameters
    ----------
    legs : tuple of Leg
        The pieces.
    """

    legs: tuple[Leg, ...]

    @property
    def duration(self) -> float:
        """Length, s."""
        return round(float(sum(leg.duration for leg in self.legs)), 9)

    @property
    def peak_rate(self) -> float:
        """Largest rate, rad/s."""
        return max(abs(leg.to) for leg in self.legs)

    @property
    def peak_acceleration(self) -> float:
        """Largest angular acceleration, rad/s²."""
        steps = np.abs(np.diff([0.0, *(leg.to for leg in self.legs)]))
        return float(PEAK_OF_RAMP * np.max(steps / [leg.duration for leg in self.legs]))

    @cached_property
    def _rate(self) -> PPoly:
        # Legs of one second at the start rate and at the last rate, for what looks beyond the ends.
        pieces = [Leg(0.0, 1.0), *self.legs, Leg(self.legs[-1].to, 1.0)]
        breaks = np.cumsum([-1.0, *(leg.duration for leg in pieces)])
        starts = [0.0, *(leg.to for leg in pieces[:-1])]
        ramps = [smooth_ramp(start, leg.to, leg.duration) for start, leg in zip(starts, pieces, strict=True)]
        return PPoly(np.column_stack(ramps), breaks)

    @cached_property
    def _angle(self) -> PPoly:
        return self._rate.antiderivative()

    def at(self, t: ArrayLike) -> State:
        """Return angle (zero at time zero), rate and acceleration at times (n,), s."""
        times = np.asarray(t, dtype=float)
        angle: NDArray[np.float64] = self._angle(times) - self._angle(0.0)
        return State(angle, self._rate(times), self._rate.derivative()(times))

    def to_segments(self) -> list[dict[str, Any]]:
        """Return the entries of ``motion.segment`` in a scenario file."""
        entries: list[dict[str, Any]] = []
        rate = 0.0
        for leg in self.legs:
            if leg.to == rate:
                entries.append({"kind": "hold", "duration_s": leg.duration})
            else:
                entries.append({"kind": "ramp", "to_rad_s": leg.to, "duration_s": leg.duration})
            rate = leg.to
        return entries

    def in_words(self) -> list[str]:
        """Return one line per leg for people, a burst of reversals in one line."""
        lines: list[str] = []
        rates = [0.0, *(leg.to for leg in self.legs)]
        place = 0
        while place < len(self.legs):
            burst = _burst_length(rates, place)
            if burst > 3:
                part = self.legs[place : place + burst]
                low, high = min(leg.to for leg in part), max(leg.to for leg in part)
                fast, slow = min(leg.duration for leg in part), max(leg.duration for leg in part)
                lines.append(
                    f"{burst} ramps to and fro between {low:+.2f} and {high:+.2f} rad/s, "
                    f"{slow:.2f} to {fast:.2f} s each, {sum(leg.duration for leg in part):.1f} s in all"
                )
                place += burst
                continue
            leg = self.legs[place]
            hold = leg.to == rates[place]
            what = ("rest" if leg.to == 0 else "hold") if hold else f"ramp to {leg.to:+.2f} rad/s in"
            lines.append(f"{what} {leg.duration:.2f} s")
            place += 1
        return lines


def _burst_length(rates: Sequence[float], place: int) -> int:
    """Return how many ramps in a row from ``place`` on turn back each time."""
    steps = np.diff(rates[place:])
    turns = np.flatnonzero(steps[1:] * steps[:-1] >= 0)
    return int(turns[0]) + 1 if len(turns) else len(steps)
