"""What a case of a campaign does: simulate and estimate, hide an effect and diagnose, or measure a world."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from gfimu.base.errors import InputError, check_name, unknown_name, warn
from sim.trials.campaign.drive import DriveWork, as_toml

if TYPE_CHECKING:
    from gfimu.calibration.result import Calibration
    from gfimu.recording import Recording
    from sim.scenarios import Scenario
    from sim.trials.study.cases import Case as StudyCase
    from sim.trials.sweep.design import Case
    from sim.trials.sweep.plan import PlanFile, Value

__all__ = ["KINDS", "check_factors", "diagnose_case", "estimate_case", "measure_case"]

_SCENARIO = "paper_run"
_CALIBRATIONS = ("none", "rest", "poses")
_SHORT = {"array": "array", "part": "sensor.part", "duration_s": "duration_s", "sample_rate_hz": "sample_rate_hz"}
"""Factors of `estimate_case` with a short name, and the key of the scenario file that they set."""

_OF_STUDY = {
    "effect": "effects",
    "d_prime": "size",
    "duration_s": "duration",
    "sample_rate_hz": "sample_rate",
    "bias_instability_mg": "bias_instability_mg",
    "tacho_noise_rad_s": "tacho_noise",
    "array": "array",
    "residue": "residue",
    "encoder_counts": "encoder_counts",
}
"""Factors of `diagnose_case`, and the fields of `sim.trials.study.cases.Case`."""


def estimate_case(case: Case) -> Mapping[str, float]:
    """Simulate a scenario, calibrate the unit if asked for, estimate its motion, and compare that with the truth.

    Factors: ``scenario``, ``method`` (of the angular rate), ``calibration`` (``none``; ``rest``: biases read at the
    first rest; ``poses``: a calibration from poses of the same chips), ``array``, ``part``, ``duration_s``,
    ``sample_rate_hz``, any key of the scenario file; ``EFFECT.KEY``, a parameter of an effect such as
    ``table_tilt.x_rad``; ``EFFECT.std_UNIT``, the standard deviation by which all its sizes are drawn, such as
    ``sensor_position.std_m``. Effects are there while poses are recorded, too.

    Returns
    -------
    dict
        Root mean square errors of α, ω (norms) and p, that of ω at the end, and the error of the position at the end.
    """
    from gfimu.motion.estimation import estimate
    from gfimu.motion.place import place_options
    from gfimu.motion.rest_bias import estimate_from_rest
    from gfimu.recording.timing.reference_times import reference_on_rows
    from sim.simulation import simulate

    scenario, method, calibration = _setting(case)
    recording, array = simulate(scenario, seed=case.seed), scenario.array
    readings = recording
    if calibration == "poses":
        unit = _calibrated(scenario, case.seed)
        readings, array = unit.apply(recording), unit.calibrated_array(array)
    readings = reference_on_rows(readings)
    solve = estimate_from_rest if calibration == "rest" else estimate
    found = solve(readings, array, method=method, with_position=True, **place_options(readings))
    alpha, omega = found.alpha - _truth(recording, "alpha", "rad_s2"), found.omega - _truth(recording, "omega", "rad_s")
    results = {
        "alpha_rms_rad_s2": _rms(alpha),
        "omega_rms_rad_s": _rms(omega),
        "omega_end_rad_s": float(np.linalg.norm(omega[-1])),
    }
    if found.position is not None:
        true = _truth(recording, "position", "m")
        results["position_end_m"] = float(np.linalg.norm(found.position[-1] - (true[-1] - true[0])))
    return results


def diagnose_case(case: Case) -> Mapping[str, Any]:
    """Hide an effect in a world of the study and diagnose the recording.

    Factors: ``effect`` (a name, or ``none``), ``d_prime``, ``duration_s``, ``sample_rate_hz``, ``bias_instability_mg``,
    ``tacho_noise_rad_s``, ``array``, ``residue``, ``encoder_counts``.

    Returns
    -------
    dict
        Verdict, names of the causes, whether exactly what is hidden was named, whether a wrong name was, and the share
        of excess removed.
    """
    from sim.trials.study.outcome import run_case
    from sim.trials.study.tally import brief

    outcome = run_case(_study_case(case))
    return {**brief(outcome), "share_of_excess_removed": outcome["share_of_excess_removed"]}


def measure_case(case: Case) -> Mapping[str, float]:
    """Measure a world and compare a linear solution with the truth (`sim.trials.campaign.worlds`)."""
    from sim.trials.campaign.worlds import measure_case as measure

    return measure(case)


KINDS: dict[str, Callable[[Case], Mapping[str, Any]]] = {
    "estimate": estimate_case,
    "diagnose": diagnose_case,
    "measure": measure_case,
    "drive": DriveWork(),
}
"""What a case does, by the plan's ``kind``."""


def check_factors(plan: PlanFile, first: Case, source: str) -> None:
    """Raise `InputError` where the kind or a factor is unknown, or the first case can't be set up.

    Warns of each other listed value with which no case can be set up: those cases will be rows with a failure.

    Parameters
    ----------
    plan : PlanFile
        The plan.
    first : Case
        Its first case.
    source : str
        Name of the plan, for the message.
    """
    if plan.kind not in KINDS:
        raise InputError(f"{source}: {unknown_name('kind', plan.kind, KINDS)}")
    try:
        check = _check_of(plan, first)
        check(first)
        for name, value in _listed(plan):
            error = _refusal(check, first, {name: value})
            # A value that does not go with the first values of the others may go with a second one.
            others = ((other, one) for other, one in _listed(plan) if other != name)
            if error and all(_refusal(check, first, {name: value, other: one}) for other, one in others):
                text = f"{source}: [factors]: every case with {name} = {value!r} will fail: {error}"
                warn(text)
    except InputError as error:
        raise InputError(f"{source}: [factors]: {error}") from None


def _check_of(plan: PlanFile, first: Case) -> Callable[[Case], object]:
    """Return what sets a case up without running it; refuses unknown factors."""
    if plan.kind == "diagnose":
        for name in plan.factors:
            check_name("factor of kind 'diagnose'", name, _OF_STUDY)
        return _study_case
    if plan.kind == "measure":
        from sim.trials.campaign.worlds import check_world_factors

        return partial(check_world_factors, plan)
    return DriveWork().check if plan.kind == "drive" else _setting


def _listed(plan: PlanFile) -> Iterator[tuple[str, Value]]:
    """Yield every listed value but the first of each factor, with its factor."""
    for name, factor in plan.factors.items():
        if isinstance(factor, list):
            yield from ((name, value) for value in factor[1:])


def _refusal(check: Callable[[Case], object], first: Case, changed: Mapping[str, Value]) -> InputError | None:
    try:
        check(replace(first, values={**first.values, **changed}))
    except InputError as error:
        return error
    return None


def _study_case(case: Case) -> StudyCase:
    """Return the hidden world of a case of `diagnose_case`."""
    from gfimu.array.array import AccelerometerArray
    from sim.effects import EFFECTS
    from sim.trials.study.cases import EXOTICS
    from sim.trials.study.cases import Case as StudyCase

    values: dict[str, Any] = {_OF_STUDY[name]: value for name, value in case.values.items()}
    hidden = values.pop("effects", "none")
    if hidden not in {"none", *EFFECTS, *EXOTICS}:
        raise unknown_name("effect", str(hidden), ("none", *EFFECTS, *EXOTICS))
    if "array" in values:
        AccelerometerArray.load(values["array"])
    values["effects"] = () if hidden == "none" else (hidden,)
    try:
        return msgspec.convert({"study": "campaign", "seed": case.seed, **values}, StudyCase)
    except msgspec.ValidationError as error:
        what, _, field = str(error).partition(" - at `$.")
        name = next((one for one, of_case in _OF_STUDY.items() if f"{of_case}`" == field), field)
        raise InputError(f"{name}: {what}") from None


def _setting(case: Case) -> tuple[Scenario, str, str]:
    """Return scenario, method and calibration of a case of `estimate_case`."""
    from gfimu.rate.registry import RATE_METHODS
    from sim.scenarios import Scenario
    from sim.trials.campaign.effects import drawn_effects, names_effect

    rest = {key: value for key, value in case.values.items() if not names_effect(key)}
    name, method = str(rest.pop("scenario", _SCENARIO)), str(rest.pop("method", "smoother"))
    calibration = str(rest.pop("calibration", "none"))
    check_name("method", method, RATE_METHODS)
    check_name("calibration", calibration, _CALIBRATIONS)
    changes = [f"{_SHORT.get(key, key)}={as_toml(value)}" for key, value in rest.items()]
    scenario = Scenario.load(name, changes=changes)
    rng = np.random.default_rng([case.seed, 1])  # apart from the world's own chance
    effects = drawn_effects(case.values, scenario.array, rng)
    return replace(scenario, effects=scenario.effects + effects), method, calibration


def _calibrated(scenario: Scenario, seed: int) -> Calibration:
    """Calibrate the chips of a scenario from poses: the same seed draws the same chips."""
    from gfimu.calibration.array_calibration import calibrate_array
    from sim.motions.pose_sequence import PoseSequence
    from sim.simulation import simulate

    sequence = PoseSequence()
    poses = simulate(replace(scenario, motion=sequence, duration=sequence.duration), seed=seed)
    return calibrate_array(poses, scenario.array, gravity=scenario.gravity)


def _truth(recording: Recording, quantity: str, unit: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return a vector of the true motion, (n, 3)."""
    return np.column_stack([recording.extra[f"truth_{quantity}_{axis}_{unit}"] for axis in "xyz"])


def _rms(errors: np.ndarray[Any, np.dtype[np.float64]]) -> float:
    """Return the root of the mean square of the norms of errors (n, 3), without samples that have none."""
    return float(np.sqrt(np.nanmean(np.sum(errors**2, axis=1))))
