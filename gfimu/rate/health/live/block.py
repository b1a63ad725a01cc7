"""A block of a live stream, as a picture shows it: readings, rate, health of the channels, state of the stream."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gfimu.rate.health.fault import HealthCode
from gfimu.rate.result import RateEstimate

__all__ = ["Event", "Health", "LiveBlock", "StreamState"]


class Event(NamedTuple):
    """Something that happened in the stream."""

    t_s: float
    text: str
    is_fault: bool = False
    """Whether it is about a fault of a channel."""


class Health(NamedTuple):
    """Health of the channels from a time on."""

    t_s: float
    codes: tuple[HealthCode | None, ...]
    """One per channel; None while it is not watched."""


class StreamState(NamedTuple):
    """How the stream comes in at a time."""

    t_s: float
    rate_hz: float
    """Samples that came per second of the host's clock, Hz."""
    lost: int
    """Samples lost so far."""
    corrupt: int
    """Frames with a wrong checksum so far."""
    delay_s: float
    """Age of the newest sample when it was read, beyond the least of the last minute, s."""
    behind_s: float
    """Time of the stream that the rate filter has still to do, s."""


@dataclass(frozen=True)
class LiveBlock:
    """What came in since the block before.

    Parameters
    ----------
    t_s : ndarray, shape (n,)
        Times of the readings, s.
    readings : ndarray, shape (n, c)
        Readings, m/s², NaN where missing.
    rate_t_s : ndarray, shape (m,)
        Times of the rate that became ready, s; it may lie behind the readings.
    omega, omega_std : ndarray, shape (m, 3)
        Angular rate in body axes and its standard deviation, rad/s.
    sign_probability : ndarray, shape (m,)
        Probability that ``omega`` and not ``−omega`` is the rate.
    health : tuple of Health
        Health of the channels, where it was looked at.
    states : tuple of StreamState
        State of the stream, where it was looked at.
    events : tuple of Event
        What happened.
    """

    t_s: NDArray[np.float64]
    readings: NDArray[np.float64]
    rate_t_s: NDArray[np.float64]
    omega: NDArray[np.float64]
    omega_std: NDArray[np.float64]
    sign_probability: NDArray[np.float64]
    health: tuple[Health, ...] = ()
    states: tuple[StreamState, ...] = ()
    events: tuple[Event, ...] = ()

    @classmethod
    def of(cls, t: NDArray[np.float64], readings: NDArray[np.float64], rates: Sequence[RateEstimate] = ()) -> LiveBlock:
        """Return a block of readings (n, c), m/s², at times (n,), s, and of estimates that became ready."""
        none = np.empty(0)
        made = [cls(t, readings, none, np.empty((0, 3)), np.empty((0, 3)), none)]
        for rate in rates:
            chance = np.ones(len(rate)) if rate.sign_probability is None else rate.sign_probability
            made.append(cls(t[:0], readings[:0], rate.t_s, rate.omega, rate.std, chance))
        return cls.join(made)

    @classmethod
    def join(cls, blocks: Sequence[LiveBlock]) -> LiveBlock:
        """Put blocks of one stream together, at least one."""

        def joined(values: list[Any]) -> Any:
            return np.concatenate(values) if isinstance(values[0], np.ndarray) else sum(values, ())

        return cls(*(joined([getattr(block, one.name) for block in blocks]) for one in fields(cls)))
