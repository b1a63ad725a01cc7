"""Effects inside the sensing chain with a memory or a frequency: lag, resonance, hysteresis, interference."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.units import MILLI_G
from gfimu.model.parameter_units import RATIO
from sim.effects.base import Effect, Size
from sim.effects.low_pass import low_pass, mass_on_spring
from sim.effects.per_channel import with_step
from sim.effects.scans import tone_shapes
from sim.world import World

__all__ = ["Hysteresis", "InterferenceTone", "ProofMass", "SensorLag"]


class SensorLag(Effect):
    """Limited bandwidth of the sensing chain: a first-order lag.

    All channels pass through the same low pass before they are sampled: the chip's filter at its output data rate, or
    an RC filter on the board.

    Notes
    -----
    :formula: τ·ẏ + y = f
    :symbols: τ = time_constant_s
    :size: 5 ms: the ADXL345 has a bandwidth of half its output data rate, 50 Hz at 100 Hz, and 1/(2π · 50 Hz) is 3.2
        ms.
    :example: time_constant_s = 0.008
    :experiment: Rock the table with a chirp up to the highest frequency it follows. A lag lowers the amplitude and
        turns the phase as the arctangent, a delay turns the phase alone and in proportion to the frequency.
    """

    name = "sensor_lag"
    summary = "limited bandwidth of the sensing chain"
    place = "sensing"
    separated_by = "a fast chirp of the rate"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One time constant, never negative."""
        return (Size("time_constant_s", "s", 5e-3, positive=True, step=0.5),)

    def apply(self, world: World) -> World:
        """Pass the readings through a first-order low pass."""
        tau = abs(self.value("time_constant_s"))
        return with_step(world, lambda readings, context: low_pass(readings, context.t, tau)) if tau else world


class ProofMass(Effect):
    """A sensing chain of second order: the chip's mass on its spring, with its damper (GF-IMU paper, eq. 2).

    The sensing element is a mass on a spring with a damper. It resonates, if it is excited near its own frequency.

    Far below the resonance it is `SensorLag` with the time constant damping_ratio / (π resonance_hz). So it is a part
    of simulations only: a diagnosis names the lag.

    Notes
    -----
    :formula: ÿ/ω₀² + 2·ζ/ω₀·ẏ + y = f
    :symbols: ω₀ = 2π·resonance_hz; ζ = damping_ratio
    :size: 1 kHz; surface micromachined elements have kilohertz. A damping ratio of 0.7 is the default.
    :example: resonance_hz = 60.0, damping_ratio = 0.3
    :experiment: Tap the resting unit and sample at more than twice the resonance: the reading oscillates at it. Far
        below the resonance only the lag 2ζ/ω₀ is seen.
    :rivals: A diagnosis looks for ``sensor_lag`` in its place, whose page has the rivals.
    """

    name = "proof_mass"
    summary = "a mass on a spring: the sensing chain resonates (its limit far below is sensor_lag)"
    place = "sensing"
    separated_by = "motion near the resonance, sampled at more than twice its frequency"
    other_units: ClassVar = {"damping_ratio": RATIO}

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """Resonance frequency; zero is none."""
        return (Size("resonance_hz", "Hz", 1e3, positive=True),)

    def apply(self, world: World) -> World:
        """Pass the readings through the second-order low pass."""
        natural = 2.0 * np.pi * abs(self.value("resonance_hz"))
        damping = abs(self.value("damping_ratio", 0.7))
        if not natural:
            return world
        return with_step(world, lambda readings, context: mass_on_spring(readings, context.t, natural, damping))


@njit(cache=True)
def _play(readings: NDArray[np.float64], width: float) -> NDArray[np.float64]:
    """Play operator of half-width ``width`` on every column."""
    out = np.empty_like(readings)
    for column in range(readings.shape[1]):
        state = readings[0, column]
        for row in range(readings.shape[0]):
            state = min(max(state, readings[row, column] - width), readings[row, column] + width)
            out[row, column] = state
    return out


class Hysteresis(Effect):
    """Backlash in the reading: it follows the specific force only after the backlash is taken up.

    A share of each reading depends on the direction from which it came: a flexing package, a creeping solder joint,
    friction in a mount.

    Notes
    -----
    :formula: y = f + (h/w)·(backlash(f, w) − f)
    :symbols: h = lost_m_s2; w = width_m_s2
    :size: 5 mg lost, by choice; the half-width from 2 to 600 mg is searched on a grid.
    :example: lost_m_s2 = 0.1, width_m_s2 = 0.1
    :experiment: Reverse the rate slowly many times and plot the residual against the reading: hysteresis makes a loop
        of one sense. A non-linearity makes a single line, and a lag a loop that widens with the speed of the reversal.
    """

    name = "hysteresis"
    summary = "hysteresis: a reading depends on the direction from which it came"
    place = "sensing"
    separated_by = "slow reversals of the rate"
    shape_limits: ClassVar = {"width_m_s2": (1e-3, 20.0)}
    level_error = 0.2  # of the white noise of a reading: half-widths of ten narrow plays were off by that, rms
    inexactness = 0.01  # a play remembers the extremes of a motion that is only estimated
    other_units: ClassVar = {"width_m_s2": "m/s²"}

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One lost motion, common to all channels, never negative."""
        return (Size("lost_m_s2", "m/s²", 5 * MILLI_G, positive=True, step=0.5),)

    @classmethod
    def shapes(cls, duration: float, sample_rate: float) -> tuple[dict[str, float], ...]:
        """Return half-widths of the play."""
        return tuple({"width_m_s2": width * MILLI_G} for width in (2.0, 10.0, 50.0, 200.0, 600.0))

    def apply(self, world: World) -> World:
        """Add lost · (play − reading)/width, the play of half-width ``width_m_s2``."""
        return with_step(
            world,
            lambda readings, context: (
                readings + self.share * (_play(np.ascontiguousarray(readings), self._width) - readings)
            ),
        )

    @property
    def _width(self) -> float:
        return max(self.value("width_m_s2", abs(self.value("lost_m_s2"))), 1e-9)

    @property
    def share(self) -> float:
        """Share of a reading that the play holds."""
        return self.value("lost_m_s2") / self._width


class InterferenceTone(Effect):
    """A tone at a fixed frequency on all channels.

    The same sine is added to all channels: mains on a supply or ground line, a fan or pump, possibly aliased to a low
    frequency by the sampling.

    Notes
    -----
    :formula: y = f + A·sin(2·π·ν·t + φ)
    :symbols: A = amplitude_m_s2; ν = frequency_hz; φ = phase_rad
    :size: 2 mg, by choice.
    :example: amplitude_m_s2 = 0.03, frequency_hz = 21.3, phase_rad = 0.0
    :experiment: Record at rest: the readings are the line and noise alone. Record at another sample rate: an aliased
        line moves, a true one stays.
    :recordings: None on all channels. One channel of the MIMU4444 (m41) has a tone of 0.14 m/s² that varies between 8
        and 9.4 Hz; its frequency is not fixed and it is on one channel, so that this effect does not describe it.
    """

    name = "interference_tone"
    summary = "a tone at a fixed frequency (mains, aliased or not) on all channels"
    place = "sensing"
    of_one_recording = True
    separated_by = "a run at rest, where only the tone is left"
    other_units: ClassVar = {"amplitude_m_s2": "m/s²", "frequency_hz": "Hz", "phase_rad": "rad"}

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """Sine and cosine amplitudes."""
        return (Size("sine_m_s2", "m/s²", 2 * MILLI_G), Size("cosine_m_s2", "m/s²", 2 * MILLI_G))

    @classmethod
    def shapes(cls, duration: float, sample_rate: float) -> tuple[dict[str, float], ...]:
        """Return one frequency; the scan over the spectrum finds it."""
        return ({"frequency_hz": 0.2 * sample_rate},)

    @classmethod
    def scan(cls, left, duration, sample_rate):  # type: ignore[no-untyped-def]
        """Return the strongest lines of the residual."""
        return tone_shapes(left, 2)

    @classmethod
    def from_sizes(cls, array, values, shape) -> Effect:  # type: ignore[no-untyped-def]
        """Turn sine and cosine into amplitude and phase."""
        sine, cosine = (float(v) for v in values)
        return cls(
            {"amplitude_m_s2": float(np.hypot(sine, cosine)), "phase_rad": float(np.arctan2(cosine, sine)), **shape}
        )

    def size_values(self, array: AccelerometerArray) -> NDArray[np.float64]:
        """Return sine and cosine amplitudes."""
        amplitude, phase = self.value("amplitude_m_s2"), self.value("phase_rad")
        return amplitude * np.array([np.cos(phase), np.sin(phase)])

    @classmethod
    def parameter_units(cls, array: AccelerometerArray) -> dict[str, str]:
        """Return the units of the contract's keys, amplitude and phase instead of the sizes."""
        return dict(cls.other_units)

    def apply(self, world: World) -> World:
        """Add amplitude · sin(2π f t + phase)."""
        amplitude, phase = self.value("amplitude_m_s2"), self.value("phase_rad")
        omega = 2 * np.pi * self.value("frequency_hz")
        return with_step(
            world,
            lambda readings, context: readings + amplitude * np.sin(omega * context.t + phase)[:, None],
        )
