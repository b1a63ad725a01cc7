"""One case: draw the hidden world, diagnose its recording, and keep what the tables need."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.base.short_repr import short_repr
from gfimu.base.units import MILLI_G
from gfimu.diagnosis.design.distinguishability import energy_left, normal_equations, plan_contenders
from gfimu.diagnosis.design.planned_run import PlannedRun, planned
from gfimu.diagnosis.verdict.library import standing_out
from gfimu.diagnosis.verdict.parts import Located
from gfimu.diagnosis.verdict.verdict import Diagnosis
from gfimu.model.user_code import user_function
from gfimu.recording import Recording
from sim.effects import Effect, make_effect
from sim.motions.motion import SpinMotion
from sim.trials.study.bodies import body_twin, draw_body
from sim.trials.study.cases import Case
from sim.trials.worlds.elsewhere import recorded_elsewhere
from sim.trials.worlds.hidden import (
    FORMLESS,
    Measurement,
    clipped_motion,
    detectability,
    hidden_effect,
    measure,
    random_profile,
)
from sim.trials.worlds.z_scores import z_scores
from sim.twin import Twin

__all__ = ["HiddenWorld", "SmallerLibrary", "draw_world", "outcome_of", "run_case"]

_TURN = 2 * np.pi
_SHAPES = frozenset(("frequency_hz", "damping_ratio", "order", "width_m_s2", "time_constant_s"))
_LONGEST_PLANNED = 120.0  # s: a planned run has one drive, whose normal equations grow with its square
_CLOSEST = 8  # of the other effects, of which one is taken into every pair


@dataclass(frozen=True)
class HiddenWorld:
    """A recording, the twin to diagnose it with, and what is hidden: contract names and parameters.

    ``reached`` is the d′ of the least hidden effect that has a noise-free form, infinite where none has, the drive
    known. Of a single effect with sizes in a run of up to two minutes, ``drive_unknown`` is its d′ with the drive
    unknown and ``left_by`` what of that each other effect of the library leaves at its best. Of one that is taken out
    of the library, ``left_by_two`` is what the best two others together leave.
    """

    recording: Recording
    twin: Twin
    truth: tuple[tuple[str, Mapping[str, Any]], ...]
    reached: float
    drive_unknown: float | None = None
    left_by: Mapping[str, float] = field(default_factory=dict)
    left_by_two: float | None = None

    __repr__ = short_repr


@dataclass(frozen=True)
class SmallerLibrary(Twin):
    """A twin whose library of effects lacks some."""

    without: frozenset[str] = frozenset()

    def families(self) -> Mapping[str, type[Effect]]:
        """Return the library without the effects left out."""
        return {name: family for name, family in super().families().items() if name not in self.without}


def calibration_residue(rng: np.random.Generator, array: AccelerometerArray) -> list[Effect]:
    """Draw what a good calibration leaves: bias 0.3 mg, scale 5e-4, misalignment 0.02°, position 0.05 mm."""
    stds = {"bias": 0.3 * MILLI_G, "scale_factor": 5e-4, "misalignment": np.deg2rad(0.02), "sensor_position": 5e-5}
    residue = []
    for name, std in stds.items():
        keys = make_effect(name).parameter_keys(array)
        residue.append(make_effect(name, dict(zip(keys, std * rng.standard_normal(len(keys)), strict=True))))
    return residue


def draw_world(case: Case, source: str = "") -> HiddenWorld:
    """Draw the hidden world of a case.

    Parameters
    ----------
    case : Case
        The case.
    source : str
        ``FILE.py:FUNCTION`` of a generator of its own, called as ``function(seed, effects, size, **measurement)``;
        by default the project's own campaign.
    """
    if case.body:
        recording, thrown, least = draw_body(case)
        return HiddenWorld(recording, body_twin(case), tuple((one.name, one.parameters) for one in thrown), least)
    twin: Twin = SmallerLibrary(
        array=AccelerometerArray.load(case.array),
        array_name=case.array,
        sample_rate=case.sample_rate,
        without=frozenset({case.without} - {""}),
        drive_source="angle" if case.encoder_counts else "tacho",
    )
    setting = Measurement(
        case.duration,
        case.sample_rate,
        case.bias_instability_mg * MILLI_G,
        case.tacho_noise,
        encoder_step=_TURN / case.encoder_counts if case.encoder_counts else 0.0,
    )
    if source:
        hide = user_function(source, "a generator")
        recording, run = recorded_elsewhere(hide, case.seed, case.effects, case.size, twin.array, setting)
        return HiddenWorld(recording, twin, tuple(run.truth), run.detectability)
    rng = np.random.default_rng(case.seed)
    drawn = partial(random_profile, rng, case.duration)
    motion = clipped_motion(drawn, twin, setting) if "saturation" in case.effects else drawn()
    hidden = [hidden_effect(rng, twin, name, motion, case.size, setting) for name in case.effects]
    residue = calibration_residue(rng, twin.array) if case.residue else []
    recording = measure(rng, twin, [*residue, *hidden], setting, motion=motion)
    sizes = [detectability(twin, [effect], motion, setting) for effect in hidden if effect.name not in FORMLESS]
    truth = tuple((effect.name, effect.parameters) for effect in hidden)
    world = HiddenWorld(recording, twin, truth, min(sizes, default=np.inf))
    if len(hidden) == 1 and sizes and hidden[0].sizes(twin.array) and case.duration <= _LONGEST_PLANNED:
        world = _with_limits(world, hidden[0], motion, setting, pairs=bool(case.without))
    return world


def _with_limits(
    world: HiddenWorld, hidden: Effect, motion: SpinMotion, setting: Measurement, *, pairs: bool
) -> HiddenWorld:
    """Return the world with what an ideal observer could see of its single effect, and what others leave of it."""
    twin = Twin(array=world.twin.array, array_name=world.twin.array_name, sample_rate=world.twin.sample_rate)
    rivals = [
        name
        for name, family in twin.families().items()
        if name not in {hidden.name, *FORMLESS} and family.sizes(twin.array)
    ]
    run = PlannedRun(
        motion,
        setting.duration,
        setting.sample_rate,
        reference_noise=setting.tacho_noise,
        bias_instability=setting.bias_instability,
    )
    signatures, (own, *others) = plan_contenders(
        twin, [hidden, *rivals], duration=setting.duration, sample_rate=setting.sample_rate
    )
    gram, _ = normal_equations(*planned(twin, [run]), signatures)
    size = own.directions[:, 0]
    left = np.sqrt(energy_left(gram, own, others))
    by_two = None
    if pairs:
        closest = np.argsort(left)[:_CLOSEST]
        couples = [
            others[first].beside(other)
            for first in closest
            for second, other in enumerate(others)
            if second not in closest or second > first
        ]
        by_two = float(energy_left(gram, own, couples).min()) ** 0.5
    return replace(
        world,
        drive_unknown=max(float(size @ gram[np.ix_(own.columns, own.columns)] @ size), 0.0) ** 0.5,
        left_by=dict(zip(rivals, left.tolist(), strict=True)),
        left_by_two=by_two,
    )


def run_case(case: Case, source: str = "") -> dict[str, Any]:
    """Draw, diagnose and score one case; an exception becomes part of the outcome.

    Returns
    -------
    dict
        The case and its outcome, ready for JSON.
    """
    # The engine is heavy to load, and the generators can be used without it.
    from gfimu.diagnosis import diagnose

    world = draw_world(case, source)
    wall, processor = time.perf_counter(), processor_time()
    try:
        diagnosis = diagnose([world.recording], world.twin)
    except Exception as error:  # noqa: BLE001 - a crash is an outcome that the report counts
        found: dict[str, Any] = {"verdict": "error", "error": f"{type(error).__name__}: {error}", "causes": []}
    else:
        found = outcome_of(diagnosis, world.truth)
    times = {"wall_s": time.perf_counter() - wall, "processor_s": processor_time() - processor}
    reached = {
        "reached": world.reached,
        "drive_unknown": world.drive_unknown,
        "left_by": dict(world.left_by),
        "left_by_two": world.left_by_two,
    }
    return {"key": case.key, "source": source or "sim.campaign", **case.to_dict(), **reached, **found, **times}


def processor_time() -> float:
    """Return the processor time that this process and those it has ended took so far, s."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def outcome_of(diagnosis: Diagnosis, truth: Sequence[tuple[str, Mapping[str, Any]]]) -> dict[str, Any]:
    """Return what the tables need of a diagnosis whose truth is known."""
    hidden = dict(truth)
    causes, located = [], []
    for cause in diagnosis.causes:
        if cause.unlisted is not None:
            located.append({"text": cause.why, "log_odds": cause.log_odds, **_place_of(cause.unlisted)})
            continue
        scores = z_scores(cause.parameters, cause.std, hidden[cause.effect]) if cause.effect in hidden else {}
        causes.append(
            {
                "effect": cause.effect,
                "place": cause.place,
                "probability": cause.probability,
                "log_odds": cause.log_odds,
                "rivals": list(cause.not_distinguishable_from),
                "stds": standing_out(cause, _SHAPES),
                "z": {key: round(value, 3) for key, value in scores.items()},
            }
        )
    gain, residual = diagnosis.gain, diagnosis.residual
    return {
        "verdict": diagnosis.verdict,
        "causes": causes,
        "share_of_excess_removed": gain.share_of_excess_removed,
        "rms_before": residual.rms_before,
        "rms_after": residual.rms_after,
        "noise_floor": residual.noise_floor,
        "rival_log_odds": max((rival.log_odds for rival in diagnosis.rivals), default=None),
        "unexplained": diagnosis.unexplained.significant,
        "unexplained_nats": diagnosis.unexplained.log_odds,
        "library_probability": diagnosis.library_probability,
        "located": located,
        "signature": diagnosis.unexplained.signature,
        "noise": diagnosis.noise.to_dict(),
        "truth": {name: {key: _plain(value) for key, value in parameters.items()} for name, parameters in truth},
    }


def _place_of(found: Located) -> dict[str, Any]:
    keys = ("place", "what", "dependence", "place_probability", "dependence_probability")
    return {key: getattr(found, key) for key in keys}


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
