"""A located term: an unknown function at a place, as a family of effects whose sizes are its coefficients."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from gfimu.array.array import AccelerometerArray
from gfimu.diagnosis.terms.cause import Cause
from gfimu.diagnosis.terms.columns import Columns
from gfimu.model.located.dependences.dependence import Dependence
from gfimu.model.located.effect import LocatedEffect
from gfimu.model.located.operators import Operator, Place
from gfimu.model.located.rig_state import RigState
from gfimu.model.own_rig.places import Size

__all__ = ["LocatedBasis", "LocatedTerm", "is_located", "located_columns"]

_Floats = NDArray[np.float64]


@dataclass(frozen=True)
class LocatedTerm:
    """An unknown function of a dependence at a place, as an `gfimu.model.world_model.EffectFamily`.

    Parameters
    ----------
    where : Place
        The place.
    dependence : Dependence
        What the function is of.
    pattern : str
        Which series share it: ``one`` channel, those of one ``chip``, each its ``own``, or ``all``.
    """

    where: Place
    dependence: Dependence
    pattern: str = "all"

    summary = "an unknown function at a place"
    separated_by = "another run with another motion"
    place = "located"
    per_run = False
    inexactness = 0.0
    starts: tuple[float, ...] = ()

    @property
    def name(self) -> str:
        """Place, pattern and dependence, which identify it."""
        series = "" if self.pattern == "all" else f" {', '.join(self.where.components)}"
        return f"{self.where.name} {self.where.what}{series}: {self.dependence.name}"

    @property
    def count(self) -> int:
        """Number of coefficients."""
        return len(self.where.components) * self.dependence.count

    @property
    def of_one_recording(self) -> bool:
        """Whether the function is of absolute time."""
        return self.dependence.of_one_recording

    def sizes(self, array: AccelerometerArray) -> tuple[Size, ...]:
        """Return the coefficients."""
        del array
        return tuple(Size(f"f{index}", self.where.unit, self.where.usual) for index in range(self.count))

    def patterns(self, array: AccelerometerArray) -> tuple[Any, ...]:
        """Return none: it is in no library."""
        del array
        return ()

    def parameter_units(self, array: AccelerometerArray) -> Mapping[str, str]:
        """Return none: it has no parameters of the contract."""
        del array
        return {}

    def reach(self, array: AccelerometerArray) -> None:
        """Return that all channels may change."""
        del array

    def shapes(self, duration: float, sample_rate: float) -> tuple[dict[str, float], ...]:
        """Return no shape."""
        del duration, sample_rate
        return ({},)

    def __call__(self, parameters: Mapping[str, Any]) -> LocatedEffect:
        """Build the effect without coefficients."""
        del parameters
        return LocatedEffect(self.where, self.dependence, self.pattern, np.zeros(self.count))

    def from_sizes(self, array: AccelerometerArray, values: _Floats, shape: Mapping[str, float]) -> LocatedEffect:
        """Build the effect from its coefficients."""
        del array, shape
        return LocatedEffect(self.where, self.dependence, self.pattern, np.asarray(values))

    def mixing(self, length: int) -> _Floats:
        """Return the root (P, k) of the prior of all coefficients for one of the length scales."""
        return np.asarray(block_diag(*[self.dependence.roots[length]] * len(self.where.components)))

    def cause(self, length: int, coordinates: _Floats, log_prior: float) -> Cause:
        """Return the cause with coordinates in the prior of one of the length scales."""
        return Cause(self, self.name, self.mixing(length), {}, coordinates, log_prior)


def is_located(cause: Cause) -> bool:
    """Whether a cause has no name but a place."""
    return isinstance(cause.family, LocatedTerm)


class LocatedBasis:
    """Operators of places and basis functions of dependences on the rows of one stretch, each computed once.

    Parameters
    ----------
    state : RigState
        Motion, readings and temperature of the stretch.
    averaged : callable
        Averages samples (n, …) over groups of neighbouring rows; the identity for the samples themselves.
    about : LocatedEffect, optional
        Effect about which the operators of its place are linearised; about zero error by default.
    """

    def __init__(
        self,
        state: RigState,
        averaged: Callable[[_Floats], _Floats] = np.asarray,
        about: LocatedEffect | None = None,
    ) -> None:
        self._state, self._averaged, self._about = state, averaged, about
        self._operators: dict[tuple[str, str, tuple[str, ...]], list[Operator]] = {}
        self._values: dict[Dependence, tuple[list[_Floats], list[_Floats]]] = {}

    def operators(self, where: Place) -> list[Operator]:
        """Return the operator of each component of a place."""
        key, about = (where.name, where.what, where.components), self._about
        if key not in self._operators:
            operators = list(where.operators(self._state))
            if about is not None and about.where is where and any(one.signal is not None for one in operators):
                errors = about.functions(self._state)  # (components, n)
                period = self._state.period
                operators = [one.about(error[:, None], period) for one, error in zip(operators, errors, strict=True)]
            self._operators[key] = [one.averaged(self._averaged) for one in operators]
        return self._operators[key]

    def functions(self, dependence: Dependence, order: int) -> list[_Floats]:
        """Return the functions (n, K), or (c + 1, n, K), and their derivatives by time up to an order."""
        exact, found = self._values.setdefault(dependence, ([], []))
        while len(exact) <= order:
            of = np.gradient(exact[-1], self._state.period, axis=-2, edge_order=2) if exact else None
            exact.append(dependence.values(self._state) if of is None else of)
            own = exact[-1]
            found.append(self._averaged(own) if own.ndim < 3 else np.stack([*map(self._averaged, own)]))
        return found


def located_columns(
    term: LocatedTerm,
    basis: LocatedBasis,
    weight: _Floats,
    observed: Callable[[_Floats], _Floats] = np.asarray,
) -> Columns:
    """Return what each coefficient of a term, in its usual size, adds to observations weighed by (m, c + 1).

    ``observed`` makes observations of values at the samples, where these differ (`BodyStretch.observed`).
    """
    operators = basis.operators(term.where)
    values = basis.functions(term.dependence, max(operator.order for operator in operators))
    count, observations = term.dependence.count, weight.shape[1]
    places: list[list[NDArray[np.intp]]] = [[] for _ in range(observations)]
    parts: list[list[_Floats]] = [[] for _ in range(observations)]
    for index, operator in enumerate(operators):
        for c in operator.reached:
            own = [one[c] if one.ndim == 3 else one for one in values]
            column = sum(
                part[:, [c]] * value for part, value in zip(operator.parts, own, strict=False) if part is not None
            )
            places[c].append(np.arange(index * count, (index + 1) * count))
            parts[c].append(observed(np.asarray(column)) * (term.where.usual * weight[:, [c]]))
    empty = np.zeros((len(weight), 0))
    return Columns(
        term.count,
        tuple(np.concatenate(mine) if mine else np.zeros(0, dtype=np.intp) for mine in places),
        tuple(np.concatenate(mine, axis=1) if mine else empty for mine in parts),
    )
