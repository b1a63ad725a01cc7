"""Write the tables of docs/accuracy/benchmark.md from the judged answers in docs/accuracy/benchmark.jsonl.xz."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from make_cli_reference import escape

from sim.trials.benchmark.judged import Judged
from sim.trials.benchmark.judged_file import read_judged
from sim.trials.benchmark.release import SETS, cases, release_hash
from sim.trials.benchmark.table import markdown, summaries

FOLDER = Path(__file__).resolve().parents[1] / "accuracy"
PAGE, JUDGED = FOLDER / "benchmark.md", FOLDER / "benchmark.jsonl.xz"
OWN = "gfimu"
TABLE = re.compile(r"(?P<begin><!-- table: (?P<name>[\w ]+) -->\n).*?(?P<end><!-- end -->)", re.DOTALL)


def with_tables(page: str) -> str:
    """Return the text of the page with the tables of the stored judgements between their marks."""
    judged = read_judged(JUDGED)
    parts = {
        "sets": sets_table(judged),
        "methods": markdown(summaries(judged)),
        "wrong names": wrong_names(judged),
    }
    return TABLE.sub(lambda found: f"{found['begin']}\n{parts[found['name']]}\n{found['end']}", page)


def sets_table(judged: Sequence[Judged]) -> str:
    """Return the sets, the worlds of their test split, and how many of them gfimu was run on."""
    rows = ["| set | worlds | licence | in the split | judged |", "| --- | --- | --- | --- | --- |"]
    for info in SETS.values():
        count = sum(one.set_name == info.name and one.method == OWN for one in judged)
        listed = len(cases(info.name, "test"))
        rows.append(f"| {info.name} | {escape(info.about)} | {info.licence} | {listed} | {count} |")
    return "\n".join(rows) + f"\n\nHash of the release: `{release_hash()}`.\n"


def wrong_names(judged: Sequence[Judged]) -> str:
    """Return every wrong name and false alarm of gfimu's own method."""
    rows = ["| world | hidden | answer |", "| --- | --- | --- |"]
    rows += [
        f"| {one.world} | {_names(one.hidden)} | {_names(one.said)} |"
        for one in judged
        if one.method == OWN and one.outcome in {"wrong", "false_alarm"}
    ]
    return "\n".join(rows if len(rows) > 2 else ["None."]) + "\n"


def _names(names: Sequence[str]) -> str:
    return " + ".join(f"`{name.replace('|', '` or `')}`" for name in names) or "nothing"


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
