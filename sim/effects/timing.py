"""Effects of time and of the reference: skew, clocks, and a tachometer that is late, scaled or modulated."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.model.parameter_units import NUMBER, RATIO
from gfimu.model.world_model import SpinState
from sim.effects.base import LARGEST_TURN, Effect, Size
from sim.effects.scans import order_shapes, per_rate
from sim.world import World

__all__ = ["ChannelSkew", "ClockError", "TachoLatency", "TachoRipple", "TachoScale"]


class ChannelSkew(Effect):
    """Chips sampled one after another, not together.

    The host reads the chips one after another over one bus. Chip i is late by (i − 1)δ, but all readings of a
    row have one time stamp.

    Notes
    -----
    :formula: y = f(t + (i − 1)·δ)
    :symbols: δ = per_chip_s
    :size: 1 ms, by choice. Reading six bytes of a chip over I²C at 400 kHz takes 0.2 ms, at 100 kHz 0.8 ms.
    :example: per_chip_s = 0.002
    :experiment: Rock the table fast. The residual of each chip is its delay times the rate of change of the reading.
        Read the chips in the opposite order: a skew changes its sign, delays of the chips' own do not.
    """

    name = "channel_skew"
    summary = "chips are sampled one after another, not together"
    place = "timing"
    contained_in = frozenset({"chip_delay"})
    separated_by = "fast changes of the rate"
    starts = (-200.0, -80.0, -30.0, -10.0, 10.0, 30.0, 80.0, 200.0)

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One delay from chip to chip."""
        return (Size("per_chip_s", "s", 1e-3, step=0.1),)

    def apply(self, world: World) -> World:
        """Sample chip i late by (i − 1) times the delay."""
        delay = np.zeros(len(world.array.chips)) if world.chip_delay is None else world.chip_delay
        return world.changed(chip_delay=delay + self.value("per_chip_s") * np.arange(len(delay)))


class ClockError(Effect):
    """The board's clock runs fast or slow against the reference's.

    Board and reference have oscillators of their own. The board's shows (1 + ε) of the true time, so that the two drift
    apart from the start of the run.

    Notes
    -----
    :formula: y = f(t/(1 + ε))
    :symbols: ε = ratio
    :size: 1e-3, by choice. A crystal is within 1e-4, an RC oscillator in a microcontroller or a sensor within some
        percent.
    :example: ratio = 0.001
    :experiment: Make the same fast change of the rate at the beginning and at the end of a long run. A delay is the
        same at both, a clock error grows with the time between them.
    """

    name = "clock_error"
    summary = "the board's clock runs fast or slow against the reference's"
    place = "timing"
    separated_by = "a longer run with fast changes of the rate at its end"
    starts = (-20.0, -8.0, -3.0, 3.0, 8.0, 20.0)

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One ratio; positive: the board's clock is fast."""
        return (Size("ratio", RATIO, 1e-3, step=0.02, bound=0.1),)  # a free-running oscillator is within some percent

    def apply(self, world: World) -> World:
        """Let the board's clock show (1 + ratio) of the true time."""
        return world.changed(clock_ratio=(1 + world.clock_ratio) * (1 + self.value("ratio")) - 1)


class TachoLatency(Effect):
    """The reference is late.

    The reading of the tachometer arrives late: a filter or a gate time in its electronics, a queue of the host. Its
    value is that of a time δ earlier than its time stamp.

    Notes
    -----
    :formula: Ω′ = Ω(t − δ)
    :symbols: δ = delay_s
    :size: 10 ms, one sample period at 100 Hz, by choice.
    :example: delay_s = 0.01
    :experiment: Rock the table with a chirp. A delay turns the phase in proportion to the frequency and leaves the
        amplitude; a lag of the tachometer lowers the amplitude as well.
    """

    name = "tacho_latency"
    summary = "the reference is late"
    place = "reference"
    separated_by = "a fast chirp of the rate"
    starts = (3.0, 10.0, 30.0)

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One delay, never negative."""
        return (Size("delay_s", "s", 1e-2, positive=True, step=0.1),)

    def apply(self, world: World) -> World:
        """Delay the reference."""
        return world.changed(tacho_delay=world.tacho_delay + self.value("delay_s"))


class TachoScale(Effect):
    """The reference has a wrong gain: it reads (1 + ratio)·ω.

    The tachometer's calibration, its number of marks or a gear ratio in between is wrong.

    Notes
    -----
    :formula: Ω′ = (1 + s)·Ω
    :symbols: s = ratio
    :size: 1 %, by choice: a tachogenerator.
    :example: ratio = 0.02
    :experiment: Count whole turns against a mark on the table for a minute. From the recording alone: fast ramps, as a
        wrong gain scales the centripetal part by 2s and the tangential one by s.
    """

    name = "tacho_scale"
    summary = "the reference has a wrong gain"
    place = "reference"
    separated_by = "fast ramps: a wrong gain of the reference scales the centripetal and tangential parts unlike"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One ratio."""
        return (Size("ratio", RATIO, 0.01),)

    def apply(self, world: World) -> World:
        """Multiply the reference by 1 + ratio."""
        gain = 1 + self.value("ratio")
        return world.changed(reference_steps=(*world.reference_steps, lambda reading, spin, t: reading * gain))


class AngleZero(Effect):
    """The encoder's zero is not where the twin has it: gravity shows that where the axis leans.

    The encoder's index is not at the angle where the twin has its zero: a coupling that was tightened in another place.

    Notes
    -----
    :formula: θ′ = θ + Δ
    :symbols: Δ = offset_rad
    :size: 0.02 rad, by choice.
    :example: offset_rad = 0.02
    :experiment: Let the pendulum hang at rest and read the encoder; repeat at several angles.
    :rivals: It shows where the axis is inclined and the reference is an angle. The table of the standard motions has an
        upright axis and a tachometer.
    """

    name = "angle_zero"
    summary = "the encoder's zero is off the direction of gravity"
    place = "reference"
    per_run = True
    separated_by = "poses at rest at several angles"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One angle."""
        return (Size("offset_rad", "rad", 0.02, bound=LARGEST_TURN),)

    def apply(self, world: World) -> World:
        """Let the encoder read more by the offset."""
        return world.changed(angle_zero=world.angle_zero + self.value("offset_rad"))


class TachoRipple(Effect):
    """The reference is modulated once or n times per revolution.

    The reading of the reference is modulated with the table's angle, while the table turns evenly: an encoder disc that
    is off centre, poles of a tachogenerator.

    Notes
    -----
    :formula: Ω′ = Ω·(1 + A·sin(n·θ + φ))
    :symbols: A = amplitude; n = order; φ = phase_rad
    :size: 1 %, by choice: a disc of 10 mm radius that is 0.1 mm off centre.
    :example: amplitude = 0.02, order = 1, phase_rad = 0.4
    :experiment: Turn slowly and steadily. The lines are in the reference alone. A table that really turns unevenly
        has them in the tangential channels as well.
    """

    name = "tacho_ripple"
    summary = "the reference itself is modulated once or n times per revolution"
    other_units: ClassVar = {"amplitude": RATIO, "order": NUMBER, "phase_rad": "rad"}
    whole = frozenset({"order"})
    place = "reference"
    separated_by = "a second reference, or slow steady rotation in both directions"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """Relative sine and cosine amplitudes."""
        return (Size("sine", RATIO, 0.01), Size("cosine", RATIO, 0.01))

    @classmethod
    def shapes(cls, duration: float, sample_rate: float) -> tuple[dict[str, float], ...]:
        """Return one order; the scan over orders finds it."""
        return ({"order": 1.0},)

    @classmethod
    def scan(cls, left, duration, sample_rate):  # type: ignore[no-untyped-def]
        """Return the strongest orders of a ratio of the reference."""
        return order_shapes(left, 3, per_rate)

    @classmethod
    def from_sizes(cls, array, values, shape) -> Effect:  # type: ignore[no-untyped-def]
        """Turn sine and cosine into amplitude and phase."""
        sine, cosine = (float(v) for v in values)
        return cls({"amplitude": float(np.hypot(sine, cosine)), "phase_rad": float(np.arctan2(cosine, sine)), **shape})

    def size_values(self, array: AccelerometerArray) -> NDArray[np.float64]:
        """Return sine and cosine amplitudes."""
        amplitude, phase = self.value("amplitude"), self.value("phase_rad")
        return amplitude * np.array([np.cos(phase), np.sin(phase)])

    @classmethod
    def parameter_units(cls, array: AccelerometerArray) -> dict[str, str]:
        """Return the units of the contract's keys, amplitude and phase instead of the sizes."""
        return dict(cls.other_units)

    def apply(self, world: World) -> World:
        """Multiply the reference by 1 + amplitude · sin(order·θ + phase)."""
        amplitude, order = self.value("amplitude"), self.value("order", 1.0)
        phase = self.value("phase_rad")

        def step(reading: NDArray[np.float64], spin: SpinState, t: NDArray[np.float64]) -> NDArray[np.float64]:
            return reading * (1 + amplitude * np.sin(order * spin.angle + phase))

        return world.changed(reference_steps=(*world.reference_steps, step))
