"""Hidden worlds of a free body: a torque-free tumble with a gyro as the only reference, effects drawn by seed.

What a throw of a board in the hand is like for the diagnosis: attitude and specific force unknown, the rate from a
noisy gyro. The scenario is ``tumble``; rate, sway and inclination are drawn.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import numpy as np

from gfimu.base.errors import InputError
from gfimu.base.files.model_files import find_model, read_toml
from gfimu.base.units import MILLI_G
from gfimu.recording import Recording
from sim.effects import BODY_EFFECTS, Effect, make_effect
from sim.scenarios import Scenario
from sim.simulation import simulate
from sim.trials.study.cases import BODY_PARTS, Case
from sim.trials.worlds.hidden import discrete_parameters
from sim.twin import Twin

__all__ = ["body_twin", "draw_body"]

GYRO_NOISE = 0.002
"""White noise of the reference gyro, rad/s: that of the scenario ``tumble``."""
_CLOSE = 0.02
_GYRO = tuple(f"gyro_{axis}_rad_s" for axis in "xyz")


def body_twin(case: Case) -> Twin:
    """Return the twin of a free body, which a gyro drives.

    Raises
    ------
    InputError
        If the part of the case's array is not known here.
    """
    if case.array not in BODY_PARTS:
        raise InputError(f"array {case.array!r} has no free body in the study; use one of {', '.join(BODY_PARTS)}")
    table = {"array": case.array, "drive": {"source": "gyro"}, "sensor": {"part": BODY_PARTS[case.array]}}
    return Twin.from_dict(table)


def draw_body(case: Case) -> tuple[Recording, tuple[Effect, ...], float]:
    """Draw a tumble with the effects of a case.

    Returns
    -------
    tuple
        The recording, what is hidden, and the d′ of the least of it over channels and gyro (infinite where none has a
        size).
    """
    rng = np.random.default_rng(case.seed)
    scenario = _scenario(case, rng)
    twin = body_twin(case)
    drawn = [_drawn(rng, twin, scenario, name, case) for name in case.effects]
    recording = simulate(Scenario.from_dict(_with(scenario, [effect for effect, _ in drawn])), seed=case.seed)
    return recording, tuple(effect for effect, _ in drawn), min((size for _, size in drawn), default=np.inf)


def _scenario(case: Case, rng: np.random.Generator) -> dict[str, Any]:
    data = copy.deepcopy(dict(read_toml(find_model("scenarios", "tumble"))))
    data |= {"array": case.array, "duration_s": case.duration, "sample_rate_hz": case.sample_rate}
    data["sensor"] = {"errors": False, "bandwidth": False, "bias_instability_m_s2": case.bias_instability_mg * MILLI_G}
    data["motion"] = {
        **data["motion"],
        "rate_rad_s": float(rng.uniform(6.0, 18.0)),
        "inclination_rad": float(rng.uniform(0.6, 1.0)),
        "sway_m": [float(size) for size in rng.uniform(0.01, 0.06, 3)],
    }
    return data


def _with(scenario: dict[str, Any], effects: Sequence[Effect], **more: Any) -> dict[str, Any]:
    table = [{"name": effect.name, "parameters": dict(effect.parameters)} for effect in effects]
    return {**scenario, "effect": table, **more}


def _drawn(
    rng: np.random.Generator, twin: Twin, scenario: dict[str, Any], name: str, case: Case
) -> tuple[Effect, float]:
    """Draw an effect and return it with its d′; place and direction by chance, the size so that d′ is the case's."""
    family, array = BODY_EFFECTS[name], twin.array
    sizes = family.sizes(array)
    if not sizes:
        magnitude = np.abs(_columns(scenario, [])[:, : array.n_channels])
        parameters = discrete_parameters(rng, twin, name, magnitude, case.duration, case.sample_rate)
        return make_effect(name, parameters), np.inf
    patterns = family.patterns(array)
    pattern = patterns[rng.integers(len(patterns))]
    direction = pattern.mixing @ rng.standard_normal(pattern.mixing.shape[1])
    direction *= np.array([size.prior_std for size in sizes])
    shapes = family.shapes(case.duration, case.sample_rate)
    shape = shapes[rng.integers(len(shapes))]
    before = _columns(scenario, [])
    noise = np.concatenate([twin.expected_noise(case.sample_rate).white, np.full(len(_GYRO), GYRO_NOISE)])
    scale, reached = 1.0, 0.0
    for _ in range(6):
        effect = family.from_sizes(array, scale * direction, shape)
        reached = float(np.linalg.norm((_columns(scenario, [effect]) - before) / noise))
        ratio = float(np.clip(case.size / max(reached, 1e-9), 1e-3, 1e3))
        if abs(ratio - 1.0) < _CLOSE:
            break
        scale *= ratio
    return effect, reached


def _columns(scenario: dict[str, Any], effects: Sequence[Effect]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return channels and gyro (n, c + 3) without noise."""
    reference = {**scenario["reference"], "gyro_noise_std_rad_s": 0.0}
    data = _with(scenario, effects, sensor={"perfect": True}, reference=reference)
    recording = simulate(Scenario.from_dict(data), seed=0)
    return np.column_stack([recording.readings, *(recording.reference[name] for name in _GYRO)])
