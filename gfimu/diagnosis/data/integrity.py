"""Integrity: faults that are seen in the samples themselves, before any Gaussian test.

Lost frames, a coarser step than assumed, clipping, frozen channels, exchanged or inverted channels, a chip in another
range. What they spoil is marked invalid; what they did is undone in the twin, so that the search sees clean data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.base.difference_noise import difference_noise
from gfimu.diagnosis.data.faults.clipping import clipping_level, own_rails
from gfimu.diagnosis.data.faults.rails import Rail, on_rails, rail_parameters, rail_sentence
from gfimu.diagnosis.data.faults.wiring import Fault, find_wiring, range_factors, rewired
from gfimu.diagnosis.data.rounding import common_step
from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.data.samples import (
    channel_spikes,
    frozen_fault,
    frozen_stretches,
    is_at_extreme,
    is_frozen,
)
from gfimu.model.world_model import Effect, ExpectedNoise, WorldModel

__all__ = ["IntegrityReport", "check_integrity"]

_OF_RANGE = 0.97  # of the configured range: clipping there is no fault
_DIFFERENT = 0.6  # share of values above which steps are finer than what is seen


@dataclass(frozen=True)
class IntegrityReport:
    """Faults of a run and the run with what they spoiled marked invalid.

    Parameters
    ----------
    run : Run
        The run, invalid samples marked.
    effects : tuple of Effect
        Faults found, as effects of the library.
    why : mapping of str to str
        One sentence per effect name.
    spikes : int
        Isolated samples far off their neighbours.
    """

    run: Run
    effects: tuple[Effect, ...]
    why: dict[str, str]
    spikes: int


def check_integrity(model: WorldModel, run: Run, prediction: NDArray[np.float64]) -> IntegrityReport:
    """Look for faults in the samples of a run.

    Parameters
    ----------
    model : WorldModel
        The simulation; faults that it has already are not reported again.
    run : Run
        The run.
    prediction : ndarray, shape (n, c)
        What the simulation predicts for the run, m/s².
    """
    known, library = {effect.name for effect in model.effects}, model.families()
    step, expected = _resolution(run), model.expected_noise(run.output_data_rate)
    counts = _Counts(max(step or 0.0, expected.quantum), range_factors(model.effects, model), expected)
    stopped = _stopped(run, prediction, counts)  # wherever the motion is wrong, too
    run = replace(run, valid=_without(run.valid, stopped))
    wiring = find_wiring(model, _alive(model, run, prediction, counts), prediction, expected.white, known)
    wired = [library[name](parameters) for name, parameters, _ in wiring if name in library]
    prediction = rewired(prediction, wired, model)
    counts = replace(counts, coarser=range_factors([*model.effects, *wired], model))
    stopped += _stopped(run, prediction, counts, rewired=True)
    run = replace(run, valid=_without(run.valid, stopped))
    ends = _ends(model, run, prediction, counts)
    clipped = _clipped(run, prediction, ends, counts)
    faults = [*_lost(run), *_coarse(step, expected.quantum), *wiring]
    faults += _saturation(run, clipped, ends, counts, model.array.channels)
    run = replace(run, valid=run.valid & ~clipped)
    whole = replace(run, valid=run.valid | clipped)
    held = _held(run, prediction, counts)
    frozen = stopped + [one for one in held if not is_at_extreme(whole, one, *counts.of(one[0]))]
    run = replace(run, valid=_without(run.valid, frozen))
    if frozen:
        faults.append(("stuck_channel", *frozen_fault(run, frozen, model.array.channels)))
    spikes = channel_spikes(run, counts.white, counts.steps)
    run = replace(run, valid=run.valid & ~spikes)
    found = [fault for fault in faults if fault[0] in library and fault[0] not in known]
    effects = tuple(library[name](parameters) for name, parameters, _ in found)
    return IntegrityReport(run, effects, {name: sentence for name, _, sentence in found}, int(spikes.sum()))


@dataclass(frozen=True)
class _Counts:
    """Steps and noise of the channels, some of which may be ``coarser`` (c,) than expected by a factor."""

    quantum: float
    coarser: NDArray[np.float64]
    expected: ExpectedNoise

    @property
    def steps(self) -> NDArray[np.float64]:
        """One count of each channel, m/s²."""
        return self.quantum * self.coarser

    def of(self, channel: int) -> tuple[float, float]:
        """Return the step and the white noise of a channel, m/s²."""
        return float(self.steps[channel]), float(self.white[channel])

    @property
    def white(self) -> NDArray[np.float64]:
        """White noise of each channel, m/s²."""
        return np.asarray(self.expected.white * self.coarser)


@dataclass(frozen=True)
class _Ends:
    """Where readings end: at one limit for all channels, m/s², or at rails of single ones."""

    limit: float | None
    rails: Sequence[Rail]


def _lost(run: Run) -> list[Fault]:
    """Return the lost samples as a fault."""
    if not run.lost:
        return []
    parameters: dict[str, object] = {
        "share": run.lost / len(run.t),
        "count": int(run.lost),
        "longest_s": run.longest_gap,
    }
    text = f"{run.lost} of {len(run.t)} samples are missing; the longest gap is {run.longest_gap:.3f} s"
    return [("dropped_frames", parameters, text)]


def _coarse(step: float | None, quantum: float) -> list[Fault]:
    """Return a step that is coarser than expected as a fault."""
    if step is None or step <= 1.5 * quantum:
        return []
    text = f"all readings are multiples of {step:.4g} m/s², not of {quantum:.4g} m/s²"
    return [("coarse_resolution", {"step_m_s2": step}, text)]


def _ends(model: WorldModel, run: Run, prediction: NDArray[np.float64], counts: _Counts) -> _Ends:
    """Return where readings end: where the model says so, else where the run shows it."""
    clipped_at = [float(effect.parameters["limit_m_s2"]) for effect in model.effects if effect.name == "saturation"]
    if clipped_at:
        return _Ends(min(clipped_at), ())
    limit = clipping_level(run, prediction, counts.steps, counts.white)
    return _Ends(limit, own_rails(run, prediction, limit, counts.steps, counts.white))


def _alive(model: WorldModel, run: Run, prediction: NDArray[np.float64], counts: _Counts) -> Run:
    """Return the run without clipped and dead readings, which look like those of a chip in a wider range."""
    ends = _ends(model, run, prediction, counts)
    limit = np.inf if ends.limit is None or ends.rails else ends.limit - 0.6 * counts.quantum
    at_limit = np.abs(run.readings) >= limit
    at_limit |= on_rails(run, np.zeros_like(prediction), ends.rails, counts.steps, np.zeros_like(counts.coarser))
    frozen = _held(run, prediction, counts)
    return replace(run, valid=_without(run.valid & ~at_limit, frozen))


def _held(run: Run, prediction: NDArray[np.float64], counts: _Counts) -> list[tuple[int, int, int]]:
    """Return (channel, start, stop) of stretches in which a channel holds one value, frozen or on a rail."""
    return frozen_stretches(run, prediction, counts.quantum, counts.expected.analogue)


def _stopped(
    run: Run, prediction: NDArray[np.float64], counts: _Counts, *, rewired: bool = False
) -> list[tuple[int, int, int]]:
    """Return those that are on no rail, by the readings alone or, ``rewired``, by their prediction too."""
    beyond = prediction if rewired else None
    held = _held(run, prediction, counts)
    return [one for one in held if is_frozen(run, one, *counts.of(one[0]), beyond)]


def _without(valid: NDArray[np.bool_], frozen: Sequence[tuple[int, int, int]]) -> NDArray[np.bool_]:
    """Return which readings count without (channel, start, stop)."""
    valid = valid.copy()
    for channel, start, stop in frozen:
        valid[start:stop, channel] = False
    return valid


def _clipped(run: Run, prediction: NDArray[np.float64], ends: _Ends, counts: _Counts) -> NDArray[np.bool_]:
    """Mark readings (n, c) at which a channel ends, or so near that noise is cut."""
    noise = _noise_seen(run, counts.expected.white)
    if ends.rails:
        return on_rails(run, prediction, ends.rails, counts.steps, noise)
    if ends.limit is None:
        return np.zeros_like(run.valid)
    # Just below the limit only those samples are whole whose noise points down.
    near = np.abs(prediction) > ends.limit - 4.0 * noise
    return np.asarray((np.abs(run.readings) >= ends.limit - 0.6 * counts.quantum) | near)


def _saturation(
    run: Run, clipped: NDArray[np.bool_], ends: _Ends, counts: _Counts, names: Sequence[str]
) -> list[Fault]:
    """Return clipping below the configured range as a fault."""
    levels = [abs(rail.level) for rail in ends.rails] or ([] if ends.limit is None else [ends.limit])
    if not levels or min(levels) >= _OF_RANGE * counts.expected.full_scale:
        return []
    if ends.rails:
        parameters = rail_parameters(run, ends.rails, names, counts.steps)
        return [("saturation", parameters, rail_sentence(ends.rails, names, int((clipped & run.valid).sum())))]
    text = f"readings pile up at ±{ends.limit:.2f} m/s² and never exceed it"
    return [("saturation", {"limit_m_s2": ends.limit}, text)]


def _resolution(run: Run) -> float | None:
    """Return the step that all readings of most channels are multiples of, m/s²."""
    steps = []
    for column, valid in zip(run.readings.T, run.valid.T, strict=True):
        step = common_step(column[valid])
        if step is not None and len(np.unique(column[valid])) < _DIFFERENT * valid.sum():
            steps.append(step)
    if len(steps) < max(2, run.readings.shape[1] // 2):
        return None
    return float(np.median(steps))


def _noise_seen(run: Run, white: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the white noise of each channel (c,), at least what is expected."""
    seen = [difference_noise(mine[valid]) for mine, valid in zip(run.readings.T, run.valid.T, strict=True)]
    return np.maximum(white, seen)
