"""Write the tables of docs/accuracy/measured.md: how often the diagnosis is right, and speeds, from stored outcomes.

Run ``python docs/scripts/make_measured_tables.py`` to write the page, with ``--measure`` to measure the speeds anew.
"""

# ruff: noqa: E402  (NumPy reads the number of threads when it is first imported)
from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")  # threads that wait would count as processor time

import argparse
import json
import platform
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import gfimu
from sim.trials.study.outcome_file import read_outcomes
from sim.trials.study.tally import Tally, visible

FOLDER = Path(__file__).resolve().parents[1] / "accuracy"
PAGE, SPEEDS, OUTCOMES = FOLDER / "measured.md", FOLDER / "speed.json", FOLDER / "diagnosis-study.jsonl.xz"
OWN, OTHER, PROGRAMMED = "sim.campaign", "tests/independent_world.py:hide", "tests/independent_profiles.py:hide"
NAME_GIVEN = "mujoco.sysid, told"  # its name in the stored outcomes
CASES = {
    ("singles", OWN): "one effect, d′ 15 to 6000",
    ("singles", OTHER): "the same in the independent simulator",
    ("other_settings", OTHER): "the same, other rates, lengths and noise",
    ("other_settings", PROGRAMMED): "the same, programmed motions",
    ("fresh_faint", OWN): "one effect, d′ 8 to 30",
    ("faint", OWN): "one effect, d′ 7 to 22",
    ("pairs", OWN): "two effects",
    ("triples", OWN): "three effects",
    ("residue", OWN): "one effect or none, beside a calibration's residue",
    ("nulls", OWN): "nothing",
    ("other_nulls", OTHER): "nothing, in the independent simulator",
    ("other_nulls", PROGRAMMED): "nothing, programmed motions",
    ("exotics", OTHER): "an effect that the library lacks",
}
"""What is hidden, by study and by the simulator that draws it; the order of the table."""


def with_tables(page: str) -> str:
    """Return the text of the page with the tables of the stored outcomes and speeds between their marks."""
    outcomes = read_outcomes(OUTCOMES)
    own = [outcome for outcome in outcomes if "method" not in outcome and visible(outcome)]
    parts = {
        "diagnosis": diagnosis_table(own),
        "other methods": baseline_table(outcomes),
        "speed": speed_table(json.loads(SPEEDS.read_text(encoding="utf-8"))),
        "time of a diagnosis": time_of_a_diagnosis(own),
    }
    for name, text in parts.items():
        start, stop = f"<!-- {name}: made by make_measured_tables.py -->", f"<!-- {name}: end -->"
        before, mark, after = page.partition(start)
        page = f"{before}{mark}\n{text}\n{stop}{after.partition(stop)[2]}"
    return page


def diagnosis_table(outcomes: list[Mapping[str, Any]]) -> str:
    """Return the table of right and wrong names by what was hidden."""
    rows = [
        "| hidden | runs | right alone | or in a set that the data can't separate | wrong name | `unknown` |",
        "|---|---|---|---|---|---|",
    ]
    for (study, source), words in CASES.items():
        tally = Tally([one for one in outcomes if one["study"] == study and one["source"] == source])
        right = ("–", "–") if study == "exotics" else (tally.share("exact"), tally.share("fair"))
        rows.append(
            f"| {words} | {len(tally)} | {' | '.join((*right, tally.share('wrong'), tally.share('unknown')))} |"
        )
    return "\n".join(rows)


def baseline_table(outcomes: list[Mapping[str, Any]]) -> str:
    """Return the table of other methods on the worlds that all of them were run on."""
    others = [one for one in outcomes if "method" in one]
    keys = {one["key"] for one in others}
    groups = {"gfimu": [one for one in outcomes if "method" not in one and one["source"] == OWN and one["key"] in keys]}
    for one in others:
        groups.setdefault(one["method"], []).append(one)
    rows = [
        "| method | runs | right alone | wrong name | 95 % intervals that hold the truth |",
        "|---|---|---|---|---|",
    ]
    for method, group in groups.items():
        tally = Tally(group)
        z = tally.z()
        covered = f"{np.mean(z < 1.96):.0%} of {len(z)}" if len(z) else "–"
        named = ("given", "–") if method == NAME_GIVEN else (tally.share("exact"), tally.share("wrong"))
        rows.append(f"| {method.removesuffix(', told')} | {len(tally)} | {' | '.join(named)} | {covered} |")
    return "\n".join(rows)


def speed_table(stored: Mapping[str, Any]) -> str:
    """Return the table of stored speeds, and what they were measured with."""
    head = f"Processor time of one core, least of three, {stored['machine']}:"
    return "\n".join(
        [head, "", "| job | speed |", "|---|---|", *(f"| {job} | {text} |" for job, text in stored["jobs"].items())]
    )


def time_of_a_diagnosis(outcomes: list[Mapping[str, Any]]) -> str:
    """Return the sentence on the processor time of the stored runs of the usual length and rate."""
    usual = [one for one in outcomes if one["duration"] == 40.0 and one["sample_rate"] == 100.0]
    seconds = Tally(usual).numbers("processor_s")
    return (
        f"A diagnosis of 40 s at 100 Hz took {np.median(seconds):.1f} s of processor time at the median of "
        f"{len(seconds)} stored runs, and {np.quantile(seconds, 0.9):.1f} s at the ninth decile."
    )


def measured_speeds(length_s: float = 300.0, repeats: int = 3) -> dict[str, str]:
    """Measure the speed of each job; ``length_s`` is that of the recording from which motion is estimated."""
    cube = gfimu.AccelerometerArray.load("cube12")
    run = gfimu.simulate("paper_run", seed=1)
    copies = max(1, round(length_s / run.t_s[-1]))
    t = np.arange(copies * len(run.t_s)) / 100.0
    long = gfimu.Recording.from_arrays(t, np.tile(run.readings, (copies, 1)), cube)
    poses = gfimu.simulate("calibration_poses", seed=1)
    white = np.random.default_rng(0).standard_normal(1_000_000)
    samples = len(t)

    def rate(method: str) -> Callable[[], object]:
        return lambda: gfimu.estimate(long, method=method, rest_bias=True, force=True)

    jobs: dict[str, tuple[Callable[[], object], float, str]] = {
        "simulate `paper_run`, 30 s × 12 channels": (lambda: gfimu.simulate("paper_run", seed=1), 0.0, ""),
        "`estimate --method integrate`": (rate("integrate"), samples, "samples"),
        "`estimate --method ml`": (rate("ml"), samples, "samples"),
        "`estimate --method filter`": (rate("filter"), samples, "samples"),
        "`estimate --method smoother`": (rate("smoother"), samples, "samples"),
        "calibrate an array from 18 poses": (lambda: gfimu.calibrate("array", poses), 0.0, ""),
        "score `cube12`": (lambda: gfimu.score(cube), 0.0, ""),
        "drift budget in closed form": (
            lambda: gfimu.drift_budget(cube, 30.0, gfimu.ErrorSources(bias=0.01, noise_density=3e-3)),
            0.0,
            "",
        ),
        "tolerance budget in closed form": (lambda: gfimu.tolerance("cube12", closed_form=True), 0.0, ""),
        "Allan deviation of 10⁶ samples": (lambda: gfimu.allan_deviation(white, 100.0), 0.0, ""),
    }
    return {job: _speed(*work, repeats) for job, work in jobs.items()}


def _speed(work: Callable[[], object], count: float, unit: str, repeats: int) -> str:
    work()  # compiles, and fills caches
    times = []
    for _ in range(repeats):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    least = min(times)
    return f"{_figures(count / least)} {unit} per second" if unit else f"{_figures(1e3 * least)} ms"


def _figures(value: float) -> str:
    return f"{float(f'{value:.2g}'):,.4g}" if value < 1000 else f"{float(f'{value:.2g}'):,.0f}"


def main() -> None:
    """Write the page; measure first if asked."""
    parser = argparse.ArgumentParser(description="Measured accuracy and speed.")
    parser.add_argument("--measure", action="store_true", help="measure the speeds anew")
    if parser.parse_args().measure:
        stored = {"machine": f"Python {platform.python_version()}, NumPy {np.__version__}", "jobs": measured_speeds()}
        SPEEDS.write_text(json.dumps(stored, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
