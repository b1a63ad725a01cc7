"""What a world of the benchmark is: the task that a method sees, the truth that it does not, a fresh motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.short_repr import short_repr
from gfimu.recording import Recording
from sim.effects import Effect
from sim.motions.motion import SpinMotion
from sim.twin import Twin

__all__ = ["FreshMotion", "Task", "Truth", "World"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Task:
    """What a method is given.

    Parameters
    ----------
    world : str
        Name of the world, such as ``own/test/007``.
    recording : Recording
        What was measured: channels, m/s², tachometer, rad/s, temperature, °C.
    twin : Twin
        The simulation that may lack something; its ``predict`` and ``families`` are free to use.
    """

    world: str
    recording: Recording
    twin: Twin

    __repr__ = short_repr


@dataclass(frozen=True)
class Truth:
    """What is hidden in a world.

    Parameters
    ----------
    hidden : tuple of (str, mapping)
        Names and parameters of what is hidden; contract names, except in the set ``unlisted``.
    allowed : tuple of str
        Names that are true as well but need not be named, such as a motor's own cogging.
    ties : mapping of str to tuple of str
        For a hidden effect, those that no method can tell from it in this recording (`sim.trials.benchmark.ties`).
    place : str
        Of an unlisted effect: where in the chain it acts.
    right, near : tuple of str
        Of an unlisted effect: names that state its place and dependence, and names of the nearest usual effect.
    distance : float
        d′ = √Σ(Δ/σ)² of the least hidden effect over channels and tachometer, the drive known; NaN where it has no
        noise-free form.
    distance_drive_unknown : float
        The same of a single effect with the drive free; NaN where it was not computed.
    """

    hidden: tuple[tuple[str, Mapping[str, Any]], ...] = ()
    allowed: tuple[str, ...] = ()
    ties: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    place: str = ""
    right: tuple[str, ...] = ()
    near: tuple[str, ...] = ()
    distance: float = float("nan")
    distance_drive_unknown: float = float("nan")


@dataclass(frozen=True)
class FreshMotion:
    """Another motion of the same world, without noise: what an extended simulation should predict.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Sample times, s.
    spin : SpinMotion
        True motion of the table.
    temperature : ndarray, shape (n,)
        Of the board, °C.
    channels : ndarray, shape (n, c)
        True readings, m/s².
    reference : ndarray, shape (n,)
        True reading of the tachometer, rad/s.
    white : ndarray, shape (c,)
        White noise of each channel, m/s².
    reference_noise : float
        White noise of the tachometer, rad/s.
    """

    t: Floats
    spin: SpinMotion
    temperature: Floats
    channels: Floats
    reference: Floats
    white: Floats
    reference_noise: float

    __repr__ = short_repr

    def distance(self, twin: Twin, effects: Sequence[Effect] = ()) -> float:
        """Return d′ = √Σ(Δ/σ)² between this world and a simulation with some effects, in this motion."""
        channels, reference = twin.predict(self.spin, self.t, effects=effects, temperature=self.temperature)
        moved = np.sum(((channels - self.channels) / self.white) ** 2)
        return float(np.sqrt(moved + np.sum(((reference - self.reference) / self.reference_noise) ** 2)))

    def rms_error(self, twin: Twin, effects: Sequence[Effect] = ()) -> float:
        """Return the rms error of the channels that a new recording would have, its white noise included, m/s²."""
        channels, _ = twin.predict(self.spin, self.t, effects=effects, temperature=self.temperature)
        return float(np.sqrt(np.mean((channels - self.channels) ** 2 + self.white**2)))


@dataclass(frozen=True)
class World:
    """A task and its truth.

    Parameters
    ----------
    task : Task
        What a method is given.
    truth : Truth
        What is hidden, as drawn; ties are computed later.
    motion : SpinMotion
        True motion of the table in the recording.
    """

    task: Task
    truth: Truth
    motion: SpinMotion

    __repr__ = short_repr
