"""The protocol of a world model: it predicts channels and lists the effects that it may lack.

Estimation and diagnosis know no more of a simulation than this. `sim.twin.Twin` implements `WorldModel` and
`BodyModel`; a simulation of another kind takes part by implementing them too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.geometry.array import AccelerometerArray
from gfimu.motion.body_drive import BodyDrive

__all__ = [
    "BasisUnits",
    "BodyModel",
    "Effect",
    "EffectFamily",
    "ExpectedNoise",
    "Mode",
    "ModelWithModes",
    "ModelWithPlay",
    "ModelWithRipple",
    "Pattern",
    "Play",
    "Ripple",
    "RippledMotion",
    "Size",
    "Spin",
    "SpinState",
    "WorldModel",
    "bound_of",
    "is_of_one_recording",
]


class SpinState(Protocol):
    """Angle (rad), rate (rad/s) and angular acceleration (rad/s²) of the table, each of shape (n,)."""

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
    """One linear coordinate of an effect: key, unit, physical prior, sign, finite-difference step.

    It may have ``most``, the largest size that a fit may take, and ``bound`` (see `bound_of`); others need not.
    """

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


def bound_of(size: Size) -> float:
    """Return the size beyond which the twin must be of another unit, in the size's unit; infinite where it has none."""
    return float(getattr(size, "bound", np.inf))


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
    """Tell whether a kind of effect has the phase of a clock that no other recording shares; others need not say so."""
    return bool(getattr(family, "of_one_recording", False))


class EffectFamily(Protocol):
    """A kind of effect: its coordinates, places, shapes and how to build one."""

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
        """Return the unit of each parameter by key: a unit, or `gfimu.units.RATIO`, ``NUMBER`` or ``NAME``."""
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
class BasisUnits:
    """What rate (rad/s), acceleration (rad/s²) and time (s) are divided by in a generic basis; all positive."""

    rate: float
    acceleration: float
    duration: float


@dataclass(frozen=True)
class Play:
    """What holds a share of every reading until the specific force has taken up a play.

    Parameters
    ----------
    share : float
        Share of a reading that is held.
    lost : float
        Most that a reading is off by it, m/s².
    model : WorldModel
        The simulation without the play.
    effects : sequence of Effect
        The effects that were added, without the play.
    sources : callable
        From the readings (n, c) without the play, the sample (n, c) at which what is held of each was last moved.
    """

    share: float
    lost: float
    model: WorldModel
    effects: Sequence[Effect]
    sources: Callable[[NDArray[np.float64]], NDArray[np.intp]]


class RippledMotion(Protocol):
    """Motion of a table whose drive ripples, which depends on all that was commanded before."""

    @property
    def grid(self) -> NDArray[np.float64]:
        """Times at which it is computed, s, shape (g,)."""
        ...

    def at(self, t: ArrayLike) -> SpinState:
        """Return the state at times (n,), s."""
        ...

    def derivative(
        self,
        first: NDArray[np.intp],
        angle: NDArray[np.float64],
        rate: NDArray[np.float64],
        size: int,
        t: NDArray[np.float64],
    ) -> tuple[NDArray[np.float64], NDArray[np.intp], NDArray[np.intp]]:
        """Differentiate what the ripple adds at times ``t`` by the ``size`` coefficients of the command.

        Given are, at each time of the grid, the first coefficient that matters (g,) and what angle and rate take from
        it and those after it (g, p); returned are the derivatives of angle, rate and acceleration (3, e), coefficient
        by coefficient, the time of each (e,) and where each coefficient's end (m + 1,).
        """
        ...


@dataclass(frozen=True)
class Ripple:
    """A ripple of the drive's torque that is locked to the table's angle.

    Parameters
    ----------
    steepness : float
        Most that its torque changes with the angle, relative to what takes it back.
    model : WorldModel
        The simulation without the ripple.
    effects : sequence of Effect
        The effects that were added, without the ripple.
    motion : callable
        From the commanded motion and the times (n,), s, of the recording, the table's motion.
    """

    steepness: float
    model: WorldModel
    effects: Sequence[Effect]
    motion: Callable[[Spin, NDArray[np.float64]], RippledMotion]


@dataclass(frozen=True)
class Mode:
    """A mode between table and array that the table's angular acceleration α rings: φ'' + 2ζω₀φ' + ω₀²φ = −α.

    Parameters
    ----------
    gain : float
        Share of the twist φ that the array takes part in.
    natural : float
        ω₀, rad/s.
    damping : float
        ζ.
    """

    gain: float
    natural: float
    damping: float


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
        """What drives it: tacho, angle, command or gyro."""
        ...

    def families(self) -> Mapping[str, EffectFamily]:
        """Return all kinds of effects it could have, by name."""
        ...

    def unnamed(self, dependence: str, units: BasisUnits, *, of_reference: bool = False) -> EffectFamily:
        """Return what no effect of the library explains as one more: a function of `generic_basis` per channel."""
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

    def sample_times(self, t: NDArray[np.float64], effects: Sequence[Effect] = ()) -> NDArray[np.float64]:
        """Return the true time that each chip's reading and, last, the reference belong to, shape (n, k + 1)."""
        ...

    def sensing_lag(self, effects: Sequence[Effect] = ()) -> float:
        """Return the time constant of the sensing chain's first-order lag, s; zero where it has none."""
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


@runtime_checkable
class ModelWithPlay(Protocol):
    """A `WorldModel` some of whose effects hold readings; others need not say so."""

    def play(self, effects: Sequence[Effect] = ()) -> Play | None:
        """Return what holds a share of the readings once effects are added; None where nothing does."""
        ...


@runtime_checkable
class ModelWithRipple(Protocol):
    """A `WorldModel` whose table may ripple with its angle; others need not say so."""

    def ripple(self, effects: Sequence[Effect] = ()) -> Ripple | None:
        """Return what the table ripples by once effects are added; None where nothing does, or several things do."""
        ...


@runtime_checkable
class ModelWithModes(Protocol):
    """A `WorldModel` in which something may ring between the table and the array; others need not say so."""

    def modes(self, effects: Sequence[Effect] = ()) -> Sequence[Mode]:
        """Return what rings once effects are added."""
        ...
