"""Physics for the emulated board: what each conversion of each chip yields.

The sensing chain is that of `sim.chips.adxl345`, up to the point where the register-level chip takes over: range,
resolution and justification are applied there, when a register is read.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.adxl345.registers import RAW_PER_COUNT, TICKS_PER_SECOND
from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from sim.chips.adxl345 import Sensor

__all__ = ["Conversions", "RestPhysics", "RidePhysics", "Scene"]

_CHIPS = 4
_FASTEST_HZ, _FASTEST_CODE = 3200.0, 15
_LARGEST_RAW = 1 << 24
_LOW_POWER, _LOW_POWER_NOISE = 0x10, 1.5  # BW_RATE bit 4: "somewhat higher noise"; the data sheet gives no figure


class Conversions(Protocol):
    """Gives the board what its chips convert."""

    def __call__(self, sensor: int, first: int, period: int, count: int, bw_rate: int) -> NDArray[np.int32]:
        """Return raw conversions (count, 3) of a sensor (from 0), from tick ``first`` on, ``period`` ticks apart."""
        ...


class Scene(Protocol):
    """Where the board is and what its chips are like (`sim.ride.Ride`)."""

    array: AccelerometerArray
    seed: int

    @property
    def lsb(self) -> float:
        """Size of a full-resolution count, m/s²."""
        ...

    @property
    def noise_factor(self) -> float:
        """White noise against the data sheet's."""
        ...

    @property
    def bias_walk(self) -> float:
        """Random walk of the offsets, m/s²/√s."""
        ...

    def force(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Specific force along the sensing axes (n, 12), m/s², at times (n,), s."""
        ...

    def temperature(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Board temperature at times (n,), °C."""
        ...

    def sensor(self, output_data_rate: float) -> Sensor:
        """Sensing chain at an output data rate, Hz."""
        ...

    def conversion_offsets(self, output_data_rate: float) -> NDArray[np.float64]:
        """When the conversions behind one sample take place, against the sample, s."""
        ...

    def references(self, t: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return what other instruments read at times (n,), by column name."""
        ...

    @property
    def metadata(self) -> dict[str, Any]:
        """What a recording should say about the scene."""
        ...


class RestPhysics:
    """A board that lies still: 1 g along z, no noise."""

    def __call__(self, sensor: int, first: int, period: int, count: int, bw_rate: int) -> NDArray[np.int32]:
        """Return the same conversion over and over."""
        return np.tile(np.array([0, 0, 256 * RAW_PER_COUNT], dtype=np.int32), (count, 1))


class RidePhysics:
    """The physics of a scene.

    Parameters
    ----------
    scene : Scene
        Where the board is.

    Raises
    ------
    InputError
        If the array is not of four three-axis chips.
    """

    def __init__(self, scene: Scene) -> None:
        array = scene.array
        if len(array.chips) != _CHIPS or any(len(chip.axes) != 3 for chip in array.chips):
            raise InputError(f"array {array.name!r}: the board carries four three-axis chips; name such an array")
        self.scene = scene
        self._noise = [np.random.default_rng(s) for s in np.random.SeedSequence([scene.seed, 2]).spawn(_CHIPS)]
        self._walk = np.zeros((_CHIPS, 3))
        self._columns = [np.flatnonzero(array.chip_of_channel == chip) for chip in range(_CHIPS)]

    def analogue(self, sensor: int, t: NDArray[np.float64], output_data_rate: float) -> NDArray[np.float64]:
        """Noise-free analogue readings (n, 3) of a sensor (from 0) at times (n,), s, m/s²."""
        offsets = self.scene.conversion_offsets(output_data_rate)
        force = np.mean([self.scene.force(t + offset) for offset in offsets], axis=0)  # (n, 12)
        errors = self.scene.sensor(output_data_rate).errors
        return np.asarray(errors.distort(force, self.scene.temperature(t))[:, self._columns[sensor]])

    def __call__(self, sensor: int, first: int, period: int, count: int, bw_rate: int) -> NDArray[np.int32]:
        """Return raw conversions (count, 3) of a sensor (from 0), from tick ``first`` on, ``period`` ticks apart."""
        t = (first + period * np.arange(count, dtype=np.int64)) / TICKS_PER_SECOND
        rate = _FASTEST_HZ / 2.0 ** (_FASTEST_CODE - (bw_rate & 15))
        reading = self.analogue(sensor, t, rate)
        chance = self._noise[sensor]
        if self.scene.bias_walk:
            steps = chance.normal(size=(count, 3)) * self.scene.bias_walk * np.sqrt(period / TICKS_PER_SECOND)
            walk = self._walk[sensor] + np.cumsum(steps, axis=0)
            self._walk[sensor] = walk[-1]
            reading = reading + walk
        spread = self.scene.sensor(rate).noise_std[self._columns[sensor]] * self.scene.noise_factor
        if bw_rate & _LOW_POWER:
            spread = spread * _LOW_POWER_NOISE
        if spread.any():
            reading = reading + chance.normal(size=(count, 3)) * spread
        raw = np.floor(reading / self.scene.lsb * RAW_PER_COUNT + 0.5)
        return np.clip(raw, -_LARGEST_RAW, _LARGEST_RAW).astype(np.int32)
