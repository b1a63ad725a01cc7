"""The protocol of a world model: it predicts channels and lists the effects that it may lack.

Estimation and diagnosis know no more of a simulation than this. `sim.twin.Twin` implements `WorldModel` and
`BodyModel`; a simulation of another kind takes part by implementing them too.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.motion.body_drive import BodyDrive

__all__ = [
    "BodyModel",
    "Effect",
    "EffectFamily",
    "ExpectedNoise",
    "Pattern",
    "PlacedArray",
    "Size",
    "Spin",
    "SpinState",
    "Whitened",
    "WorldModel",
    "acts_back",
    "is_linear",
    "is_of_one_recording",
    "is_of_wiring",
    "memory_of",
    "prior_of",
    "reads_place",
    "shapes_to_screen",
]


class SpinState(Protocol):
    """Angle (rad), rate (rad/s) and angular acceleration (rad/s²) of the table, each of shape (n,).

    Of a linear axis: place (m), speed (m/s) and acceleration (m/s²) of its carriage.
    """

    @property
    def angle(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def rate(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def acceleration(self) -> NDArray[np.float64]: ...  # noqa: D102


class Spin(Protocol):
    """Spin of the table as a function of time."""

    def at(self, t: ArrayLike) -> SpinState:
        """Return the state at times (n,), s."""
        ...


class Size(Protocol):
    """One linear coordinate of an effect, as `gfimu.model.own_rig.places.Size` describes it."""

    @property
    def key(self) -> str: ...  # noqa: D102
    @property
    def unit(self) -> str: ...  # noqa: D102
    @property
    def prior_std(self) -> float: ...  # noqa: D102
    @property
    def positive(self) -> bool: ...  # noqa: D102
    @property
    def step(self) -> float: ...  # noqa: D102
    @property
    def most(self) -> float: ...  # noqa: D102
    @property
    def bound(self) -> float: ...  # noqa: D102


class Pattern(Protocol):
    """Sizes that move together: a name and a mixing matrix (m, k)."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def mixing(self) -> NDArray[np.float64]: ...  # noqa: D102


class Effect(Protocol):
    """One effect with its parameters."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def place(self) -> str: ...  # noqa: D102
    @property
    def parameters(self) -> dict[str, Any]: ...  # noqa: D102

    def size_values(self, array: AccelerometerArray) -> NDArray[np.float64]:
        """Return the linear coordinates."""
        ...

    def shape_values(self) -> dict[str, float]:
        """Return the shape parameters."""
        ...


def is_of_one_recording(family: EffectFamily) -> bool:
    """Whether a kind of effect has the phase of a clock that no other recording shares; others need not say so."""
    return bool(getattr(family, "of_one_recording", False))


def is_of_wiring(effect: Effect) -> bool:
    """Whether a fault of the samples changes a prediction without noise; others need not say so."""
    return bool(getattr(effect, "of_wiring", False))


def prior_of(family: EffectFamily, families: Iterable[EffectFamily]) -> float:
    """Return the prior probability of one kind of effect among several, of which some are rarer (``rarity``)."""
    chance, *chances = (1.0 / float(getattr(one, "rarity", 1.0)) for one in (family, *families))
    return chance / sum(chances)


def memory_of(effect: Effect) -> float:
    """Return how long a reading depends on the drive before it by an effect, s; others need not say so."""
    return float(getattr(effect, "memory_s", 0.0))


def reads_place(model: WorldModel) -> bool:
    """Whether the reference of a simulation is an angle, or the place of a carriage, and no rate."""
    return model.drive_source in ("angle", "carriage")


def is_linear(model: WorldModel) -> bool:
    """Whether a simulation is of a linear axis, whose spin has place (m), speed (m/s) and acceleration (m/s²)."""
    return model.drive_source in ("carriage", "carriage_speed", "carriage_acceleration")


def acts_back(effect: Effect) -> bool:
    """Whether what an effect remembers acts back on the motion, as a mode between table and array does.

    What only adds to the readings has little to do with how they depend on the drive.
    """
    return bool(getattr(effect, "acts_back", True))


class EffectFamily(Protocol):
    """A kind of effect: its coordinates, places, shapes and how to build one.

    What else it may know of itself is optional: ``whole`` (shape parameters that are whole numbers), ``shape_limits``
    (least and largest value by shape parameter), ``needs_temperature``, ``tolerance`` (what a good calibration leaves
    of each size), ``of_one_recording``, ``of_wiring`` (`is_of_wiring`), ``of_pose`` (it depends on the specific force
    alone), ``alike_by_lot`` (chips of one lot have nearly the same sizes), ``contained_in`` (effects that can do all
    that it does), ``level_error`` (to which a level of a reading is found at best, in units of its white noise),
    ``memory_s``, ``acts_back`` (`acts_back`), ``rarity`` (`prior_of`) and, of a fault of the samples,
    ``channel_order`` of an effect, ``scan`` (`shapes_to_screen`).
    """

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def summary(self) -> str: ...  # noqa: D102
    @property
    def separated_by(self) -> str: ...  # noqa: D102
    @property
    def place(self) -> str: ...  # noqa: D102
    @property
    def per_run(self) -> bool: ...  # noqa: D102
    @property
    def inexactness(self) -> float: ...  # noqa: D102
    @property
    def starts(self) -> tuple[float, ...]: ...  # noqa: D102

    def __call__(self, parameters: Mapping[str, Any]) -> Effect:
        """Build an effect from its contract parameters."""
        ...

    def sizes(self, array: AccelerometerArray) -> tuple[Size, ...]:
        """Return the linear coordinates."""
        ...

    def parameter_units(self, array: AccelerometerArray) -> Mapping[str, str]:
        """Return the unit of each parameter by key, or ``RATIO``, ``NUMBER`` or ``NAME`` of `parameter_units`."""
        ...

    def patterns(self, array: AccelerometerArray) -> tuple[Pattern, ...]:
        """Return the places and structures it can take."""
        ...

    def reach(self, array: AccelerometerArray) -> NDArray[np.bool_] | None:
        """Return which channels each size changes, shape (m, c), or None where all may change."""
        ...

    def shapes(self, duration: float, sample_rate: float) -> tuple[dict[str, float], ...]:
        """Return the grid of shape parameters."""
        ...

    def from_sizes(self, array: AccelerometerArray, values: NDArray[np.float64], shape: Mapping[str, float]) -> Effect:
        """Build an effect from its linear coordinates."""
        ...


def shapes_to_screen(
    family: EffectFamily, left: Sequence[Whitened], duration: float, sample_rate: float
) -> tuple[Sequence[Mapping[str, float]], float]:
    """Return the shapes of a kind of effect to screen, and how many independent ones they were chosen from.

    A family with a method ``scan(left, duration, sample_rate)`` looks for them in what a fit leaves; of others it is
    the whole grid.
    """
    scan = getattr(family, "scan", None)
    if scan is not None:
        shapes, looks = scan(left, duration, sample_rate)
        return shapes, float(looks)
    grid = family.shapes(duration, sample_rate)
    return grid, float(len(grid))


@dataclass(frozen=True)
class ExpectedNoise:
    """Noise that the world model expects of its sensors.

    Parameters
    ----------
    white : ndarray, shape (c,)
        Standard deviation of white noise including quantisation, m/s².
    quantum : float
        Size of one count, m/s².
    full_scale : float
        Largest reading of the configured range, m/s².
    """

    white: NDArray[np.float64]
    quantum: float
    full_scale: float

    @property
    def analogue(self) -> NDArray[np.float64]:
        """White noise before quantisation, shape (c,), m/s²."""
        power = self.white**2
        return np.asarray(np.sqrt(np.maximum(power - self.quantum**2 / 12.0, 0.01 * power)))


@dataclass(frozen=True)
class PlacedArray:
    """An array on the table of a rig, in the frame that turns with the table, its z along the axis.

    Parameters
    ----------
    axes : ndarray, shape (c, 3)
        Sensing axes, unit vectors.
    places : ndarray, shape (c, 3)
        Places of the chips from a point of the axis, m.
    gravity : ndarray, shape (3,)
        Specific force of a rig at rest, m/s², at the angle zero.
    """

    axes: NDArray[np.float64]
    places: NDArray[np.float64]
    gravity: NDArray[np.float64]


@dataclass(frozen=True)
class Whitened:
    """What a stretch leaves unexplained, whitened: its product with any column is that column's score.

    Parameters
    ----------
    residual : ndarray, shape (n, c + 1)
        W times the residual, drive at its best; the reference last.
    weights : ndarray, shape (c + 1,)
        One over the white variance of each observation.
    t : ndarray, shape (n,)
        Sample times, s.
    state : SpinState
        The table's motion there.
    array : AccelerometerArray
        The array.
    """

    residual: NDArray[np.float64]
    weights: NDArray[np.float64]
    t: NDArray[np.float64]
    state: SpinState
    array: AccelerometerArray


class WorldModel(Protocol):
    """A simulation that can be wrong."""

    @property
    def array(self) -> AccelerometerArray:
        """The accelerometer array."""
        ...

    @property
    def effects(self) -> Sequence[Effect]:
        """Effects that the model already has."""
        ...

    @property
    def drive_source(self) -> str:
        """What drives it: tacho, angle, command, gyro, or of a linear axis carriage and so on (`is_linear`)."""
        ...

    def families(self) -> Mapping[str, EffectFamily]:
        """Return all kinds of effects it could have, by name."""
        ...

    def described(self, parameters: Mapping[str, object]) -> Effect:
        """Return an error without a name as an effect (`gfimu.model.located.effect.LocatedEffect.parameters`)."""
        ...

    def predict(
        self,
        spin: Spin,
        t: NDArray[np.float64],
        *,
        effects: Sequence[Effect] = (),
        temperature: NDArray[np.float64] | None = None,
        mounting: NDArray[np.float64] | None = None,
        start: float | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Predict noise-free channels (n, c), m/s², and the reference (n,) for a spin, with more effects added."""
        ...

    def placed(self, mounting: NDArray[np.float64] | None = None) -> PlacedArray | None:
        """Return the array as it stands on the table, turned by a rotation vector from upright; None if not known."""
        ...

    def sample_times(self, t: NDArray[np.float64], effects: Sequence[Effect] = ()) -> NDArray[np.float64]:
        """Return the true time that each chip's reading and, last, the reference belong to, shape (n, k + 1)."""
        ...

    def reference_gain(self, effects: Sequence[Effect] = ()) -> float:
        """Return what the reference reads per unit of motion once effects are added, relative to without them."""
        ...

    def expected_noise(self, sample_rate: float) -> ExpectedNoise:
        """Return the noise it expects at a sample rate."""
        ...

    def extended(self, effects: Sequence[Effect]) -> WorldModel:
        """Return the model with these effects added to its own."""
        ...

    def with_array(self, array: AccelerometerArray) -> WorldModel:
        """Return the model of another array with the same channels."""
        ...

    def to_toml(self) -> str:
        """Return the twin file."""
        ...


@runtime_checkable
class BodyModel(WorldModel, Protocol):
    """A simulation of an array on a free body."""

    @property
    def local_gravity(self) -> float:
        """Magnitude of the specific force at rest, m/s²."""
        ...

    def predict_body(
        self,
        drive: BodyDrive,
        t: NDArray[np.float64],
        *,
        effects: Sequence[Effect] = (),
        temperature: NDArray[np.float64] | None = None,
        start: float | None = None,
    ) -> NDArray[np.float64]:
        """Predict noise-free channels (n, c), m/s², from gyro and specific force."""
        ...
