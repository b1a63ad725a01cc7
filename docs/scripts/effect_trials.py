"""Hide the example of each effect in a simulated recording, and write down what a diagnosis makes of it.

The recording is that of the command on the effect's page: ideal chips with the noise of the data sheet. A diagnosis
takes ten seconds to some minutes, so that the verdicts are stored and not part of the quick tests.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from effect_signatures import WARMING, WARMING_TIME, reference_run_of

from gfimu.base.errors import GfimuError
from gfimu.diagnosis.diagnose import diagnose
from sim.effects.base import Effect
from sim.scenarios import Scenario
from sim.simulation import simulate
from sim.twin import Twin

__all__ = ["changes_of", "run_of", "simulate_command", "trial", "twin_of"]

IDEAL = ("sensor.errors=false", "sensor.bandwidth=false")
SEED = 1


def changes_of(effect: type[Effect], example: Mapping[str, Any]) -> list[str]:
    """Return the ``--set`` options that hide an effect in its reference run."""
    parameters = ", ".join(f"{key} = {_toml(value)}" for key, value in example.items())
    warm = (f"temperature.final_degC={25.0 + WARMING}", f"temperature.time_constant_s={WARMING_TIME}")
    hidden = f'effect=[{{name = "{effect.name}", parameters = {{{parameters}}}}}]'
    return [*IDEAL, *(warm if effect.needs_temperature else ()), hidden]


def _toml(value: Any) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list):
        return "[" + ", ".join(_toml(one) for one in value) + "]"
    return str(value)


def simulate_command(effect: type[Effect], example: Mapping[str, Any]) -> str:
    """Return the command line that simulates a recording with an effect."""
    run = run_of(effect.name)
    options = [f"  --set '{one}'" if " " in one else f"  --set {one}" for one in changes_of(effect, example)]
    return " \\\n".join([f"gfimu simulate {run} --seed {SEED} --out hidden.parquet", *options])


def run_of(name: str) -> str:
    """Return the scenario to hide an effect in; a gyro is hidden in the hand, where all axes turn."""
    return "hand" if name.startswith("gyro_") else reference_run_of(name)


def twin_of(name: str) -> str:
    """Return the shipped twin that diagnoses the run of an effect; of a free body it is made from that of the table."""
    return {"linear_axis": "linear_axis", "pendulum": "pendulum"}.get(run_of(name), "cube12_turntable")


def trial(effect: type[Effect], example: Mapping[str, Any]) -> dict[str, Any]:
    """Return verdict, causes with their probability, and share of the excess removed of the hidden example.

    A recording that a diagnosis refuses has the verdict ``refused`` and its message.
    """
    twin = Twin.load(twin_of(effect.name))
    if run_of(effect.name) == "hand":
        twin = replace(twin, drive_source="gyro")
    try:
        recording = simulate(Scenario.load(run_of(effect.name), changes=changes_of(effect, example)), seed=SEED)
        found = diagnose([recording], twin)
    except GfimuError as error:
        return {"of": dict(example), "verdict": "refused", "message": str(error)}
    verdict = found.to_dict()
    causes = [
        {
            "effect": one["effect"],
            **{key: one[key] for key in ("place", "dependence", "name") if key in one},
            "probability": round(float(one["probability"]), 3),
            "not_distinguishable_from": list(one.get("not_distinguishable_from", [])),
        }
        for one in verdict["causes"]
    ]
    share = verdict.get("gain", {}).get("share_of_excess_removed")
    return {
        "of": dict(example),
        "verdict": verdict["verdict"],
        "causes": causes,
        "share": None if share is None or math.isnan(share) else round(float(share), 3),
    }
