"""Effects of a body that moves freely with its gyro: the gyro as the reference, and chips on clocks of their own."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.base.units import RATIO
from sim.effects.base import LARGEST_TURN, Effect, Pattern, Size, chip_patterns
from sim.world import World

__all__ = ["ChipDelay", "GyroLatency", "GyroMisalignment", "GyroScale"]

_AXES = "xyz"
_DEGREE = np.pi / 180.0


class ChipDelay(Effect):
    """Chips that are sampled late, each by a delay of its own.

    The chips are not triggered together: each gives its latest sample when it is asked, or has a filter with another
    group delay.

    Notes
    -----
    :formula: y = f(t + δ)
    :symbols: δ = {chip}_s
    :size: 1 ms, by choice: a tenth of the sample period at 100 Hz.
    :example: a2_s = 0.002, a3_s = -0.001
    :experiment: Rock the array fast. The residual of a chip is its delay times the rate of change of its reading, the
        same with both signs of the motion. On a free body only differences between chips are seen: what all share is a
        delay of the gyro.
    :recordings: MIMU4444: the channels disagree in proportion to how fast their readings change, as if each chip were
        sampled at an instant of its own, 1.6 ms rms apart; these delays change from sample to sample, so that this
        effect, a constant delay, does not explain them.
    """

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
    """The gyro that drives the twin is late against the accelerometers.

    Gyro and accelerometers have filters of different group delay, or the gyro is read after them.

    Notes
    -----
    :formula: Ω′ = Ω(t − δ)
    :symbols: δ = delay_s
    :size: 2 ms, by choice: group delays of MEMS gyros at bandwidths of some 100 Hz.
    :example: delay_s = 0.002
    :experiment: Shake the body about one axis with quick reversals: the channels disagree in proportion to the rate of
        change of the centripetal and tangential parts. A delay that all chips share is the same by another name.
    :recordings: MIMU4444: −1.60 ± 0.02 ms in one recording, −1.62 ± 0.03 ms in the other: the accelerometers lag behind
        the gyros.
    """

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
    """The gyro that drives the twin has wrong gains: it reads (1 + ratio)·ω along each axis.

    The gains of the reference gyro are off, axis by axis.

    Notes
    -----
    :formula: Ω′ = (1 + s)·Ω
    :symbols: s = {axis}
    :size: 2 %. MPU-9150: ±3 % by its data sheet.
    :example: x = 0.02, z = -0.015
    :experiment: Turn about each axis in turn, at several rates, through a known number of turns.
    """

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
        single = (Pattern(f"gyro axis {axis}", unit[:, [index]]) for index, axis in enumerate(_AXES))
        return (Pattern("all axes", unit), Pattern("all axes alike", np.ones((3, 1))), *single)

    def apply(self, world: World) -> World:
        """Multiply what the gyro reads."""
        return world.changed(gyro_matrix=np.diag(1.0 + self.vector(_AXES)) @ world.gyro_matrix)


class GyroMisalignment(Effect):
    """The gyro that drives the twin is turned against the body.

    The gyro chip, or the board that carries it, is turned against the array.

    Notes
    -----
    :formula: Ω′ = Ω − n×Ω
    :symbols: n = {x,y,z}_rad
    :size: 0.5°, by choice, as of a soldered chip.
    :example: x_rad = 0.006, y_rad = -0.005
    :experiment: Turn about each axis in turn: the gyro then shows a share on the other two.
    """

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
