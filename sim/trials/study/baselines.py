"""What simpler methods make of the same recordings.

Greedy selection by BIC and least squares with everything at once see the same library as the diagnosis; MuJoCo's system
identification names nothing and is given the right parameters. All take the smoothed tachometer for the drive and white
noise, as is usual.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import check_name
from sim.effects import make_effect
from sim.trials.benchmark.baselines.sysid import identify
from sim.trials.benchmark.library import Block, Candidate, LinearLibrary
from sim.trials.study.cases import Case
from sim.trials.study.outcome import HiddenWorld, draw_world, processor_time

__all__ = ["METHODS", "run_baseline"]

_MOST_CAUSES = 5
_SIGNIFICANT = 4.0
_SEEN = 1e-6  # standard deviation as a share of the prior below which a coordinate was left out, not measured


def run_baseline(method: str, case: Case, source: str = "") -> dict[str, Any]:
    """Draw a case and let a simpler method name its causes; the outcome has the form of `run_case`."""
    check_name("method", method, METHODS)
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


def _greedy_bic(world: HiddenWorld) -> list[dict[str, Any]]:
    """Add the place of a family that lowers BIC most, until none does (Schwarz 1978)."""
    library = LinearLibrary.of(world.recording, world.twin)
    chosen: list[Candidate] = []
    reached = 0.0
    for _ in range(_MOST_CAUSES):
        gains = [
            library.explained([*chosen, one]) - sum(each.free for each in [*chosen, one]) * np.log(library.samples)
            for one in library.candidates
        ]
        best = int(np.argmax(gains))
        if gains[best] <= reached:
            break
        reached = gains[best]
        chosen.append(library.candidates[best])
    if not chosen:
        return []
    estimate, covariance = library.fit(chosen)
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return _causes(library, {one.effect: one.block for one in chosen}, estimate, std, dict(world.truth))


def _everything(world: HiddenWorld) -> list[dict[str, Any]]:
    """Fit all families together and name those with a coordinate of more than four standard deviations."""
    normal = LinearLibrary.of(world.recording, world.twin)
    first: dict[str, Block] = {}
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
    normal: LinearLibrary,
    named: Mapping[str, Block],
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


def _sysid_of_given_name(world: HiddenWorld) -> list[dict[str, Any]]:
    """Let MuJoCo's system identification fit the sizes that are hidden, in the right place and shape.

    Its optimiser, weights and intervals; the predictions are those of the analytic model, which agrees with MuJoCo to
    1e-9 m/s². Only a single effect with sizes can be given to it.
    """
    if len(world.truth) != 1:
        return []
    name, truth = world.truth[0]
    effect, array = make_effect(name, truth), world.twin.array
    places = np.flatnonzero(effect.size_values(array))
    if not len(places):
        return []
    estimate, std = identify(world, effect, places)
    keys = [effect.sizes(array)[place].key for place in places]
    z = (estimate - effect.size_values(array)[places]) / std
    scores = {key: round(float(value), 3) for key, value in zip(keys, z, strict=True)}
    return [{"effect": name, "place": "", "probability": 1.0, "log_odds": None, "rivals": [], "z": scores}]


METHODS = {"greedy BIC": _greedy_bic, "everything at once": _everything, "mujoco.sysid, told": _sysid_of_given_name}
"""Simpler methods by name."""
