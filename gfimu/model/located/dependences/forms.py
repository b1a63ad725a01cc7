"""Forms: one number times a known function of a regressor, a step in time, a linear form of a body's motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.kinematics import omega_products
from gfimu.model.located.dependences.dependence import Dependence
from gfimu.model.located.dependences.regressors import (
    ACCELERATION,
    ANGLE,
    NOTHING,
    RATE,
    TEMPERATURE,
    TIME,
    WARMING,
    Regressor,
)
from gfimu.model.located.rig_state import RigState
from gfimu.model.located.usual import USUAL
from gfimu.motion.body_drive import BodyDrive

__all__ = ["FORMS", "VECTORS", "Form", "Step", "VectorForm", "vector_forms"]

_Floats = NDArray[np.float64]


_Function = Callable[[_Floats], _Floats]
FORMS: dict[str, tuple[str, str, Regressor, _Function, Regressor | None]] = {
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
        return FORMS[self.name][0]

    @property
    def words(self) -> str:  # type: ignore[override]
        """How an error goes with it."""
        return FORMS[self.name][1]

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
        _, _, regressor, _, times = FORMS[self.name]
        return None if times or not regressor.unit else regressor

    @property
    def numbers(self) -> dict[str, Any]:
        """What makes it."""
        return {"scale": self.scale, "first": self.first}

    def values(self, state: RigState) -> _Floats:
        """Return the functions at the samples."""
        _, _, regressor, function, times = FORMS[self.name]
        values = function(regressor.of(state) - self.first) / self.scale
        return np.asarray(values if times is None else values * times.of(state))[:, None]


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


_Vectors = dict[str, tuple[str, str, Callable[[BodyDrive], _Floats]]]
VECTORS: _Vectors = {
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
        return VECTORS[self.name][0]

    @property
    def words(self) -> str:  # type: ignore[override]
        """How an error goes with it."""
        return VECTORS[self.name][1]

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
        return np.asarray(VECTORS[self.name][2](state.free_body) / self.scale)


def vector_forms(states: Sequence[RigState]) -> list[VectorForm]:
    """Return the forms of free bodies, over the largest that each of these did."""
    largest = {
        name: max(float(np.abs(components(state.free_body)).max()) for state in states)
        for name, (_, _, components) in VECTORS.items()
    }
    return [VectorForm(name, scale) for name, scale in largest.items() if scale > 0.0]
