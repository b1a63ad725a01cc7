"""Effects that a diagnosis adds to a prediction itself: a function at a place of the rig, which no simulation has."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.model.world_model import Effect, PlacedArray, SpinState

__all__ = ["AddedEffect", "RigState", "split"]


@dataclass(frozen=True)
class RigState:
    """What a rig does at the samples of a stretch, as the simulation has it.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times since the run began, s.
    spin : SpinState
        Angle (rad), rate (rad/s) and angular acceleration (rad/s²) of the table, each (n,).
    readings : ndarray, shape (n, c)
        Channels as predicted, m/s².
    temperature : ndarray, shape (n,), optional
        Temperature of the board, °C.
    period : float
        Sample period, s.
    placed : PlacedArray, optional
        The array on the table; None where the simulation does not say how it stands.
    """

    t: NDArray[np.float64]
    spin: SpinState
    readings: NDArray[np.float64]
    temperature: NDArray[np.float64] | None
    period: float
    placed: PlacedArray | None

    @property
    def on_table(self) -> PlacedArray:
        """The array on the table, where the simulation says how it stands."""
        assert self.placed is not None
        return self.placed


class AddedEffect(ABC):
    """An effect whose first order is added to what a simulation predicts."""

    name: str
    place: str = "located"

    @abstractmethod
    def added(self, state: RigState) -> NDArray[np.float64]:
        """Return what it adds to channels and reference, shape (n, c + 1)."""

    @abstractmethod
    def size_values(self, array: AccelerometerArray) -> NDArray[np.float64]:
        """Return the linear coordinates."""

    def shape_values(self) -> dict[str, float]:
        """Return no shape."""
        return {}

    @property
    def parameters(self) -> dict[str, Any]:
        """No parameters of the contract."""
        return {}


def split(effects: Sequence[Effect]) -> tuple[list[Effect], list[AddedEffect]]:
    """Return the effects of the simulation, and those that are added to what it predicts."""
    added = [effect for effect in effects if isinstance(effect, AddedEffect)]
    return [effect for effect in effects if not isinstance(effect, AddedEffect)], added
