"""Held-out data of a free body: whether causes predict readings that the fit never saw, whatever the motion was."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.causes import Cause, effects_of_run
from gfimu.diagnosis.free_body.engine import Screening, learn_noise, screen
from gfimu.diagnosis.free_body.segment import BodySegment
from gfimu.diagnosis.search import Blocks
from gfimu.diagnosis.verdict.verdict import Gain
from gfimu.world_model import Effect

__all__ = ["BodyHoldout", "gate_gains", "held_out_gain", "other_recording", "stretches"]

_STRETCHES = 16
_BLOCK = 40
_EXCESS = 0.02


@dataclass(frozen=True)
class BodyHoldout:
    """Fitted and held-out runs with the effects known beforehand in each."""

    train: list[BodySegment]
    train_fixed: list[list[Effect]]
    test: list[BodySegment]
    test_fixed: list[list[Effect]]


def stretches(segments: Sequence[BodySegment], fixed: Sequence[Sequence[Effect]]) -> list[BodyHoldout]:
    """Cut every run into stretches of time and hold out every other one, both ways."""
    parts: list[list[BodySegment]] = [[], []]
    for segment in segments:
        turn = (np.arange(len(segment.starts)) * _STRETCHES // len(segment.starts)) % 2
        for place in range(2):
            part = segment.only(turn == place)
            part.set_noise(segment.noise)
            parts[place].append(part)
    known = [list(effects) for effects in fixed]
    return [BodyHoldout(parts[0], known, parts[1], known), BodyHoldout(parts[1], known, parts[0], known)]


def other_recording(
    segments: Sequence[BodySegment],
    fixed: Sequence[Sequence[Effect]],
    held_out: Sequence[BodySegment],
    held_fixed: Sequence[Sequence[Effect]],
    causes: Sequence[Cause],
) -> list[BodyHoldout]:
    """Hold out whole recordings; their noise is learned from themselves."""
    learn_noise(held_out, causes, held_fixed)
    known = [list(effects) for effects in fixed]
    return [BodyHoldout(list(segments), known, list(held_out), [list(effects) for effects in held_fixed])]


def gate_gains(causes: Sequence[Cause], pairs: Sequence[BodyHoldout]) -> dict[str, float]:
    """Return the log predictive gain of each cause on held-out data, the other causes refitted without it."""
    gains = {cause.name: 0.0 for cause in causes}
    names = set(gains)
    for pair in pairs:
        train = screen(pair.train, causes, pair.train_fixed, only=names)
        test = screen(pair.test, causes, pair.test_fixed, only=names)
        blocks = Blocks(train.signatures)
        places = {(h.name, h.pattern): number for number, h in reversed(list(enumerate(blocks.hypotheses)))}
        whole = tuple(places[cause.key] for cause in causes)
        best = _squares(test, _columns(train, blocks, whole))
        for cause, number in zip(causes, whole, strict=True):
            rest = tuple(member for member in whole if member != number)
            gains[cause.name] += 0.5 * (_squares(test, _columns(train, blocks, rest)) - best) / len(pairs)
    return gains


def _columns(screening: Screening, blocks: Blocks, members: tuple[int, ...]) -> NDArray[np.float64]:
    """Return a set, fitted, in the columns of the normal equations."""
    at = np.zeros(len(screening.at))
    for member, cause in zip(members, screening.fit(blocks, members).causes, strict=True):
        at[blocks.hypotheses[member].signature.columns] = cause.mixing @ cause.coordinates
    return at


def _squares(screening: Screening, at: NDArray[np.float64]) -> float:
    signatures = screening.signatures
    return screening.nothing - 2 * float(signatures.score @ at) + float(at @ signatures.gram @ at)


def held_out_gain(
    causes: Sequence[Cause], pairs: Sequence[BodyHoldout], constant: Sequence[Effect], label: str
) -> tuple[Gain, float]:
    """Measure what causes, fitted on one part, are worth on the other.

    The motion is marginalised before and after alike. The share of the excess is that over the sensors' own noise at
    rest: what the motion adds and no cause explains counts as error.

    Returns
    -------
    gain : Gain
        What the causes are worth.
    over_noise : float
        The share of the misfit removed in units of all noise that was learned, that of the motion too; NaN where
        there was none.
    """
    before = after = floor = 0.0
    misfits, rows_counted = np.zeros(2), 0
    samples, gains = 0, []
    for pair in pairs:
        fitted = tuple(causes)
        if len(pairs) > 1 and causes:
            train = screen(pair.train, causes, pair.train_fixed, only={cause.name for cause in causes})
            blocks = Blocks(train.signatures)
            places = {(h.name, h.pattern): number for number, h in reversed(list(enumerate(blocks.hypotheses)))}
            fitted = train.fit(blocks, tuple(places[cause.key] for cause in causes)).causes
        for segment, known in zip(pair.test, pair.test_fixed, strict=True):
            effects = [*known, *effects_of_run(fitted, segment.model.array, segment.index)]
            plain = [effect for effect in known if effect not in constant]
            use = (segment.use & segment.in_stretch)[:, None] & segment.run.valid
            squares, rows = [], []
            for chosen in (plain, effects):
                line = segment.linearise(chosen)
                squares.append(float(np.sum(segment.motion_removed(line)[use] ** 2)))
                rows.append(np.sum(line.rows**2, axis=1))
            before, after = before + squares[0], after + squares[1]
            floor += float(segment.noise_floor**2 * use.sum())
            samples += int(use.sum())
            misfits += [float(part.sum()) for part in rows]
            rows_counted += segment.observations
            counted = segment.stretch & (segment.count > 0)
            change = 0.5 * (rows[0] - rows[1])[counted] / np.maximum(segment.count[counted], 1)
            whole = len(change) // _BLOCK * _BLOCK
            gains.append(change[:whole].reshape(-1, _BLOCK).mean(axis=1) if whole else change)
    excess = before - floor
    share = 1.0 - max(after - floor, 0.0) / excess if excess > _EXCESS * floor else float("nan")
    likelihood = np.concatenate(gains)
    over = misfits - rows_counted
    over_noise = 1.0 - max(over[1], 0.0) / over[0] if over[0] > _EXCESS * rows_counted else float("nan")
    gain = Gain(
        label,
        float(np.sqrt(before / samples)),
        float(np.sqrt(after / samples)),
        float(min(share, 1.0)),
        float(likelihood.mean()),
        float(likelihood.std(ddof=1) / np.sqrt(len(likelihood))) if len(likelihood) > 1 else float("nan"),
    )
    return gain, float(over_noise)
