"""Lines of serial monitors and programs made plain: named cells (``ax:0.12``), brackets, checksums, host times."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Sequence

from gfimu.recording.units import bracketed_unit, kind_of

__all__ = ["plain_lines"]

_LOOKED_AT = 400  # lines
_DATE = r"(?:\d{4}-\d\d-\d\d[T _])?"
_HOST_TIME = re.compile(
    rf"^\s*\[?({_DATE}\d{{1,2}}:\d\d:\d\d[.,:]\d+)\]?(?:\s*(?:->|>|\]|\|)\s*| +(?=[+-]?[\d.]+ *[,;\t]))"
)
_REAL = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_LABEL = r"(?<![A-Za-z_])[A-Za-z_][\w .@#\[\]()/°²^-]{0,60}?"
_REALS = rf"({_REAL}(?:\s{{0,9}}[,;\s]\s{{0,9}}{_REAL}(?![\d:.]))*)(?![\d:])"
_MARKED = re.compile(
    rf"({_LABEL}|(?<!\w))\s{{0,9}}(?:(?:[:=]|->|\s[->|](?=\s))\s{{0,9}}[\[(]?|(?<=\W)[\[(])\s{{0,9}}{_REALS}"
)
_SPACED = re.compile(rf"({_LABEL})\s{{1,9}}{_REALS}")
_BRACKETED = re.compile(r"^\s*[\[({][^A-Za-z\"]*[\])}]\s*,?\s*$")
_VECTORS = re.compile(r"\d\t[^,\t]+,[^,\t]+,")
_CHECKED = re.compile(r"\*[0-9A-Fa-f]{2}\s*$")
_STAMP = re.compile(rf"({_DATE}\d{{1,2}}:\d\d:\d\d(?:[.,:]\d+)?)(?:,\d{{3}})*")
_PLOTTED = re.compile(r"^>([A-Za-z_][\w.]*):(\d+(?:\.\d+)?):([+-]?[\d.]+(?:[eE][+-]?\d+)?)")
_REMARK = re.compile(r"(?<=\d)\s*(?://|#)[^\"]*$")
_COLOURS = re.compile(r"\x1b\[[\d;]*m")
_TICK = re.compile(r"^\s*[IWEDV] \((\d+(?:\.\d+)?)\)|(\d+) ?[mun]?s(?=\W)")
_UNIT = re.compile(r"[A-Za-zµ°²%/^\d]{0,8}")
_SECONDS = re.compile(r"\[\s*(\d+\.\d+)\]")
_HOST, _VALUE = "host_time", "value"
_LONGEST_STAMP = 60  # numerical: characters before and with the time of a line
_LABVIEW, _END = "LabVIEW Measurement", "***End_of_Header***"
_LONGEST = 10_000  # characters of a line of a serial monitor
_LONGEST_LOG = 1000  # numerical: characters of a line of a log
_LEAST = 0.5  # of the filled lines
_LEAST_OFTEN = 0.5  # of the lines of the most frequent kind


def plain_lines(lines: Sequence[str]) -> list[str]:
    """Return the lines of a text file without brackets and checksums around them, with the time of the host as a cell.

    Named cells become a table with a header. Other lines stay as they are.
    """
    lines = _of_labview(lines) if lines and lines[0].startswith(_LABVIEW) else list(lines)
    return _without_labels(_with_host_time(_without_frames(lines)))


def _most(lines: Sequence[str], mark: re.Pattern[str]) -> bool:
    """Whether most of the first filled lines match."""
    looked = [line for line in lines[:_LOOKED_AT] if line.strip()]
    return sum(len(line) <= _LONGEST and mark.search(line) is not None for line in looked) > _LEAST * len(looked)


def _without_frames(lines: list[str]) -> list[str]:
    """Return lines as ``(0.1, 0.2, 9.8)`` and ``$IMU,0.1,0.2*5A`` without brackets and checksums."""
    lines = [_COLOURS.sub("", line) for line in lines] if any("\x1b" in line for line in lines[:_LOOKED_AT]) else lines
    if _most(lines, _REMARK):
        lines = [_REMARK.sub("", line) for line in lines]
    if _most(lines, _PLOTTED):
        return [_PLOTTED.sub(r"I (\2) \1:\3", line) for line in lines if _PLOTTED.match(line)]
    if _most(lines, _BRACKETED):
        return [re.sub(r"[\[\](){}]", "", line) if _BRACKETED.search(line) else line for line in lines]
    if _most(lines, _VECTORS):
        return [line.replace("\t", ",") for line in lines]
    if _most(lines, _CHECKED):
        return [_CHECKED.sub("", line) for line in lines]
    return lines


def _with_host_time(lines: list[str]) -> list[str]:
    """Return lines as ``10:25:14.000 -> 88,0.1,0.2`` with the time as the first cell."""
    if not _most(lines, _HOST_TIME):
        return lines
    plain = []
    for line in lines:
        found = _HOST_TIME.match(line)
        rest = line[found.end() :] if found else line
        if found is None or _MARKED.match(rest.strip()):
            plain.append(line)
            continue
        separator = next((mark for mark in "\t;," if mark in rest), " ")
        is_header = bool(re.match(r"[A-Za-z]", rest.split(separator)[0].strip()))
        plain.append(f"{_HOST if is_header else found[1]}{separator}{rest}")
    return plain


def _of_labview(lines: Sequence[str]) -> list[str]:
    """Return the names, units and rows of all segments of a LabVIEW measurement file; its rate as a comment."""
    fields = {cells[0]: cells[1:] for cells in (line.split("\t") for line in lines[:_LOOKED_AT])}
    rows: list[str] = []
    names = ""
    for segment in "\n".join(lines).split(_END)[2:]:
        names, *body = segment.split("\n")[1:] or [names]
        rows += itertools.takewhile(str.strip, body)
    names = names.removesuffix("\tComment")
    width = names.count("\t") + 1
    units = "\t".join(["s", *fields.get("Y_Unit_Label", [])[: width - 1]])
    step = re.fullmatch(r"\d{1,9}[.,]?\d{0,16}(E[+-]?\d\d?)?", fields.get("Delta_X", [""])[0])
    period = float(step[0].replace(",", ".")) if step else 0.0
    rate = [f"# sample rate {1.0 / period:.9g} Hz"] if period else []
    return [*rate, names, units, *("\t".join(line.split("\t")[:width]) for line in rows)] if rows else list(lines)


def _without_labels(lines: list[str]) -> list[str]:
    """Return log lines as ``t:88 ax:0.1`` as a header and lines of numbers; several kinds in turn make one row."""
    looked = [line for line in lines[:_LOOKED_AT] if line.strip()]
    kinds = Counter(tuple(cells) for line in looked if (cells := _cells(line)))
    often = max(kinds.values(), default=0)
    order = [names for names, count in kinds.items() if count >= _LEAST_OFTEN * often]
    if sum(kinds[names] for names in order) <= _LEAST * len(looked):
        return lines
    order = [names[names[0] == _HOST and place > 0 :] for place, names in enumerate(order)]
    header = [name for names in order for name in names]
    if len(header) < 3 or len(set(header)) < len(header):
        return lines
    rows: list[dict[str, str]] = []
    for line in lines:
        cells = _cells(line)
        if tuple(cells) not in order:
            cells.pop(_HOST, None)
        if tuple(cells) in order:
            if tuple(cells) == order[0] or not rows:
                rows.append({})
            rows[-1] |= cells
    before = [f"# {line}" for line in itertools.takewhile(lambda line: tuple(_cells(line)) not in order, lines)]
    named = [";".join(header)] if any(not name.startswith((_HOST, _VALUE)) for name in header) else []
    return [*before, *named, *(";".join(row.get(name, "") for name in header) for row in rows)]


def _cells(line: str) -> dict[str, str]:
    """Return the numbers of a log line by name, as ``acc X [g]``; none where not all of the line is so.

    A label with ``:``, ``=`` or a bracket after it has one number or a list. Where no label of the line has such a mark
    two labels, or a unit after the numbers, show that words are labels.
    """
    if len(line) > _LONGEST_LOG:
        return {}
    stamp, line = _stamp(line)
    found = list(_MARKED.finditer(line))
    is_marked = bool(found)
    found = found or list(_SPACED.finditer(line))
    if not found or (not stamp and re.search(r"\d", line[: found[0].start()])):
        return {}
    labels: list[str] = []
    units: list[str] = []
    for one, end in zip(found, [*(after.start() for after in found[1:]), len(line)], strict=True):
        label, unit = bracketed_unit(one[1].rpartition("] ")[2] if "[" not in one[1] else one[1])
        first, _, others = label.partition(" ")
        if labels and others and not units[-1] and kind_of(first):
            label, units[-1] = others, first
        after = line[one.end() : end].strip(" ,;|\t)]}>")
        if not _UNIT.fullmatch(after):
            return {}
        labels.append(label.strip(" .-[]()"))
        units.append(unit or after)
    if not is_marked and len(found) < 2 and not kind_of(units[-1]):
        return {}
    if len(found) <= 3 and not any(units[:-1]):
        units = units[-1:] * len(found)
    cells = {_HOST: stamp} if stamp else {}
    stem = ""
    for label, unit, one in zip(labels, units, found, strict=True):
        numbers = re.split(r"[\s,;]+", one[2])
        name = f"{stem} {label}" if stem and label.lower() in {"y", "z"} else label or _VALUE
        stem = name[:-1].strip() if name[-1:].lower() == "x" and len(name) > 1 else stem
        axes = {1: ("",), 3: (" X", " Y", " Z")}.get(
            len(numbers), tuple(f" {place}" for place in range(1, 1 + len(numbers)))
        )
        cells |= {
            f"{name}{axis} [{unit}]" if unit else f"{name}{axis}": number
            for axis, number in zip(axes, numbers, strict=True)
        }
    return cells


def _stamp(line: str) -> tuple[str, str]:
    """Split off the time in front of a line: a date or time of day, or ms since the start as an ESP32 prints them."""
    for mark in (_STAMP, _TICK, _SECONDS):
        found = mark.search(line[:_LONGEST_STAMP])
        if found and not _MARKED.search(line[: found.start()]):
            return next(filter(None, found.groups())), line[found.end() :]
    return "", line
