"""Rails: levels of a channel, above or below, that its readings reach again and again and hardly exceed.

The two sides of a channel, and the channels, may differ. A rail is a few counts wide: now and then a reading lies
beyond it, or its readings carry some noise. Readings on a rail show nothing but that the truth is beyond.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.data.run import Run
from gfimu.recording.policy import SamplePolicy

__all__ = ["PILE", "Rail", "find_rails", "on_rails", "rail_parameters", "rail_sentence"]

PILE = 30  # samples
_STEEP = 3.0  # times the counts just below it
_VISITS, _STAY = 2, 5  # times that a rail is reached by a channel that moves, for so many samples each
_MOVES = 20.0  # noise: range of a channel that moves
_CLEAR = 4.0  # noise, and counts, by which a prediction is beyond a level for sure
_SLOPE = 0.1  # of the prediction, that readings on a rail follow at most
_FOLLOWS = (0.5, 2.0)  # of the prediction, elsewhere
_SCATTER = 6.0  # noise, or counts: a rail that scatters by more is none
_ON_IT = 0.8  # of the readings that should be beyond a rail


@dataclass(frozen=True)
class Rail:
    """One side of a channel that clips.

    Parameters
    ----------
    channel : int
        Number of the channel.
    sign : int
        1 for the upper side, −1 for the lower.
    level : float
        Where its readings pile up, m/s².
    scatter : float
        Noise of the readings there, m/s².
    """

    channel: int
    sign: int
    level: float
    scatter: float


def find_rails(
    run: Run, prediction: NDArray[np.float64], steps: NDArray[np.float64], white: NDArray[np.float64]
) -> list[Rail]:
    """Return the rails of a run.

    Parameters
    ----------
    run : Run
        The run.
    prediction : ndarray, shape (n, c)
        What the simulation predicts for it, m/s².
    steps, white : ndarray, shape (c,)
        One count and the white noise of each channel, m/s².
    """
    found = []
    for channel, (step, sigma) in enumerate(zip(steps, white, strict=True)):
        valid = run.valid[:, channel]
        mine, expected = run.readings[valid, channel], prediction[valid, channel]
        if len(mine) < 2 * PILE or np.ptp(mine) < _MOVES * sigma:
            continue  # a channel that hardly moves reaches no rail
        for sign in (1, -1):
            one = _pile(sign * mine, sign * expected, step, sigma)
            if one is None:
                flat = _flat(sign * mine, sign * expected, step, sigma)
                if flat is not None and _others_follow(run, prediction, channel, np.flatnonzero(valid)[flat[1]], white):
                    one = flat[0]
            if one is not None:
                found.append(Rail(channel, sign, sign * one[0], one[1]))
    return [*found, *_pinned(run, prediction, found, steps, white)]


def _pinned(
    run: Run,
    prediction: NDArray[np.float64],
    rails: Sequence[Rail],
    steps: NDArray[np.float64],
    white: NDArray[np.float64],
) -> list[Rail]:
    """Return the rails of channels that never leave the level at which others clip, as the motion wants them beyond."""
    found = []
    for channel in sorted(set(range(run.readings.shape[1])) - {rail.channel for rail in rails}):
        valid = run.valid[:, channel]
        for rail in rails:
            mine, beyond = rail.sign * run.readings[valid, channel], rail.sign * prediction[valid, channel]
            level, margin = rail.sign * rail.level, max(1.5 * steps[channel], 3.0 * rail.scatter)
            at = np.abs(mine - level) < margin
            clear = beyond > level + _CLEAR * white[channel] + steps[channel]
            if len(mine) >= PILE and at.mean() > 1.0 - SamplePolicy.beyond_pile and clear.mean() > _ON_IT:
                found.append(Rail(channel, rail.sign, rail.level, rail.scatter))
                break
    return found


def _pile(
    mine: NDArray[np.float64], expected: NDArray[np.float64], step: float, sigma: float
) -> tuple[float, float] | None:
    """Return the level of a pile of equal readings at the top of a channel, and its scatter."""
    below_top = np.rint((mine.max() - mine) / step).astype(int)  # counts
    counts = np.bincount(below_top[below_top < 2 * SamplePolicy.rail_width], minlength=2 * SamplePolicy.rail_width)
    place = int(np.argmax(counts[: SamplePolicy.rail_width + 1]))
    pile, above, under = int(counts[place]), int(counts[:place].sum()), int(counts[place + 1 : place + 4].max())
    if pile < PILE or above > SamplePolicy.beyond_pile * pile or pile <= _STEEP * under + 4:
        return None
    level = float(mine[below_top == place].mean())
    on = below_top <= place
    # Noise of half a count and more would spread any signal that just gets there; coarser steps hide small errors.
    fine = sigma > 0.5 * step
    predicted = (expected[on] > level + _CLEAR * sigma + (step if fine else _CLEAR * step)).mean() > 0.5
    again = fine and _visits(on) >= _VISITS
    # A channel that stays once is at its rail where it came and goes without a jump; one that had stopped jumps.
    steady = fine and not again and _joins(mine, on, level, max(sigma, step))
    return (level, 0.0) if predicted or again or steady else None


def _visits(on: NDArray[np.bool_]) -> int:
    """Return how many times readings stay at a level."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], on.astype(int), [0]])))
    return int(np.sum(edges[1::2] - edges[::2] >= _STAY))


def _joins(mine: NDArray[np.float64], on: NDArray[np.bool_], level: float, scatter: float) -> bool:
    """Return whether the readings before and after each stay at a level lead up to it, within their usual change."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], on.astype(int), [0]])))
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        before, after = mine[max(start - _STAY - 1, 0) : start][::-1], mine[stop : stop + _STAY + 1]
        for outside in (before, after):
            usual = float(np.median(np.abs(np.diff(outside)))) if len(outside) > 1 else 0.0
            if len(outside) and abs(outside[0] - level) > _SCATTER * max(scatter, usual):
                return False
    return True


def _others_follow(
    run: Run, prediction: NDArray[np.float64], channel: int, rows: NDArray[np.intp], white: NDArray[np.float64]
) -> bool:
    """Return whether another channel follows its prediction in these rows.

    Where none does, the motion is not as predicted: the reference is wrong there, and the channel that stays at its
    highest level is right.
    """
    for other in range(run.readings.shape[1]):
        valid = rows[run.valid[rows, other]]
        mine, expected = run.readings[valid, other], prediction[valid, other]
        if other == channel or len(valid) < PILE or np.ptp(expected) < _MOVES * white[other]:
            continue
        if _FOLLOWS[0] < _slope(expected, mine) < _FOLLOWS[1]:
            return True
    return False


def _flat(
    mine: NDArray[np.float64], expected: NDArray[np.float64], step: float, sigma: float
) -> tuple[tuple[float, float], NDArray[np.bool_]] | None:
    """Return the level at which readings stay while their prediction moves beyond, their scatter, and these rows."""
    top = float(np.partition(mine, -SamplePolicy.garbage - 1)[-SamplePolicy.garbage - 1])
    clear = _CLEAR * (sigma + step)
    beyond = expected > top + clear
    if beyond.sum() < PILE:
        return None
    level = float(np.median(mine[beyond]))
    scatter = 1.4826 * float(np.median(np.abs(mine[beyond] - level)))
    within = np.abs(mine[beyond] - level) < _CLEAR * max(scatter, step)
    under = expected < level - clear
    if (
        scatter > _SCATTER * max(sigma, step)
        or top - level > SamplePolicy.rail_width * step + _SCATTER * sigma
        or within.mean() < _ON_IT
        or under.sum() < PILE
        or np.ptp(expected[beyond]) < _SCATTER * max(scatter, sigma, step)
        or np.ptp(expected[under]) < _MOVES * sigma
    ):
        return None
    stays = abs(_slope(expected[beyond], mine[beyond])) < _SLOPE
    follows = _FOLLOWS[0] < _slope(expected[under], mine[under]) < _FOLLOWS[1]
    return ((level, scatter), beyond) if stays and follows else None


def _slope(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    centred = x - x.mean()
    return float(centred @ y / (centred @ centred))


def on_rails(
    run: Run,
    prediction: NDArray[np.float64],
    rails: Sequence[Rail],
    steps: NDArray[np.float64],
    noise: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Mark readings, shape (n, c), that are on a rail or so near to it that only half of their noise is read.

    ``steps`` and ``noise`` hold one count and the noise of each channel, m/s², shape (c,).
    """
    on = np.zeros(run.readings.shape, dtype=bool)
    for rail in rails:
        level = rail.sign * rail.level
        margin = max(0.6 * steps[rail.channel], 3.0 * rail.scatter)
        on[:, rail.channel] |= rail.sign * run.readings[:, rail.channel] >= level - margin
        on[:, rail.channel] |= rail.sign * prediction[:, rail.channel] > level - _CLEAR * noise[rail.channel]
    # Of a channel that hardly leaves its rail only the noise would be left.
    return np.asarray(on | (on.mean(axis=0) > 1.0 - SamplePolicy.beyond_pile))


def rail_parameters(
    run: Run, rails: Sequence[Rail], channels: Sequence[str], steps: NDArray[np.float64]
) -> dict[str, object]:
    """Return the parameters of a saturation: the typical level and, unless it holds for all channels, each of them.

    ``steps`` holds one count of each channel, m/s², shape (c,).
    """
    limit = float(np.median([abs(rail.level) for rail in rails]))
    sides = {1: "upper", -1: "lower"}
    each = {f"{channels[rail.channel]}_{sides[rail.sign]}_m_s2": rail.level for rail in rails}
    alike = all(abs(abs(rail.level) - limit) < 1.5 * steps[rail.channel] for rail in rails)
    beyond = np.abs(np.where(run.valid, run.readings, 0.0)) > limit + SamplePolicy.rail_width * steps
    return {"limit_m_s2": limit, **({} if alike and beyond.sum(axis=0).max() <= SamplePolicy.garbage else each)}


def rail_sentence(rails: Sequence[Rail], channels: Sequence[str], left_out: int) -> str:
    """Return which channels clip, where, and how many readings are left out for it."""
    levels: dict[str, list[str]] = {}
    for rail in rails:
        levels.setdefault(f"{rail.level:+.2f}", []).append(channels[rail.channel])
    where = "; ".join(f"{', '.join(names)} at {level} m/s²" for level, names in levels.items())
    return f"readings pile up at a level that they hardly exceed ({where}); {left_out} readings there are left out"
