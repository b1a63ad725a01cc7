"""Run ``python -m sim.study run STUDY --out FILE.jsonl``, then ``python -m sim.study report FILE.jsonl --out DIR``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import Any

from gfimu.errors import GfimuError, InputError
from sim.study.baselines import METHODS
from sim.study.cases import STUDIES, study_cases
from sim.study.report import summarise, write_report
from sim.study.runner import open_executor, read_outcomes, run_study


def _print_outcome(outcome: dict[str, Any]) -> None:
    causes = " + ".join(cause["effect"] for cause in outcome["causes"])
    hidden = " + ".join(outcome["effects"]) or "nothing"
    sys.stdout.write(
        f"{outcome['key']:24s} {hidden:32s} d'={outcome['size']:<6.0f} "
        f"{outcome['verdict']:14s} {causes or outcome.get('error', '')} ({outcome['processor_s']:.1f} s)\n"
    )
    sys.stdout.flush()


def _run(options: argparse.Namespace) -> None:
    with open_executor(options.workers, options.cluster) as executor:
        for study in options.studies:
            cases = study_cases(study, options.first)
            run_study(cases, options.out, executor, source=options.world, method=options.method, tell=_print_outcome)


def _report(options: argparse.Namespace) -> None:
    latest: dict[tuple[str, str, str], dict[str, Any]] = {}
    for file in options.outcomes:
        found = read_outcomes(file)
        if not found:
            raise InputError(f"{file}: no outcomes; give a file that `python -m sim.study run` wrote")
        for outcome in found:
            latest[outcome["key"], outcome["source"], outcome.get("method", "")] = outcome
    outcomes = list(latest.values())
    if options.out:
        for path in write_report(outcomes, options.out):
            sys.stdout.write(f"{path}\n")
    else:
        sys.stdout.write(summarise(outcomes))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run or report a study; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m sim.study", description=__doc__)
    commands = parser.add_subparsers(required=True)
    run = commands.add_parser("run", help="diagnose the hidden worlds of studies")
    run.add_argument("studies", nargs="+", metavar="STUDY", choices=STUDIES, help=", ".join(STUDIES))
    run.add_argument("--out", required=True, help="file of outcomes (JSON lines); a run that was cut off is resumed")
    run.add_argument("--first", type=int, help="only so many cases of each study")
    run.add_argument("--workers", type=int, default=2)
    run.add_argument("--cluster", default="", help="address of a Dask scheduler")
    run.add_argument("--world", default="", help="FILE.py:FUNCTION of another generator of worlds")
    run.add_argument("--method", default="", choices=["", *METHODS], help="a simpler method instead of the diagnosis")
    run.set_defaults(work=_run)
    report = commands.add_parser("report", help="tables and figures from outcomes")
    report.add_argument("outcomes", nargs="+", help="files of outcomes; what a later one has again replaces an earlier")
    report.add_argument(
        "--out",
        help="folder for diagnosis-study.md, figures/ and the outcomes (diagnosis-study.jsonl.xz); "
        "without it a summary is printed",
    )
    report.set_defaults(work=_report)
    options = parser.parse_args(arguments)
    try:
        options.work(options)
    except GfimuError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
