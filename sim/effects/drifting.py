"""Effects inside the sensing chain that follow time or temperature: offsets and gains that drift."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.base.units import MILLI_G
from sim.effects.base import Effect, Size
from sim.effects.per_channel import PerChannel, with_step
from sim.world import World

__all__ = ["BiasTemperature", "ColdStart", "GainDrift", "WarmUp"]

_REFERENCE_TEMPERATURE = 25.0


class BiasTemperature(PerChannel):
    """Offsets that follow the board's temperature.

    The offset of each channel is proportional to the board's temperature above 25 °C. It needs a temperature in the
    recording.

    Notes
    -----
    :formula: y = f + k·(T − 25)
    :symbols: k = {channel}_m_s2_K
    :size: Data sheet of the ADXL345: ±0.4 mg/K (x, y) and ±1.2 mg/K (z) typical; the prior is 0.8 mg/K for all.
    :example: a11_m_s2_K = 0.01, a22_m_s2_K = -0.008
    :experiment: Warm the resting unit by 10 K with a hair dryer or in an oven and let it cool: offsets that follow the
        temperature come back with it, a settling after turn-on does not.
    :recordings: Recordings at hand have no temperature that changes enough to measure it.
    """

    name = "bias_temperature"
    summary = "biases follow the board's temperature"
    suffix = "_m_s2_K"
    unit = "m/s²/K"
    needs_temperature = True
    alike_by_lot = True
    prior_std = 0.8 * MILLI_G
    separated_by = "a run in which the temperature changes while the motion does not"

    def apply(self, world: World) -> World:
        """Add coefficient · (T − 25 °C)."""
        coefficient = self.per_channel(world.array)
        return with_step(
            world,
            lambda readings, context: readings + np.outer(context.temperature - _REFERENCE_TEMPERATURE, coefficient),
        )


class WarmUp(PerChannel):
    """Offsets that settle exponentially after power-on.

    Offsets start at the values of the cold unit, for which it was calibrated. They approach other values as the chip
    warms up.

    Notes
    -----
    :formula: y = f + b·(1 − exp(−t/τ))
    :symbols: b = {channel}_m_s2; τ = time_constant_s
    :size: 10 mg, by choice: some kelvins of self-heating times 1 mg/K. The time constant is that of the board, seconds
        to minutes.
    :example: a11_m_s2 = 0.1, a23_m_s2 = -0.08, time_constant_s = 15.0
    :experiment: Switch on the cold unit and record ten minutes at rest; then record again without switching off. Only
        the first recording settles.
    :recordings: MIMU4444: z offsets settle by some 0.06 m/s² with a slow time constant, the same sign in both
        recordings; z of chip 4 moved by more than 30 mm/s² in its first minute.
    """

    name = "warm_up"
    summary = "biases settle exponentially after turn-on (warm-up)"
    suffix = "_m_s2"
    unit = "m/s²"
    prior_std = 10 * MILLI_G
    alike_by_lot = True
    of_one_recording = True
    shape_limits: ClassVar = {"time_constant_s": (1.0, 1e5)}
    separated_by = "a cold start followed by a long rest, or a longer run"
    other_units: ClassVar = {"time_constant_s": "s"}

    @classmethod
    def shapes(cls, duration: float, sample_rate: float) -> tuple[dict[str, float], ...]:
        """Return time constants from a fraction of the run to several runs."""
        return tuple({"time_constant_s": float(tau)} for tau in duration * np.array([0.04, 0.1, 0.25, 0.7, 2.0]))

    def apply(self, world: World) -> World:
        """Add offset · (1 − exp(−t/τ))."""
        offset = self.per_channel(world.array)
        tau = max(self.value("time_constant_s", 20.0), 1e-3)
        return with_step(
            world, lambda readings, context: readings - np.outer(np.expm1(-world.since_start(context.t) / tau), offset)
        )


class ColdStart(WarmUp):
    """Offsets that decay from power-on: a unit that was calibrated warm and starts cold.

    The unit was calibrated warm. Switched on cold, its offsets are off at first and come back to the calibrated values.

    Notes
    -----
    :formula: y = f + b·exp(−t/τ)
    :symbols: b = {channel}_m_s2; τ = time_constant_s
    :size: 10 mg, as of `warm_up`. It is taken to be 30 times rarer than that, by choice.
    :example: a11_m_s2 = 0.1, a23_m_s2 = -0.08, time_constant_s = 10.0
    :experiment: Record a rest directly after the calibration, without switching off: the offsets are zero then. Record
        another one after a cold start: they decay to zero. A constant bias shows in both.
    :recordings: No real recording at hand was found to have it; the settling of the MIMU4444 is listed at `warm_up`.
    :rivals: On one recording it is a ``warm_up`` beside a ``bias``; a diagnosis names these.
    """

    name = "cold_start"
    summary = "biases decay exponentially after turn-on (calibrated warm, started cold)"
    rarity = 30.0  # times rarer than offsets that settle, by choice

    @classmethod
    def shapes(cls, duration: float, sample_rate: float) -> tuple[dict[str, float], ...]:
        """Return time constants from a fraction of the run to most of it."""
        return tuple({"time_constant_s": float(tau)} for tau in duration * np.array([0.05, 0.2, 0.7]))

    def apply(self, world: World) -> World:
        """Add offset · exp(−t/τ)."""
        offset = self.per_channel(world.array)
        tau = max(self.value("time_constant_s", 20.0), 1e-3)
        return with_step(
            world, lambda readings, context: readings + np.outer(np.exp(-world.since_start(context.t) / tau), offset)
        )


class GainDrift(Effect):
    """All gains drift with time.

    The gain of all channels changes in proportion to time: a supply or a reference voltage that drifts during the run.

    Notes
    -----
    :formula: y = f·(1 + k·t)
    :symbols: k = slope_1_s
    :size: 2e-4 per second, or 1.2 % in a minute, by choice: a battery under load.
    :example: slope_1_s = 0.0002
    :experiment: Repeat the same speeds early and late in a run of some minutes. A drifting offset adds the same amount
        at every speed, a drifting gain adds in proportion to the reading.
    """

    name = "gain_drift"
    summary = "all gains drift with time"
    place = "sensing"
    separated_by = "a longer run, with the same rates early and late"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One relative drift per second."""
        return (Size("slope_1_s", "1/s", 2e-4),)

    def apply(self, world: World) -> World:
        """Multiply the readings by 1 + slope · (t − start)."""
        slope = self.value("slope_1_s")
        return with_step(
            world, lambda readings, context: readings * (1.0 + slope * world.since_start(context.t))[:, None]
        )
