"""The pins of the hidden cases, and the check that compares an outcome with its pin.

They stand in ``hidden_cases.toml``, and are written again, for a review as a diff, by

    python tests/gfimu/diagnosis/hidden_pins.py [--workers 2] [--check] [PART OF A NAME ...]

What a right answer is follows from what is hidden; a case that is answered otherwise is a known miss and needs a reason
there.
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from hidden_cases import HiddenCase, hidden_cases

from sim.study.outcome import run_case
from sim.study.tally import score, visible
from sim.sweep.executors import open_workers

PINS = Path(__file__).with_name("hidden_cases.toml")

WITHIN = 3.0
"""Standard deviations within which the parameters of a rightly named cause must lie."""
LEAST_REMOVED = 0.95
"""Share of the excess error on held-out data that a right extension removes, of effects of d′ 300 and more."""
_GROSS = 300.0
_SHARE_KEPT = 0.05  # by which a documented share may change with the machine


def reported(outcome: Mapping[str, Any]) -> str:
    """Return verdict and names of an outcome as text."""
    names = sorted({cause["effect"] for cause in outcome["causes"]})
    link = " or " if outcome["verdict"] == "ambiguous" else " + "
    return f"{outcome['verdict']}: {link.join(names)}" if names else str(outcome["verdict"])


def far_off(outcome: Mapping[str, Any]) -> list[str]:
    """Return the parameters of rightly named causes that lie beyond three standard deviations."""
    return sorted(
        f"{cause['effect']}.{key}"
        for cause in outcome["causes"]
        if cause["effect"] in outcome["effects"]
        for key, z in cause["z"].items()
        if abs(z) >= WITHIN
    )


def little_removed(outcome: Mapping[str, Any]) -> float | None:
    """Return the share of the excess removed, to two digits, where it is less than a right extension removes.

    That of large effects under their right name, and of the description of what is not in the library.
    """
    removed = removed_share(outcome)
    named = score(outcome)["exact"] and outcome["size"] >= _GROSS
    judged = bool(outcome["effects"]) and (named or outcome["verdict"] == "unknown")
    return round(removed, 2) if judged and removed is not None and removed < LEAST_REMOVED else None


def removed_share(outcome: Mapping[str, Any]) -> float | None:
    """Return the share of the excess error that was removed on held-out data; None where there was no excess."""
    removed = outcome.get("share_of_excess_removed")
    return None if removed is None or not np.isfinite(removed) else float(removed)


@dataclass(frozen=True)
class Pins:
    """What is pinned by case: reports, misses with a reason each, estimates far off, and shares of little gain."""

    reports: Mapping[str, str]
    misses: Mapping[str, Mapping[str, str]]
    far_off: Mapping[str, Sequence[str]]
    little_removed: Mapping[str, float]

    @classmethod
    def load(cls) -> Pins:
        """Read the pins."""
        table = tomllib.loads(PINS.read_text(encoding="utf-8")) if PINS.exists() else {}
        return cls(*(table.get(name, {}) for name in ("right", "known_misses", "beyond_three_sigma", "little_removed")))

    def of(self, name: str) -> str:
        """Return what is reported of a case."""
        return self.misses[name]["reported"] if name in self.misses else self.reports[name]


def problems(hidden: HiddenCase, outcome: Mapping[str, Any], pins: Pins) -> list[str]:
    """Compare an outcome with its pin; returns what is otherwise, empty where it is as pinned."""
    told, pinned = reported(outcome), pins.of(hidden.name)
    found = []
    if told != pinned:
        found.append(f"reported {told!r}, pinned {pinned!r} {outcome.get('error', '')}".rstrip())
    if hidden.is_right(outcome) == (hidden.name in pins.misses):
        found.append("right, but pinned as a known miss" if hidden.name in pins.misses else "not right")
    beyond, documented = far_off(outcome), list(pins.far_off.get(hidden.name, []))
    if score(outcome)["exact"] and beyond != documented:
        found.append(f"beyond {WITHIN:g} standard deviations: {beyond}, documented {documented}")
    removed, little = removed_share(outcome), little_removed(outcome)
    if removed is not None and removed > 1.0:
        found.append(f"share of the excess removed {removed} > 1")
    # A residue of the calibration is no cause, but learnt and removed.
    if not hidden.case.effects and not hidden.case.residue and removed is not None:
        found.append(f"share of the excess removed {removed} where nothing is hidden")
    pinned_little = pins.little_removed.get(hidden.name)
    if little is not None and (pinned_little is None or abs(little - pinned_little) > _SHARE_KEPT):
        found.append(f"share of the excess removed {little}, documented {pinned_little}")
    if little is None and pinned_little is not None:
        found.append(f"share of the excess removed {removed}, documented {pinned_little}")
    if score(outcome)["exact"] and outcome["effects"] and outcome["unexplained"]:
        found.append(f"something unexplained beside the right name: {outcome['signature']}")
    named = [cause["effect"] for cause in outcome["causes"]]
    if len(named) > len(set(named)):
        found.append(f"a cause is listed twice: {named}")
    return found


_HEAD = """\
# What the diagnosis reports of every hidden case of hidden_cases.py: written by hidden_pins.py, reviewed as a diff.
# A name has the group, what is hidden, its size d', the generator of the world and the seed.
"""
_REMARKS = {
    "right": "The hidden names, alone or in a set that the data can't part; nothing; unknown outside the library.",
    "known_misses": "Answered otherwise than it should be. An improvement fails the test too: write the pins again.",
    "beyond_three_sigma": "Parameters of a right cause that lie more than three standard deviations off.",
    "little_removed": "Share of the held-out excess that a right name or an unknown's description removes, if small.",
}


def _line(key: str, value: str) -> str:
    return f'"{key}" = {value}\n'


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def write_pins(outcomes: Mapping[str, Mapping[str, Any]], old: Pins) -> str:
    """Return the text of the pins from outcomes by name; reasons are kept, and pins of cases that were not run."""
    right, misses = dict(old.reports), dict(old.misses)
    far, little = dict(old.far_off), dict(old.little_removed)
    for hidden in hidden_cases():
        if hidden.name not in outcomes:
            continue
        for table in (right, misses, far, little):
            table.pop(hidden.name, None)
        outcome = outcomes[hidden.name]
        if hidden.is_right(outcome):
            right[hidden.name] = reported(outcome)
        else:
            why = old.misses.get(hidden.name, {}).get("why", "")
            misses[hidden.name] = {"reported": reported(outcome), "why": why}
        if score(outcome)["exact"] and far_off(outcome):
            far[hidden.name] = far_off(outcome)
        if little_removed(outcome) is not None:
            little[hidden.name] = little_removed(outcome)
    tables = {
        "right": {name: _quoted(told) for name, told in right.items()},
        "known_misses": {
            name: f"{{ reported = {_quoted(miss['reported'])}, why = {_quoted(miss['why'])} }}"
            for name, miss in misses.items()
        },
        "beyond_three_sigma": {name: f"[{', '.join(map(_quoted, keys))}]" for name, keys in far.items()},
        "little_removed": {name: f"{share:g}" for name, share in little.items()},
    }
    text = _HEAD
    for title, table in tables.items():
        text += f"\n# {_REMARKS[title]}\n[{title}]\n"
        text += "".join(_line(hidden.name, table[hidden.name]) for hidden in hidden_cases() if hidden.name in table)
    return text


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the cases and write their pins; returns the exit code."""
    parser = argparse.ArgumentParser(description="Run the hidden cases and write what is reported into their pins.")
    parser.add_argument("parts", nargs="*", metavar="PART", help="only cases whose name contains one of these")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--check", action="store_true", help="only tell what is otherwise than pinned, write nothing")
    options = parser.parse_args(arguments)
    wanted = [
        hidden for hidden in hidden_cases() if not options.parts or any(part in hidden.name for part in options.parts)
    ]
    if not wanted:
        sys.stderr.write(f"no case has {' or '.join(options.parts)} in its name; see {PINS}\n")
        return 2
    old, outcomes, otherwise = Pins.load(), {}, 0
    with open_workers(options.workers) as opened:
        futures = {hidden.name: opened.executor.submit(run_case, hidden.case, hidden.source) for hidden in wanted}
        for hidden in wanted:
            outcome = outcomes[hidden.name] = futures[hidden.name].result()
            known = hidden.name in old.reports or hidden.name in old.misses
            differs = problems(hidden, outcome, old) if known else ["new"]
            otherwise += bool(differs)
            seen = "" if visible(outcome) else f" (d' {outcome['reached']:.1f}: not to be seen)"
            sys.stdout.write(
                f"{'*' if differs else ' '} {hidden.name:60s} {reported(outcome)}{seen} "
                f"removed {removed_share(outcome)} ({outcome['processor_s']:.1f} s) {'; '.join(differs)}\n"
            )
            sys.stdout.flush()
    if options.check:
        return 1 if otherwise else 0
    PINS.write_text(write_pins(outcomes, old), encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
