"""Signatures of effects on a free body, by finite differences of the simulation that is being judged."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.causes import Cause, Signature, effects_of_run, wired
from gfimu.diagnosis.free_body.segment import BodyLine, BodySegment
from gfimu.world_model import Effect, EffectFamily

__all__ = ["plan_signatures", "signature_columns"]

_MOST_SHAPES = 3


def plan_signatures(
    segments: Sequence[BodySegment], base: Sequence[Cause], only: Collection[str] | None = None
) -> list[Signature]:
    """List the signatures of every kind of effect that has a size, or of some kinds only, with their columns."""
    model = segments[0].model
    duration = max(segment.run.duration for segment in segments)
    warm = any(segment.run.temperature is not None for segment in segments)
    held = {cause.name: cause for cause in base}
    signatures: list[Signature] = []
    columns = 0
    for name, family in model.families().items():
        width = len(family.sizes(model.array))
        if width == 0 or (name == "bias_temperature" and not warm) or (only is not None and name not in only):
            continue
        grid: Sequence[dict[str, float]] = family.shapes(duration, 1.0 / segments[0].run.sample_period)
        grid = grid[:: 2 if len(grid) > _MOST_SHAPES else 1]
        penalty = float(np.log(len(grid)))
        if name in held:
            grid = [dict(held[name].shape)]
        for shape in grid:
            signatures.append(Signature(family, shape, np.arange(columns, columns + width), penalty))
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
    present = effects_of_run(base, segment.model.array, segment.index)
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
    reach = wired(family.reach(array), [*segment.model.effects, *fixed], array)
    at_zero = [] if mine is None else [mine]
    nominal = segment.predict([*others, *at_zero], line.drive)
    for group in _disjoint(reach, len(sizes)):
        moved = zero.copy()
        for size in group:
            moved[size] += sizes[size].step * sizes[size].prior_std
        change = segment.predict([*others, family.from_sizes(array, moved, shape)], line.drive) - nominal
        grouped = segment.grouped(change)
        for size in group:
            alone = grouped if reach is None else grouped * reach[size]
            yield size, segment.signature(alone) / sizes[size].step


def _disjoint(reach: NDArray[np.bool_] | None, count: int) -> list[list[int]]:
    """Group sizes whose reaches do not overlap, so that one difference serves them all."""
    if reach is None:
        return [[size] for size in range(count)]
    groups: list[tuple[list[int], NDArray[np.bool_]]] = []
    for size in range(count):
        for members, taken in groups:
            if not (taken & reach[size]).any():
                members.append(size)
                np.logical_or(taken, reach[size], out=taken)
                break
        else:
            groups.append(([size], reach[size].copy()))
    return [members for members, _ in groups]
