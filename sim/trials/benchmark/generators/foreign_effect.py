"""What a foreign effect is: a definition with its stage in the chain, and the functions that several share.

A foreign effect is physics of a rig on a table that no library of effects holds. It stands where it acts in the chain:
the drive, where the chips are and point, what they make of specific force, the reference, when they are read, and what
hangs on the instants of sampling. Each has its parameters for a typical size, a place, and in words what it depends on.
Nothing here comes from `sim` or `gfimu`. What is of a recording and not of the world (when somebody walks by) is drawn
from the motion's ``luck``.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import bilinear, lfilter
from scipy.spatial.transform import Rotation

from sim.trials.benchmark.generators.independent_table import Rig

STAGES = ("drive", "places", "analogue", "reference", "times", "sampled", "noise")
PLACES = ("reference", "clock", "motion", "bench", "cube", "chip", "supply", "host", "nothing")


@dataclass(frozen=True)
class Motion:
    """Motion of the table on a fine, even time base, readings (n, 12) of ideal chips, and the board's temperature."""

    t: np.ndarray
    angle: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    readings: np.ndarray
    temperature: np.ndarray
    seed: tuple[int, ...] = (0,)

    @property
    def step(self):
        return self.t[1] - self.t[0]

    def luck(self):
        """What happens by chance in this recording, the same at every call."""
        return np.random.default_rng(self.seed)


@dataclass(frozen=True)
class Places:
    """Positions (n, 4, 3) and sensing axes (n, 4, 3 axes, 3) of the chips in the turning table's frame, and how far
    the whole bench is moved in the lab (n, 3); n may be 1. The origin is the foot of the cube, on the axis."""

    arms: np.ndarray
    axes: np.ndarray
    lab: np.ndarray

    @classmethod
    def at_rest(cls):
        rig = Rig()
        return cls(rig.arms[None], rig.axes[None], np.zeros((1, 3)))

    def turned(self, lean):
        """Turned about the foot by rotation vectors (n, 3)."""
        back = Rotation.from_rotvec(lean).as_matrix().transpose(0, 2, 1)
        return replace(self, arms=self.arms @ back, axes=self.axes @ back[:, None])

    def moved(self, lab):
        return replace(self, lab=self.lab + lab)


@dataclass(frozen=True)
class Foreign:
    """An effect: stage in the chain, place, dependence in words, draw(rng, plan) of its parameters at a typical size.

    ``act`` takes the parameters, the motion and what its stage passes on: places, readings (n, 12), the reference's
    reading, stamps and sample times, or sample times and channels; in the drive the parameters and the rig.

    ``shape`` are the parameters that no scaling touches, ``most`` is how large one of the others gets in practice,
    ``kin`` are names of a library that would be no wrong answer. Those without a continuous size are ``sizeless``.
    """

    stage: str
    place: str
    dependence: str
    draw: Callable
    act: Callable
    shape: tuple[str, ...] = ()
    most: tuple[str, float] | None = None
    kin: tuple[str, ...] = ()
    sizeless: bool = False

    def scaled(self, parameters, factor):
        """Return the parameters with the size multiplied, as far as it gets in practice."""
        if self.sizeless:
            return parameters
        if self.most:
            key, most = self.most
            factor = min(factor, most / abs(parameters[key]))
        return {key: value if key in self.shape else value * factor for key, value in parameters.items()}


def entering(effects):
    """Return the decorator that enters an effect into a dictionary, by the name of its function."""

    def foreign(stage, place, dependence, draw, **more):
        def enter(act):
            effects[act.__name__] = Foreign(stage, place, dependence, draw, act, **more)
            return act

        return enter

    return foreign


def _azimuth(rng):
    return float(rng.uniform(0, 2 * np.pi))


def _mode(rng, low, high):
    return {"frequency_hz": float(rng.uniform(low, high)), "damping_ratio": float(rng.uniform(0.02, 0.06))}


_MODE = ("frequency_hz", "damping_ratio")


def _along(azimuth):
    return np.array([np.cos(azimuth), np.sin(azimuth), 0.0])


def _rung(push, step, one):
    """Solve x'' + 2ζω₀x' + ω₀²x = push by the bilinear transform, from rest."""
    natural = 2 * np.pi * one["frequency_hz"]
    return lfilter(*bilinear([1.0], [1.0, 2 * one["damping_ratio"] * natural, natural**2], 1 / step), push)


def _low_passed(signal, step, time_constant):
    """First-order low-pass along the first axis by the bilinear transform, settled at first."""
    x = step / (2 * time_constant)
    gain, pole = x / (1 + x), (1 - x) / (1 + x)
    return lfilter([gain, gain], [1, -pole], signal, axis=0, zi=(1 - gain) * signal[:1])[0]
