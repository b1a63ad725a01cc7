"""The truth of the release: one line per world with its draw, the hash of its recording, what is hidden, and ties.

`gfimu-bench-1.jsonl.xz` beside this file was written once by ``python -m sim.trials.benchmark.truth_file``. It fixes
the release: the judge reads the truth here, and the hashes show whether a world that is drawn again is the same one.
"""

from __future__ import annotations

import argparse
import functools
import hashlib
import json
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gfimu.base.errors import InputError
from gfimu.base.files.atomic_file import write_text
from gfimu.recording import Recording
from sim.json_lines import read_lines, six_digits, write_lines
from sim.trials.benchmark.answer import answer_schema
from sim.trials.benchmark.drawing import draw
from sim.trials.benchmark.release import MEASURED, SETS, SPLITS, TRUTH_FILE, Case, cases, find_case
from sim.trials.benchmark.ties import free_distance_and_ties
from sim.trials.benchmark.world import Task, Truth

__all__ = ["SCHEMA_FILE", "Fixed", "digest_of", "fixed_world", "task_of", "truths", "write_tasks"]

SCHEMA_FILE = "answer.schema.json"
"""The file beside the worlds that are written, which describes an answer."""

LEAST_VISIBLE = 7.0
"""d′ with the drive unknown below which what is hidden counts as not to be seen: such a draw is replaced."""

_TACHO_STEP, _KELVIN_STEP = 1e-6, 1e-6  # rad/s and K to which a recording is rounded before it is hashed
_READING_STEP = 1e-6  # m/s²
_MOST_DRAWS = 50


@dataclass(frozen=True)
class Fixed:
    """What the release says of one world.

    Parameters
    ----------
    case : Case
        The case.
    attempt : int
        Which of its draws.
    digest : str
        Hash of the recording (`digest_of`).
    truth : Truth
        What is hidden.
    """

    case: Case
    attempt: int
    digest: str
    truth: Truth


def digest_of(recording: Recording) -> str:
    """Return the hash of a recording: times, channels, tachometer and temperature rounded to 1e-6 of their units."""
    parts = (
        (recording.t_s, _TACHO_STEP),
        (recording.readings, _READING_STEP),
        (recording.reference["tacho_rad_s"], _TACHO_STEP),
        (recording.reference["temperature_degC"], _KELVIN_STEP),
    )
    found = hashlib.sha256()
    for values, step in parts:
        found.update(np.rint(np.nan_to_num(values, nan=-1e6) / step).astype("<i8").tobytes())
    return found.hexdigest()[:16]


@functools.cache
def truths() -> Mapping[str, Fixed]:
    """Return what the release says of its worlds, by name."""
    lines = read_lines(TRUTH_FILE, "reinstall gfimu")
    return {entry["world"]: _read(entry) for entry in map(json.loads, lines)}


def fixed_world(world: str) -> Fixed:
    """Return what the release says of a world; raises `InputError` where it has none of that name."""
    if world not in truths():
        find_case(world)  # names what is wrong
        raise InputError(f"{TRUTH_FILE.name} has no world {world!r}; write it again")
    return truths()[world]


def task_of(world: str) -> Task:
    """Draw a world of the release and return what a method is given; raises `InputError` for an unknown name."""
    fixed = fixed_world(world)
    return draw(fixed.case, fixed.attempt).task


def write_tasks(
    worlds: Sequence[str], out: str | Path, file_type: str, progress: Callable[[int, int], None] | None = None
) -> list[Path]:
    """Write what a method is given of worlds as plain files, a folder each, and the schema of answers.

    Parameters
    ----------
    worlds : sequence of str
        Their names.
    out : str or Path
        Folder to write.
    file_type : str
        ``parquet`` or ``csv``.
    progress : callable, optional
        Called with the number of worlds that are done and of all.

    Returns
    -------
    list of Path
        The folders of the worlds.
    """
    folders = [Path(out) / world for world in worlds]
    for number, (world, folder) in enumerate(zip(worlds, folders, strict=True), start=1):
        task = task_of(world)
        folder.mkdir(parents=True, exist_ok=True)
        task.recording.write(folder / f"recording.{file_type}")
        write_text(folder / "twin.toml", task.twin.to_toml())
        if progress is not None:
            progress(number, len(worlds))
    Path(out).mkdir(exist_ok=True)
    write_text(Path(out) / SCHEMA_FILE, json.dumps(answer_schema(), indent=2) + "\n")
    return folders


def make(case: Case) -> dict[str, Any]:
    """Draw a case until what is hidden can be seen, and return its line."""
    for attempt in range(_MOST_DRAWS):
        world = draw(case, attempt)
        truth = world.truth
        if case.set_name == "unlisted":
            seen = truth.distance
        else:
            seen, ties = free_distance_and_ties(world, case.tacho_noise, LEAST_VISIBLE)
            truth = replace(truth, distance_drive_unknown=seen, ties=ties)
        if not seen < LEAST_VISIBLE:  # NaN: without a noise-free form
            break
    return {
        "world": case.world,
        "attempt": attempt,
        "digest": digest_of(world.task.recording),
        "hidden": [{"effect": name, "parameters": parameters} for name, parameters in truth.hidden],
        "allowed": list(truth.allowed),
        "ties": {name: list(rivals) for name, rivals in truth.ties.items()},
        "place": truth.place,
        "right": list(truth.right),
        "near": list(truth.near),
        "distance": _short(truth.distance),
        "distance_drive_unknown": _short(truth.distance_drive_unknown),
    }


def _short(value: float) -> float | None:
    return None if math.isnan(value) else six_digits(value)


def _read(entry: Mapping[str, Any]) -> Fixed:
    truth = Truth(
        tuple((one["effect"], one["parameters"]) for one in entry["hidden"]),
        tuple(entry["allowed"]),
        {name: tuple(rivals) for name, rivals in entry["ties"].items()},
        entry["place"],
        tuple(entry["right"]),
        tuple(entry["near"]),
        math.nan if entry["distance"] is None else entry["distance"],
        math.nan if entry["distance_drive_unknown"] is None else entry["distance_drive_unknown"],
    )
    return Fixed(find_case(entry["world"]), entry["attempt"], entry["digest"], truth)


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw all worlds of the release and write their truth; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m sim.trials.benchmark.truth_file", description=main.__doc__)
    parser.add_argument("--out", type=Path, default=TRUTH_FILE)
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args(arguments)
    listed = [case for split in reversed(SPLITS) for name in SETS for case in cases(name, split)]
    listed = [case for case in listed if case.generator != MEASURED]
    with ProcessPoolExecutor(options.workers) as pool:
        lines = []
        for entry in pool.map(make, listed):
            lines.append(json.dumps(entry))
            sys.stdout.write(f"{entry['world']} draw {entry['attempt']} ties {entry['ties']}\n")
            sys.stdout.flush()
    write_lines(options.out, lines)
    return 0


if __name__ == "__main__":
    sys.exit(main())
