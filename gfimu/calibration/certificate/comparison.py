"""Comparison of two certificates of one instrument by E_n.

E_n = (x₁ − x₂) / √(U₁² + U₂²) with the expanded uncertainties of both; |E_n| ≤ 1 is satisfactory (ISO 13528, ISO/IEC
17043; the form from secondary sources, see docs/how_to/certificate.md).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from gfimu.base.errors import InputError, UnitError
from gfimu.calibration.certificate.certificate import Certificate, ChipCertificate, Comparison, ComparisonRow, Term

__all__ = ["compare"]

_OWN_FRAMES = {"x_axis", "z_axis", "array"}
"""Frames that the sensing axes define (of an array, with its drawing); others depend on the mounting."""


def compare(first: Certificate, second: Certificate, *, other: str) -> Comparison:
    """Compare the intrinsic parameters of the chips, and the terms of the model where both have the same frame.

    Parameters
    ----------
    first, second : Certificate
        Of one instrument, in one unit.
    other : str
        Name of the second, for the result and for messages.

    Raises
    ------
    InputError
        If the instruments or the chips differ, or no quantity has an uncertainty in both.
    UnitError
        If the units of the readings differ.
    """
    if first.unit != second.unit:
        raise UnitError(f"{other}: is in {second.unit}, not in {first.unit}; compare certificates in one unit")
    theirs = {chip.chip: chip for chip in second.chips}
    shared = [(chip, theirs[chip.chip]) for chip in first.chips if chip.chip in theirs]
    if first.item and second.item and first.item != second.item:
        raise InputError(
            f"{other}: is of {second.item!r}, not of {first.item!r}; compare certificates of one instrument"
        )
    if not shared or len(shared) < max(len(first.chips), len(second.chips)):
        raise InputError(
            f"{other}: is of {', '.join(theirs)}, not of {', '.join(chip.chip for chip in first.chips)}; "
            "compare certificates of the same chips"
        )
    rows = tuple(row for pair in shared for row in _rows(*pair))
    if not rows:
        raise InputError(f"{other}: has no quantity in common with an uncertainty in both; calibrate again")
    return Comparison(other, rows, tuple(_left_out(shared)))


def _rows(ours: ChipCertificate, theirs: ChipCertificate) -> Iterator[ComparisonRow]:
    groups = [(ours.intrinsic, theirs.intrinsic)]
    if _same_frame(ours, theirs):
        groups.append((ours.terms, theirs.terms))
    for mine, others in groups:
        by_name = {(term.name, term.unit): term for term in others}
        for term in mine:
            other = by_name.get((term.name, term.unit))
            if other is not None:
                yield from _row(term, other)


def _row(ours: Term, theirs: Term) -> Iterator[ComparisonRow]:
    """Yield the comparison of a quantity, unless one of the two has no value or no uncertainty."""
    x1, u1, x2, u2 = ours.value, ours.expanded, theirs.value, theirs.expanded
    if x1 is not None and u1 is not None and x2 is not None and u2 is not None and u1 + u2 > 0.0:
        yield ComparisonRow(ours.name, ours.unit, x1, u1, x2, u2, (x1 - x2) / math.hypot(u1, u2))


def _same_frame(ours: ChipCertificate, theirs: ChipCertificate) -> bool:
    """Whether the terms of the model have the same reference axes in both."""
    return ours.frame == theirs.frame and ours.frame in _OWN_FRAMES


def _left_out(pairs: Iterable[tuple[ChipCertificate, ChipCertificate]]) -> Iterator[str]:
    """Say of which chips the terms of the model are not compared, and why."""
    chips: dict[tuple[str, str], list[str]] = {}
    for ours, theirs in pairs:
        if not _same_frame(ours, theirs):
            chips.setdefault((ours.frame, theirs.frame), []).append(ours.chip)
    for (frame, other), names in chips.items():
        reason = f"the reference axes ({frame}, {other}) depend on the mounting"
        yield f"terms of the model of {', '.join(names)}: {reason}"
