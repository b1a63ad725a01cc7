"""Motions of a table that are made of others: over the gain of a reference, and joined at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.model.world_model import Spin, SpinState

__all__ = ["JoinedSpin", "ScaledSpin", "State"]


@dataclass(frozen=True)
class State:
    """Angle (rad), rate (rad/s) and angular acceleration (rad/s²), each of shape (n,)."""

    angle: NDArray[np.float64]
    rate: NDArray[np.float64]
    acceleration: NDArray[np.float64]


class ScaledSpin:
    """A motion over the gain of the reference that it was read by."""

    def __init__(self, spin: Spin, gain: float) -> None:
        self._spin, self._gain = spin, gain

    def at(self, t: ArrayLike) -> SpinState:
        """Return the state at times (n,), s."""
        state = self._spin.at(t)
        return State(state.angle / self._gain, state.rate / self._gain, state.acceleration / self._gain)


class JoinedSpin:
    """One motion up to a time, s, and another from there on."""

    def __init__(self, before: Spin, after: Spin, at: float) -> None:
        self._before, self._after, self._at = before, after, at

    def at(self, t: ArrayLike) -> SpinState:
        """Return the state at times (n,), s."""
        times = np.asarray(t, dtype=float)
        late, early = self._after.at(times), self._before.at(times)
        after = times > self._at
        return State(
            np.where(after, late.angle, early.angle),
            np.where(after, late.rate, early.rate),
            np.where(after, late.acceleration, early.acceleration),
        )
