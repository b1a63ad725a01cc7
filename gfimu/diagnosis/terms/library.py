"""What effects would change, by finite differences of the very simulation that is being judged."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.data.stretch import NoPredictionError, Stretch
from gfimu.diagnosis.terms.cause import Cause, effects_of
from gfimu.diagnosis.terms.columns import Columns
from gfimu.diagnosis.terms.located.term import LocatedBasis, LocatedTerm, located_columns
from gfimu.diagnosis.terms.reach import behind_wiring, disjoint
from gfimu.model.located.effect import LocatedEffect
from gfimu.model.world_model import Effect, EffectFamily

__all__ = ["Nuisance", "Seen", "cause_columns", "family_columns"]

_SHAPE_STEP = 1e-5  # numerical: a tone of a thousand cycles must not turn by a sensible part of a cycle
_NOT_SMOOTH = 0.01  # numerical: step of an effect, in units of its prior, beyond which its derivative is one-sided
_ON_ITS_SIDE = 0.05  # numerical: of the present size, the step of such an effect


class Seen(Protocol):
    """A prediction with the weights of its observations: of a table `Observed`, of a free body its own."""

    @property
    def prediction(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def weight(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def weights(self) -> NDArray[np.float64]: ...  # noqa: D102


class Nuisance(Protocol):
    """A drive that is integrated out, of a table or of a free body: what a fit and the search ask of it."""

    @property
    def spin(self) -> Any: ...  # noqa: D102
    @property
    def is_learnt(self) -> bool: ...  # noqa: D102


def family_columns(
    stretch: Stretch,
    seen: Seen,
    drive: Nuisance,
    causes: Sequence[Cause],
    family: EffectFamily,
    shape: Mapping[str, float],
) -> Columns:
    """Return what each size of a family, in units of its prior, adds beside causes.

    A family that is among the causes is varied in its place: effects do not commute.
    """
    array = stretch.model.array
    present = effects_of(causes, array, stretch.index)
    place = next((k for k, effect in enumerate(present) if effect.name == family.name), len(present))
    before, after = present[:place], present[place + 1 :]
    sizes = family.sizes(array)
    zero = present[place].size_values(array) if place < len(present) else np.zeros(len(sizes))
    prior, steps = np.array([s.prior_std for s in sizes]), np.array([s.step for s in sizes])

    def changed(group: Sequence[int]) -> list[Effect]:
        moved = zero.copy()
        moved[group] += steps[group] * prior[group]
        return [*before, family.from_sizes(array, moved, shape), *after]

    reach = _reach(stretch, family.reach(array))
    return _differences(stretch, seen, drive, changed, 1.0 / steps, reach)


def cause_columns(stretch: Stretch, seen: Seen, drive: Nuisance, causes: Sequence[Cause]) -> Columns:
    """Return the derivative by each coordinate of a set of causes and by their free shapes, cause by cause."""
    array = stretch.model.array
    present = effects_of(causes, array, stretch.index)
    found = [Columns.none(len(seen.weights), len(seen.prediction))]
    for number, cause in enumerate(causes):
        if isinstance(cause.family, LocatedTerm):
            state, own = stretch.state(present, drive.spin), present[number]
            assert isinstance(own, LocatedEffect)
            columns = located_columns(cause.family, LocatedBasis(state, about=own), seen.weight, stretch.observed)
            found.append(columns.mixed(cause.mixing))
            continue
        count = len(cause.coordinates)
        step = _step(cause, stretch)

        def replaced(other: Cause, number: int = number) -> list[Effect]:
            return [*present[:number], other.effect(array, stretch.index), *present[number + 1 :]]

        def changed(group: Sequence[int], cause: Cause = cause, count: int = count, step: float = step) -> list[Effect]:
            if group[0] >= count:
                key = cause.free_shape[group[0] - count]
                return replaced(cause.at(cause.coordinates, {**cause.shape, key: cause.shape_moved(key, _SHAPE_STEP)}))
            moved = cause.coordinates.copy()
            moved[list(group)] += step
            return replaced(cause.at(moved))

        reach = _reach(stretch, cause.reach(array))
        if reach is not None:
            reach = np.vstack([reach, np.ones((len(cause.free_shape), reach.shape[1]), dtype=bool)])
        scale = np.append(np.full(count, 1.0 / step), np.full(len(cause.free_shape), 1.0 / _SHAPE_STEP))
        found.append(_differences(stretch, seen, drive, changed, scale, reach))
    return Columns.together(found)


def _step(cause: Cause, stretch: Stretch) -> float:
    sizes = cause.family.sizes(stretch.model.array)
    step = min(size.step for size in sizes)
    if any(size.step > _NOT_SMOOTH for size in sizes):
        step = max(0.2 * step, _ON_ITS_SIDE * float(np.abs(cause.coordinates).max(initial=0.0)))
    return float(step)


def _differences(
    stretch: Stretch,
    seen: Seen,
    drive: Nuisance,
    changed: Callable[[Sequence[int]], list[Effect]],
    scale: NDArray[np.float64],
    reach: NDArray[np.bool_] | None,
) -> Columns:
    """Take one difference for each group of unknowns that reach different channels."""
    base, weight, spin, count = seen.prediction, seen.weight, drive.spin, len(scale)
    places: list[list[int]] = [[] for _ in range(base.shape[1])]
    parts: list[list[NDArray[np.float64]]] = [[] for _ in range(base.shape[1])]
    for group in disjoint(reach, count):
        try:
            change = (stretch.predict(changed(group), spin) - base) * weight
        except NoPredictionError:  # an unknown that can't be moved explains nothing here
            continue
        there = change.any(axis=0)
        for unknown in group:
            reached = there if reach is None else there & np.append(reach[unknown], False)
            for c in np.flatnonzero(reached):
                places[c].append(unknown)
                parts[c].append(change[:, c] * scale[unknown])
    empty = np.zeros((len(base), 0))
    return Columns(
        count,
        tuple(np.array(mine, dtype=np.intp) for mine in places),
        tuple(np.column_stack(mine) if mine else empty for mine in parts),
    )


def _reach(stretch: Stretch, reach: NDArray[np.bool_] | None) -> NDArray[np.bool_] | None:
    """Return which channels each unknown changes, (k, c); None where that is not known."""
    return behind_wiring(reach, (*stretch.model.effects, *stretch.known), stretch.model.array)
