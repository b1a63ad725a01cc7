"""What simpler methods make of the same recordings.

Greedy selection by BIC and least squares with everything at once see the same library as the diagnosis; MuJoCo's system
identification names nothing and is told the right parameters. All take the smoothed tachometer for the drive and white
noise, as is usual.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from gfimu.errors import InputError, unknown_name
from gfimu.recording import Recording
from sim.effects import Effect, make_effect
from sim.motion import SplineSpin
from sim.study.cases import Case
from sim.study.outcome import HiddenWorld, draw_world, processor_time

__all__ = ["METHODS", "run_baseline"]

_SMOOTHING = 0.03  # of the tachometer, s
_MOST_CAUSES = 5
_SIGNIFICANT = 4.0
_SEEN = 1e-6  # standard deviation as a share of the prior below which a coordinate was left out, not measured
_HALF_WIDTH = 1.96  # of a 95 % interval, in standard deviations
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
    wall, processor = time.perf_counter(), processor_time()
    causes = METHODS[method](world)
    return {
        "key": case.key,
        "source": source or "sim.campaign",
        "method": method,
        **case.to_dict(),
        "reached": world.reached,
        "verdict": "explained" if causes else "nothing_found",
        "causes": causes,
        "wall_s": time.perf_counter() - wall,
        "processor_s": processor_time() - processor,
    }


class _KnownDrive:
    """Predictions for a recording whose smoothed tachometer is taken for the truth."""

    def __init__(self, world: HiddenWorld) -> None:
        recording, self._twin = world.recording, world.twin
        self._t = recording.t_s
        self._rate = gaussian_filter1d(recording.reference["tacho_rad_s"], _SMOOTHING / recording.sample_period)
        self._temperature = recording.reference.get("temperature_degC")
        self._motion = SplineSpin.through(self._t, self._rate)
        self.nominal, self._reference = self._predict(self._motion, ())

    def _predict(
        self, motion: SplineSpin, effects: Sequence[Effect]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return self._twin.predict(motion, self._t, effects=effects, temperature=self._temperature)

    def readings(self, effect: Effect) -> NDArray[np.float64]:
        """Return the channels (n, c) with an effect, m/s²; a wrong reference means another motion than it says."""
        moved, reading = self._predict(self._motion, [effect])
        if np.array_equal(reading, self._reference):
            return moved
        corrected = SplineSpin.through(self._t, self._rate - (reading - self._reference))
        return self._predict(corrected, ())[0]


def _normal_equations(world: HiddenWorld) -> _Normal:
    recording, twin = world.recording, world.twin
    white = twin.expected_noise(recording.sample_rate).white
    drive = _KnownDrive(world)
    residual = recording.for_array(twin.array) - drive.nominal

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
                moved = drive.readings(family.from_sizes(twin.array, values, shape))
                columns.append(((moved - drive.nominal) / white).ravel() / _STEP)
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


def _greedy_bic(world: HiddenWorld) -> list[dict[str, Any]]:
    """Add the place of a family that lowers BIC most, until none does (Schwarz 1978)."""
    normal = _normal_equations(world)
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
    std = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", mixing, covariance, mixing), 0.0))
    return _causes(normal, {block.family.name: block for block, _ in chosen}, estimate, std, dict(world.truth))


def _explained(normal: _Normal, spreads: list[NDArray[np.float64]]) -> float:
    """Drop of χ² by free coordinates."""
    mixing = np.hstack(spreads)
    score = mixing.T @ normal.score
    return float(score @ np.linalg.pinv(mixing.T @ normal.gram @ mixing, rcond=1e-10) @ score)


def _everything(world: HiddenWorld) -> list[dict[str, Any]]:
    """Fit all families together and name those with a coordinate of more than four standard deviations."""
    normal = _normal_equations(world)
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
    return _causes(normal, named, estimate, std, dict(world.truth))


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
            for key, value, spread, size in zip(
                block.keys, estimate[block.columns] * scale, std[block.columns] * scale, scale, strict=True
            )
            if name in truth and key in truth[name] and _SEEN < spread / size < np.inf
        }
        causes.append({"effect": name, "place": "", "probability": 1.0, "log_odds": None, "rivals": [], "z": z})
    return causes


def _told_sysid(world: HiddenWorld) -> list[dict[str, Any]]:
    """Let MuJoCo's system identification fit the sizes that are hidden, in the right place and shape.

    Its optimiser, weights and intervals; the predictions are those of the analytic model, which agrees with MuJoCo to
    1e-9 m/s². Only a single effect with sizes can be told to it.
    """
    if len(world.truth) != 1:
        return []
    name, truth = world.truth[0]
    effect, array = make_effect(name, truth), world.twin.array
    places = np.flatnonzero(effect.size_values(array))
    if not len(places):
        return []
    estimate, std = _identify(world, effect, places)
    keys = [effect.sizes(array)[place].key for place in places]
    z = (estimate - effect.size_values(array)[places]) / std
    scores = {key: round(float(value), 3) for key, value in zip(keys, z, strict=True)}
    return [{"effect": name, "place": "", "probability": 1.0, "log_odds": None, "rivals": [], "z": scores}]


def _identify(
    world: HiddenWorld, effect: Effect, places: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Fit some sizes of an effect with ``mujoco.sysid``; returns estimates and standard deviations."""
    from mujoco import sysid

    if not hasattr(sysid, "optimize"):
        raise InputError('MuJoCo\'s system identification is not installed: pip install "mujoco[sysid]"')
    array, shape = world.twin.array, effect.shape_values()
    measured, drive = world.recording.for_array(array), _KnownDrive(world)
    priors = np.array([size.prior_std for size in effect.sizes(array)])

    def residual(x: NDArray[np.float64], parameters: Any) -> tuple[list[NDArray[np.float64]], None, None]:
        columns = []
        for free in np.reshape(x, (len(places), -1)).T:
            values = np.zeros(len(priors))
            values[places] = free * priors[places]
            left = drive.readings(type(effect).from_sizes(array, values, shape)) - measured
            columns.append(sysid.normalize_residual(left, measured).ravel())
        return [np.array(columns).T if np.ndim(x) > 1 else columns[0]], None, None

    sizes = sysid.ParameterDict()
    for place in places:  # in units of the prior, for the optimiser's sake
        sizes.add(sysid.Parameter(str(place), 0.0, -1e3, 1e3))
    with redirect_stdout(StringIO()):  # its optimiser prints each iteration
        fitted, result = sysid.optimize(sizes, residual, verbose=False, max_iters=20)
    final, *_ = residual(fitted.as_vector(), fitted)
    _, half_widths = sysid.calculate_intervals(final, np.asarray(result.jac))
    return fitted.as_vector() * priors[places], np.asarray(half_widths) / _HALF_WIDTH * priors[places]


METHODS = {"greedy BIC": _greedy_bic, "everything at once": _everything, "mujoco.sysid, told": _told_sysid}
"""Simpler methods by name."""
