"""Effects that a diagnosis adds to a prediction itself: a function at a place of the rig, which no simulation has."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.model.world_model import Effect, PlacedArray, SpinState
from gfimu.motion.body_drive import BodyDrive

__all__ = ["AddedEffect", "RigState", "split"]


_NO_BODY = "effect 'unlisted': it is an error of a free body, and this rig has an axis; leave the effect out"
_NO_TABLE = "effect 'unlisted': it is an error of a table or of its angle, and this rig has none; leave the effect out"


@dataclass(frozen=True)
class _Magnitudes:
    """Magnitudes of the rate and of the angular acceleration of a body, which has no one angle."""

    rate: NDArray[np.float64]
    acceleration: NDArray[np.float64]

    @property
    def angle(self) -> NDArray[np.float64]:
        """There is none."""
        raise InputError(_NO_TABLE)


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
        The array on the table, or on its body; None where the simulation does not say how it stands.
    body : BodyDrive, optional
        Rate and specific force of a free body, whose spin then holds the magnitudes of rate and angular acceleration.
    """

    t: NDArray[np.float64]
    spin: SpinState
    readings: NDArray[np.float64]
    temperature: NDArray[np.float64] | None
    period: float
    placed: PlacedArray | None
    body: BodyDrive | None = None

    @classmethod
    def of_body(
        cls,
        array: AccelerometerArray,
        body: BodyDrive,
        t: NDArray[np.float64],
        readings: NDArray[np.float64],
        temperature: NDArray[np.float64] | None,
    ) -> RigState:
        """Return the state of an array on a free body, at times since its run began."""
        speed, quickness = (np.linalg.norm(one, axis=1) for one in body.rate_at())
        spin = _Magnitudes(speed, quickness)
        period = float(np.median(np.diff(t))) if len(t) > 1 else 1.0
        return cls(t, spin, readings, temperature, period, PlacedArray(array.axes, array.positions, np.zeros(3)), body)

    @property
    def free_body(self) -> BodyDrive:
        """The motion of a free body, where it is one."""
        if self.body is None:
            raise InputError(_NO_BODY)
        return self.body

    @property
    def on_body(self) -> PlacedArray:
        """The array on its free body."""
        if self.body is None or self.placed is None:
            raise InputError(_NO_BODY)
        return self.placed

    @property
    def on_table(self) -> PlacedArray:
        """The array on the table, where the simulation says how it stands."""
        if self.placed is None or self.body is not None:
            raise InputError(_NO_TABLE)
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
