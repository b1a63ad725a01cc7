"""Effects of a body that moves freely with its gyro: the gyro as the reference, and chips on clocks of their own."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from gfimu.geometry.array import AccelerometerArray
from gfimu.units import RATIO
from sim.effects.base import LARGEST_TURN, Effect, Pattern, Size, chip_patterns
from sim.world import World

__all__ = ["ChipDelay", "GyroLatency", "GyroMisalignment", "GyroScale"]

_AXES = "xyz"
_DEGREE = np.pi / 180.0


class ChipDelay(Effect):
    """Chips that are sampled late, each by a delay of its own."""

    name = "chip_delay"
    summary = "chips are sampled late, each by a delay of its own"
    place = "timing"
    separated_by = "faster changes of the specific force"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One delay per chip."""
        return tuple(Size(f"{chip.name}_s", "s", 1e-3, step=0.1) for chip in array.chips)

    @classmethod
    def patterns(cls, array: AccelerometerArray) -> tuple[Pattern, ...]:
        """Return all chips free about their mean, or one chip: what all share is the gyro's latency."""
        count = len(array.chips)
        free = np.linalg.svd(np.eye(count) - 1.0 / count)[0][:, : count - 1]
        return (Pattern("all chips", free), *chip_patterns(array, 1)[1:])

    def apply(self, world: World) -> World:
        """Sample each chip late by its delay."""
        delay = np.zeros(len(world.array.chips)) if world.chip_delay is None else world.chip_delay
        return world.changed(chip_delay=delay + self.vector([f"{chip.name}_s" for chip in world.array.chips]))


class GyroLatency(Effect):
    """The gyro that drives the twin is late against the accelerometers."""

    name = "gyro_latency"
    summary = "the reference gyro is late against the accelerometers (early where negative)"
    place = "reference"
    separated_by = "faster changes of the rate"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One delay of either sign."""
        return (Size("delay_s", "s", 2e-3, step=0.1),)

    def apply(self, world: World) -> World:
        """Delay the reference."""
        return world.changed(tacho_delay=world.tacho_delay + self.value("delay_s"))


class GyroScale(Effect):
    """The gyro that drives the twin has wrong gains: it reads (1 + ratio)·ω along each axis."""

    name = "gyro_scale"
    summary = "the reference gyro has wrong gains"
    place = "reference"
    separated_by = "rotation about each axis in turn, at several rates"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One ratio per axis."""
        # Ten times the ±3 % that the MPU-9150's data sheet allows.
        return tuple(Size(axis, RATIO, 0.02, bound=0.3) for axis in _AXES)

    @classmethod
    def patterns(cls, array: AccelerometerArray) -> tuple[Pattern, ...]:
        """Return all axes free, all alike, or one axis."""
        unit = np.eye(3)
        single = (Pattern(f"gyro axis {axis}", unit[:, [place]]) for place, axis in enumerate(_AXES))
        return (Pattern("all axes", unit), Pattern("all axes alike", np.ones((3, 1))), *single)

    def apply(self, world: World) -> World:
        """Multiply what the gyro reads."""
        return world.changed(gyro_matrix=np.diag(1.0 + self.vector(_AXES)) @ world.gyro_matrix)


class GyroMisalignment(Effect):
    """The gyro that drives the twin is turned against the body."""

    name = "gyro_misalignment"
    summary = "the reference gyro is turned against the body"
    place = "reference"
    separated_by = "rotation about each axis in turn"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """Rotation vector of the gyro in the body frame."""
        return tuple(Size(f"{axis}_rad", "rad", 0.5 * _DEGREE, bound=LARGEST_TURN) for axis in _AXES)

    def apply(self, world: World) -> World:
        """Turn the gyro's axes by the rotation vector: it reads Rᵀω."""
        turn = Rotation.from_rotvec(self.vector([f"{axis}_rad" for axis in _AXES]))
        return world.changed(gyro_matrix=world.gyro_matrix @ turn.as_matrix().T)
