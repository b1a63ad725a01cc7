"""Rules, what breaks them, and where."""

from __future__ import annotations

import enum
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated

from gfimu.base.declared import Declared, figure

__all__ = ["Finding", "Ledger", "Place", "Rule", "Severity"]

_PLACES_PER_RULE = 50  # enough to mend by; a loop that breaks a rule does so at one place


class Severity(enum.Enum):
    """Whether the chip fails for certain, or may."""

    FAULT = "fault"
    WARNING = "warning"


@dataclass(frozen=True)
class Rule:
    """One rule.

    Parameters
    ----------
    name : str
        Name, words joined by underscores.
    remedy : str
        What to do about it.
    source : str
        Document and chapter.
    severity : Severity
        Whether breaking it fails on the chip, or may.
    """

    name: str
    remedy: str
    source: str
    severity: Severity = Severity.FAULT


@dataclass(frozen=True)
class Place:
    """Where the program stands.

    Parameters
    ----------
    pc : int
        Address of the instruction.
    exception : int
        Exception that is handled; 0 in the main program.
    time_s : float
        Virtual time, s.
    """

    pc: int
    exception: int
    time_s: float


@dataclass(frozen=True)
class Finding(Declared):
    """A rule that was broken at one place of the program."""

    rule: Annotated[str, figure("Name of the rule.")]
    severity: Annotated[str, figure("fault or warning.")]
    what: Annotated[str, figure("What happened, the first time.")]
    pc: Annotated[int, figure("Address of the instruction.")]
    symbol: Annotated[str, figure("Function and offset, where the image has symbols.")]
    exception: Annotated[int, figure("Exception that was handled; 0 in the main program.")]
    time_s: Annotated[float, figure("Virtual time of the first time.", "s")]
    count: Annotated[int, figure("How often at this place.")]
    remedy: Annotated[str, figure("What to do.")]
    source: Annotated[str, figure("Document that says so.")]


@dataclass
class _Entry:
    """What is written down about a rule at one place."""

    what: str
    place: Place
    count: int = 1


@dataclass
class Ledger:
    """Keeps findings, one per rule and place of the program.

    Parameters
    ----------
    symbol_at : callable
        Name of an address.
    here : callable
        Where the program stands now.
    hopeless : bool
        Whether nothing more can come of the run.
    """

    symbol_at: Callable[[int], str]
    here: Callable[[], Place]
    hopeless: bool = False
    _entries: dict[Rule, dict[int, _Entry]] = field(default_factory=dict)

    def add(self, rule: Rule, what: str, place: Place | None = None) -> None:
        """Note that a rule was broken, here or at another place of the program."""
        place = place or self.here()
        places = self._entries.setdefault(rule, {})
        entry = places.get(place.pc)
        if entry is not None:
            entry.count += 1
        elif len(places) < _PLACES_PER_RULE:
            places[place.pc] = _Entry(what, place)

    def findings(self) -> tuple[Finding, ...]:
        """Return the findings so far: faults first, then in the order of their times."""
        found = [
            Finding(
                rule.name, rule.severity.value, entry.what, entry.place.pc, self.symbol_at(entry.place.pc),
                entry.place.exception, entry.place.time_s, entry.count, rule.remedy, rule.source,
            )
            for rule, places in self._entries.items()
            for entry in places.values()
        ]  # fmt: skip
        return tuple(sorted(found, key=lambda finding: (finding.severity, finding.time_s)))
