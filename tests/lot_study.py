"""How the diagnosis does outside its library: runs the worlds of `lot_worlds` and prints its table.

python tests/lot_study.py --out lot --workers 2 --half second
"""

import argparse
import json
from functools import partial
from pathlib import Path

import lot_worlds
import msgspec
import numpy as np

from gfimu import GfimuError
from gfimu.diagnosis import diagnose
from sim.trials import Dataset, draw_world
from sim.trials.benchmark.unlisted import PLACES_OF_LISTED, SAME_PLACE, quantities_of
from sim.trials.study.outcome import outcome_of, processor_time
from sim.trials.sweep.engine import run_campaign
from sim.trials.sweep.executors import open_workers
from sim.trials.sweep.plan import PlanFile

SURE = 0.9  # probability of a name that is stated as good as certain
JOBS = {case.key: (generator, case) for generator, cases in lot_worlds.CASES.items() for case in cases}


def judged(outcome):
    """Return whether the place, and what the error goes with, are right, and whether a sure name is wrong."""
    number = int(outcome["effects"][0].removeprefix("lot_"))
    lot, place = lot_worlds.LOTS[number], lot_worlds.PLACE.get(lot_worlds.LOTS[number].place, "chip")
    named = [one for one in outcome["causes"] if one["effect"] != "unlisted"]
    located = outcome.get("located", [])
    places = {SAME_PLACE.get(one["place"], one["place"]) for one in located}
    wrong = [one for one in named if place not in PLACES_OF_LISTED.get(one["effect"], (place,))]
    there = bool(places or named) and places <= {place} and not wrong
    same = {"t", "T"} if lot.quantity in {"t", "T"} else {lot.quantity}  # it warms with time
    goes = any(quantities_of(one["dependence"]) & same for one in located)
    return {
        "place": there,
        "goes": there and (goes or not located),
        "wrong": any(one["probability"] >= SURE for one in wrong),
        "named": "+".join(f"{one['effect']} {one['probability']:.2f}" for one in named),
        "said": "; ".join(f"{one['place']} {one['dependence']}" for one in located) or outcome["verdict"],
    }


def run_world(case):
    """Run a case of the campaign: ``world`` is its key."""
    generator, drawn = JOBS[case.values["world"]]
    outcome = {"generator": generator, **drawn.to_dict(), "causes": [], "processor_s": 0.0, "verdict": "error"}
    try:
        world = draw_world(drawn, f"{lot_worlds.__file__}:{generator}")
        start = processor_time()
        found = diagnose([world.recording], world.twin)
        outcome |= {"processor_s": processor_time() - start, "reached": world.reached, **outcome_of(found, world.truth)}
    except GfimuError as error:
        outcome |= {"error": str(error)}
    return {"outcome": msgspec.json.encode(outcome, enc_hook=np.generic.item).decode()}


def table(outcomes):
    """Return a row for each world and the shares."""
    rows = ["| hidden | d′ | said | names | place | goes with |", "|---|---|---|---|---|---|"]
    found = [(one, judged(one)) for one in sorted(outcomes, key=lambda one: one["effects"][0])]
    for one, mine in found:
        lot = lot_worlds.LOTS[int(one["effects"][0].removeprefix("lot_"))]
        hidden = f"{lot.place} by {lot.quantity}, {lot.pattern}"
        marks = " | ".join("yes" if mine[key] else "no" for key in ("place", "goes"))
        rows.append(f"| {hidden} | {one['size']:.0f} | {mine['said']} | {mine['named']} | {marks} |")
    shares = ", ".join(
        f"{text} {100 * np.mean([mine[key] for _, mine in found]):.0f} %"
        for key, text in (
            ("place", "place right"),
            ("goes", "place and dependence right"),
            ("wrong", "a sure wrong name"),
        )
    )
    seconds = np.median([one["processor_s"] for one in outcomes])
    return "\n".join([*rows, "", f"{len(found)} worlds: {shares}; {seconds:.0f} s of processor time, median."])


def main():
    parser = argparse.ArgumentParser(description="Diagnose worlds outside the library, drawn by lot.")
    parser.add_argument("--out", type=Path, required=True, help="folder of the run")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--half", choices=("first", "second"), default="second", help="which of the two draws")
    options = parser.parse_args()
    second = options.half == "second"
    worlds = [key for key, (_, case) in JOBS.items() if (case.seed >= 700_000 + lot_worlds.HALF) is second]
    dataset = Dataset.create(options.out, PlanFile({"world": worlds}, kind="lot", batch=1))
    run_campaign(
        dataset, run_world, partial(open_workers, options.workers), progress=lambda *counts: print(*counts, flush=True)
    )
    print(table([json.loads(row["outcome"]) for row in dataset.table().to_pylist() if not row["failure"]]))


if __name__ == "__main__":
    main()
