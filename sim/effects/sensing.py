"""Effects inside the sensing chain: what a chip does to the specific force before it becomes a number."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gfimu.geometry.array import AccelerometerArray
from gfimu.units import MILLI_G, RATIO, STANDARD_GRAVITY
from sim.effects.base import LARGEST_TURN, Effect, Pattern, Size, channel_patterns
from sim.effects.low_pass import low_pass, mass_on_spring
from sim.effects.scans import tone_shapes
from sim.world import SensingStep, World

__all__ = [
    "Bias",
    "BiasTemperature",
    "ColdStart",
    "CrossAxis",
    "GainDrift",
    "Hysteresis",
    "InterferenceTone",
    "ProofMass",
    "Quadratic",
    "ScaleFactor",
    "SensorLag",
    "VibrationRectification",
    "WarmUp",
]

_REFERENCE_TEMPERATURE = 25.0


def _with_step(world: World, step: SensingStep) -> World:
    return world.changed(sensing_steps=(*world.sensing_steps, step))


class _PerChannel(Effect):
    """One size per channel, keyed ``channel + suffix``."""

    place = "sensing"
    suffix = ""
    unit = RATIO
    prior_std = 1.0
    bound = np.inf

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        return tuple(
            Size(f"{channel}{cls.suffix}", cls.unit, cls.prior_std, bound=cls.bound) for channel in array.channels
        )

    @classmethod
    def patterns(cls, array: AccelerometerArray) -> tuple[Pattern, ...]:
        return channel_patterns(array)

    @classmethod
    def reach(cls, array: AccelerometerArray) -> NDArray[np.bool_]:
        return np.eye(array.n_channels, dtype=bool)

    def per_channel(self, array: AccelerometerArray) -> NDArray[np.float64]:
        return self.vector([f"{channel}{self.suffix}" for channel in array.channels])


class Bias(_PerChannel):
    """Constant offset per channel."""

    name = "bias"
    summary = "a bias: a constant offset per channel"
    suffix = "_m_s2"
    unit = "m/s²"
    tolerance = 0.3 * MILLI_G
    of_pose = True
    prior_std = 20 * MILLI_G
    bound = STANDARD_GRAVITY  # four times the 0.25 g that the ADXL345's data sheet allows along z
    separated_by = "static poses on several sides (six-position), or the array remounted on its side"

    def apply(self, world: World) -> World:
        """Add the offsets to the readings."""
        offset = self.per_channel(world.array)
        return _with_step(world, lambda readings, context: readings + offset)


class ScaleFactor(_PerChannel):
    """Gain error per channel."""

    name = "scale_factor"
    summary = "a scale-factor error per channel (another supply voltage, say)"
    tolerance = 5e-4
    of_pose = True
    prior_std = 0.02
    bound = 0.3  # three times the ±10 % that the ADXL345's data sheet allows; the MPU-9150's ±3 % is narrower
    separated_by = "static poses on several sides, or the array remounted on its side and several speeds"

    @classmethod
    def patterns(cls, array: AccelerometerArray) -> tuple[Pattern, ...]:
        """Add to the usual places: all gains alike."""
        alike = Pattern("all channels alike", np.ones((array.n_channels, 1)))
        return (*channel_patterns(array), alike)

    def apply(self, world: World) -> World:
        """Multiply the readings by 1 + ratio."""
        gain = 1.0 + self.per_channel(world.array)
        return _with_step(world, lambda readings, context: readings * gain)


class Quadratic(_PerChannel):
    """Second-order non-linearity per channel."""

    name = "quadratic"
    summary = "a second-order non-linearity per channel"
    of_pose = True
    suffix = "_s2_m"
    unit = "s²/m"
    prior_std = 3e-3 / STANDARD_GRAVITY
    separated_by = "several speeds, so that the reading's square and the reading differ; or static poses on all sides"

    def apply(self, world: World) -> World:
        """Add coefficient · reading²."""
        coefficient = self.per_channel(world.array)
        return _with_step(world, lambda readings, context: readings + coefficient * readings**2)


class BiasTemperature(_PerChannel):
    """Offsets that follow the board's temperature."""

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
        return _with_step(
            world,
            lambda readings, context: readings + np.outer(context.temperature - _REFERENCE_TEMPERATURE, coefficient),
        )


class WarmUp(_PerChannel):
    """Offsets that settle exponentially after power-on."""

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
        return _with_step(
            world, lambda readings, context: readings - np.outer(np.expm1(-world.since_start(context.t) / tau), offset)
        )


class ColdStart(WarmUp):
    """Offsets that decay from power-on: a unit that was calibrated warm and starts cold."""

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
        return _with_step(
            world, lambda readings, context: readings + np.outer(np.exp(-world.since_start(context.t) / tau), offset)
        )


class VibrationRectification(_PerChannel):
    """Mean readings that shift with vibration, as ω⁴."""

    name = "vibration_rectification"
    summary = "mean readings shift with vibration, about as ω⁴"
    suffix = "_m_s2_per_rad4_s4"
    unit = "m/s²/(rad/s)⁴"
    prior_std = 30 * MILLI_G / 15.0**4
    separated_by = "several speeds with and without vibration isolation"

    @classmethod
    def patterns(cls, array: AccelerometerArray) -> tuple[Pattern, ...]:
        """Add to the usual places: alike on all channels, alike per sensing axis."""
        axis = np.concatenate([np.arange(len(chip.axes)) for chip in array.chips])
        alike = np.stack([(axis == j).astype(float) for j in sorted(set(axis))], axis=1)
        return (
            *channel_patterns(array),
            Pattern("alike on every chip, per sensing axis", alike),
            Pattern("all channels alike", np.ones((array.n_channels, 1))),
        )

    def apply(self, world: World) -> World:
        """Add coefficient · ω⁴."""
        coefficient = self.per_channel(world.array)
        return _with_step(world, lambda readings, context: readings + np.outer(context.spin.rate**4, coefficient))


class CrossAxis(Effect):
    """A channel that picks up its neighbour on the same chip."""

    name = "cross_axis"
    summary = "cross-axis sensitivity: a channel picks up its neighbour on the same chip"
    place = "sensing"
    of_pose = True
    separated_by = "static poses on several sides and several speeds"

    @classmethod
    def _pairs(cls, array: AccelerometerArray) -> list[tuple[int, int]]:
        chip = array.chip_of_channel
        n = array.n_channels
        return [(i, j) for i in range(n) for j in range(n) if i != j and chip[i] == chip[j]]

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One ratio per ordered pair of channels of a chip: ``a11_from_a12``."""
        names = array.channels
        bound = float(np.sin(LARGEST_TURN))  # an axis that is turned picks up the sine
        return tuple(Size(f"{names[i]}_from_{names[j]}", RATIO, 0.01, bound=bound) for i, j in cls._pairs(array))

    @classmethod
    def reach(cls, array: AccelerometerArray) -> NDArray[np.bool_]:
        """Return the channel that each pair changes."""
        return np.array([[i == c for c in range(array.n_channels)] for i, _ in cls._pairs(array)])

    @classmethod
    def patterns(cls, array: AccelerometerArray) -> tuple[Pattern, ...]:
        """Return all pairs, the same pick-up on every chip, one chip, one channel, one pair."""
        pairs = cls._pairs(array)
        unit = np.eye(len(pairs))
        chip = array.chip_of_channel
        first = [int(np.flatnonzero(chip == k)[0]) for k in range(len(array.chips))]
        local = [(i - first[chip[i]], j - first[chip[j]]) for i, j in pairs]
        kinds = sorted(set(local))
        alike = np.array([[float(pair == kind) for kind in kinds] for pair in local])
        patterns = [Pattern("all channels", unit), Pattern("the same on every chip", alike)]
        patterns.append(Pattern("all pairs alike", np.ones((len(pairs), 1))))
        cyclic = np.array([[float((j - i) % 3 == 1)] for i, j in local])
        patterns.append(Pattern("every channel from the next, alike", cyclic))
        patterns.append(Pattern("every channel from the one before, alike", np.ones_like(cyclic) - cyclic))
        patterns += [
            Pattern(f"chip {array.chips[k].name}", unit[:, [chip[i] == k for i, _ in pairs]])
            for k in range(len(array.chips))
        ]
        patterns += [
            Pattern(f"channel {name}", unit[:, [i == c for i, _ in pairs]]) for c, name in enumerate(array.channels)
        ]
        patterns += [
            Pattern(f"channel {array.channels[i]} from {array.channels[j]}", unit[:, [k]])
            for k, (i, j) in enumerate(pairs)
        ]
        return tuple(patterns)

    def apply(self, world: World) -> World:
        """Add ratio · neighbour to each reading."""
        mixing = np.eye(world.array.n_channels)
        for (i, j), size in zip(self._pairs(world.array), self.sizes(world.array), strict=True):
            mixing[i, j] = self.value(size.key)
        return _with_step(world, lambda readings, context: readings @ mixing.T)


class SensorLag(Effect):
    """Limited bandwidth of the sensing chain: a first-order lag."""

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
        return _with_step(world, lambda readings, context: low_pass(readings, context.t, tau)) if tau else world


class ProofMass(Effect):
    """A sensing chain of second order: the chip's mass on its spring, with its damper (GF-IMU paper, eq. 2).

    Far below the resonance it is `SensorLag` with the time constant damping_ratio / (π resonance_hz). So it is a part
    of simulations only: a diagnosis names the lag.
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
        return _with_step(world, lambda readings, context: mass_on_spring(readings, context.t, natural, damping))


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
    """Play in the reading: it follows the specific force only after the play is taken up."""

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
        return _with_step(
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


class GainDrift(Effect):
    """All gains drift with time."""

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
        return _with_step(
            world, lambda readings, context: readings * (1.0 + slope * world.since_start(context.t))[:, None]
        )


class InterferenceTone(Effect):
    """A tone at a fixed frequency on all channels."""

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
        return _with_step(
            world,
            lambda readings, context: readings + amplitude * np.sin(omega * context.t + phase)[:, None],
        )
