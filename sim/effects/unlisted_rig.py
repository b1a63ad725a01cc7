"""Points of the grammar in the rig: a reference that reads wrong, an array that leans."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from gfimu.array.array import AccelerometerArray
from sim.effects.base import LARGEST_TURN, Size
from sim.effects.grammar import (
    ACCELERATION,
    CONSTANT,
    RATE,
    RATE_CUBED,
    RATE_SQUARED,
    SIGNED_SQUARE,
    SPEED,
    TURNS,
    Unlisted,
)
from sim.world import Lean, World

__all__ = [
    "LeanByAcceleration",
    "LeanByRate",
    "LeanByRateSquared",
    "LeanByTurns",
    "ReferenceCube",
    "ReferenceEven",
    "ReferenceOffset",
    "ReferenceSpeed",
    "ReferenceSquare",
]


class _OfReference(Unlisted):
    """The reference reads c · f(ω, α) too much."""

    place = "reference"
    grammar_place = "reference"
    error: ClassVar[float] = 0.1
    """Error in an ordinary run that would surprise nobody, rad/s."""

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        one = cls.dependence
        return (Size(one.key("error_rad_s"), one.per("rad/s"), cls.error / one.usual),)

    def apply(self, world: World) -> World:
        """Add the error to the reading."""
        size, function = self.value(self.dependence.key("error_rad_s")), self.dependence.of
        return world.changed(
            reference_steps=(*world.reference_steps, lambda reading, spin, t: reading + size * function(spin))
        )


class ReferenceOffset(_OfReference):
    """A reference with a constant offset.

    The tachometer reads a constant amount at rest: an amplifier that was not zeroed, the bias of a gyro.

    Notes
    -----
    :formula: Ω′ = Ω + e
    :symbols: e = error_rad_s
    :size: 0.1 rad/s, by choice.
    :example: error_rad_s = 0.05
    :experiment: Hold the table still and read the reference.
    """

    name = "reference_offset"
    summary = "the reference is off by a constant"
    dependence = CONSTANT


class ReferenceSpeed(_OfReference):
    """A reference whose gain differs between the directions.

    The gain of the reference is larger in one direction than in the other: brushes of a tachogenerator, a rectifying
    stage.

    Notes
    -----
    :formula: Ω′ = Ω + e·abs(ω)
    :symbols: e = error_rad_s_per_rad_s
    :size: 0.1 rad/s at 10 rad/s, by choice.
    :example: error_rad_s_per_rad_s = 0.01
    :experiment: Repeat the same speeds in both directions against counted turns.
    """

    name = "reference_by_direction"
    summary = "the reference has another gain in one direction than in the other"
    dependence = SPEED


class ReferenceSquare(_OfReference):
    """A reference whose gain grows with the rate.

    The gain of the reference changes in proportion to the rate, equally in both directions: a tachogenerator under the
    load of its own current.

    Notes
    -----
    :formula: Ω′ = Ω + e·ω·abs(ω)
    :symbols: e = error_rad_s_per_rad2_s2
    :size: 0.1 rad/s at 10 rad/s, by choice.
    :example: error_rad_s_per_rad2_s2 = 0.001
    :experiment: A second reference, such as a gyro on the table or a stopwatch over counted turns, shows it at once.
        With one: runs at several speeds in both directions, as the channels know ω² without it.
    """

    name = "reference_rate_squared"
    summary = "the gain of the reference changes in proportion to the rate"
    dependence = SIGNED_SQUARE


class ReferenceEven(_OfReference):
    """A reference whose error has one sign in both directions and grows with the rate squared.

    The reference is off by the same amount in both directions, in proportion to ω²: a gyro that is sensitive to the
    centripetal acceleration.

    Notes
    -----
    :formula: Ω′ = Ω + e·ω²
    :symbols: e = error_rad_s_per_rad2_s2
    :size: 0.1 rad/s at 10 rad/s, by choice.
    :example: error_rad_s_per_rad2_s2 = 0.001
    :experiment: Repeat the same speeds in both directions: the error of a gain changes its sign with the direction,
        this one does not. A gyro is also moved onto the axis.
    """

    name = "reference_error_by_rate_squared"
    summary = "the reference is off in proportion to the rate squared, the same way in both directions"
    dependence = RATE_SQUARED


class ReferenceCube(_OfReference):
    """A reference whose gain grows with the rate squared.

    The gain of the reference changes with ω²: saturation of a tachogenerator or of a gyro near its range.

    Notes
    -----
    :formula: Ω′ = Ω + e·ω³
    :symbols: e = error_rad_s_per_rad3_s3
    :size: 0.1 rad/s at 10 rad/s, by choice.
    :example: error_rad_s_per_rad3_s3 = 0.0001
    :experiment: A second reference, such as a gyro on the table or a stopwatch over counted turns, shows it at once.
        With one: runs at several speeds in both directions, as the channels know ω² without it.
    """

    name = "reference_rate_cubed"
    summary = "the gain of the reference changes with the rate squared"
    dependence = RATE_CUBED


class _OfCube(Unlisted):
    """The array leans about its foot by a rotation vector across the axis that follows the motion."""

    place = "geometry"
    grammar_place = "array on the table"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        one, usual = cls.dependence, 4e-3 / cls.dependence.usual
        bound = LARGEST_TURN / one.usual
        return tuple(Size(one.key(f"{axis}_rad"), one.per("rad"), usual, bound=bound) for axis in "xy")

    def apply(self, world: World) -> World:
        """Let the array lean."""
        vector = np.array([*self.vector([self.dependence.key(f"{axis}_rad") for axis in "xy"]), 0.0])
        if not vector.any():
            return world
        return world.changed(leans=(*world.leans, Lean(vector, self.dependence.of)))


class LeanByRateSquared(_OfCube):
    """An array that leans under the centrifugal force.

    The foot of the array is compliant: under the centrifugal force the array leans by n about it, in proportion to ω².
    F is the specific force at the chip, r its place from the foot.

    Notes
    -----
    :formula: n = ω²·ν;
        y = f + (n×a)·F + a·(n̈×r + 2·ω·z×(ṅ×r) + α·z×(n×r) + ω²·z×(z×(n×r)))
    :symbols: ν = {x,y}_rad_per_rad2_s2
    :size: 4 mrad at 10 rad/s, by choice.
    :example: x_rad_per_rad2_s2 = 4e-5, y_rad_per_rad2_s2 = -2e-5
    :experiment: Spin at several speeds, then clamp the foot or brace the top of the array: the lean disappears.
    """

    name = "lean_by_rate_squared"
    summary = "the array leans with the square of the rate"
    dependence = RATE_SQUARED


class LeanByRate(_OfCube):
    """An array that leans in proportion to the rate, to opposite sides in the two directions.

    The array leans by n in proportion to the rate, with the sign of the rate: the gyroscopic torque of a
    part that spins within it, such as a fan.

    Notes
    -----
    :formula: n = ω·ν;
        y = f + (n×a)·F + a·(n̈×r + 2·ω·z×(ṅ×r) + α·z×(n×r) + ω²·z×(z×(n×r)))
    :symbols: ν = {x,y}_rad_per_rad_s
    :size: 4 mrad at 10 rad/s, by choice.
    :example: x_rad_per_rad_s = 4e-4, y_rad_per_rad_s = -2e-4
    :experiment: Repeat the same speeds in both directions: the lean changes its side.
    """

    name = "lean_by_rate"
    summary = "the array leans with the rate"
    dependence = RATE


class LeanByAcceleration(_OfCube):
    """An array that leans when the table accelerates.

    A tall array on a compliant foot leans back while the table accelerates.

    Notes
    -----
    :formula: n = α·ν;
        y = f + (n×a)·F + a·(n̈×r + 2·ω·z×(ṅ×r) + α·z×(n×r) + ω²·z×(z×(n×r)))
    :symbols: ν = {x,y}_rad_per_rad_s2
    :size: 4 mrad at 20 rad/s², by choice.
    :example: x_rad_per_rad_s2 = 2e-4, y_rad_per_rad_s2 = -1e-4
    :experiment: Make slow and fast ramps between the same two speeds: the lean occurs during the ramps alone, in
        proportion to the acceleration.
    """

    name = "lean_by_acceleration"
    summary = "the array leans with the angular acceleration"
    dependence = ACCELERATION


class LeanByTurns(_OfCube):
    """An array that is pulled over by a cable as it winds up.

    A cable that winds up pulls the array over, in proportion to the angle turned since the start.

    Notes
    -----
    :formula: n = θ·ν;
        y = f + (n×a)·F + a·(n̈×r + 2·ω·z×(ṅ×r) + α·z×(n×r) + ω²·z×(z×(n×r)))
    :symbols: ν = {x,y}_rad_per_rad
    :size: 4 mrad after 20 rad, by choice.
    :example: x_rad_per_rad = 2e-4, y_rad_per_rad = -1e-4
    :experiment: Turn some revolutions one way, rest, and turn back: the lean follows the angle. Replace the
        cable by a battery and a logger: the lean disappears.
    """

    name = "lean_by_turns"
    summary = "the array leans with the angle turned (a cable that winds up)"
    dependence = TURNS
