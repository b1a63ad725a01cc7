"""Waves: functions of the angle within a revolution, of an order of the angle, or of a frequency in time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.model.located.dependences.dependence import Dependence
from gfimu.model.located.dependences.regressors import WITHIN_REVOLUTION, Regressor
from gfimu.model.located.rig_state import RigState
from gfimu.model.located.usual import USUAL

__all__ = ["ENVELOPES", "Revolution", "Wave"]

_Floats = NDArray[np.float64]


ENVELOPES: dict[str, Callable[[_Floats], _Floats]] = {
    "revolution": np.ones_like,
    "revolution |omega|": np.abs,
    "revolution omega^2": np.square,
    "revolution omega": np.asarray,
}
"""Of a function of the angle within a revolution, what it grows with: a function of the rate over the fastest one."""


@dataclass(frozen=True)
class Revolution(Dependence):
    """A function of the angle within a revolution, by harmonics, times what its name says of rate over ``scale``.

    With ``mean`` the last coefficient is the mean over a revolution, which half of the priors that are tried leave out.
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
    def abscissa(self) -> Regressor | None:
        """The angle within a revolution, where nothing else multiplies the function."""
        return WITHIN_REVOLUTION if self.name == "revolution" else None

    @property
    def numbers(self) -> dict[str, Any]:
        """What makes it."""
        return {"scale": self.scale, "harmonics": self.harmonics, "mean": self.mean}

    @property
    def roots(self) -> tuple[_Floats, ...]:
        """Roots of the prior covariance, one for each length scale, without a mean and with one."""
        order: _Floats = np.repeat(np.arange(1.0, self.harmonics + 1), 2)
        falling = (1.0 / np.sqrt(order), 1.0 / order**2)
        if not self.mean:
            return tuple(np.diag(one) for one in falling)
        whole = tuple(np.diag(np.append(one, 1.0)) for one in falling)
        return (*(one[:, :-1] for one in whole), *whole)

    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples."""
        phase = np.outer(state.spin.angle, np.arange(1, self.harmonics + 1))
        waves = np.stack([np.cos(phase), np.sin(phase)], axis=2).reshape(len(phase), -1)
        if self.mean:
            waves = np.column_stack([waves, np.ones(len(phase))])
        return np.asarray(waves * ENVELOPES[self.name](state.spin.rate / self.scale)[:, None])


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
