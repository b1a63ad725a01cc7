"""What an unknown function is of: the motion, the angle, time, temperature or a reading, with a prior of functions.

A function without a form is a Gaussian process with a squared-exponential covariance, on cubic B-splines of a warped
regressor (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, ch. 2). One-number forms compete with
these: they win where they serve, as they have fewer coefficients, and they extrapolate.
"""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.ndimage import uniform_filter1d
from scipy.signal import cont2discrete, lfilter, ss2tf

from gfimu.array.kinematics import omega_products
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.model.located.rig_state import RigState
from gfimu.model.located.usual import USUAL
from gfimu.motion.body_drive import BodyDrive

__all__ = [
    "Curve",
    "Dependence",
    "Form",
    "LowPassed",
    "Memory",
    "Mode",
    "OfReading",
    "Product",
    "Regressor",
    "Revolution",
    "VectorForm",
    "Wave",
    "curve_over",
    "vector_forms",
]

_Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Regressor:
    """A quantity that an error may go with.

    Parameters
    ----------
    name : str
        As in ``verdict.json``: omega, alpha, theta, t, T.
    words : str
        For people.
    unit : str
        Its unit.
    of : callable
        From the state of a rig to its values (n,).
    """

    name: str
    words: str
    unit: str
    of: Callable[[RigState], _Floats]


RATE = Regressor("omega", "the rate", "rad/s", lambda state: state.spin.rate)
ACCELERATION = Regressor("alpha", "the angular acceleration", "rad/s²", lambda state: state.spin.acceleration)
ANGLE = Regressor("theta", "the angle turned", "rad", lambda state: state.spin.angle)
TIME = Regressor("t", "time", "s", lambda state: state.t)
NOTHING = Regressor("1", "nothing", "", lambda state: np.ones_like(state.t))


def _rate_squared(state: RigState) -> _Floats:
    return np.asarray(state.spin.rate**2)


def _force_along_x(state: RigState) -> _Floats:
    """Return the force of an unbalance along x of the room, over its mass and arm, (n,), rad²/s²."""
    angle = state.spin.angle
    return np.asarray(_rate_squared(state) * np.cos(angle) + state.spin.acceleration * np.sin(angle))


def _force_along_y(state: RigState) -> _Floats:
    """Return the same along y."""
    angle = state.spin.angle
    return np.asarray(_rate_squared(state) * np.sin(angle) - state.spin.acceleration * np.cos(angle))


RATE_SQUARED = Regressor("omega^2", "the rate squared", "rad²/s²", _rate_squared)
FORCES = (
    Regressor("unbalance x", "an unbalance", "rad²/s²", _force_along_x),
    Regressor("unbalance y", "an unbalance", "rad²/s²", _force_along_y),
)


def _temperature(state: RigState) -> _Floats:
    if state.temperature is None:
        raise ValueError("the recording has no temperature")
    return state.temperature


TEMPERATURE = Regressor("T", "the temperature", "°C", _temperature)


def _warming(state: RigState) -> _Floats:
    """Return how fast the temperature changes over two seconds, K/s."""
    smooth = uniform_filter1d(_temperature(state), max(int(2.0 / state.period), 3))
    return np.asarray(np.gradient(smooth, state.period))


WARMING = Regressor("dT/dt", "the rate of change of the temperature", "K/s", _warming)


REGRESSORS = {
    one.name: one for one in (RATE, ACCELERATION, ANGLE, TIME, NOTHING, RATE_SQUARED, *FORCES, TEMPERATURE, WARMING)
}
"""By name."""


class Dependence(ABC):
    """A linear family of functions of what a rig does.

    ``name`` identifies it in ``verdict.json``, ``kind`` is the same for all that mean the same to a person, ``words``
    say how an error goes with it, ``looks`` is what it costs to have been chosen among many alike, nats, ``memory_s``
    how long it remembers the drive, and ``of_one_recording`` whether it is of absolute time.
    """

    name: str
    kind: str
    words: str
    looks: float = 0.0
    memory_s: float = 0.0
    of_one_recording: bool = False

    @property
    @abstractmethod
    def roots(self) -> tuple[_Floats, ...]:
        """Roots (K, k) of the prior covariance of the coefficients, one for each length scale that is tried."""

    @abstractmethod
    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples, (n, K), or (c + 1, n, K) where each observation has its own."""

    @property
    def abscissa(self) -> Regressor | None:
        """What a picture of the function is drawn over; None where it is no function of one quantity."""
        return None

    def near(self, width: float) -> list[Dependence]:
        """Return dependences of another shape nearby, where it has a shape: a frequency, a damping, an order."""
        del width
        return []

    def highest_hz(self, fastest: float) -> float:
        """Return the highest frequency that it adds to a motion at rates up to ``fastest``, rad/s; zero if none."""
        del fastest
        return 0.0

    @property
    def count(self) -> int:
        """Number K of functions."""
        return len(self.roots[0])

    @property
    @abstractmethod
    def numbers(self) -> dict[str, Any]:
        """What makes it, beside its name: numbers, or names, as a file holds them (`dependence_of`)."""


def _covariance_root(centres: _Floats, length: float) -> _Floats:
    """Return a root (K, k) of the squared-exponential covariance at centres (K,)."""
    power, turn = np.linalg.eigh(np.exp(-0.5 * ((centres[:, None] - centres) / length) ** 2))
    kept = power > USUAL.least_prior * power[-1]
    return np.asarray(turn[:, kept] * np.sqrt(power[kept]))


_Function = Callable[[_Floats], _Floats]
_FORMS: dict[str, tuple[str, str, Regressor, _Function, Regressor | None]] = {
    "1": ("1", "always", NOTHING, np.asarray, None),
    "omega": ("omega", "in proportion to the rate", RATE, np.asarray, None),
    "omega^2": ("omega", "in proportion to rate²", RATE, np.square, None),
    "omega^3": ("omega", "in proportion to rate³", RATE, lambda x: x**3, None),
    "omega^4": ("omega", "in proportion to rate⁴", RATE, lambda x: x**4, None),
    "|omega|": ("omega", "in proportion to |rate|", RATE, np.abs, None),
    "omega|omega|": ("omega", "in proportion to rate · |rate|", RATE, lambda x: x * np.abs(x), None),
    "alpha": ("alpha", "in proportion to the angular acceleration", ACCELERATION, np.asarray, None),
    "|alpha|": ("alpha", "in proportion to |angular acceleration|", ACCELERATION, np.abs, None),
    "alpha omega": ("omega, alpha", "in proportion to rate · angular acceleration", ACCELERATION, np.asarray, RATE),
    "theta": ("theta", "in proportion to the angle turned", ANGLE, np.asarray, None),
    "t": ("t", "in proportion to time", TIME, np.asarray, None),
    "T": ("T", "in proportion to the temperature", TEMPERATURE, np.asarray, None),
    "dT/dt": ("T", "in proportion to the warming", WARMING, np.asarray, None),
}
"""Of each one-number form its kind, its words, the regressor, the function, and a regressor that multiplies it."""


@dataclass(frozen=True)
class Form(Dependence):
    """A one-number form by its name, over ``scale``; the regressor counts from ``first``."""

    name: str
    scale: float
    first: float = 0.0

    @property
    def kind(self) -> str:  # type: ignore[override]
        """The same for all that mean the same to a person."""
        return _FORMS[self.name][0]

    @property
    def words(self) -> str:  # type: ignore[override]
        """How an error goes with it."""
        return _FORMS[self.name][1]

    @property
    def of_one_recording(self) -> bool:  # type: ignore[override]
        """Whether it is of absolute time."""
        return self.name == "t"

    @property
    def roots(self) -> tuple[_Floats, ...]:
        """Roots of the prior covariance, one for each length scale."""
        return (np.eye(1),)

    @property
    def abscissa(self) -> Regressor | None:
        """What a picture of the function is drawn over."""
        _, _, regressor, _, times = _FORMS[self.name]
        return None if times or not regressor.unit else regressor

    @property
    def numbers(self) -> dict[str, Any]:
        """What makes it."""
        return {"scale": self.scale, "first": self.first}

    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples."""
        _, _, regressor, function, times = _FORMS[self.name]
        values = function(regressor.of(state) - self.first) / self.scale
        return np.asarray(values if times is None else values * times.of(state))[:, None]


_Vectors = dict[str, tuple[str, str, Callable[[BodyDrive], _Floats]]]
_VECTORS: _Vectors = {
    "omega vector": ("omega", "in proportion to the rate about some axis", lambda body: body.rate),
    "omega products": ("omega", "in proportion to products of the rates", lambda body: omega_products(body.rate)),
    "omega cubes": ("omega", "in proportion to the cube of each rate", lambda body: body.rate**3),
    "alpha vector": ("alpha", "in proportion to the angular acceleration", lambda body: body.acceleration),
    "force vector": ("force", "in proportion to the specific force along some axis", lambda body: body.force),
    "force change": (
        "force",
        "in proportion to how the specific force differs from that at first",
        lambda body: body.force - body.force[0],
    ),
}
"""Of what a free body does, by components: kind, words, and the components (n, K).

The bias of a gyro is what it reads at first, at rest, and so holds what goes with the specific force there.
"""


@dataclass(frozen=True)
class VectorForm(Dependence):
    """A linear form of the components of a free body's motion, over ``scale``."""

    name: str
    scale: float

    @property
    def kind(self) -> str:  # type: ignore[override]
        """The same for all that mean the same to a person."""
        return _VECTORS[self.name][0]

    @property
    def words(self) -> str:  # type: ignore[override]
        """How an error goes with it."""
        return _VECTORS[self.name][1]

    @property
    def roots(self) -> tuple[_Floats, ...]:
        """Roots of the prior covariance, one for each length scale."""
        return (np.eye(6 if self.name == "omega products" else 3),)

    @property
    def numbers(self) -> dict[str, Any]:
        """What makes it."""
        return {"scale": self.scale}

    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples."""
        return np.asarray(_VECTORS[self.name][2](state.free_body) / self.scale)


def vector_forms(states: Sequence[RigState]) -> list[VectorForm]:
    """Return the forms of free bodies, over the largest that each of these did."""
    largest = {
        name: max(float(np.abs(components(state.free_body)).max()) for state in states)
        for name, (_, _, components) in _VECTORS.items()
    }
    return [VectorForm(name, scale) for name, scale in largest.items() if scale > 0.0]


@dataclass(frozen=True)
class Curve(Dependence):
    """A smooth function of one regressor: cubic B-splines of asinh(x / warp), or of x itself where ``warp`` is 0."""

    regressor: Regressor
    low: float
    high: float
    functions: int
    lengths: tuple[float, ...] = USUAL.lengths
    warp: float = 0.0

    @property
    def name(self) -> str:  # type: ignore[override]
        """Name in ``verdict.json``."""
        return f"f({self.regressor.name})"

    @property
    def kind(self) -> str:  # type: ignore[override]
        """The same for all that mean the same to a person."""
        return self.regressor.name

    @property
    def words(self) -> str:  # type: ignore[override]
        """How an error goes with it."""
        return f"as a function of {self.regressor.words}"

    @property
    def of_one_recording(self) -> bool:  # type: ignore[override]
        """Whether it is of absolute time."""
        return self.regressor is TIME

    @property
    def numbers(self) -> dict[str, Any]:
        """What makes it."""
        return {"low": self.low, "high": self.high, "functions": self.functions, "warp": self.warp}

    @cached_property
    def grid(self) -> _Floats:
        """Knots, on the scale 0 to 1."""
        inner = np.linspace(-1e-9, 1.0 + 1e-9, self.functions - 2)  # numerical
        return np.concatenate([[inner[0]] * 3, inner, [inner[-1]] * 3])

    @cached_property
    def roots(self) -> tuple[_Floats, ...]:  # type: ignore[override]
        """Roots of the prior covariance, one for each length scale."""
        centres = np.convolve(self.grid, np.ones(3) / 3.0, "valid")[1:-1]
        return tuple(_covariance_root(centres, length) for length in self.lengths)

    @property
    def abscissa(self) -> Regressor | None:
        """What a picture of the function is drawn over."""
        return self.regressor

    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples."""
        return self.at(self.regressor.of(state))

    def at(self, x: _Floats) -> _Floats:
        """Return the splines at values (n,) of the regressor, shape (n, K)."""
        low, high, here = (np.arcsinh(v / self.warp) if self.warp else v for v in (self.low, self.high, x))
        share = np.clip((here - low) / max(high - low, 1e-12), 0.0, 1.0)  # numerical
        return np.asarray(BSpline.design_matrix(share, self.grid, 3).toarray())


def curve_over(
    regressor: Regressor, seen: _Floats, functions: int, lengths: tuple[float, ...], *, warp: float = 0.0
) -> Curve:
    """Return a smooth function over the range of a regressor that was seen (n,)."""
    return Curve(regressor, float(seen.min()), float(seen.max()), functions, lengths, warp)


@dataclass(frozen=True)
class Product(Dependence):
    """A smooth function of two regressors."""

    first: Curve
    second: Curve

    @property
    def numbers(self) -> dict[str, Any]:
        """What makes it."""
        return {"first": self.first.numbers, "second": self.second.numbers}

    @property
    def name(self) -> str:  # type: ignore[override]
        """Name in ``verdict.json``."""
        return f"f({self.kind})"

    @property
    def kind(self) -> str:  # type: ignore[override]
        """The same for all that mean the same to a person."""
        return f"{self.first.kind}, {self.second.kind}"

    @property
    def words(self) -> str:  # type: ignore[override]
        """How an error goes with it."""
        return f"as a function of {self.first.regressor.words} and {self.second.regressor.words}"

    @cached_property
    def roots(self) -> tuple[_Floats, ...]:  # type: ignore[override]
        """Roots of the prior covariance, one for each length scale."""
        return (np.asarray(np.kron(self.first.roots[0], self.second.roots[0]), dtype=np.float64),)

    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples."""
        one, other = self.first.values(state), self.second.values(state)
        return (one[:, :, None] * other[:, None, :]).reshape(len(one), -1)


_ENVELOPES: dict[str, Callable[[_Floats], _Floats]] = {
    "revolution": np.ones_like,
    "revolution |omega|": np.abs,
    "revolution omega^2": np.square,
    "revolution omega": np.asarray,
}
"""Of a function of the angle within a revolution, what it grows with: a function of the rate over the fastest one."""


@dataclass(frozen=True)
class Revolution(Dependence):
    """A function of the angle within a revolution, by harmonics, times what its name says of rate over ``scale``.

    With ``mean``, its mean is a coefficient too, the last; of some length scales the prior keeps that at zero.
    """

    name: str
    scale: float = 1.0
    harmonics: int = USUAL.harmonics
    mean: bool = True
    kind: str = "revolution"
    words: str = "by the angle within a revolution"

    def highest_hz(self, fastest: float) -> float:
        """Return the highest frequency that it adds to a motion at rates up to ``fastest``, rad/s."""
        return self.harmonics * fastest / (2.0 * np.pi)

    @property
    def numbers(self) -> dict[str, Any]:
        """What makes it."""
        return {"scale": self.scale, "harmonics": self.harmonics, "mean": self.mean}

    @property
    def roots(self) -> tuple[_Floats, ...]:
        """Roots of the prior covariance, one for each length scale, without a mean and with one."""
        order: _Floats = np.repeat(np.arange(1.0, self.harmonics + 1), 2)
        every = [np.diag(np.append(one, self.mean)) for one in (1.0 / np.sqrt(order), 1.0 / order**2)]
        return (*(one[:, :-1] for one in every), *every) if self.mean else tuple(one[:-1, :-1] for one in every)

    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples."""
        phase = np.outer(state.spin.angle, np.arange(1, self.harmonics + 1))
        waves = np.stack([np.cos(phase), np.sin(phase)], axis=2).reshape(len(phase), -1)
        if self.mean:
            waves = np.column_stack([waves, np.ones(len(phase))])
        return np.asarray(waves * _ENVELOPES[self.name](state.spin.rate / self.scale)[:, None])


@dataclass(frozen=True)
class Wave(Dependence):
    """A wave that was looked for: cycles per revolution, or per second of time.

    Parameters
    ----------
    cycles : float
        Cycles per revolution, or Hz.
    apart : float
        Least difference of two waves that the recording separates, in the unit of ``cycles``.
    of_time : bool
        Whether it is of time, and not of the angle.
    fastest : float
        Rate by which its amplitude grows to one, rad/s; 0 where it does not grow with the rate.
    """

    cycles: float
    apart: float
    of_time: bool = False
    fastest: float = 0.0
    looks: float = USUAL.wave_looks

    def highest_hz(self, fastest: float) -> float:
        """Return the highest frequency that it adds to a motion at rates up to ``fastest``, rad/s."""
        return self.cycles if self.of_time else self.cycles * fastest / (2.0 * np.pi)

    @property
    def numbers(self) -> dict[str, Any]:
        """What makes it."""
        return {"cycles": self.cycles, "fastest": self.fastest}

    @property
    def name(self) -> str:  # type: ignore[override]
        """Name in ``verdict.json``."""
        return f"tone at {self.cycles:.4g} Hz" if self.of_time else f"order {self.cycles:.4g}{self._growth}"

    @property
    def kind(self) -> str:  # type: ignore[override]
        """The same for all that mean the same to a person."""
        return "tone" if self.of_time else "order"

    @property
    def words(self) -> str:  # type: ignore[override]
        """How an error goes with it."""
        if self.of_time:
            return f"at {self.cycles:.4g} Hz, whatever the motion"
        return f"{self.cycles:.4g} times per revolution{', in proportion to |rate|' if self.fastest else ''}"

    @property
    def of_one_recording(self) -> bool:  # type: ignore[override]
        """Whether it is of absolute time."""
        return self.of_time

    @property
    def _growth(self) -> str:
        return " |omega|" if self.fastest else ""

    @property
    def roots(self) -> tuple[_Floats, ...]:
        """Roots of the prior covariance, one for each length scale."""
        return (np.eye(2),)

    def near(self, width: float) -> list[Dependence]:
        """Return dependences of another shape nearby."""
        steps = np.linspace(-1.0, 1.0, 5) * width * self.apart  # numerical
        return [replace(self, cycles=self.cycles + float(step)) for step in steps]

    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples."""
        phase = self.cycles * (2.0 * np.pi * state.t if self.of_time else state.spin.angle)
        speed = np.abs(state.spin.rate)
        envelope = speed / self.fastest if self.fastest else np.where(self.of_time | (speed > USUAL.turning), 1.0, 0.0)
        return np.asarray(np.column_stack([np.cos(phase), np.sin(phase)]) * envelope[:, None])


@dataclass(frozen=True)
class Step(Dependence):
    """A change at a time since the start of a run, within a moment.

    Parameters
    ----------
    at : float
        Time, s.
    apart : float
        Time between two steps that are tried, s.
    """

    at: float
    apart: float
    kind: str = "step"
    looks: float = USUAL.step_looks
    of_one_recording: bool = True

    @property
    def numbers(self) -> dict[str, Any]:
        """What makes it."""
        return {"at": self.at}

    @property
    def name(self) -> str:  # type: ignore[override]
        """Name in ``verdict.json``."""
        return f"step at {self.at:.4g} s"

    @property
    def words(self) -> str:  # type: ignore[override]
        """How an error goes with it."""
        return f"all at once at {self.at:.4g} s"

    @property
    def roots(self) -> tuple[_Floats, ...]:
        """Roots of the prior covariance, one for each length scale."""
        return (np.eye(1),)

    def near(self, width: float) -> list[Dependence]:
        """Return dependences of another shape nearby."""
        steps = np.linspace(-0.5, 0.5, 5) * width * self.apart  # numerical
        return [replace(self, at=self.at + float(step)) for step in steps]

    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples."""
        share = np.clip((state.t - self.at) / USUAL.step_s + 0.5, 0.0, 1.0)
        return np.asarray((share**2 * (3.0 - 2.0 * share))[:, None])


@dataclass(frozen=True)
class Memory(Dependence):
    """A regressor at several times before: any linear filter of it that forgets within the longest lag."""

    regressor: Regressor
    scale: float
    lags_s: tuple[float, ...] = USUAL.lags_s

    def highest_hz(self, fastest: float) -> float:
        """Return the highest frequency that its lags tell apart, Hz."""
        del fastest
        return 0.5 / min(np.diff(self.lags_s))

    @property
    def numbers(self) -> dict[str, Any]:
        """What makes it."""
        return {"scale": self.scale}

    @property
    def name(self) -> str:  # type: ignore[override]
        """Name in ``verdict.json``."""
        return f"memory of {self.regressor.name}"

    @property
    def kind(self) -> str:  # type: ignore[override]
        """The same for all that mean the same to a person."""
        return self.name

    @property
    def words(self) -> str:  # type: ignore[override]
        """How an error goes with it."""
        return f"with {self.regressor.words} of the last {max(self.lags_s):g} s"

    @property
    def memory_s(self) -> float:  # type: ignore[override]
        """How long it remembers the drive, s."""
        return max(self.lags_s)

    @cached_property
    def roots(self) -> tuple[_Floats, ...]:  # type: ignore[override]
        """Roots of the prior covariance, one for each length scale."""
        lags = np.array(self.lags_s)
        return np.hstack([_covariance_root(lags, USUAL.lag_length_s), USUAL.rough * np.eye(len(lags))]), np.eye(
            len(lags)
        )

    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples."""
        x = self.regressor.of(state) / self.scale
        return np.column_stack([np.interp(state.t - lag, state.t, x) for lag in self.lags_s])


@dataclass(frozen=True)
class LowPassed(Dependence):
    """A regressor, less its first value, behind first-order filters."""

    regressor: Regressor
    first: float
    scale: float
    times_s: tuple[float, ...] = USUAL.filter_times_s

    @property
    def numbers(self) -> dict[str, Any]:
        """What makes it."""
        return {"first": self.first, "scale": self.scale}

    @property
    def name(self) -> str:  # type: ignore[override]
        """Name in ``verdict.json``."""
        return f"{self.regressor.name} lagging"

    @property
    def kind(self) -> str:  # type: ignore[override]
        """The same for all that mean the same to a person."""
        return self.regressor.name

    @property
    def words(self) -> str:  # type: ignore[override]
        """How an error goes with it."""
        return f"behind {self.regressor.words}"

    @property
    def roots(self) -> tuple[_Floats, ...]:
        """Roots of the prior covariance, one for each length scale."""
        return (np.eye(len(self.times_s)),)

    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples."""
        x = (self.regressor.of(state) - self.first) / self.scale
        shares = [np.exp(-state.period / time) for time in self.times_s]
        return np.column_stack([lfilter([1.0 - share], [1.0, -share], x) for share in shares])


@dataclass(frozen=True)
class Mode(Dependence):
    """The response of a damped oscillator to a regressor: displacement, velocity and acceleration, in its units."""

    regressor: Regressor
    scale: float
    frequency_hz: float
    outputs: tuple[int, ...] = (0, 1, 2)
    damping: float = USUAL.damping
    looks: float = USUAL.mode_looks

    def highest_hz(self, fastest: float) -> float:
        """Return its own frequency, Hz."""
        del fastest
        return self.frequency_hz

    @property
    def numbers(self) -> dict[str, Any]:
        """What makes it."""
        shape = {"frequency_hz": self.frequency_hz, "damping": self.damping}
        return {**shape, "outputs": list(self.outputs), "scale": self.scale}

    @property
    def name(self) -> str:  # type: ignore[override]
        """Name in ``verdict.json``."""
        return f"mode at {self.frequency_hz:.3g} Hz of {self.regressor.name}"

    @property
    def kind(self) -> str:  # type: ignore[override]
        """The same for all that mean the same to a person."""
        return f"mode of {self.regressor.name.split(' ')[0]}"

    @property
    def words(self) -> str:  # type: ignore[override]
        """How an error goes with it."""
        return f"as a mode near {self.frequency_hz:.2g} Hz that {self.regressor.words} excites"

    def near(self, width: float) -> list[Dependence]:
        """Return dependences of another shape nearby."""
        faster, damped = np.exp(USUAL.spacing * width * np.arange(-2, 3)), np.exp(width * np.arange(-1, 2))
        pairs = [(self.frequency_hz * f, self.damping * z) for f in faster for z in damped]
        return [replace(self, frequency_hz=float(f), damping=float(min(z, 1.0))) for f, z in pairs]

    @property
    def memory_s(self) -> float:  # type: ignore[override]
        """How long it remembers the drive, s."""
        return USUAL.forgotten / (2.0 * np.pi * self.frequency_hz * self.damping)

    @property
    def roots(self) -> tuple[_Floats, ...]:
        """Roots of the prior covariance, one for each length scale."""
        return (np.eye(len(self.outputs)),)

    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples."""
        omega = 2.0 * np.pi * self.frequency_hz
        drag = 2.0 * self.damping * omega
        continuous = (
            np.array([[0.0, 1.0], [-(omega**2), -drag]]),
            np.array([[0.0], [1.0]]),
            np.array([[omega**2, 0.0], [0.0, omega], [-(omega**2), -drag]]),
            np.array([[0.0], [0.0], [1.0]]),
        )
        a, b, c, d, _ = cont2discrete(continuous, state.period, "foh")
        numerators, denominator = ss2tf(a, b, c, d)
        x = self.regressor.of(state) / self.scale
        return np.column_stack([lfilter(numerators[output], denominator, x) for output in self.outputs])


@dataclass(frozen=True)
class OfReading(Dependence):
    """A function of each channel's own reading: its power, or a smooth one up to the largest reading."""

    most: float
    power: int = 0
    kind: str = "own reading"

    @property
    def name(self) -> str:  # type: ignore[override]
        """Name in ``verdict.json``."""
        return f"y^{self.power}" if self.power else "f(y)"

    @property
    def words(self) -> str:  # type: ignore[override]
        """How an error goes with it."""
        return (
            f"in proportion to reading{'²' if self.power == 2 else '³'}"
            if self.power
            else "as a function of the reading"
        )

    @property
    def numbers(self) -> dict[str, Any]:
        """What makes it."""
        return {"most": self.most}

    @cached_property
    def _curve(self) -> Curve:
        reading = Regressor("y", "the reading", "m/s²", lambda state: state.t)
        functions, warp = USUAL.reading_functions, self.most / USUAL.harmonics
        return Curve(reading, -self.most, self.most, functions, warp=warp)

    @property
    def roots(self) -> tuple[_Floats, ...]:
        """Roots of the prior covariance, one for each length scale."""
        return (np.eye(1),) if self.power else self._curve.roots

    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples."""
        readings = np.column_stack([state.readings, np.zeros(len(state.t))]).T  # (c + 1, n)
        if self.power:
            return np.asarray((readings[:, :, None] / STANDARD_GRAVITY) ** self.power)
        return np.stack([self._curve.at(mine) for mine in readings])


_FEWEST, _MOST = 4, 320  # numerical: functions of a dependence that a file may have
_MADE: tuple[tuple[str, Callable[[re.Match[str], Mapping[str, Any]], Dependence]], ...] = (
    (r"f\((\w+), (\w+)\)", lambda m, n: Product(_curve(m[1], n["first"]), _curve(m[2], n["second"]))),
    (r"f\(y\)|y\^([23])", lambda m, n: OfReading(_positive(n, "most"), int(m[1] or 0))),
    (r"f\((\w+)\)", lambda m, n: _curve(m[1], n)),
    (
        r"revolution.*",
        lambda m, n: Revolution(
            _one_of(m[0], _ENVELOPES), _positive(n, "scale"), _count(n["harmonics"]), mean=n.get("mean", False) is True
        ),
    ),
    (r"order .*", lambda m, n: Wave(_positive(n, "cycles"), 1.0, fastest=_finite(n, "fastest"))),
    (r"step at .*", lambda m, n: Step(_finite(n, "at"), 1.0)),
    (r"memory of (.*)", lambda m, n: Memory(_regressor(m[1]), _positive(n, "scale"))),
    (r"(\w+) lagging", lambda m, n: LowPassed(_regressor(m[1]), _finite(n, "first"), _positive(n, "scale"))),
    (r"mode at .* of (.*)", lambda m, n: _mode(_regressor(m[1]), n)),
    (r"\w+ (?:vector|products|cubes|change)", lambda m, n: VectorForm(_one_of(m[0], _VECTORS), _positive(n, "scale"))),
    (r".*", lambda m, n: Form(_one_of(m[0], _FORMS), _positive(n, "scale"), _finite(n, "first"))),
)
"""Patterns of names, and what makes the dependence from its name and its numbers."""


def dependence_of(name: str, numbers: Mapping[str, Any]) -> Dependence:
    """Return a dependence from its name and its `Dependence.numbers`.

    Raises
    ------
    KeyError, TypeError, ValueError
        If there is none of that name, or a number is missing or none.
    """
    for pattern, made in _MADE:
        if match := re.fullmatch(pattern, name):
            return made(match, numbers)
    raise KeyError(name)


def _one_of(name: str, known: Mapping[str, Any]) -> str:
    known[name]
    return name


def _regressor(name: str) -> Regressor:
    return REGRESSORS[name]


def _curve(name: str, numbers: Mapping[str, Any]) -> Curve:
    low, high, warp = (_finite(numbers, key) for key in ("low", "high", "warp"))
    return Curve(_regressor(name), low, high, _count(numbers["functions"]), warp=warp)


def _count(value: Any) -> int:
    count = int(value)
    if not _FEWEST <= count <= _MOST:
        raise ValueError(f"{count} functions, not {_FEWEST} to {_MOST},")
    return count


def _mode(regressor: Regressor, numbers: Mapping[str, Any]) -> Mode:
    scale, frequency, damping = (_positive(numbers, key) for key in ("scale", "frequency_hz", "damping"))
    outputs = tuple(int(one) for one in numbers["outputs"])
    if not outputs or not set(outputs) <= {0, 1, 2}:
        raise ValueError(f"outputs = {outputs}")
    return Mode(regressor, scale, frequency, outputs, damping)


def _finite(numbers: Mapping[str, Any], key: str) -> float:
    value = float(numbers[key])
    if not math.isfinite(value):
        raise ValueError(f"{key} = {value}")
    return value


def _positive(numbers: Mapping[str, Any], key: str) -> float:
    value = _finite(numbers, key)
    if not value > 0.0:
        raise ValueError(f"{key} = {value}")
    return value
