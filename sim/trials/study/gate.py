"""The gate: cases of all studies that one core runs in half an hour, to compare an engine with the one before.

The list stands in ``gate.txt``. `choose_gate` chose it once, from the times in
``docs/accuracy/diagnosis-study.jsonl.xz``. It stays as it is, so that comparisons of different days are of the same
cases.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sim.trials.study.cases import STUDIES, Case, find_case
from sim.trials.study.tally import LEAST_VISIBLE

__all__ = ["GATE", "STRATA", "Stratum", "choose_gate", "gate_cases"]

GATE = "gate"
"""Name of the list on the command line."""
LONGEST = 8.0
"""Processor time of a case, s, above which it is not chosen: three quarters of all cases take less."""
_LIST = Path(__file__).with_name("gate.txt")
_OTHER = "sim/trials/benchmark/generators/independent_world.py:hide"
_PROGRAMMED = "sim/trials/benchmark/generators/independent_profiles.py:hide"


@dataclass(frozen=True)
class Stratum:
    """Cases of a study and a generator of which the first few by seed are taken.

    Parameters
    ----------
    study : str
        Name of the study.
    count : int
        How many are taken of each group.
    source : str
        Generator of the worlds, as in `sim.trials.study.outcome.draw_world`.
    by : tuple of str
        Fields of a case that make groups: every value of them has its share.
    """

    study: str
    count: int
    source: str = ""
    by: tuple[str, ...] = ()


STRATA = (
    # A sized effect has ten cases, two of each size: the first two in reach of each size class would be 260.
    Stratum("singles", 1, by=("effects", "class")),
    Stratum("singles", 20, _OTHER),
    Stratum("fresh_singles", 8),
    Stratum("fresh_faint", 10),
    Stratum("faint", 6),
    Stratum("coarse_steps", 3),
    Stratum("coarse_steps", 3, _OTHER),
    Stratum("other_settings", 12, _OTHER),
    Stratum("other_settings", 12, _PROGRAMMED),
    Stratum("other_pairs", 12, _OTHER),
    Stratum("other_nulls", 10, _OTHER),
    Stratum("other_nulls", 10, _PROGRAMMED),
    Stratum("nulls", 10, by=("bias_instability_mg",)),
    Stratum("pairs", 20),
    Stratum("triples", 12),
    Stratum("residue", 3, by=("size",)),
    Stratum("short_runs", 4),
    Stratum("slow_samples", 4),
    Stratum("corners8", 4),
    Stratum("three_plus_one", 4),
    Stratum("noisy_tacho", 4),
    Stratum("encoders", 5),
    Stratum("coarse_encoders", 4),
    Stratum("left_out", 5, by=("size",)),
    Stratum("exotics", 2, _OTHER, by=("effects",)),
    Stratum("free_body", 16),
)


def gate_cases(first: int | None = None) -> list[tuple[Case, str]]:
    """Return the cases of the gate with their generators, in a fixed shuffled order.

    Raises
    ------
    InputError
        If a line of the list is no case of a study.
    """
    lines = [line.partition(" ") for line in _LIST.read_text(encoding="utf-8").splitlines()]
    chosen = [(find_case(key), source) for key, _, source in lines]
    order = np.random.default_rng(len(chosen)).permutation(len(chosen))
    return [chosen[place] for place in order[:first]]


def choose_gate(outcomes: Iterable[Mapping[str, Any]]) -> list[str]:
    """Choose the gate: of every stratum the first cases by seed that took no longer than `LONGEST`.

    What was reported plays no part, only the time it took and whether the draw can be seen at all. Cases of a study
    that no outcome has are taken by seed.

    Returns
    -------
    list of str
        ``STUDY/SEED SOURCE`` of each.
    """
    known: dict[tuple[str, str], Mapping[str, Any]] = {}
    for outcome in outcomes:
        if not outcome.get("method"):
            source = "" if outcome["source"] == "sim.campaign" else outcome["source"]
            known[outcome["key"], source] = outcome
    studied = {(key.partition("/")[0], source) for key, source in known}
    lines = []
    for stratum in STRATA:
        cases = sorted(STUDIES[stratum.study](), key=lambda case: case.seed)
        if (stratum.study, stratum.source) in studied:
            cases = [case for case in cases if _is_quick(known.get((case.key, stratum.source)))]
        for group in _groups(cases, stratum.by):
            lines += [f"{case.key} {stratum.source}".strip() for case in group[: stratum.count]]
    return list(dict.fromkeys(lines))


def _is_quick(outcome: Mapping[str, Any] | None) -> bool:
    if outcome is None:
        return False
    reached = outcome.get("reached")
    return outcome["processor_s"] <= LONGEST and (reached is None or reached >= LEAST_VISIBLE)


def _groups(cases: Sequence[Case], by: Sequence[str]) -> list[list[Case]]:
    groups: dict[tuple[Any, ...], list[Case]] = defaultdict(list)
    for case in cases:
        groups[tuple(_property(case, name) for name in by)].append(case)
    return list(groups.values())


def _property(case: Case, name: str) -> Any:
    """Return a field of a case; ``class`` is its size as small (d′ to 100), middling or gross (1000 and more)."""
    if name != "class":
        return getattr(case, name)
    return int(np.searchsorted([100.0, 1000.0], case.size, side="right"))
