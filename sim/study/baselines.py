"""What simpler methods make of the same recordings: greedy selection by BIC, and least squares with everything at once.

Both take the smoothed tachometer for the drive and white noise of the data sheet, as is usual; both see the same
library as the diagnosis.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from gfimu.errors import unknown_name
from gfimu.recording import Recording
from sim.effects import Effect
from sim.motion import SplineSpin
from sim.study.cases import Case
from sim.study.outcome import HiddenWorld, draw_world

__all__ = ["METHODS", "run_baseline"]

_SMOOTHING = 0.03  # of the tachometer, s
_MOST_CAUSES = 5
_SIGNIFICANT = 4.0
_STEP = 0.1  # finite difference as a share of the prior's standard deviation


@dataclass(frozen=True)
class _Block:
    """Columns of one family at one shape, and the places its sizes may be confined to."""

    family: type[Effect]
    columns: slice
    keys: tuple[str, ...]
    places: tuple[NDArray[np.float64], ...]


@dataclass(frozen=True)
class _Normal:
    """Normal equations of all columns against the residual, in units of the noise."""

    blocks: tuple[_Block, ...]
    gram: NDArray[np.float64]
    score: NDArray[np.float64]
    scale: NDArray[np.float64]
    samples: int


def run_baseline(method: str, case: Case, source: str = "") -> dict[str, Any]:
    """Draw a case and let a simpler method name its causes; the outcome has the form of `run_case`."""
    if method not in METHODS:
        raise unknown_name("method", method, METHODS)
    world = draw_world(case, source)
    wall, processor = time.perf_counter(), time.process_time()
    causes = METHODS[method](_normal_equations(world), dict(world.truth))
    return {
        "key": case.key,
        "source": source or "sim.campaign",
        "method": method,
        **case.to_dict(),
        "verdict": "explained" if causes else "nothing_found",
        "causes": causes,
        "wall_s": time.perf_counter() - wall,
        "processor_s": time.process_time() - processor,
    }


def _normal_equations(world: HiddenWorld) -> _Normal:
    recording, twin = world.recording, world.twin
    t = recording.t_s
    smooth = gaussian_filter1d(recording.reference["tacho_rad_s"], _SMOOTHING / recording.sample_period)
    temperature = recording.reference.get("temperature_degC")
    white = twin.expected_noise(recording.sample_rate).white
    motion = SplineSpin.through(t, smooth)
    nominal, reference = twin.predict(motion, t, temperature=temperature)
    residual = recording.for_array(twin.array) - nominal

    def change(effect: Effect) -> NDArray[np.float64]:
        moved, reading = twin.predict(motion, t, effects=[effect], temperature=temperature)
        if not np.array_equal(reading, reference):
            # A wrong reference means another motion, for the reading is what was measured.
            moved, _ = twin.predict(SplineSpin.through(t, smooth - (reading - reference)), t, temperature=temperature)
        return ((moved - nominal) / white).ravel()

    blocks: list[_Block] = []
    columns: list[NDArray[np.float64]] = []
    scale: list[float] = []
    for family in twin.families().values():
        sizes = family.sizes(twin.array)
        for shape in _shapes(family, recording, residual) if sizes else ():
            first = len(columns)
            for number, size in enumerate(sizes):
                values = np.zeros(len(sizes))
                values[number] = _STEP * size.prior_std
                columns.append(change(family.from_sizes(twin.array, values, shape)) / _STEP)
                scale.append(size.prior_std)
            blocks.append(
                _Block(
                    family,
                    slice(first, len(columns)),
                    tuple(size.key for size in sizes),
                    tuple(pattern.mixing for pattern in family.patterns(twin.array)),
                )
            )
    design = np.column_stack(columns)
    score = design.T @ np.nan_to_num(residual / white).ravel()
    return _Normal(tuple(blocks), design.T @ design, score, np.array(scale), residual.size)


def _shapes(family: type[Effect], recording: Recording, residual: NDArray[np.float64]) -> tuple[dict[str, float], ...]:
    """Return the grid of a family; a tone is put at the highest line of the mean periodogram."""
    if family.name != "interference_tone":
        return family.shapes(recording.duration, recording.sample_rate)
    power = np.mean(np.abs(np.fft.rfft(residual - residual.mean(axis=0), axis=0)) ** 2, axis=1)
    line = int(np.argmax(power[1:])) + 1
    return ({"frequency_hz": line * recording.sample_rate / len(residual)},)


def _greedy_bic(normal: _Normal, truth: Mapping[str, Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Add the place of a family that lowers BIC most, until none does (Schwarz 1978)."""
    candidates = []
    for block in normal.blocks:
        for mixing in block.places:
            spread = np.zeros((len(normal.score), mixing.shape[1]))
            spread[block.columns] = mixing
            candidates.append((block, spread))
    chosen: list[tuple[_Block, NDArray[np.float64]]] = []
    reached = 0.0
    for _ in range(_MOST_CAUSES):
        taken = [spread for _, spread in chosen]
        gains = [_explained(normal, [*taken, spread]) for _, spread in candidates]
        penalised = [
            gain - sum(matrix.shape[1] for matrix in [*taken, spread]) * np.log(normal.samples)
            for gain, (_, spread) in zip(gains, candidates, strict=True)
        ]
        best = int(np.argmax(penalised))
        if penalised[best] <= reached:
            break
        reached = penalised[best]
        chosen.append(candidates[best])
    if not chosen:
        return []
    mixing = np.hstack([spread for _, spread in chosen])
    covariance = np.linalg.pinv(mixing.T @ normal.gram @ mixing, rcond=1e-10)
    estimate = mixing @ (covariance @ (mixing.T @ normal.score))
    std = np.sqrt(np.einsum("ij,jk,ik->i", mixing, covariance, mixing))
    return _causes(normal, {block.family.name: block for block, _ in chosen}, estimate, std, truth)


def _explained(normal: _Normal, spreads: list[NDArray[np.float64]]) -> float:
    """Drop of χ² by free coordinates."""
    mixing = np.hstack(spreads)
    score = mixing.T @ normal.score
    return float(score @ np.linalg.pinv(mixing.T @ normal.gram @ mixing, rcond=1e-10) @ score)


def _everything(normal: _Normal, truth: Mapping[str, Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Fit all families together and name those with a coordinate of more than four standard deviations."""
    first: dict[str, _Block] = {}
    for block in normal.blocks:
        first.setdefault(block.family.name, block)
    places = np.concatenate([np.arange(b.columns.start, b.columns.stop) for b in first.values()])
    gram = normal.gram[np.ix_(places, places)]
    covariance = np.linalg.pinv(gram, rcond=1e-10, hermitian=True)
    estimate, std = np.zeros(len(normal.score)), np.full(len(normal.score), np.inf)
    estimate[places] = covariance @ normal.score[places]
    std[places] = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    # The minimum-norm solution puts a finite number on what the data do not see at all: leave those out.
    unseen = np.abs(np.diag(gram @ covariance) - 1.0) > 0.01
    std[places[unseen]] = np.inf
    named = {
        name: block
        for name, block in first.items()
        if np.max(np.abs(estimate[block.columns]) / std[block.columns]) > _SIGNIFICANT
    }
    return _causes(normal, named, estimate, std, truth)


def _causes(
    normal: _Normal,
    named: Mapping[str, _Block],
    estimate: NDArray[np.float64],
    std: NDArray[np.float64],
    truth: Mapping[str, Mapping[str, Any]],
) -> list[dict[str, Any]]:
    causes = []
    for name, block in named.items():
        scale = normal.scale[block.columns]
        z = {
            key: round(float((value - truth[name].get(key, 0.0)) / spread), 3)
            for key, value, spread in zip(
                block.keys, estimate[block.columns] * scale, std[block.columns] * scale, strict=True
            )
            if name in truth and key in truth[name] and 0 < spread < np.inf
        }
        causes.append({"effect": name, "place": "", "probability": 1.0, "log_odds": None, "rivals": [], "z": z})
    return causes


METHODS = {"greedy BIC": _greedy_bic, "everything at once": _everything}
"""Simpler methods by name."""
