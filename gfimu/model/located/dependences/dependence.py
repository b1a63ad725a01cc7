"""`Dependence`: a linear family of functions of what a rig does, with the prior of its coefficients."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.model.located.dependences.regressors import Regressor
from gfimu.model.located.rig_state import RigState
from gfimu.model.located.usual import USUAL

__all__ = ["Dependence", "covariance_root"]

_Floats = NDArray[np.float64]


class Dependence(ABC):
    """A linear family of functions of what a rig does.

    ``name`` identifies it in ``verdict.json``, ``kind`` is the same for all that mean the same to a person, ``words``
    say how an error goes with it, ``looks`` is what it costs to have been chosen among many alike, nats, ``memory_s``
    how long it remembers the drive, and ``of_one_recording`` whether it is of absolute time.
    """

    name: str
    kind: str
    words: str
    looks: float = 0.0
    memory_s: float = 0.0
    of_one_recording: bool = False

    @property
    @abstractmethod
    def roots(self) -> tuple[_Floats, ...]:
        """Roots (K, k) of the prior covariance of the coefficients, one for each length scale that is tried."""

    @abstractmethod
    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples, (n, K), or (c + 1, n, K) where each observation has its own."""

    @property
    def abscissa(self) -> Regressor | None:
        """What a picture of the function is drawn over; None where it is no function of one quantity."""
        return None

    def near(self, width: float) -> list[Dependence]:
        """Return dependences of another shape nearby, where it has a shape: a frequency, a damping, an order."""
        del width
        return []

    def highest_hz(self, fastest: float) -> float:
        """Return the highest frequency that it adds to a motion at rates up to ``fastest``, rad/s; zero if none."""
        del fastest
        return 0.0

    @property
    def count(self) -> int:
        """Number K of functions."""
        return len(self.roots[0])

    @property
    @abstractmethod
    def numbers(self) -> dict[str, Any]:
        """What makes it, beside its name: numbers, or names, as a file holds them (`dependence_of`)."""


def covariance_root(centres: _Floats, length: float) -> _Floats:
    """Return a root (K, k) of the squared-exponential covariance at centres (K,)."""
    power, turn = np.linalg.eigh(np.exp(-0.5 * ((centres[:, None] - centres) / length) ** 2))
    kept = power > USUAL.least_prior * power[-1]
    return np.asarray(turn[:, kept] * np.sqrt(power[kept]))
