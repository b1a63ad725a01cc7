"""Points of the grammar in the chips: a supply that changes all gains, offsets that follow motion or temperature."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.units import MILLI_G, STANDARD_GRAVITY
from sim.effects.base import Pattern, Size, channel_patterns
from sim.effects.grammar import KELVIN, LOAD, RATE_SQUARED, SPEED, USUAL_RATE, Dependence, Unlisted
from sim.effects.low_pass import low_pass
from sim.effects.per_channel import with_step
from sim.world import SampleContext, World

__all__ = [
    "Cubic",
    "GainByLoad",
    "GainByRateSquared",
    "GainBySpeed",
    "GainTemperature",
    "LaggedTemperature",
    "OffsetByLoad",
    "OffsetBySpeed",
    "TemperatureGradient",
]


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
        return with_step(world, lambda readings, context: readings * (1.0 + ratio * function(context.spin))[:, None])


class GainBySpeed(_OfSupply):
    """A supply that sags with the speed of the motor.

    The chips share the motor's supply, which sags as the motor draws current; the gain of all chips changes with its
    speed.

    Notes
    -----
    :formula: y = f·(1 + k·abs(ω))
    :symbols: k = ratio_per_rad_s
    :size: 0.5 % at 10 rad/s, by choice. The gain of an ADXL345 rises by 3.5 % on x and y from 2.5 to 3.3 V.
    :example: ratio_per_rad_s = 0.0005
    :experiment: Log the supply voltage of the chips. From the recording alone: steady speeds and ramps in both
        directions, because each cause follows another function of the motion.
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
        directions, because each cause follows another function of the motion.
    """

    name = "gain_by_rate_squared"
    summary = "the gain of all chips changes with the square of the rate"
    dependence = RATE_SQUARED


class GainByLoad(_OfSupply):
    """A supply that sags when the motor accelerates.

    The motor draws its largest current while it accelerates the table; the gain of all chips follows the
    size of α.

    Notes
    -----
    :formula: y = f·(1 + k·abs(α))
    :symbols: k = ratio_per_rad_s2
    :size: 0.5 % at 20 rad/s², by choice.
    :example: ratio_per_rad_s2 = 0.0003
    :experiment: Log the supply voltage of the chips. From the recording alone: steady speeds and ramps in both
        directions, because each cause follows another function of the motion.
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
    dependence = Dependence("T", "temperature", "K", KELVIN)

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One ratio per kelvin."""
        return (Size("ratio_per_K", "1/K", 1e-3),)

    def apply(self, world: World) -> World:
        """Multiply the readings by 1 + ratio · (T − 25 °C)."""
        ratio = self.value("ratio_per_K")
        return with_step(
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
        return with_step(world, lambda readings, context: readings + np.outer(function(context.spin), sizes))


class OffsetBySpeed(_OfChannels):
    """Offsets that follow the speed of the motor.

    The motor's current or field shifts the offset of single channels, in proportion to the
    speed.

    Notes
    -----
    :formula: y = f + k·abs(ω)
    :symbols: k = {channel}_m_s2_per_rad_s
    :size: 5 mg at 10 rad/s, by choice.
    :example: a11_m_s2_per_rad_s = 0.01, a22_m_s2_per_rad_s = -0.006
    :experiment: Let the motor turn at speed with the array taken off the table and held beside it: the remaining offset
        is electrical.
    """

    name = "offset_by_speed"
    summary = "offsets of channels change with |rate|"
    dependence = SPEED


class OffsetByLoad(_OfChannels):
    """Offsets that follow the load of the motor.

    The motor's current while it accelerates shifts the offset of single channels, in
    proportion to the size of α.

    Notes
    -----
    :formula: y = f + k·abs(α)
    :symbols: k = {channel}_m_s2_per_rad_s2
    :size: 5 mg at 20 rad/s², by choice.
    :example: a11_m_s2_per_rad_s2 = 0.006, a22_m_s2_per_rad_s2 = -0.004
    :experiment: Make ramps of several accelerations in both directions. A displaced chip reads αr with the sign of α,
        this reads its size.
    """

    name = "offset_by_load"
    summary = "offsets of channels change with |angular acceleration|"
    dependence = LOAD


class Cubic(_OfChannels):
    """Third-order non-linearity per channel.

    The reading has an error in proportion to its cube, of opposite sign on both sides of zero: the beginning of
    saturation.

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
    dependence = Dependence("f^3", "reading³", "m3_s6", USUAL_RATE**3)

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One coefficient per channel."""
        usual = 3e-3 / STANDARD_GRAVITY**2
        return tuple(Size(f"{channel}_s4_m2", "s⁴/m²", usual) for channel in array.channels)

    def apply(self, world: World) -> World:
        """Add coefficient · reading³."""
        sizes = self.per_channel(world.array)
        return with_step(world, lambda readings, context: readings + sizes * readings**3)


class LaggedTemperature(_OfChannels):
    """Offsets that follow the board's temperature with a lag.

    The thermometer is nearer to the heat source than the sensing element, whose temperature T′ follows with a lag.

    Notes
    -----
    :formula: τ·Ṫ′ + T′ = T;
        y = f + k·(T′ − 25)
    :symbols: k = {channel}_m_s2_K; τ = time_constant_s
    :size: 0.8 mg/K, as of `bias_temperature`.
    :example: a11_m_s2_K = 0.02, a22_m_s2_K = -0.015, time_constant_s = 6.0
    :experiment: Change the temperature in steps and hold it: an offset without lag settles with the thermometer, this
        one later.
    """

    name = "lagged_temperature"
    summary = "offsets follow the board's temperature with a lag"
    needs_temperature = True
    alike_by_lot = True
    separated_by = "a run in which the temperature changes while the motion does not"
    shape_limits: ClassVar = {"time_constant_s": (0.5, 1e4)}
    other_units: ClassVar = {"time_constant_s": "s"}
    dependence = Dependence("T lagged", "lagged temperature", "K", KELVIN)

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

        return with_step(world, step)


class TemperatureGradient(LaggedTemperature):
    """Offsets that follow the difference of temperature within the unit: between the sensor and what lags behind it.

    A difference of temperature within the unit bends its board; it exists while the temperature changes and vanishes
    when the temperature is uniform.

    Notes
    -----
    :formula: τ·Ṫ′ + T′ = T;
        y = f + k·(T − T′)
    :symbols: k = {channel}_m_s2_K; τ = time_constant_s
    :size: 0.8 mg/K, as of `bias_temperature`.
    :example: a11_m_s2_K = 0.03, a22_m_s2_K = -0.02, time_constant_s = 6.0
    :experiment: Warm the unit from one side and then hold it at the new temperature: this offset appears and vanishes,
        one that follows the temperature stays.
    """

    name = "temperature_gradient"
    summary = "offsets follow a difference of temperature within the unit, as it is while the temperature changes"
    dependence = Dependence("T - T lagged", "temperature less lagged temperature", "K", KELVIN)

    def apply(self, world: World) -> World:
        """Add coefficient · (T − lagged T)."""
        sizes, tau = self.per_channel(world.array), max(self.value("time_constant_s", 5.0), 1e-3)

        def step(readings: NDArray[np.float64], context: SampleContext) -> NDArray[np.float64]:
            lagged = low_pass(context.temperature[:, None], context.t, tau)
            return readings + (context.temperature[:, None] - lagged) * sizes

        return with_step(world, step)
