"""A factory of measured worlds: `sim.trials.worlds.hidden.measure`, many times faster and equal in distribution.

Campaigns draw millions of recordings of one twin. What they share is made once (times, geometry, noise filters), the
noise of a channel is one process driven by one number per sample (`gfimu.sensor_noise.innovations`), and the
table's profile is evaluated at the samples only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import gaussian_filter1d

from gfimu.base.errors import InputError
from gfimu.recording import Recording
from gfimu.recording.carried_array import array_metadata
from gfimu.sensor_noise.innovations import FlickerShape, add_noise, flicker_shape
from sim import forward
from sim.effects import Effect
from sim.motions.motion import SpinMotion, SpinState, SplineSpin
from sim.trials.worlds.hidden import (
    GRID,
    SMOOTHING,
    Measurement,
    drawn_profile,
    level_factors,
    profile_grid,
    temperature_course,
)
from sim.twin import Twin
from sim.world import World

__all__ = ["MeasuredWorld", "WorldFactory"]

Floats = NDArray[np.float64]

_REACH = 4.0  # standard deviations to which the smoothing Gaussian is summed, as by SciPy


@dataclass(frozen=True)
class MeasuredWorld:
    """A recording, and what is true of it.

    Parameters
    ----------
    recording : Recording
        What was measured.
    motion : SpinState
        Angle, rate and acceleration that the table was asked for, at the samples of the recording, each (n,).
    ideal : ndarray, shape (n, c)
        What the twin's own world, without the effects, reads in that motion without noise, m/s².
    """

    recording: Recording
    motion: SpinState
    ideal: Floats


@dataclass(frozen=True)
class WorldFactory:
    """Measured worlds of one twin in one setting.

    Parameters
    ----------
    twin : Twin
        The nominal world.
    setting : Measurement
        Length, rate and noise; without an encoder.

    Raises
    ------
    InputError
        If the setting has an encoder.
    """

    twin: Twin
    setting: Measurement = field(default_factory=Measurement)

    # Cached properties that do not depend on what `with_noise` changes.
    _NOT_OF_NOISE: ClassVar = (
        *("_t", "_fine", "_stride", "_first", "_taps", "_world", "_geometry", "_quantum", "_white", "_shape"),
        "_metadata",
    )

    def __post_init__(self) -> None:
        if self.setting.encoder_step:
            raise InputError("the factory makes no encoder readings; use sim.trials.worlds.hidden.measure")

    def measure(self, rng: np.random.Generator, effects: Sequence[Effect] = ()) -> Recording:
        """Record a world: the twin's, plus effects, on a random profile.

        Parameters
        ----------
        rng : numpy.random.Generator
            Random number generator.
        effects : sequence of Effect
            What is hidden in it.

        Returns
        -------
        Recording
            As that of `sim.trials.worlds.hidden.measure`, of the same distribution.
        """
        return self.world(rng, effects).recording

    def world(self, rng: np.random.Generator, effects: Sequence[Effect] = ()) -> MeasuredWorld:
        """Record a world as `measure` does, and return what is true of it too."""
        t, setting = self._t, self.setting
        spin = self._spin(rng)
        world = self.twin.world(effects) if effects else self._world
        temperature = temperature_course(rng, t)
        readings = forward.channels(world, spin, t, temperature, None if effects else self._geometry)
        asked = spin.at(t)
        motion = SpinState(asked.angle, asked.rate, asked.acceleration)
        ideal = forward.channels(self._world, spin, t, temperature, self._geometry) if effects else readings.copy()
        white = self._white * world.noise_factor
        level = setting.bias_instability * level_factors(rng, readings.shape[1])
        if np.all(white > 0.0) and setting.bias_instability:
            add_noise(readings, white, level, rng, shape=self._shape)
        else:
            readings += white * rng.standard_normal(readings.shape)
        if world.bias_walk:
            step = world.bias_walk / np.sqrt(setting.sample_rate)
            readings += np.cumsum(step * rng.standard_normal(readings.shape), axis=0)
        steps = [effect.value("step_m_s2") for effect in effects if effect.name == "coarse_resolution"]
        readings /= max(steps, default=self._quantum)
        np.rint(readings, out=readings)
        readings *= max(steps, default=self._quantum)
        for data_step in world.data_steps:
            readings = data_step(t, readings, rng)
        tacho = forward.reference(world, spin, t) + setting.tacho_noise * rng.standard_normal(len(t))
        reference = {"tacho_rad_s": tacho, "temperature_degC": temperature}
        if world.data_steps:  # frames may be lost
            kept = np.isfinite(readings).any(axis=1)
            t, readings, ideal = t[kept], readings[kept], ideal[kept]
            motion = SpinState(motion.angle[kept], motion.rate[kept], motion.acceleration[kept])
            reference = {name: column[kept] for name, column in reference.items()}
        recording = Recording(t, readings, self.twin.array.channels, reference, self._metadata)
        return MeasuredWorld(recording, motion, ideal)

    def with_noise(self, bias_instability: float, tacho_noise: float) -> WorldFactory:
        """Return the factory of the same worlds with other noise, m/s² and rad/s; what they share is not made again."""
        setting = replace(self.setting, bias_instability=bias_instability, tacho_noise=tacho_noise)
        if setting == self.setting:
            return self
        other = replace(self, setting=setting)
        other.__dict__.update({name: getattr(self, name) for name in self._NOT_OF_NOISE})
        return other

    def _spin(self, rng: np.random.Generator) -> SpinMotion:
        fine = self._fine
        profile = drawn_profile(rng, fine, self.setting.duration)
        if not self._stride:
            return SplineSpin.through(fine, gaussian_filter1d(profile, SMOOTHING / GRID))
        state = _at_samples(profile, *self._taps, self._first, self._stride, len(self._t))
        return _SampledSpin(self._t, fine, profile, SpinState(*state))

    @cached_property
    def _t(self) -> Floats:
        return np.arange(round(self.setting.duration * self.setting.sample_rate)) / self.setting.sample_rate

    @cached_property
    def _fine(self) -> Floats:
        return profile_grid(self.setting.duration)

    @cached_property
    def _stride(self) -> int:
        """Steps of the profile's grid from sample to sample; 0 where samples lie between them."""
        steps = 1.0 / (self.setting.sample_rate * GRID)
        return round(steps) if abs(steps - round(steps)) < 1e-9 * steps else 0

    @cached_property
    def _first(self) -> int:
        """Place of the first sample on the profile's grid."""
        return round(-float(self._fine[0]) / GRID)

    @cached_property
    def _taps(self) -> tuple[Floats, Floats]:
        """Gaussian that smooths the profile, and its derivative, 1/s, on the profile's grid."""
        u = np.arange(-round(_REACH * SMOOTHING / GRID), round(_REACH * SMOOTHING / GRID) + 1) * GRID
        weights = np.exp(-0.5 * (u / SMOOTHING) ** 2)
        weights /= weights.sum()
        return weights, weights * u / SMOOTHING**2

    @cached_property
    def _world(self) -> World:
        return self.twin.world()

    @cached_property
    def _geometry(self) -> forward.TableGeometry:
        return forward.table_geometry(self._world)

    @cached_property
    def _quantum(self) -> float:
        return self.twin.expected_noise(self.setting.sample_rate).quantum

    @cached_property
    def _white(self) -> Floats:
        """Standard deviation of the analogue noise of a sample, shape (c,), m/s²."""
        noise = self.twin.expected_noise(self.setting.sample_rate)
        return np.sqrt(np.maximum(noise.white**2 - noise.quantum**2 / 12.0, 0.0))

    @cached_property
    def _shape(self) -> FlickerShape:
        return flicker_shape(len(self._t))

    @cached_property
    def _metadata(self) -> dict[str, Any]:
        array = self.twin.array
        return {**array_metadata(array), "array": self.twin.array_name or array.name}


class _SampledSpin:
    """A spin whose states at the samples are at hand; at other times it is the spline through its profile."""

    def __init__(self, t: Floats, fine: Floats, profile: Floats, state: SpinState) -> None:
        self._t, self._fine, self._profile, self._state = t, fine, profile, state

    @cached_property
    def _spline(self) -> SplineSpin:
        return SplineSpin.through(self._fine, gaussian_filter1d(self._profile, SMOOTHING / GRID))

    def at(self, t: ArrayLike) -> SpinState:
        """State of the spin at times ``t``, s, shape (n,)."""
        return self._state if t is self._t or np.array_equal(t, self._t) else self._spline.at(t)


@njit(cache=True, fastmath=True)
def _at_samples(profile, weights, slopes, first, stride, n):  # type: ignore[no-untyped-def]
    """Return angle, rate and acceleration of a smoothed profile at n samples, each (n,); the table is at rest before.

    The angle is the integral of the cubic through rates and accelerations at both ends of each step.
    """
    angle, rate, acceleration = np.zeros(n), np.empty(n), np.empty(n)
    reach = len(weights) // 2
    for i in range(n):
        begin = first + stride * i - reach
        r, a = 0.0, 0.0
        for k in range(len(weights)):
            r += weights[k] * profile[begin + k]
            a += slopes[k] * profile[begin + k]
        rate[i], acceleration[i] = r, a
    step = stride * GRID
    for i in range(1, n):
        mean = 0.5 * (rate[i - 1] + rate[i]) + step / 12.0 * (acceleration[i - 1] - acceleration[i])
        angle[i] = angle[i - 1] + step * mean
    return angle, rate, acceleration
