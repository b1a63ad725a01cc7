"""Run the studies: tests marked ``study``, too long for the usual suite, and store what came out of them.

    python -m tests.studies                 every list
    python -m tests.studies hidden rate     two lists
    python -m tests.studies --list          the lists, and what came out of each last

A list is a room of tests (`tests/gfimu/rate` is ``rate``, the pages are ``docs``). What belongs to it is marked at the
test itself. The last outcome of each list stands in ``tests/studies/outcome.toml``: date, commit, cases, minutes,
failures, and the figures that tests record.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import tomllib
import xml.etree.ElementTree as ET
from collections import defaultdict
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import tomli_w

TESTS = Path(__file__).resolve().parents[1]
OUTCOME = Path(__file__).with_name("outcome.toml")
_HEAD = "# The last outcome of each list of studies, written by `python -m tests.studies`.\n\n"


def list_of(file: Path) -> str:
    """Return the list to which the studies of a test file belong."""
    rooms = file.relative_to(TESTS).parts[:-1]
    return "docs" if not rooms else rooms[1] if rooms[0] == "gfimu" else rooms[0]


def study_lists() -> dict[str, list[Path]]:
    """Return the test files with studies in them by the name of their list."""
    lists = defaultdict(list)
    for file in sorted(TESTS.rglob("test_*.py")):
        if file.parent != OUTCOME.parent and "mark.study" in file.read_text(encoding="utf-8"):
            lists[list_of(file)].append(file)
    return dict(sorted(lists.items()))


def run_list(files: Sequence[Path], workers: int) -> dict[str, Any]:
    """Run the studies of some test files and return their outcome."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        options = ["-m", "study", "-n", str(workers), f"--junitxml={report}"]
        command = [sys.executable, "-m", "pytest", *options, *map(str, files)]
        subprocess.run(command, cwd=TESTS.parent, check=False)
        if not report.exists():
            return {"failed": [f"{' '.join(command)} ended without a report"]}
        return read_report(report.read_text(encoding="utf-8"))


def read_report(text: str) -> dict[str, Any]:
    """Return the outcome in a report of pytest (JUnit XML)."""
    cases = list(ET.fromstring(text).iter("testcase"))
    failed = [_name(case) for case in cases if case.find("failure") is not None or case.find("error") is not None]
    skipped = [_name(case) for case in cases if case.find("skipped") is not None]
    figures = {
        _name(case): {one.attrib["name"]: one.attrib["value"] for one in case.iter("property")}
        for case in cases
        if case.find(".//property") is not None
    }
    minutes = round(sum(float(case.attrib["time"]) for case in cases) / 60.0, 1)
    return {"cases": len(cases), "minutes": minutes, "failed": failed, "skipped": skipped, "figures": figures}


def _name(case: ET.Element) -> str:
    return f"{case.attrib['classname'].removeprefix('tests.')}.{case.attrib['name']}"


def stored() -> dict[str, Any]:
    """Return the stored outcomes by list."""
    return tomllib.loads(OUTCOME.read_text(encoding="utf-8")) if OUTCOME.exists() else {}


def store(name: str, outcome: Mapping[str, Any]) -> None:
    """Store the outcome of a list, with today's date and the commit."""
    command = ["git", "describe", "--always", "--dirty"]
    commit = subprocess.run(command, cwd=TESTS, capture_output=True, text=True, check=False).stdout.strip()
    dated = {"date": datetime.now(UTC).date(), "commit": commit, **outcome}
    OUTCOME.write_text(_HEAD + tomli_w.dumps(dict(sorted({**stored(), name: dated}.items()))), encoding="utf-8")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the lists that are asked for; return 1 where a study failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.studies", description="Run the long lists of tests.")
    lists = study_lists()
    parser.add_argument("names", nargs="*", metavar="LIST", help=f"{', '.join(lists)}; all of them by default")
    parser.add_argument("--list", action="store_true", help="print the lists and their last outcome")
    parser.add_argument("--workers", type=int, default=2, help="test processes")
    options = parser.parse_args(arguments)
    if unknown := sorted(set(options.names) - set(lists)):
        parser.error(f"no list {', '.join(unknown)}; the lists are {', '.join(lists)}")
    if options.list:
        for name, files in lists.items():
            sys.stdout.write(f"{name:16s} {len(files):3d} files   {_said(stored().get(name))}\n")
        return 0
    chosen = options.names or list(lists)
    for name in chosen:
        store(name, run_list(lists[name], options.workers))
        sys.stdout.write(f"{name}: {_said(stored()[name])}\n")
    return int(any(stored()[name]["failed"] for name in chosen))


def _said(outcome: Mapping[str, Any] | None) -> str:
    if outcome is None:
        return "never run"
    return f"{outcome['date']}: {outcome.get('cases', 0)} cases, {len(outcome['failed'])} failed"


if __name__ == "__main__":
    raise SystemExit(main())
