"""Search for table profiles: a unit cube of parameters, each point a profile within the limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gfimu.array.smooth_ramp import PEAK_OF_RAMP
from gfimu.base.errors import InputError
from gfimu.diagnosis.design.table_profile import Leg, TableProfile

__all__ = ["Limits", "improve", "plain_profile", "profile_of", "starting_points"]

_LEGS = 8
_PARAMETERS = 3 * _LEGS + 5
_SHORTEST_RAMP = 0.25
_SHORTEST_REVERSAL = 0.1
_SHORTEST_HOLD = 0.2
_GENTLEST = 6.0  # times the shortest ramp that the acceleration allows
_TIME_STEP = 0.01
_RATE_STEP = 1e-3
_CLIMBED = 3  # starts that are improved further


@dataclass(frozen=True)
class Limits:
    """What a table may do.

    Parameters
    ----------
    rate : float
        Largest rate, rad/s.
    acceleration : float
        Largest angular acceleration, rad/s².
    duration : float
        Length of a recording, s.
    """

    rate: float
    acceleration: float
    duration: float
    longest: ClassVar[float] = 1e4  # numerical: s, of a planned run

    def __post_init__(self) -> None:
        for name, value in (("rate", self.rate), ("acceleration", self.acceleration), ("duration", self.duration)):
            if not (math.isfinite(value) and value > 0):
                raise InputError(f"limit of {name} {value}: give a positive number")
        if self.duration > self.longest:
            raise InputError(f"limit of duration {self.duration:g}: give {self.longest:g} s at most")


def plain_profile(limits: Limits) -> TableProfile:
    """Return what is done without design: rest, one ramp to a speed, a long hold, a ramp back, rest."""
    return profile_of(_point([1.0], hold=0.5, gentleness=0.5), limits)


def profile_of(parameters: NDArray[np.float64], limits: Limits) -> TableProfile:
    """Return the profile of a point in the unit cube.

    Parameters
    ----------
    parameters : ndarray, shape (29,)
        Rate, gentleness of the ramp and length of the hold of eight legs; then how many legs are used, and of a burst
        of reversals (a chirp at full acceleration) its share of the time, its leg, its fastest ramp and its spread.
    limits : Limits
        Limits; the profile has exactly their duration.
    """
    table = parameters[: 3 * _LEGS].reshape(_LEGS, 3)
    used, share, place, fastest, spread = parameters[3 * _LEGS :]
    rest = min(3.0, 0.06 * limits.duration)
    burst_time = limits.duration * min(max(share - 0.3, 0.0), 0.6)
    time = limits.duration - 2 * rest - burst_time
    count = max(min(1 + int(used * (_LEGS - 1e-9)), int(time / (2 * _SHORTEST_RAMP)) - 1), 1)
    rates = limits.rate * (2 * table[:count, 0] - 1)
    ramps = _shortest(rates, limits)
    while ramps.sum() > 0.9 * time and np.abs(rates).max() > _RATE_STEP:
        rates = 0.8 * rates
        ramps = _shortest(rates, limits)
    gentle = ramps * _GENTLEST ** np.append(table[:count, 1], 0.0)
    room = max(0.95 * time - ramps.sum(), 0.0)
    ramps = ramps + (gentle - ramps) * min(1.0, room / max(gentle.sum() - ramps.sum(), 1e-9))
    weights = table[:count, 2] + 1e-3
    holds = max(time - ramps.sum(), 0.0) * weights / weights.sum()
    holds[holds < _SHORTEST_HOLD] = 0.0

    legs = [Leg(0.0, rest)]
    for leg in range(count):
        legs += [Leg(float(rates[leg]), float(ramps[leg])), Leg(float(rates[leg]), float(holds[leg]))]
        if leg == min(int(place * count), count - 1):
            legs += _burst(float(rates[leg]), burst_time, fastest, spread, limits)
    legs.append(Leg(0.0, float(ramps[-1])))
    return _finished(legs, limits)


def _shortest(rates: NDArray[np.float64], limits: Limits) -> NDArray[np.float64]:
    """Shortest ramps through rates (k,) from rest and back to it, shape (k + 1,), s."""
    steps = np.abs(np.diff([0.0, *rates, 0.0]))
    return np.asarray(np.maximum(PEAK_OF_RAMP * steps / limits.acceleration, _SHORTEST_RAMP))


def _burst(centre: float, time: float, fastest: float, spread: float, limits: Limits) -> list[Leg]:
    """Reversals about a rate at full acceleration, ever faster, ``time`` long."""
    fast = _SHORTEST_REVERSAL + 0.4 * fastest
    slow = fast * (1.0 + 4.0 * spread)
    count = 2 * int(time / (fast + slow))
    if count < 4:
        return [Leg(centre, time)] if time > 0 else []
    ramps = np.geomspace(slow, fast, count)
    ramps *= time / ramps.sum()
    swing = 0.5 * limits.acceleration / PEAK_OF_RAMP * np.minimum(ramps[:-1], ramps[1:])
    targets = np.clip(centre + swing * (-1.0) ** np.arange(count - 1), -limits.rate, limits.rate)
    return [Leg(float(to), float(ramp)) for to, ramp in zip([*targets, centre], ramps, strict=True)]


def _finished(legs: Sequence[Leg], limits: Limits) -> TableProfile:
    """Round to what a person can type in, keep the limits, and fill up or cut to the duration."""
    done: list[Leg] = []
    rate = 0.0
    for leg in legs:
        to = math.trunc(leg.to / _RATE_STEP) * _RATE_STEP
        least = PEAK_OF_RAMP * abs(to - rate) / limits.acceleration
        ticks = math.ceil(max(leg.duration, least) / _TIME_STEP - 1e-6)
        if ticks > 0:
            done.append(Leg(round(to, 3), round(ticks * _TIME_STEP, 2)))
            rate = to
    holds = [index for index in range(len(done)) if done[index].to == (done[index - 1].to if index else 0.0)]
    excess = sum(leg.duration for leg in done) + min(1.0, 0.02 * limits.duration) - limits.duration
    for place in sorted(holds, key=lambda place: -done[place].duration):
        cut = math.ceil(min(max(excess, 0.0), 0.9 * done[place].duration) / _TIME_STEP) * _TIME_STEP
        done[place] = Leg(done[place].to, round(done[place].duration - cut, 2))
        excess -= cut
    left = limits.duration - sum(leg.duration for leg in done)
    done.append(Leg(0.0, max(round(left, 6), _TIME_STEP)))
    return TableProfile(_joined(leg for leg in done if leg.duration > 0))


def _joined(legs: Iterable[Leg]) -> tuple[Leg, ...]:
    """Join holds that follow each other."""
    joined: list[Leg] = []
    for leg in legs:
        before = joined[-1].to if joined else 0.0
        earlier = joined[-2].to if len(joined) > 1 else 0.0
        if joined and leg.to == before == earlier:
            joined[-1] = Leg(leg.to, round(joined[-1].duration + leg.duration, 6))
        else:
            joined.append(leg)
    return tuple(joined)


def starting_points(rng: np.random.Generator, count: int) -> list[NDArray[np.float64]]:
    """Return points of the unit cube to start from: usual experiments first, then by chance."""
    usual = [
        _point([1.0], hold=0.5, gentleness=0.5),
        _point([0.75, 1.0, 0.25, 0.0], hold=0.5),
        _point([1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0], hold=0.1),
        _point([0.55, 0.6, 0.75, 1.0, 0.45, 0.4, 0.25, 0.0], hold=0.5, gentleness=0.5),
        _point([0.75, 0.25], hold=0.5, burst=0.7),
    ]
    chance = [rng.random(_PARAMETERS) for _ in range(max(count - len(usual), 0))]
    return [*usual, *chance][:count]


def _point(rates: Sequence[float], *, hold: float, gentleness: float = 0.0, burst: float = 0.0) -> NDArray[np.float64]:
    parameters = np.full(_PARAMETERS, 0.5)
    table = parameters[: 3 * _LEGS].reshape(_LEGS, 3)
    table[: len(rates), 0] = rates
    table[:, 1], table[:, 2] = gentleness, hold
    parameters[3 * _LEGS :] = (len(rates) - 0.5) / _LEGS, burst, 0.0, 0.0, 0.5
    return parameters


def improve(
    ranked: Sequence[tuple[float, NDArray[np.float64]]],
    score: Callable[[TableProfile], float],
    limits: Limits,
    rng: np.random.Generator,
    evaluations: int,
    report: Callable[[float], None],
) -> TableProfile:
    """Climb from the best starts by random steps whose size follows their success (1+1 evolution strategy).

    Parameters
    ----------
    ranked : sequence of (float, ndarray)
        Starts with their scores.
    score : callable
        What to maximise.
    limits : Limits
        Limits.
    rng : numpy.random.Generator
        Random number generator.
    evaluations : int
        How many profiles to try.
    report : callable
        Called with the share done.
    """
    climbed = sorted(ranked, key=lambda pair: -pair[0])[:_CLIMBED]
    tried = 0
    for index, (start_value, start) in enumerate(climbed):
        value, point, step = start_value, start, 0.15
        for _ in range(evaluations // len(climbed)):
            chosen = rng.random(_PARAMETERS) < 0.3
            trial = np.abs(point + step * chosen * rng.standard_normal(_PARAMETERS))
            trial = np.clip(np.where(trial > 1.0, 2.0 - trial, trial), 0.0, 1.0)
            reached = score(profile_of(trial, limits))
            # One success in five keeps the step (Rechenberg).
            better = reached > value
            step = min(step * 1.5, 0.4) if better else max(step * 1.5**-0.25, 0.01)
            value, point = (reached, trial) if better else (value, point)
            tried += 1
            report(tried / evaluations)
        climbed[index] = (value, point)
    return profile_of(max(climbed, key=lambda pair: pair[0])[1], limits)
