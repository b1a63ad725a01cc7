"""Run ``python -m sim.trials.study run STUDY --out RUN``, then ``report RUN --out DIR`` or ``compare RUN``.

``run gate --out RUN`` and ``compare RUN`` compare an engine with the one of the study page, list by list.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from gfimu.base.errors import GfimuError, InputError
from sim.trials.study.baselines import METHODS
from sim.trials.study.cases import STUDIES
from sim.trials.study.compare import compare, load_outcomes
from sim.trials.study.gate import GATE, choose_gate
from sim.trials.study.outcome_file import outcome_of_row, read_outcomes
from sim.trials.study.plan import study_plan, study_work
from sim.trials.study.report import summarise, write_report
from sim.trials.sweep.dataset import Dataset
from sim.trials.sweep.engine import run_campaign
from sim.trials.sweep.executors import open_workers

STORED = "docs/accuracy/diagnosis-study.jsonl.xz"
"""Outcomes of the study page, seen from the project's root."""


class _PrintedDataset(Dataset):
    """A dataset whose outcomes are printed as they come."""

    def write(self, batch: range, rows: Sequence[Mapping[str, Any]]) -> None:
        """Write the rows of a batch and print them."""
        super().write(batch, rows)
        for outcome in map(outcome_of_row, rows):
            causes = " + ".join(cause["effect"] for cause in outcome["causes"])
            hidden = " + ".join(outcome["effects"]) or "nothing"
            sys.stdout.write(
                f"{outcome['key']:24s} {hidden:32s} d'={outcome['size']:<6.0f} "
                f"{outcome['verdict']:14s} {causes or outcome.get('error', '')} ({outcome['processor_s']:.1f} s)\n"
            )
        sys.stdout.flush()


def _run(options: argparse.Namespace) -> int:
    plan = study_plan(
        options.studies, first=options.first, source=options.world, method=options.method, blame=options.blame
    )
    run_campaign(
        _PrintedDataset.create(options.out, plan),
        study_work,
        partial(open_workers, options.workers, options.cluster),
    )
    return 0


def _count(text: str) -> int:
    count = int(text)
    if count < 1:
        raise ValueError
    return count


def _compare(options: argparse.Namespace) -> int:
    old, new = options.files if len(options.files) == 2 else (STORED, options.files[0])
    found = compare(load_outcomes(old), load_outcomes(new))
    sys.stdout.write(f"{old} -> {new}\n\n{found.text}")
    return 1 if found.left else 0


def _choose_gate(options: argparse.Namespace) -> int:
    sys.stdout.write("".join(f"{line}\n" for line in choose_gate(read_outcomes(options.outcomes))))
    return 0


def _report(options: argparse.Namespace) -> int:
    latest: dict[tuple[str, str, str], dict[str, Any]] = {}
    for file in options.outcomes:
        found = read_outcomes(file)
        if not found:
            raise InputError(f"{file}: no outcomes; give a folder that `python -m sim.trials.study run` wrote")
        for outcome in found:
            latest[outcome["key"], outcome["source"], outcome.get("method", "")] = outcome
    outcomes = list(latest.values())
    if options.out:
        for path in write_report(outcomes, options.out):
            sys.stdout.write(f"{path}\n")
    else:
        sys.stdout.write(summarise(outcomes))
    return 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run or report a study; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m sim.trials.study", description=__doc__)
    commands = parser.add_subparsers(required=True)
    run = commands.add_parser("run", help="diagnose the hidden worlds of studies")
    run.add_argument("studies", nargs="+", metavar="STUDY", choices=[*STUDIES, GATE], help=", ".join([*STUDIES, GATE]))
    run.add_argument("--out", required=True, help="folder of the run; one that was cut off is resumed")
    run.add_argument("--first", type=_count, help="only so many cases of each study")
    run.add_argument("--workers", type=_count, default=2)
    run.add_argument("--cluster", default="", help="address of a Dask scheduler")
    run.add_argument("--world", default="", help="FILE.py:FUNCTION of another generator of worlds")
    run.add_argument("--method", default="", choices=["", *METHODS], help="a simpler method instead of the diagnosis")
    run.add_argument("--blame", action="store_true", help="fit each miss from the truth: search or evidence")
    run.set_defaults(work=_run)
    comparison = commands.add_parser(
        "compare", help="two runs, list by list; exit code 1 where a list leaves its interval"
    )
    comparison.add_argument(
        "files", nargs="+", metavar="[OLD] NEW", help=f"folders of runs, or files; OLD is {STORED} by default"
    )
    comparison.set_defaults(work=_compare)
    choice = commands.add_parser("choose-gate", help="print the list of the gate, chosen by the time that cases took")
    choice.add_argument("outcomes", nargs="?", default=STORED, help=f"folder of a run, or file; {STORED} by default")
    choice.set_defaults(work=_choose_gate)
    report = commands.add_parser("report", help="tables and figures from outcomes")
    report.add_argument(
        "outcomes", nargs="+", help="folders of runs, or files; what a later one has again replaces an earlier"
    )
    report.add_argument(
        "--out",
        help="folder for diagnosis-study.md, figures/ and the outcomes (diagnosis-study.jsonl.xz); "
        "without it a summary is printed",
    )
    report.set_defaults(work=_report)
    options = parser.parse_args(arguments)
    if options.work is _compare and len(options.files) > 2:
        parser.error("compare takes one file or two: [OLD] NEW")
    try:
        return int(options.work(options))
    except GfimuError as error:
        sys.stderr.write(f"{error}\n")
        return 2


if __name__ == "__main__":
    raise SystemExit(main())
