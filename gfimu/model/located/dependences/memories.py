"""Memories: what follows a regressor later: a filter of the past, a low pass, a mode that rings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter, ss2tf

from gfimu.model.located.dependences.dependence import Dependence, covariance_root
from gfimu.model.located.dependences.regressors import Regressor
from gfimu.model.located.rig_state import RigState
from gfimu.model.located.usual import USUAL

__all__ = ["LowPassed", "Memory", "Mode"]

_Floats = NDArray[np.float64]


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
        free = np.eye(len(lags))
        return np.hstack([covariance_root(lags, USUAL.lag_length_s), USUAL.rough * free]), free

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
