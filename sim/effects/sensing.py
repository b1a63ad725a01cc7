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
    """Constant offset per channel.

    Each channel reads the same amount too much whatever the unit does: a chip from the reel, one under stress after
    soldering, or one read at another temperature than it was calibrated at.

    Notes
    -----
    :formula: y = f + b
    :symbols: b = {channel}_m_s2
    :size: Data sheet of the ADXL345 (Rev. E): 35 mg (x, y) and 40 mg (z) typical, 150 and 250 mg at most. The prior of
        20 mg is smaller by choice: it is that of a unit that was trimmed once.
    :example: a11_m_s2 = 0.2, a22_m_s2 = -0.15, a33_m_s2 = 0.1
    :experiment: Put the unit at rest on six faces. Gravity changes its sign on a channel that is turned over, a bias
        keeps it. On the table, record the same profile a second time with the array on its side.
    :recordings: MIMU4444 (eight MPU-9150): up to 64 mg on z of one chip, the same within 1 mg in a second recording;
        between the two, offsets moved by 4 to 24 mm/s². Xsens MTi (IMU-TK's recording): 0.9, −0.8 and 4.4 counts, or
        2, −2 and 11 mm/s², from the factory's figures.
    """

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
    """Gain error per channel.

    Each channel reads a constant percentage too much: another supply voltage than the data sheet's, another range trim,
    a wrong count size in the file.

    Notes
    -----
    :formula: y = f·(1 + s)
    :symbols: s = {channel}
    :size: Data sheet of the ADXL345: 230 to 282 LSB/g about 256, that is ±10 % at most; 265 in place of 256 on x and y
        at 3.3 V (+3.5 %). MPU-9150: ±3 %. The prior of 2 % is that of chips of one lot, by choice.
    :example: a11 = 0.03, a22 = -0.02, a33 = 0.01
    :experiment: Put the unit at rest on six faces: the difference of a channel between up and down is twice its gain
        times gravity. For channels that see no gravity on the table, spin at several speeds with the array on its side
        as well.
    :recordings: MIMU4444: −0.5 to +0.8 % against the nominal 2048 LSB/g. Xsens MTi (IMU-TK's recording): 414.4, 412.0
        and 414.6 counts per m/s² where the factory states 415, 413 and 415, that is −0.1 to −0.2 %.
    """

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
    """Second-order non-linearity per channel.

    The reading bends with its size, the same way for both signs: a sensing element whose spring or electrostatic
    feedback is not symmetric.

    Notes
    -----
    :formula: y = f + k·f²
    :symbols: k = {channel}_s2_m
    :size: 3 mg at 1 g. The ADXL345's data sheet allows ±0.5 % of full scale for all curvature together: at ±16 g that
        is 80 mg at 16 g, or 0.3 mg at 1 g for a pure square; so the prior is wide, by choice.
    :example: a11_s2_m = 0.0005, a22_s2_m = -0.0003
    :experiment: Spin at several speeds in the centrifuge's range (tens of m/s²), so that the square of a reading and
        the reading itself differ; the array on its side as well, so that the channels along gravity take part.
    """

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
        return _with_step(
            world,
            lambda readings, context: readings + np.outer(context.temperature - _REFERENCE_TEMPERATURE, coefficient),
        )


class WarmUp(_PerChannel):
    """Offsets that settle exponentially after power-on.

    Offsets start where the cold unit has them, which the calibration knows, and approach another value as the chip
    warms itself.

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
        return _with_step(
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
        return _with_step(
            world, lambda readings, context: readings + np.outer(np.exp(-world.since_start(context.t) / tau), offset)
        )


class VibrationRectification(_PerChannel):
    """Mean readings that shift with vibration, as ω⁴.

    Vibration of motor and bearing is rectified by the curvature of the sensing element into a shift of the mean
    reading. The vibration of a rotating unbalance grows as ω², the square of it as ω⁴.

    Notes
    -----
    :formula: y = f + k·ω⁴
    :symbols: k = {channel}_m_s2_per_rad4_s4
    :size: 30 mg at 15 rad/s, by choice. Data sheets of tactical-grade parts state a rectification coefficient per g²
        rms, that of the ADXL345 none.
    :example: a11_m_s2_per_rad4_s4 = 5e-6, a22_m_s2_per_rad4_s4 = -3e-6
    :experiment: Repeat a run at several speeds with the array on a foam pad or another isolator: rectification falls
        with the vibration, a gain, a curvature or a stretching arm does not. Or shake the resting unit and look at the
        mean.
    """

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
    """A channel that picks up its neighbour on the same chip.

    A channel also reads a share of another axis of its chip: a sensing element that is not square to its neighbour, or
    electrical crosstalk within the package.

    Notes
    -----
    :formula: y[i] = f[i] + c·f[j]
    :symbols: c = {pair}
    :size: Data sheets: ±1 % (ADXL345), ±2 % (MPU-9150). The prior is 1 %.
    :example: a11_from_a12 = 0.01, a22_from_a23 = -0.008
    :experiment: Six or more poses at rest give every pair of axes. A chip that is turned as a whole has pick-up of
        opposite sign in the two directions of a pair; a pick-up that is alike in both directions is no turn. A pure
        turn of a chip is better called misalignment.
    :recordings: MIMU4444: up to 0.7 % from channel to channel, the same in both recordings. Xsens MTi (IMU-TK's
        recording): axes 0.3, 0.9 and 2.1 % off square.
    """

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
        return _with_step(world, lambda readings, context: low_pass(readings, context.t, tau)) if tau else world


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
    """Backlash in the reading: it follows the specific force only after the backlash is taken up.

    A share of each reading depends on the direction from which it came: a flexing package, a creeping solder joint,
    friction in a mount.

    Notes
    -----
    :formula: y = f + (h/w)·(backlash(f, w) − f)
    :symbols: h = lost_m_s2; w = width_m_s2
    :size: 5 mg lost, by choice; the half-width from 2 to 600 mg is searched on a grid.
    :example: lost_m_s2 = 0.1, width_m_s2 = 0.1
    :experiment: Reverse the rate slowly many times and plot the residual against the reading: a loop that is run
        through in one sense. A non-linearity is one line there, and a lag a loop that widens with the speed of the
        reversal.
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
    """All gains drift with time.

    The gain of all channels changes in proportion to time: a supply or a reference voltage that drifts during the run.

    Notes
    -----
    :formula: y = f·(1 + k·t)
    :symbols: k = slope_1_s
    :size: 2e-4 per second, or 1.2 % in a minute, by choice: a battery under load.
    :example: slope_1_s = 0.0002
    :experiment: Repeat the same speeds early and late in a run of some minutes. An offset that drifts adds the same at
        every speed, a gain adds in proportion to the reading.
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
        return _with_step(
            world, lambda readings, context: readings * (1.0 + slope * world.since_start(context.t))[:, None]
        )


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
    :experiment: Record at rest: the line is all there is besides noise. Record at another sample rate: an aliased line
        moves, a true one stays.
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
        return _with_step(
            world,
            lambda readings, context: readings + amplitude * np.sin(omega * context.t + phase)[:, None],
        )
