"""A motion of the turntable made of holds and smooth ramps, within limits of rate and acceleration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PPoly

from gfimu.array.smooth_ramp import PEAK_OF_RAMP, smooth_ramp
from gfimu.base.declared import Declared, figure
from gfimu.diagnosis.data.table.spins import State

__all__ = ["Leg", "Segment", "TableProfile"]


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
class Segment(Declared):
    """A piece of a profile as a scenario file has it under ``motion.segment``."""

    kind: Annotated[str, figure("ramp or hold.")]
    to_rad_s: Annotated[float | None, figure("Of a ramp: rate at its end.", "rad/s", absent=True)]
    duration_s: Annotated[float, figure("Its length.", "s")]


@dataclass(frozen=True)
class TableProfile(Declared):
    """Spin of the table from rest through legs in a row.

    Parameters
    ----------
    legs : tuple of Leg
        The pieces.
    """

    legs: tuple[Leg, ...]

    @property
    def duration(self) -> Annotated[float, figure("Length of the profile.", "s", key="duration_s")]:
        """Length, s."""
        return round(float(sum(leg.duration for leg in self.legs)), 9)

    @property
    def peak_rate(self) -> Annotated[float, figure("Largest rate.", "rad/s", key="peak_rate_rad_s")]:
        """Largest rate, rad/s."""
        return max(abs(leg.to) for leg in self.legs)

    @property
    def peak_acceleration(
        self,
    ) -> Annotated[float, figure("Largest angular acceleration.", "rad/s²", key="peak_acceleration_rad_s2")]:
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

    @property
    def segments(self) -> Annotated[list[Segment], figure("The profile, piece by piece.")]:
        """Its pieces for a scenario file."""
        rates = [0.0, *(leg.to for leg in self.legs)]
        return [
            Segment("hold", None, leg.duration) if leg.to == rate else Segment("ramp", leg.to, leg.duration)
            for rate, leg in zip(rates, self.legs, strict=False)
        ]

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
