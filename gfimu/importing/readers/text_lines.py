"""Lines of serial monitors made plain: a name in each cell (``ax:0.12``), samples over several lines, host times."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

__all__ = ["plain_lines"]

_LOOKED_AT = 400  # lines
_HOST_TIME = re.compile(r"\s*\[?(\d{1,2}:\d\d:\d\d[.,:]\d+)\]?\s*(?:->|>|\]|\|)\s*")
_LABELLED = re.compile(r"([A-Za-z_][\w .\[\]()/°²^-]*?)\s*[:=]\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?![\d:])")
_UNIT = re.compile(r"\s*([A-Za-zµ°²%/^\d]{0,8})\s*$")
_LEAST = 0.5  # of the filled lines
_LEAST_OFTEN = 0.5  # of the lines of the most frequent kind


def plain_lines(lines: Sequence[str]) -> list[str]:
    """Return the lines of a text file with host times as a cell of their own, and named cells as a table with a header.

    Other lines stay as they are.
    """
    return _without_labels(_with_host_time(list(lines)))


def _with_host_time(lines: list[str]) -> list[str]:
    """Return lines as ``10:25:14.000 -> 88,0.1,0.2`` with the time as the first cell."""
    looked = [line for line in lines[:_LOOKED_AT] if line.strip()]
    if sum(_HOST_TIME.match(line) is not None for line in looked) <= _LEAST * len(looked):
        return lines
    plain = []
    for line in lines:
        found = _HOST_TIME.match(line)
        if found is None:
            plain.append(line)
            continue
        rest = line[found.end() :]
        separator = next((mark for mark in "\t;," if mark in rest), " ")
        first = rest.split(separator)[0].strip()
        is_header = bool(re.match(r"[A-Za-z]", first)) and not re.search(r"[:=]", first)
        stamp = "host_time" if is_header else found[1]
        labelled = _LABELLED.match(rest.strip()) is not None
        plain.append(f"host_time:{_seconds(stamp)}{separator}{rest}" if labelled else f"{stamp}{separator}{rest}")
    return plain


def _seconds(stamp: str) -> float:
    """Return a time of day in seconds, for lines whose cells are numbers with names."""
    hours, minutes, rest = re.split(r":", stamp, maxsplit=2)
    return 3600.0 * int(hours) + 60.0 * int(minutes) + float(re.sub(r"[,:]", ".", rest))


def _without_labels(lines: list[str]) -> list[str]:
    """Return lines as ``t:88 ax:0.1`` as a header and lines of numbers; several kinds of lines in turn make one row."""
    looked = [line for line in lines[:_LOOKED_AT] if line.strip()]
    kinds = Counter(labels for line in looked if (labels := _labels(line)))
    if not kinds or sum(kinds.values()) <= _LEAST * len(looked):
        return lines
    often = max(kinds.values())
    order = [labels for labels in kinds if kinds[labels] >= _LEAST_OFTEN * often]
    if sum(len(labels) for labels in order) < 3:
        return lines
    names = [name for labels in order for name in labels]
    if len(set(names)) < len(names):
        return lines
    rows: list[dict[str, str]] = []
    for line in lines:
        labels = _labels(line)
        if labels not in order:
            continue
        if labels == order[0] or not rows:
            rows.append({})
        rows[-1] |= dict(zip(labels, (number for _, number in _LABELLED.findall(line)), strict=True))
    return [";".join(names), *(";".join(row.get(name, "") for name in names) for row in rows)]


def _labels(line: str) -> tuple[str, ...]:
    """Return the names of the numbers of a line, with the unit at its end; empty where not all of it is so."""
    found = list(_LABELLED.finditer(line))
    if not found:
        return ()
    between = _LABELLED.sub("", line[: found[-1].end()])
    unit = _UNIT.fullmatch(line[found[-1].end() :].strip(" ,;|\t}"))
    if re.search(r"\w", between) or unit is None:
        return ()
    names: list[str] = []
    stem = ""
    for one in found:
        name = one[1].strip()
        if name.lower() in {"x", "y", "z"} and stem and name.lower() != "x":
            name = f"{stem} {name}"
        stem = name[:-1].strip() if name[-1:].lower() == "x" and len(name) > 1 else stem
        names.append(name)
    return tuple(f"{name} [{unit[1]}]" if unit[1] and len(found) <= 3 else name for name in names)
