"""Screening of a free body: the normal equations of the library about a set of causes, by finite differences."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.free_body.segment import BodyLine, BodySegment
from gfimu.diagnosis.search.screening import Screening, Signature, hypotheses_of
from gfimu.diagnosis.terms.cause import Cause, effects_of
from gfimu.diagnosis.terms.reach import behind_wiring, disjoint
from gfimu.world_model import Effect, EffectFamily

__all__ = ["BodyScreening", "Known", "coordinates_of", "of_families", "plan_signatures", "screen", "signature_columns"]

Known = Sequence[Sequence[Effect]]
"""Effects known beforehand, per run."""
Chosen = Callable[[EffectFamily], bool]

_MOST_SHAPES = 3  # numerical: of a longer grid every second shape is screened


@dataclass(frozen=True)
class BodyScreening(Screening):
    """Normal equations of all signatures about a set of causes, divided by how far the residual is from white noise.

    Parameters
    ----------
    signatures, hypotheses, gram, score, base, responses
        As `Screening` has them; the specific force has no coefficients, so that there are no responses.
    objective : float
        Sum of squares about the causes, nuisance parameters eliminated.
    misfit : float
        What the normal equations have been divided by (`BodySegment.misfit`); sums of squares have not.
    """

    objective: float = 0.0
    misfit: float = 1.0

    @property
    def nothing(self) -> float:
        """Sum of squares without any cause, as the linear form has it."""
        pull = self.gram @ self.base
        taken = 2 * float((self.score - pull) @ self.base) + float(self.base @ pull)
        return self.objective + self.misfit * taken


def screen(
    segments: Sequence[BodySegment], causes: Sequence[Cause], fixed: Known, *, chosen: Chosen | None = None
) -> BodyScreening:
    """Compute the signatures of the library, or of some families only, about causes."""
    array = segments[0].model.array
    signatures = plan_signatures(segments, causes, chosen)
    count = sum(len(one.columns) for one in signatures)
    gram, score, objective = np.zeros((count, count)), np.zeros(count), 0.0
    misfits = []
    for segment, known in zip(segments, fixed, strict=True):
        effects = [*known, *effects_of(causes, array, segment.index)]
        line = segment.linearise(effects)
        columns = signature_columns(segment, signatures, causes, known, line)
        nuisances = segment.nuisances(effects, line)
        part, right, squares = segment.products(columns, line, nuisances)
        misfits.append(segment.misfit(_of_causes(columns, signatures, causes), line, nuisances))
        gram += part
        score += right
        objective += squares
    base = np.zeros(count)
    for cause in causes:
        base[_signature_of(signatures, cause).columns] = coordinates_of(cause)
    misfit = float(np.mean(misfits))
    gram, score = gram / misfit, score / misfit
    hypotheses = tuple(hypotheses_of(signatures, array, 1))
    return BodyScreening(tuple(signatures), hypotheses, gram, score + gram @ base, base, (), objective, misfit)


def coordinates_of(cause: Cause) -> NDArray[np.float64]:
    """Return the sizes of a cause in units of their prior, shape (m,)."""
    return np.asarray(cause.mixing @ cause.coordinates)


def _signature_of(signatures: Sequence[Signature], cause: Cause) -> Signature:
    return next(one for one in signatures if one.family.name == cause.name)


def of_families(causes: Sequence[Cause]) -> Chosen:
    """Return what chooses the families of causes."""
    names = {cause.name for cause in causes}
    return lambda family: family.name in names


def plan_signatures(
    segments: Sequence[BodySegment], base: Sequence[Cause], chosen: Chosen | None = None
) -> list[Signature]:
    """List the signatures of every kind of effect that has a size, or of the chosen kinds only, with their columns."""
    model = segments[0].model
    duration = max(segment.run.duration for segment in segments)
    warm = any(segment.run.temperature is not None for segment in segments)
    held = {cause.name: cause for cause in base}
    signatures: list[Signature] = []
    columns = 0
    for name, family in model.families().items():
        width = len(family.sizes(model.array))
        if not width or (getattr(family, "needs_temperature", False) and not warm):
            continue
        if chosen is not None and not chosen(family):
            continue
        grid: Sequence[Mapping[str, float]] = family.shapes(duration, 1.0 / segments[0].run.sample_period)
        grid = grid[:: 2 if len(grid) > _MOST_SHAPES else 1]
        looks = float(len(grid))
        if name in held:
            grid = [held[name].shape]
        for shape in grid:
            signatures.append(Signature(family, dict(shape), np.arange(columns, columns + width), looks))
            columns += width
    return signatures


def signature_columns(
    segment: BodySegment,
    signatures: Sequence[Signature],
    base: Sequence[Cause],
    fixed: Sequence[Effect],
    line: BodyLine,
) -> NDArray[np.float64]:
    """Return the whitened columns (rows, P) of signatures, in units of their prior."""
    present = effects_of(base, segment.model.array, segment.index)
    out = np.empty((line.rows.size, sum(len(one.columns) for one in signatures)), order="F")
    place = 0
    for signature in signatures:
        for size, column in _size_columns(segment, signature.family, signature.shape, present, fixed, line):
            out[:, place + size] = column
        place += len(signature.columns)
    return out


def _size_columns(
    segment: BodySegment,
    family: EffectFamily,
    shape: Mapping[str, float],
    present: Sequence[Effect],
    fixed: Sequence[Effect],
    line: BodyLine,
) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """Yield the number of each size of an effect and its column."""
    array = segment.model.array
    sizes = family.sizes(array)
    others = [*fixed, *(effect for effect in present if effect.name != family.name)]
    mine = next((effect for effect in present if effect.name == family.name), None)
    zero = np.zeros(len(sizes)) if mine is None else mine.size_values(array)
    reach = behind_wiring(family.reach(array), [*segment.model.effects, *fixed], array)
    at_zero = [] if mine is None else [mine]
    nominal = segment.predict([*others, *at_zero], line.drive)
    for group in disjoint(reach, len(sizes)):
        moved = zero.copy()
        for size in group:
            moved[size] += sizes[size].step * sizes[size].prior_std
        change = segment.predict([*others, family.from_sizes(array, moved, shape)], line.drive) - nominal
        grouped = segment.grouped(change)
        for size in group:
            alone = grouped if reach is None else grouped * reach[size]
            yield size, segment.signature(alone) / sizes[size].step


def _of_causes(
    columns: NDArray[np.float64], signatures: Sequence[Signature], causes: Sequence[Cause]
) -> NDArray[np.float64]:
    """Return the columns of the coordinates of causes, from those of all signatures (rows, P)."""
    parts = [np.zeros((len(columns), 0))]
    parts += [columns[:, _signature_of(signatures, cause).columns] @ cause.mixing for cause in causes]
    return np.hstack(parts)
