"""How the diagnosis does in worlds that it has never met: runs the foreign list and prints its table.

    python tests/foreign_study.py --out foreign --workers 2        (every third case; --all for the whole list)

Of each case a second recording of the same world, on another profile, is predicted from its reference alone by the
given and by the extended simulation. A run that was cut off is resumed.
"""

import argparse
import json
import random
from collections import Counter, defaultdict
from functools import partial
from pathlib import Path

import foreign_world
import msgspec
import numpy as np

from gfimu import GfimuError
from gfimu.base import STANDARD_GRAVITY
from gfimu.diagnosis import PreparedRuns, diagnose, predicted_by_reference
from gfimu.recording import Recording
from sim.trials import Dataset, draw_world
from sim.trials.benchmark.generators.foreign_effects import FOREIGN
from sim.trials.benchmark.unlisted import GOES_WITH, SAME_PLACE, quantities_of
from sim.trials.study.outcome import outcome_of, processor_time
from sim.trials.sweep.engine import run_campaign
from sim.trials.sweep.executors import open_workers
from sim.trials.sweep.plan import PlanFile
from sim.trials.sweep.summary import failures

WORSE = 1.02  # of the prediction error of a new recording, from which a twin predicts worse

# Names that are right for what is hidden; the place of what has no name is right too.
RIGHT = {
    "bearing_friction": set(),
    "tacho_low_pass": {"tacho_lag"},
    "tacho_gate": {"tacho_lag", "tacho_latency"},  # a mean of the last gate is half a gate late
    "chip_lag": {"chip_lag"},
    "late_chip": {"chip_delay", "channel_skew"},
}


def judged(outcome):
    """Return what an outcome is: right, placed (goes with something else), near, unknown, nothing, wrong or error."""
    name, verdict = outcome["effects"][0], outcome["verdict"]
    named = {cause["effect"] for cause in outcome["causes"]}
    right, located = RIGHT.get(name), outcome.get("located", [])
    if verdict == "nothing_found":
        return "right" if right == set() else "nothing"
    if verdict == "error" or not (named or located):
        return verdict
    there = all(SAME_PLACE.get(one["place"], one["place"]) == FOREIGN[name].place for one in located)
    goes = any(quantities_of(one["dependence"]) & set(GOES_WITH.get(name, ())) for one in located)
    if there and named <= (right or set()):
        return "right" if goes or not located else "placed"
    if there and named <= {*FOREIGN[name].kin, *(right or ())}:
        return "near"
    return "wrong"


def prediction_error(model, recording):
    """Return the rms error, m/s², of a prediction of the channels from the reference alone."""
    run = PreparedRuns.build([recording], model, ["new"], predicted_by_reference).runs[0]
    missed = np.where(run.valid, run.readings - predicted_by_reference(model, run), np.nan)
    return float(np.sqrt(np.nanmean(missed**2)))


def recorded_again(generator, case, array):
    """Return another recording of the world of a case."""
    again = foreign_world.new_recording(
        case.seed,
        case.effects,
        case.size,
        generator=getattr(foreign_world, generator),
        duration=case.duration,
        sample_rate=case.sample_rate,
        bias_instability_m_s2=case.bias_instability_mg * STANDARD_GRAVITY / 1000.0,
        tacho_noise_rad_s=case.tacho_noise,
    )
    columns = {name: np.asarray(values) for name, values in again.columns.items()}
    readings = np.column_stack([columns.pop(f"{channel}_m_s2") for channel in array.channels])
    return Recording.from_arrays(columns.pop("t_s"), readings, array, reference=columns)


def run_world(case):
    """Run a case of the campaign: ``world`` is its generator and key."""
    generator, key = case.values["world"].split()
    job = next(job for job in jobs(every=True) if job[0] == generator and job[1].key == key)
    outcome = run_case(job)
    return {"judged": judged(outcome), "outcome": msgspec.json.encode(outcome, enc_hook=np.generic.item).decode()}


def run_case(job):
    """Draw, diagnose and predict one case; a refusal is an outcome, too."""
    generator, case = job
    outcome = {"generator": generator, "key": case.key, **case.to_dict(), "causes": [], "processor_s": 0.0}
    try:
        world = draw_world(case, f"{foreign_world.__file__}:{generator}")
        start = processor_time()
        found = diagnose([world.recording], world.twin)
        outcome |= {"reached": world.reached, "processor_s": processor_time() - start}
        outcome |= outcome_of(found, world.truth)
        new = recorded_again(generator, case, world.twin.array)
        outcome["new_nominal"] = prediction_error(world.twin, new)
        outcome["new_extended"] = prediction_error(found.twin, new)
    except GfimuError as error:
        outcome |= {"verdict": "error", "error": str(error)}
    return outcome


def jobs(*, every):
    """Return the cases in a shuffled order: of each effect one profile by each generator, or all."""
    chosen = [
        (generator, case)
        for shift, (generator, cases) in enumerate(foreign_world.CASES.items())
        for number, case in enumerate(cases)
        if every or (number // 3 + shift) % 3 == number % 3
    ]
    random.Random(1).shuffle(chosen)
    return chosen


def table(outcomes):
    """Return the table of outcomes: by effect, then all together."""
    rows = ["| hidden | place | said | new recording, rms error before → after, m/s² |", "|---|---|---|---|"]
    by_effect = defaultdict(list)
    for outcome in outcomes:
        by_effect[outcome["effects"][0]].append(outcome)
    for name, mine in sorted(by_effect.items(), key=lambda pair: (FOREIGN[pair[0]].place, pair[0])):
        said = Counter(_said(one) for one in mine)
        new = "; ".join(f"{one['new_nominal']:.4f} → {one['new_extended']:.4f}" for one in mine if "new_nominal" in one)
        words = "; ".join(text + (f" × {count}" if count > 1 else "") for text, count in said.items())
        rows.append(f"| `{name}` | {FOREIGN[name].place} | {words} | {new} |")
    counts = Counter(judged(one) for one in outcomes)
    worse = sum(one["new_extended"] > WORSE * one["new_nominal"] for one in outcomes if "new_nominal" in one)
    total = ", ".join(f"{kind} {count}" for kind, count in counts.most_common())
    return "\n".join([*rows, "", f"{len(outcomes)} recordings: {total}; a new one predicted worse: {worse}."])


def _said(outcome):
    names = [f"{cause['effect']} ({cause['probability']:.2f})" for cause in outcome["causes"]]
    names = " + ".join([*names, *(f"{one['place']}: {one['dependence']}" for one in outcome.get("located", []))])
    return f"{judged(outcome)}: {names or outcome['verdict']}"


def main():
    parser = argparse.ArgumentParser(description="Diagnose worlds with foreign effects and print the table.")
    parser.add_argument("--out", type=Path, required=True, help="folder of the run")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--all", action="store_true", help="all three profiles of each effect")
    options = parser.parse_args()
    worlds = [f"{generator} {case.key}" for generator, case in jobs(every=options.all)]
    plan = PlanFile({"world": worlds}, kind="foreign", batch=1)
    dataset = Dataset.create(options.out, plan)
    run_campaign(
        dataset, run_world, partial(open_workers, options.workers), progress=lambda *counts: print(*counts, flush=True)
    )
    rows = dataset.table()
    print(table([json.loads(row["outcome"]) for row in rows.to_pylist() if not row["failure"]]))
    for reason, count in failures(rows).items():
        print(f"{count} failed: {reason}")


if __name__ == "__main__":
    main()
