"""Samples that are wrong: channels that hold one value, and isolated values far off their neighbours."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.special import ndtr

from gfimu.base.difference_noise import difference_noise
from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.policy import Policy
from gfimu.recording.doubts.rails import is_within_range
from gfimu.recording.policy import SamplePolicy

__all__ = [
    "channel_spikes",
    "frozen_fault",
    "frozen_stretches",
    "is_at_extreme",
    "is_frozen",
    "reference_spikes",
]

_LEAST_NOISE = 0.1  # of a step: with less no run is long enough to show it
_SPIKE = 8.0  # noise
_MOVES = 10.0  # noise, or counts: range of a channel that moves
_INWARDS = 0.25  # of the range of a channel: more than a wrong gain turns a prediction away from a rail
_TURNED = 6.0  # noise, or counts, at least
_ROUGH = 6.0  # how much neighbours usually differ there
_NEIGHBOURS, _AROUND = 5, 9


def frozen_stretches(
    run: Run, prediction: NDArray[np.float64], quantum: float, noise: NDArray[np.float64]
) -> list[tuple[int, int, int]]:
    """Return (channel, start, stop) of stretches in which a channel holds one value though it should not.

    Parameters
    ----------
    run : Run
        The run.
    prediction : ndarray, shape (n, c)
        What the simulation predicts for it, m/s².
    quantum : float
        Step of the readings, m/s².
    noise : ndarray, shape (c,)
        White noise before rounding, m/s².
    """
    found, edges, usual = [], [], []
    for mine, valid in zip(run.readings.T, run.valid.T, strict=True):
        change = np.flatnonzero((np.abs(np.diff(mine)) > 1e-12) | ~valid[1:])
        edges.append(np.concatenate([[-1], change, [len(mine) - 1]]))
        lengths = np.diff(edges[-1])
        # How much the channel usually changes: away from the stretches in question.
        alive = np.repeat(lengths <= SamplePolicy.longest_equal, lengths) & valid
        usual.append(float(np.median(np.abs(np.diff(mine[alive])))) if alive.sum() > 10 else np.nan)
    # A channel that was dead all through would have changed like the quietest of the others.
    quietest = 0.0 if np.isnan(usual).all() else float(np.nanmin(usual))
    for channel in range(run.readings.shape[1]):
        mine = run.readings[:, channel]
        changes = quietest if np.isnan(usual[channel]) else usual[channel]
        for place in np.flatnonzero(np.diff(edges[channel]) > SamplePolicy.longest_equal):
            start, stop = int(edges[channel][place]) + 1, int(edges[channel][place + 1]) + 1
            moving = float(np.ptp(prediction[start:stop, channel])) > 2.5 * quantum
            if not run.valid[start:stop, channel].any():
                continue
            spread = _spread_of_others(run, channel, start, stop, quantum)
            if np.isnan(spread):
                continue
            # In the middle of a step that is coarse beside the noise a channel at rest may well read the same for long.
            least = _least_equal(min(float(noise[channel]), spread), quantum, run.readings.size)
            if moving or (changes > 0.3 * quantum and stop - start > least):
                found.append((channel, start, stop))
    return found


def is_frozen(
    run: Run, stretch: tuple[int, int, int], step: float, noise: float, prediction: NDArray[np.float64] | None = None
) -> bool:
    """Return whether the value that a channel holds in a (channel, start, stop) can be no end of its range.

    ``step`` is one count, ``noise`` the white noise, m/s². A prediction (n, c) that turns away from the level for most
    of the time shows it, too.
    """
    channel, start, stop = stretch
    mine = np.where(run.valid[:, channel], run.readings[:, channel], np.nan)
    if is_within_range(mine, start, stop, step, noise):
        return True
    if prediction is None:
        return False
    away = mine - mine[start]
    turned = np.sign(np.nansum(np.sign(away))) * (prediction[start:stop, channel] - mine[start])
    return bool(np.median(turned) > max(_INWARDS * (np.nanmax(away) - np.nanmin(away)), _TURNED * max(noise, step)))


def is_at_extreme(run: Run, stretch: tuple[int, int, int], step: float, noise: float) -> bool:
    """Return whether a channel that moves hardly reads beyond the value that it holds in a (channel, start, stop)."""
    channel, start, stop = stretch
    away = run.readings[run.valid[:, channel], channel] - run.readings[start, channel]
    beyond = min(np.sum(away > 0.5 * step), np.sum(away < -0.5 * step))
    return bool(np.ptp(away) > _MOVES * max(noise, step) and beyond <= SamplePolicy.beyond_pile * (stop - start))


def _spread_of_others(run: Run, channel: int, start: int, stop: int, quantum: float) -> float:
    """Return how much the other channels scatter in a stretch: median standard deviation before rounding, m/s².

    NaN where they do not move either: where all repeat themselves no single one has stopped, and where they flip
    between two counts the body is at rest and the steps are coarse beside its noise.
    """
    others = np.arange(run.readings.shape[1]) != channel
    readings, valid = run.readings[start:stop, others], run.valid[start:stop, others]
    repeated = float((np.diff(readings, axis=0) != 0.0).any(axis=1).mean()) <= 0.5
    columns = [column[known] for column, known in zip(readings.T, valid.T, strict=True) if known.any()]
    moved = [span for column in columns if (span := float(np.ptp(column))) > 1e-12]
    if repeated or not moved or float(np.median(moved)) <= 1.5 * quantum:
        return float("nan")
    rounding = quantum**2 / 12.0  # Sheppard's correction: what the steps themselves add to a variance
    return float(np.median([np.sqrt(max(np.var(column) - rounding, 0.0)) for column in columns]))


def _least_equal(spread: float, quantum: float, readings: int) -> float:
    """Return how many equal readings in a row noise of a ``spread`` leaves to chance in a run of so many readings."""
    same = np.log(2.0 * ndtr(0.5 * quantum / max(spread, _LEAST_NOISE * quantum)) - 1.0)  # of one reading more
    return max(float((np.log(Policy.chance) - np.log(readings)) / same), SamplePolicy.longest_equal)


def frozen_fault(
    run: Run, frozen: Sequence[tuple[int, int, int]], names: Sequence[str]
) -> tuple[dict[str, object], str]:
    """Return the longest frozen stretch, with every channel that was frozen with it, and a sentence about all."""
    _, start, stop = max(frozen, key=lambda one: one[2] - one[1])
    # A value that happens to be read again lengthens a channel's stretch.
    together = [one for one in frozen if max(abs(one[1] - start), abs(one[2] - stop)) < SamplePolicy.longest_equal]
    channels = [names[channel] for channel, _, _ in together]

    def span(first: int, end: int) -> str:
        return f"from {run.t[first]:.2f} s to {run.t[min(end, len(run.t) - 1)]:.2f} s"

    if len(channels) == 1:
        text = f"channel {channels[0]} holds one value {span(start, stop)}"
    else:
        text = f"channels {', '.join(channels)} hold one value each {span(start, stop)}"
    for one in (one for one in frozen if one not in together):
        text += f"; {names[one[0]]} does {span(one[1], one[2])}"
    parameters: dict[str, object] = {
        "channel": channels[0] if len(channels) == 1 else channels,
        "start_s": float(run.t[start]),
        "stop_s": float(run.t[min(stop, len(run.t) - 1)]),
    }
    return parameters, text


def channel_spikes(run: Run, white: NDArray[np.float64], quantum: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mark isolated readings, shape (n, c), far off the median of their five neighbours.

    Parameters
    ----------
    run : Run
        The run.
    white, quantum : ndarray, shape (c,)
        White noise and step of each channel, m/s².
    """
    readings = run.readings.copy()
    for column, valid in zip(readings.T, run.valid.T, strict=True):
        if valid.any():  # a gap is no neighbour
            column[~valid] = np.interp(run.t[~valid], run.t[valid], column[valid])
    smooth = median_filter(readings, size=(_NEIGHBOURS, 1), mode="nearest")
    jump = np.abs(readings - smooth)
    differences = np.abs(np.diff(readings, axis=0, prepend=readings[:1]))
    rough = median_filter(differences, size=(_AROUND, 1), mode="nearest")
    return run.valid & (jump > _SPIKE * np.maximum(white, 0.5 * quantum) + _ROUGH * rough)


def reference_spikes(run: Run) -> NDArray[np.bool_]:
    """Mark isolated values, shape (n,), of the reference: a pulse too many or too few, or interference."""
    known = np.flatnonzero(run.reference_valid)
    found = np.zeros(len(run.t), dtype=bool)
    while len(known) > _AROUND:  # several close to each other hide among themselves
        values = run.reference[known]
        differences = np.abs(np.diff(values, prepend=values[:1]))
        if not differences.any():
            break
        # A coarse reference differs by a step or not at all; the least difference of a fine one is below its noise.
        noise = max(difference_noise(values), float(differences[differences > 0.0].min()))
        rough = median_filter(differences, size=_AROUND, mode="mirror")
        jump = np.abs(values - median_filter(values, size=_NEIGHBOURS, mode="mirror"))
        wrong = jump > _SPIKE * noise + _ROUGH * rough
        if not wrong.any():
            break
        found[known[wrong]] = True
        known = known[~wrong]
    return found
