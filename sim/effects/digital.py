"""Effects on the digital side: noise level, ranges, wiring, stuck channels and lost frames."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.model.parameter_units import NAME, NUMBER, RATIO
from sim.effects.base import Effect, Size
from sim.world import World

__all__ = [
    "AxisSwap",
    "BiasRandomWalk",
    "CoarseResolution",
    "DroppedFrames",
    "Noise",
    "Saturation",
    "SignFlip",
    "StuckChannel",
    "WrongRange",
]


class _Discrete(Effect):
    """An effect found by looking at the samples themselves: it has keys, but no small sizes."""

    place = "data"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        return ()

    def names(self, key: str) -> list[str]:
        """Return one or several channel names."""
        value = self.parameters.get(key, [])
        return [value] if isinstance(value, str) else [str(item) for item in value]

    def channel_order(self, array: AccelerometerArray) -> NDArray[np.intp]:
        """Return the sensor that each channel of the recording holds, shape (c,)."""
        return np.arange(array.n_channels)


class Noise(_Discrete):
    """More white noise than the part should have.

    All channels have more white noise than the data sheet's figure: a noisy supply, less oversampling than assumed,
    vibration of the bench.

    Notes
    -----
    :formula: σ′ = κ·σ
    :symbols: κ = factor
    :size: No prior: it is measured from the scatter. ADXL345 at 100 Hz: 0.75 LSB rms (x, y) and 1.1 LSB (z), LSB = 3.9
        mg.
    :example: factor = 2.0
    :experiment: Record a long rest and compare with the data sheet (`gfimu noise`). At rest on foam, vibration of the
        bench is gone and noise of the chip stays.
    :recordings: MIMU4444: the channels' noise at rest is 0.037 m/s² rms.
    :rivals: It changes the scatter of the readings and not their mean. A diagnosis estimates the white noise in its
        fit, and names this effect where the noise of all channels exceeds the data sheet's.
    """

    name = "noise"
    summary = "more white noise than the part should have"
    place = "noise"
    other_units: ClassVar = {"factor": NUMBER}
    separated_by = "a longer rest"

    def apply(self, world: World) -> World:
        """Multiply the white noise."""
        return world.changed(noise_factor=world.noise_factor * self.value("factor", 1.0))


class BiasRandomWalk(_Discrete):
    """Biases that follow a random walk.

    Each offset has a random walk of its own. The Allan deviation then rises with the square root of the
    averaging time.

    Notes
    -----
    :formula: mean((y − f)²) = q²·t
    :symbols: q = strength_m_s2_rts
    :size: No prior: it is measured. Data sheets of consumer parts do not state it.
    :example: strength_m_s2_rts = 0.005
    :experiment: Record an hour at rest at constant temperature and look at the Allan deviation (`gfimu noise`): its
        right end rises as √τ. An offset that follows the temperature is explained by a thermometer on the chip.
    :recordings: MIMU4444: z biases with 0.3 mm/s²/√s make the poses of one recording agree with their predictions
        (variance factor 1.0); the figure was chosen on these recordings.
    :rivals: It changes the spectrum of the noise and not the mean of the readings. A diagnosis compares models of the
        noise with and without it by their evidence.
    """

    name = "bias_random_walk"
    summary = "biases follow a random walk (acceleration random walk)"
    place = "noise"
    other_units: ClassVar = {"strength_m_s2_rts": "m/s²/√s"}
    separated_by = "a long rest at constant temperature"

    def apply(self, world: World) -> World:
        """Add a random walk of this strength (m/s² per √s) to every channel."""
        return world.changed(bias_walk=float(np.hypot(world.bias_walk, self.value("strength_m_s2_rts"))))


class Saturation(_Discrete):
    """Clipping below the assumed range: of all channels alike, or of single sides of single channels.

    Readings stop at a level below the range that the twin assumes: a chip set to ±2 g, or an analogue stage that clips
    first.

    ``limit_m_s2`` holds for all channels, above and below, unless levels of channels are given, such as
    ``a11_upper_m_s2`` or ``a11_lower_m_s2``: then only those clip, each at its own level.

    Notes
    -----
    :formula: y = clip(f, L₁, L₂)
    :symbols: L₁ = {channel}_lower_m_s2; L₂ = {channel}_upper_m_s2
    :size: No prior: the level is read from the samples, which stand still at it.
    :example: a11_upper_m_s2 = 4.0, a11_lower_m_s2 = -4.0
    :experiment: Repeat the run at lower rates, where no reading reaches the level: it must agree with the simulation.
    :recordings: MIMU4444: the gyros clip in 3 % of the samples of the shaken part, the accelerometers need not.
    """

    name = "saturation"
    summary = "readings clip below the assumed range"
    other_units: ClassVar = {"limit_m_s2": "m/s²"}
    separated_by = "a run at lower rates, which must agree"

    @classmethod
    def parameter_units(cls, array: AccelerometerArray) -> dict[str, str]:
        """Return the unit of the common limit and of two levels per channel."""
        levels = (*cls._side_keys(array, "upper"), *cls._side_keys(array, "lower"))
        return {**cls.other_units, **dict.fromkeys(levels, "m/s²")}

    @staticmethod
    def _side_keys(array: AccelerometerArray, side: str) -> tuple[str, ...]:
        return tuple(f"{channel}_{side}_m_s2" for channel in array.channels)

    def apply(self, world: World) -> World:
        """Clip the readings."""
        sides = [self._side_keys(world.array, side) for side in ("upper", "lower")]
        limit = self.value("limit_m_s2", np.inf)
        if any(key in self.parameters for keys in sides for key in keys):
            limit = np.inf
        upper = np.array([self.value(key, limit) for key in sides[0]])
        lower = np.array([self.value(key, -limit) for key in sides[1]])
        return _with_data_step(world, lambda t, readings, rng: np.clip(readings, lower, upper))


class CoarseResolution(_Discrete):
    """A larger LSB than assumed.

    The readings are multiples of a larger step than the part's: the 10-bit mode of an ADXL345, or an export with few
    digits.

    Notes
    -----
    :formula: y = q·round(f/q)
    :symbols: q = step_m_s2
    :size: No prior: the step is read from the samples. The ADXL345 at ±16 g in its 10-bit mode has 31.2 mg, in full
        resolution 3.9 mg.
    :example: step_m_s2 = 0.306
    :experiment: Read back the FULL_RES bit of the DATA_FORMAT register; look at the differences of sorted readings
        (`gfimu inspect`).
    """

    name = "coarse_resolution"
    summary = "a larger LSB than assumed (10-bit mode)"
    other_units: ClassVar = {"step_m_s2": "m/s²"}

    def apply(self, world: World) -> World:
        """Round the readings to the step."""
        step = self.value("step_m_s2")
        return _with_data_step(world, lambda t, readings, rng: np.round(readings / step) * step) if step else world


class WrongRange(_Discrete):
    """A chip configured for another range: its readings are off by a power of two.

    One chip is set to another range than the software assumes, so that its counts are 2, 4 or 8 times larger or
    smaller. κ is the factor on its channels, 1 on the others.

    Notes
    -----
    :formula: y = κ·f
    :symbols: κ = factor
    :size: Powers of two only.
    :example: chip = 'a2', factor = 0.5
    :experiment: Hold the array at rest: the chip reads half or twice gravity. A gain error that is no power of two
        is no wrong range.
    """

    name = "wrong_range"
    summary = "a chip is configured for another range: its readings are off by a power of two"
    of_wiring = True
    other_units: ClassVar = {"chip": NAME, "factor": NUMBER}

    def apply(self, world: World) -> World:
        """Multiply the chip's readings by the factor."""
        names = [chip.name for chip in world.array.chips]
        chip = str(self.parameters.get("chip", ""))
        if chip not in names:
            raise InputError(f"effect 'wrong_range': unknown chip {chip!r}; valid: {', '.join(names)}")
        gain = np.where(world.array.chip_of_channel == names.index(chip), self.value("factor", 1.0), 1.0)
        return _with_data_step(world, lambda t, readings, rng: readings * gain)


class AxisSwap(_Discrete):
    """Channels exchanged by wiring.

    Two columns of the file hold each other's channel: exchanged wires, or an exchanged order in the software.

    Notes
    -----
    :formula: y[i] = f[j];
        y[j] = f[i]
    :symbols: i, j = channels
    :size: None: it is there or not.
    :example: channels = ['a11', 'a22']
    :experiment: Put each axis up in turn and see which column reads +1 g. Columns with the same readings in the run,
        such as two vertical ones on a table, can be exchanged without any change of the data.
    """

    name = "axis_swap"
    summary = "channels are exchanged by wiring"
    of_wiring = True
    other_units: ClassVar = {"channels": NAME}

    def channel_order(self, array: AccelerometerArray) -> NDArray[np.intp]:
        """Return the sensor that each channel of the recording holds, shape (c,)."""
        names = self.names("channels")
        if not names or len(names) % 2 or len(set(names)) < len(names):
            raise InputError("effect 'axis_swap': channels must hold two channel names, or pairs of different ones")
        places = [array.index(name) for name in names]
        order = np.arange(array.n_channels)
        order[places[::2]], order[places[1::2]] = places[1::2], places[::2]
        return order

    def apply(self, world: World) -> World:
        """Exchange the two channels, or the two of each pair where several follow each other."""
        order = self.channel_order(world.array)
        return _with_data_step(world, lambda t, readings, rng: readings[:, order])


class SignFlip(_Discrete):
    """A channel inverted by wiring.

    A column has the wrong sign: a chip mounted upside down, a sign convention of the export.

    Notes
    -----
    :formula: y[i] = −f[i]
    :symbols: i = channel
    :size: None: it is there or not.
    :example: channel = 'a33'
    :experiment: Put each axis up in turn: at rest a channel reads +g along up.
    """

    name = "sign_flip"
    summary = "a channel is inverted"
    of_wiring = True
    other_units: ClassVar = {"channel": NAME}

    def apply(self, world: World) -> World:
        """Invert the channel or channels."""
        sign = np.ones(world.array.n_channels)
        for name in self.names("channel"):
            sign[world.array.index(name)] = -1.0
        return _with_data_step(world, lambda t, readings, rng: readings * sign)


class StuckChannel(_Discrete):
    """One or several channels frozen for a while.

    A channel repeats its last value from t₁ to t₂: a lost bus transfer whose buffer is read again, a chip that stopped
    converting.

    Notes
    -----
    :formula: y[i] = hold(f[i], t₁, t₂)
    :symbols: i = channel; t₁ = start_s; t₂ = stop_s
    :size: None: the time is read from the samples.
    :example: channel = 'a11', start_s = 20.0, stop_s = 25.0
    :experiment: Look at the raw counts: a live channel has noise of at least a count. Repeat the run; a fault of one
        chip returns on the same channel.
    """

    name = "stuck_channel"
    summary = "one or several channels are frozen for a while"
    other_units: ClassVar = {"channel": NAME, "start_s": "s", "stop_s": "s"}

    def apply(self, world: World) -> World:
        """Hold the channel at its last value before the start until the stop."""
        places = [world.array.index(name) for name in self.names("channel")]
        start, stop = self.value("start_s", -np.inf), self.value("stop_s", np.inf)

        def step(
            t: NDArray[np.float64], readings: NDArray[np.float64], rng: np.random.Generator
        ) -> NDArray[np.float64]:
            frozen = (t >= start) & (t < stop)
            if not frozen.any():
                return readings
            held = readings.copy()
            for place in places:
                held[frozen, place] = readings[max(int(np.argmax(frozen)) - 1, 0), place]
            return held

        return _with_data_step(world, step)


class DroppedFrames(_Discrete):
    """Lost samples.

    Rows are missing: a serial link that is too slow, a host that is busy. Time stamps show a gap of a whole number of
    periods.

    Notes
    -----
    :formula: mean(lost) = p
    :symbols: p = share
    :size: None: gaps are read from the time stamps.
    :example: share = 0.02
    :experiment: Record at half the rate or over a faster link: gaps by overload disappear.
    :recordings: MIMU4444: none in ten minutes.
    :rivals: A diagnosis finds the gaps in the time stamps before any fit.
    """

    name = "dropped_frames"
    summary = "samples are lost"
    other_units: ClassVar = {"share": RATIO, "count": NUMBER, "longest_s": "s"}

    def apply(self, world: World) -> World:
        """Lose a share of the frames at random (rows become NaN; the writer leaves them out)."""
        share = self.value("share")

        def step(
            t: NDArray[np.float64], readings: NDArray[np.float64], rng: np.random.Generator
        ) -> NDArray[np.float64]:
            kept = readings.copy()
            lost = rng.random(len(t)) < share
            lost[[0, -1]] = False
            kept[lost] = np.nan
            return kept

        return _with_data_step(world, step)


def _with_data_step(world: World, step: Any) -> World:
    return world.changed(data_steps=(*world.data_steps, step))
