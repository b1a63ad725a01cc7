"""A located term: an unknown function at a place, as a family of effects whose sizes are its coefficients."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from gfimu.array.array import AccelerometerArray
from gfimu.diagnosis.terms.cause import Cause
from gfimu.diagnosis.terms.columns import Columns
from gfimu.model.located.dependences import Dependence
from gfimu.model.located.effect import LocatedEffect, derivatives
from gfimu.model.located.operators import Operator, Place
from gfimu.model.located.rig_state import RigState
from gfimu.model.own_rig.places import Size

__all__ = ["LocatedTerm", "is_located", "located_columns"]

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


def located_columns(
    term: LocatedTerm, state: RigState, weight: _Floats, observed: Callable[[_Floats], _Floats] = np.asarray
) -> Columns:
    """Return what each coefficient of a term, in its usual size, adds to observations weighed by (m, c + 1).

    ``observed`` makes observations of values at the samples, where these differ (`BodyStretch.observed`).
    """
    basis, operators = term.dependence.values(state), term.where.operators(state)
    count, observations = term.dependence.count, weight.shape[1]
    places: list[list[NDArray[np.intp]]] = [[] for _ in range(observations)]
    parts: list[list[_Floats]] = [[] for _ in range(observations)]
    shared = [] if basis.ndim == 3 else derivatives(_longest(operators), basis, state.period)
    for index, operator in enumerate(operators):
        for c in operator.reached:
            own = shared or derivatives(operator, basis[c], state.period)
            column = np.zeros((len(state.t), count))
            for part, values in zip(operator.parts, own, strict=False):
                column += 0.0 if part is None else part[:, [c]] * values
            places[c].append(np.arange(index * count, (index + 1) * count))
            parts[c].append(observed(column) * (term.where.usual * weight[:, [c]]))
    empty = np.zeros((len(weight), 0))
    return Columns(
        term.count,
        tuple(np.concatenate(mine) if mine else np.zeros(0, dtype=np.intp) for mine in places),
        tuple(np.concatenate(mine, axis=1) if mine else empty for mine in parts),
    )


def _longest(operators: Sequence[Operator]) -> Operator:
    return max(operators, key=lambda one: max(order for order, part in enumerate(one.parts) if part is not None))
