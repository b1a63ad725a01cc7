"""Effects inside the sensing chain that depend on the reading or the rate: what a chip does to the specific force."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.units import MILLI_G, STANDARD_GRAVITY
from gfimu.model.parameter_units import RATIO
from sim.effects.base import LARGEST_TURN, Effect, Pattern, Size, channel_patterns
from sim.effects.per_channel import PerChannel, with_step
from sim.world import World

__all__ = ["Bias", "CrossAxis", "Quadratic", "ScaleFactor", "VibrationRectification"]


class Bias(PerChannel):
    """Constant offset per channel.

    Each channel reads a constant amount too much, independent of the motion: a chip as delivered, one under stress
    after soldering, or one read at another temperature than it was calibrated at.

    Notes
    -----
    :formula: y = f + b
    :symbols: b = {channel}_m_s2
    :size: Data sheet of the ADXL345 (Rev. E): 35 mg (x, y) and 40 mg (z) typical, 150 and 250 mg at most. The prior of
        20 mg is smaller by choice: it is that of a unit that was calibrated once.
    :example: a11_m_s2 = 0.2, a22_m_s2 = -0.15, a33_m_s2 = 0.1
    :experiment: Put the unit at rest on six faces. Gravity changes its sign on a channel that is turned over, a bias
        does not. On the table, record the same profile a second time with the array on its side.
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
        return with_step(world, lambda readings, context: readings + offset)


class ScaleFactor(PerChannel):
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
        return with_step(world, lambda readings, context: readings * gain)


class Quadratic(PerChannel):
    """Second-order non-linearity per channel.

    The reading has an error in proportion to its square, of the same sign for both signs of the reading: a sensing
    element whose spring or electrostatic feedback is not symmetric.

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
        return with_step(world, lambda readings, context: readings + coefficient * readings**2)


class VibrationRectification(PerChannel):
    """Mean readings that shift with vibration, as ω⁴.

    Vibration of motor and bearing is rectified by the second-order non-linearity of the sensing element into a shift of
    the mean reading. The vibration of a rotating unbalance grows as ω², the square of it as ω⁴.

    Notes
    -----
    :formula: y = f + k·ω⁴
    :symbols: k = {channel}_m_s2_per_rad4_s4
    :size: 30 mg at 15 rad/s, by choice. Data sheets of tactical-grade parts state a rectification coefficient per g²
        rms, that of the ADXL345 none.
    :example: a11_m_s2_per_rad4_s4 = 5e-6, a22_m_s2_per_rad4_s4 = -3e-6
    :experiment: Repeat a run at several speeds with the array on a foam pad or another isolator: rectification
        decreases with the vibration; a gain, a second-order non-linearity or a stretching arm does not. Or shake the
        resting unit and look at the mean.
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
        return with_step(world, lambda readings, context: readings + np.outer(context.spin.rate**4, coefficient))


class CrossAxis(Effect):
    """A channel that picks up its neighbour on the same chip.

    A channel also reads a share of another axis of its chip: a sensing element that is not square to its neighbour, or
    electrical crosstalk within the package.

    Notes
    -----
    :formula: y[i] = f[i] + c·f[j]
    :symbols: c = {channel}_from_{neighbour}
    :size: Data sheets: ±1 % (ADXL345), ±2 % (MPU-9150). The prior is 1 %.
    :example: a11_from_a12 = 0.01, a22_from_a23 = -0.008
    :experiment: Six or more poses at rest give every pair of axes. A chip that is turned as a whole has pick-up of
        opposite sign in the two directions of a pair; a pick-up of the same sign in both directions is no turn. A pure
        turn of a chip is named misalignment.
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
        return with_step(world, lambda readings, context: readings @ mixing.T)
