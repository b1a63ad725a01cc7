"""A grammar behind the list of effects: a place in the chain times a dependence, for what has no name of its own.

A point of the grammar enters the forward model at its physical place, so that all it does downstream is computed: a
reference that reads wrong changes no channel; an array that leans moves its chips and turns their axes; a supply that
sags lowers the gain of every chip. Each is a small class: a place (its base) and a function of the motion.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gfimu.geometry.array import AccelerometerArray
from gfimu.units import MILLI_G, STANDARD_GRAVITY
from gfimu.world_model import SpinState
from sim.effects.base import LARGEST_TURN, Effect, Pattern, Size, channel_patterns
from sim.effects.low_pass import low_pass
from sim.world import Lean, SampleContext, World

__all__ = ["UNLISTED", "Dependence", "Unlisted"]

_RATE, _ACCELERATION, _ANGLE, _KELVIN = 10.0, 20.0, 20.0, 3.0  # rad/s, rad/s², rad and K of an ordinary run
_READ = {"rad": "rad", "rad_s": "rad/s", "rad2_s2": "rad²/s²", "rad3_s3": "rad³/s³", "rad_s2": "rad/s²"}
"""Units of keys as people read them."""


@dataclass(frozen=True)
class Dependence:
    """A function of the table's motion.

    Parameters
    ----------
    name : str
        As in ``verdict.json``, such as ``"omega^3"``.
    words : str
        For people, such as ``"rate³"``.
    unit : str
        Its unit in keys, such as ``"rad3_s3"``; empty for a constant.
    usual : float
        Its value in an ordinary run, in that unit.
    function : callable, optional
        The function of the spin, shape (n,); None where it is one of something else.
    """

    name: str
    words: str
    unit: str
    usual: float
    function: Callable[[SpinState], NDArray[np.float64]] | None = None

    def of(self, spin: SpinState) -> NDArray[np.float64]:
        """Return the function of a spin, (n,); zeros where it is one of something else."""
        return np.zeros_like(spin.rate) if self.function is None else self.function(spin)

    def key(self, quantity: str) -> str:
        """Return the key of a coefficient: what is changed, per unit of the function."""
        return f"{quantity}_per_{self.unit}" if self.unit else quantity

    def per(self, unit: str) -> str:
        """Return the unit of a coefficient as people read it."""
        return f"{unit}/({_READ[self.unit]})" if self.unit else unit


CONSTANT = Dependence("1", "a constant", "", 1.0, lambda spin: np.ones_like(spin.rate))
SPEED = Dependence("|omega|", "|rate|", "rad_s", _RATE, lambda spin: np.abs(spin.rate))
RATE = Dependence("omega", "rate", "rad_s", _RATE, lambda spin: spin.rate)
RATE_SQUARED = Dependence("omega^2", "rate²", "rad2_s2", _RATE**2, lambda spin: spin.rate**2)
SIGNED_SQUARE = Dependence(
    "omega|omega|", "rate · |rate|", "rad2_s2", _RATE**2, lambda spin: spin.rate * abs(spin.rate)
)
RATE_CUBED = Dependence("omega^3", "rate³", "rad3_s3", _RATE**3, lambda spin: spin.rate**3)
ACCELERATION = Dependence("alpha", "angular acceleration", "rad_s2", _ACCELERATION, lambda spin: spin.acceleration)
LOAD = Dependence("|alpha|", "|angular acceleration|", "rad_s2", _ACCELERATION, lambda spin: np.abs(spin.acceleration))
TURNS = Dependence("theta", "the angle turned", "rad", _ANGLE, lambda spin: spin.angle)


class Unlisted(Effect):
    """A point of the grammar: what it changes is its base's, what it goes with is its dependence."""

    grammar_place: ClassVar[str]
    """Place in the grammar: reference, array on the table, supply, channel."""
    dependence: ClassVar[Dependence]
    separated_by = "runs at several speeds and accelerations, in both directions"
    rarity = 30.0  # by choice: all points together are as probable as one usual effect


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
    """A reference that reads unlike in both directions.

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

    The gain of the reference changes in proportion to the rate, alike in both directions: a tachogenerator under the
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
    """An array that centrifugal force leans.

    The foot of the array gives way to the centrifugal force, so that it leans by n about its foot in proportion to ω².
    F is the specific force at the chip, r its place from the foot.

    Notes
    -----
    :formula: n = ω²·ν;
        y = f + (n×a)·F + a·(n̈×r + 2·ω·z×(ṅ×r) + α·z×(n×r) + ω²·z×(z×(n×r)))
    :symbols: ν = {x,y}_rad_per_rad2_s2
    :size: 4 mrad at 10 rad/s, by choice.
    :example: x_rad_per_rad2_s2 = 4e-5, y_rad_per_rad2_s2 = -2e-5
    :experiment: Spin at several speeds, then clamp the foot or brace the top of the array: the lean goes.
    """

    name = "lean_by_rate_squared"
    summary = "the array leans with the square of the rate"
    dependence = RATE_SQUARED


class LeanByRate(_OfCube):
    """An array that leans one way or the other with the rate.

    The array leans by n in proportion to the rate, the other way in the other direction: air drag on a sail-like cover,
    a gyroscopic couple of a part that spins.

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

    A tall array on a soft foot leans back while the table accelerates.

    Notes
    -----
    :formula: n = α·ν;
        y = f + (n×a)·F + a·(n̈×r + 2·ω·z×(ṅ×r) + α·z×(n×r) + ω²·z×(z×(n×r)))
    :symbols: ν = {x,y}_rad_per_rad_s2
    :size: 4 mrad at 20 rad/s², by choice.
    :example: x_rad_per_rad_s2 = 2e-4, y_rad_per_rad_s2 = -1e-4
    :experiment: Make slow and fast ramps between the same two speeds: the lean is there during the ramps alone and in
        proportion to their steepness.
    """

    name = "lean_by_acceleration"
    summary = "the array leans with the angular acceleration"
    dependence = ACCELERATION


class LeanByTurns(_OfCube):
    """An array that a cable leans as it winds up.

    A cable that winds up pulls the array over, in proportion to the angle turned since the start.

    Notes
    -----
    :formula: n = θ·ν;
        y = f + (n×a)·F + a·(n̈×r + 2·ω·z×(ṅ×r) + α·z×(n×r) + ω²·z×(z×(n×r)))
    :symbols: ν = {x,y}_rad_per_rad
    :size: 4 mrad after 20 rad, by choice.
    :example: x_rad_per_rad = 2e-4, y_rad_per_rad = -1e-4
    :experiment: Turn some revolutions one way, rest, and turn back: the lean comes back with the angle. Replace the
        cable by a battery and a logger.
    """

    name = "lean_by_turns"
    summary = "the array leans with the angle turned (a cable that winds up)"
    dependence = TURNS


class _OfSupply(Unlisted):
    """The gain of every chip changes alike."""

    place = "sensing"
    grammar_place = "supply"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        one = cls.dependence
        return (Size(one.key("ratio"), one.per("1"), 5e-3 / one.usual),)

    def apply(self, world: World) -> World:
        """Multiply the readings by 1 + ratio · f."""
        ratio, function = self.value(self.dependence.key("ratio")), self.dependence.of
        return _sensed(world, lambda readings, context: readings * (1.0 + ratio * function(context.spin))[:, None])


class GainBySpeed(_OfSupply):
    """A supply that sags with the speed of the motor.

    The chips share the motor's supply, which sags as the motor draws current; the gain of all chips follows |ω|.

    Notes
    -----
    :formula: y = f·(1 + k·abs(ω))
    :symbols: k = ratio_per_rad_s
    :size: 0.5 % at 10 rad/s, by choice. The gain of an ADXL345 rises by 3.5 % on x and y from 2.5 to 3.3 V.
    :example: ratio_per_rad_s = 0.0005
    :experiment: Log the supply voltage of the chips. From the recording alone: steady speeds and ramps in both
        directions, as each follows another function of the motion.
    """

    name = "gain_by_speed"
    summary = "the gain of all chips changes with |rate| (a supply that sags under the motor)"
    dependence = SPEED


class GainByRateSquared(_OfSupply):
    """A gain that changes with the rate squared.

    The gain of all chips changes with ω²: a supply that sags under the air drag of a fast table.

    Notes
    -----
    :formula: y = f·(1 + k·ω²)
    :symbols: k = ratio_per_rad2_s2
    :size: 0.5 % at 10 rad/s, by choice.
    :example: ratio_per_rad2_s2 = 5e-5
    :experiment: Log the supply voltage of the chips. From the recording alone: steady speeds and ramps in both
        directions, as each follows another function of the motion.
    """

    name = "gain_by_rate_squared"
    summary = "the gain of all chips changes with the square of the rate"
    dependence = RATE_SQUARED


class GainByLoad(_OfSupply):
    """A supply that sags when the motor accelerates.

    The motor draws its largest current while it accelerates the table; the gain of all chips follows |α|.

    Notes
    -----
    :formula: y = f·(1 + k·abs(α))
    :symbols: k = ratio_per_rad_s2
    :size: 0.5 % at 20 rad/s², by choice.
    :example: ratio_per_rad_s2 = 0.0003
    :experiment: Log the supply voltage of the chips. From the recording alone: steady speeds and ramps in both
        directions, as each follows another function of the motion.
    """

    name = "gain_by_load"
    summary = "the gain of all chips changes with |angular acceleration| (a supply that sags under the motor)"
    dependence = LOAD


class GainTemperature(Unlisted):
    """Gains of all chips that follow the board's temperature.

    The gain of all chips is proportional to the board's temperature above 25 °C.

    Notes
    -----
    :formula: y = f·(1 + k·(T − 25))
    :symbols: k = ratio_per_K
    :size: 0.1 %/K, by choice; it is wide: the ADXL345's data sheet has ±0.01 %/K.
    :example: ratio_per_K = 0.001
    :experiment: Warm the unit at rest, upright and on its side. A gain changes the channels that see gravity, an offset
        changes all.
    """

    name = "gain_temperature"
    summary = "the gain of all chips follows the board's temperature"
    place = "sensing"
    grammar_place = "supply"
    needs_temperature = True
    separated_by = "a run in which the temperature changes while the motion does not"
    dependence = Dependence("T", "temperature", "K", _KELVIN)

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One ratio per kelvin."""
        return (Size("ratio_per_K", "1/K", 1e-3),)

    def apply(self, world: World) -> World:
        """Multiply the readings by 1 + ratio · (T − 25 °C)."""
        ratio = self.value("ratio_per_K")
        return _sensed(
            world, lambda readings, context: readings * (1.0 + ratio * (context.temperature - 25.0))[:, None]
        )


class _OfChannels(Unlisted):
    """The offset of each channel follows the motion."""

    place = "sensing"
    grammar_place = "channel"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        return tuple(
            Size(cls.dependence.key(f"{channel}_m_s2"), cls.dependence.per("m/s²"), 5 * MILLI_G / cls.dependence.usual)
            for channel in array.channels
        )

    @classmethod
    def patterns(cls, array: AccelerometerArray) -> tuple[Pattern, ...]:
        return channel_patterns(array)

    @classmethod
    def reach(cls, array: AccelerometerArray) -> NDArray[np.bool_]:
        return np.eye(array.n_channels, dtype=bool)

    def per_channel(self, array: AccelerometerArray) -> NDArray[np.float64]:
        return self.vector([size.key for size in self.sizes(array)])

    def apply(self, world: World) -> World:
        """Add coefficient · f to each reading."""
        sizes, function = self.per_channel(world.array), self.dependence.of
        return _sensed(world, lambda readings, context: readings + np.outer(function(context.spin), sizes))


class OffsetBySpeed(_OfChannels):
    """Offsets that follow the speed of the motor.

    The motor's current or field shifts the offset of single channels, in proportion to |ω|.

    Notes
    -----
    :formula: y = f + k·abs(ω)
    :symbols: k = {channel}_m_s2_per_rad_s
    :size: 5 mg at 10 rad/s, by choice.
    :example: a11_m_s2_per_rad_s = 0.01, a22_m_s2_per_rad_s = -0.006
    :experiment: Let the motor turn at speed with the array taken off the table and held beside it: what stays is
        electrical.
    """

    name = "offset_by_speed"
    summary = "offsets of channels change with |rate|"
    dependence = SPEED


class OffsetByLoad(_OfChannels):
    """Offsets that follow the load of the motor.

    The motor's current while it accelerates shifts the offset of single channels, in proportion to |α|.

    Notes
    -----
    :formula: y = f + k·abs(α)
    :symbols: k = {channel}_m_s2_per_rad_s2
    :size: 5 mg at 20 rad/s², by choice.
    :example: a11_m_s2_per_rad_s2 = 0.006, a22_m_s2_per_rad_s2 = -0.004
    :experiment: Make ramps of several steepnesses in both directions. A displaced chip reads αr with the sign of α,
        this reads |α|.
    """

    name = "offset_by_load"
    summary = "offsets of channels change with |angular acceleration|"
    dependence = LOAD


class Cubic(_OfChannels):
    """Third-order non-linearity per channel.

    The reading bends with its size, with opposite sign on both sides of zero: the beginning of saturation.

    Notes
    -----
    :formula: y = f + k·f³
    :symbols: k = {channel}_s4_m2
    :size: 3 mg at 1 g, by choice. The ADXL345's data sheet allows ±0.5 % of full scale for all curvature together.
    :example: a11_s4_m2 = 5e-5, a22_s4_m2 = -3e-5
    :experiment: Spin at several high speeds with the array upright and on its side. A gain and a cube differ only over
        a wide span of readings of one channel.
    """

    name = "cubic"
    summary = "a third-order non-linearity per channel"
    of_pose = True
    separated_by = "several speeds, or static poses on all sides"
    dependence = Dependence("f^3", "reading³", "m3_s6", _RATE**3)

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One coefficient per channel."""
        usual = 3e-3 / STANDARD_GRAVITY**2
        return tuple(Size(f"{channel}_s4_m2", "s⁴/m²", usual) for channel in array.channels)

    def apply(self, world: World) -> World:
        """Add coefficient · reading³."""
        sizes = self.per_channel(world.array)
        return _sensed(world, lambda readings, context: readings + sizes * readings**3)


class LaggedTemperature(_OfChannels):
    """Offsets that follow the board's temperature with a lag: the chip is farther from the heat than the sensor.

    The thermometer is nearer to the heat than the sensing element, whose temperature T′ follows with a lag.

    Notes
    -----
    :formula: τ·Ṫ′ + T′ = T;
        y = f + k·(T′ − 25)
    :symbols: k = {channel}_m_s2_K; τ = time_constant_s
    :size: 0.8 mg/K, as of `bias_temperature`.
    :example: a11_m_s2_K = 0.02, a22_m_s2_K = -0.015, time_constant_s = 6.0
    :experiment: Change the temperature in steps and hold it: an offset without lag settles with the thermometer, this
        one after it.
    """

    name = "lagged_temperature"
    summary = "offsets follow the board's temperature with a lag"
    needs_temperature = True
    alike_by_lot = True
    separated_by = "a run in which the temperature changes while the motion does not"
    shape_limits: ClassVar = {"time_constant_s": (0.5, 1e4)}
    other_units: ClassVar = {"time_constant_s": "s"}
    dependence = Dependence("T lagged", "lagged temperature", "K", _KELVIN)

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One coefficient per channel, as `BiasTemperature` has."""
        return tuple(Size(f"{channel}_m_s2_K", "m/s²/K", 0.8 * MILLI_G) for channel in array.channels)

    @classmethod
    def shapes(cls, duration: float, sample_rate: float) -> tuple[dict[str, float], ...]:
        """Return time constants from a fraction of the run to half of it."""
        return tuple({"time_constant_s": float(share * duration)} for share in (0.05, 0.15, 0.5))

    def apply(self, world: World) -> World:
        """Add coefficient · (lagged T − 25 °C)."""
        sizes, tau = self.per_channel(world.array), max(self.value("time_constant_s", 5.0), 1e-3)

        def step(readings: NDArray[np.float64], context: SampleContext) -> NDArray[np.float64]:
            lagged = low_pass(context.temperature[:, None], context.t, tau)
            return readings + (lagged - 25.0) * sizes

        return _sensed(world, step)


class TemperatureGradient(LaggedTemperature):
    """Offsets that follow the difference of temperature within the unit: between the sensor and what lags behind it.

    A difference of temperature within the unit bends its board; it is there while the temperature changes and gone when
    the unit is evenly warm.

    Notes
    -----
    :formula: τ·Ṫ′ + T′ = T;
        y = f + k·(T − T′)
    :symbols: k = {channel}_m_s2_K; τ = time_constant_s
    :size: 0.8 mg/K, as of `bias_temperature`.
    :example: a11_m_s2_K = 0.03, a22_m_s2_K = -0.02, time_constant_s = 6.0
    :experiment: Warm the unit from one side and then hold it at the new temperature: the offset comes and goes, one
        that follows the temperature stays.
    """

    name = "temperature_gradient"
    summary = "offsets follow a difference of temperature within the unit, as it is while the temperature changes"
    dependence = Dependence("T - T lagged", "temperature less lagged temperature", "K", _KELVIN)

    def apply(self, world: World) -> World:
        """Add coefficient · (T − lagged T)."""
        sizes, tau = self.per_channel(world.array), max(self.value("time_constant_s", 5.0), 1e-3)

        def step(readings: NDArray[np.float64], context: SampleContext) -> NDArray[np.float64]:
            lagged = low_pass(context.temperature[:, None], context.t, tau)
            return readings + (context.temperature[:, None] - lagged) * sizes

        return _sensed(world, step)


def _sensed(world: World, step: Callable[[NDArray[np.float64], SampleContext], NDArray[np.float64]]) -> World:
    return world.changed(sensing_steps=(*world.sensing_steps, step))


UNLISTED: dict[str, type[Unlisted]] = {
    point.name: point
    for point in (
        ReferenceOffset,
        ReferenceSpeed,
        ReferenceSquare,
        ReferenceEven,
        ReferenceCube,
        LeanByRateSquared,
        LeanByRate,
        LeanByAcceleration,
        LeanByTurns,
        GainBySpeed,
        GainByRateSquared,
        GainByLoad,
        GainTemperature,
        OffsetBySpeed,
        OffsetByLoad,
        Cubic,
        LaggedTemperature,
        TemperatureGradient,
    )
}
"""Every point of the grammar that the search tries, by name."""
