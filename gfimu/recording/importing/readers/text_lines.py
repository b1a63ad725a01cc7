"""Lines of serial monitors and programs made plain: named cells (``ax:0.12``), brackets, checksums, host times."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Sequence

__all__ = ["plain_lines"]

_LOOKED_AT = 400  # lines
_DATE = r"(?:\d{4}-\d\d-\d\d[T _])?"
_HOST_TIME = re.compile(
    rf"^\s*\[?({_DATE}\d{{1,2}}:\d\d:\d\d[.,:]\d+)\]?(?:\s*(?:->|>|\]|\|)\s*| +(?=[+-]?[\d.]+ *[,;\t]))"
)
_REAL = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_LABELLED = re.compile(rf"((?<![A-Za-z_])[A-Za-z_][\w .\[\]()/°²^-]{{0,60}}?)\s*[:=]\s*({_REAL})(?![\d:])")
_BRACKETED = re.compile(r"^\s*[\[({][^A-Za-z\"]*[\])}]\s*,?\s*$")
_CHECKED = re.compile(r"\*[0-9A-Fa-f]{2}\s*$")
_STAMP = re.compile(rf"{_DATE}\d{{1,2}}:\d\d:\d\d(?:[.,:]\d+)?")
_PLOTTED = re.compile(r"^>([A-Za-z_][\w.]*):(\d+(?:\.\d+)?):([+-]?[\d.]+(?:[eE][+-]?\d+)?)")
_REMARK = re.compile(r"(?<=\d)\s*(?://|#)[^\"]*$")
_COLOURS = re.compile(r"\x1b\[[\d;]*m")
_TICK = re.compile(r"^\s*[IWEDV] \((\d+)\)")
_UNIT = re.compile(r"\s*([A-Za-zµ°²%/^\d]{0,8})\s*$")
_PREFIXED = re.compile(
    r"^(?=.{0,1000}$)(.{0,200}(?:(?<!\w)([A-Za-z]\w*)|[\])])\s*(?::|->|-|>|\|)\s*)"
    rf"({_REAL}(?:[\s,;]+{_REAL})+)[\s,;]*$"
)
_SECONDS = re.compile(r"\[\s*(\d+\.\d+)\]")
_HOST = "host_time"
_LABVIEW, _END = "LabVIEW Measurement", "***End_of_Header***"
_LONGEST = 10_000  # characters of a line of a serial monitor
_LEAST = 0.5  # of the filled lines
_MOST_LABELS = 8  # words before the numbers of a log: sensors
_LEAST_OFTEN = 0.5  # of the lines of the most frequent kind


def plain_lines(lines: Sequence[str]) -> list[str]:
    """Return the lines of a text file without brackets and checksums around them, with the time of the host as a cell.

    Named cells become a table with a header. Other lines stay as they are.
    """
    lines = _of_labview(lines) if lines and lines[0].startswith(_LABVIEW) else list(lines)
    return _without_labels(_without_prefixes(_with_host_time(_without_frames(lines))))


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
        first = next(found[1] for line in lines if (found := _PLOTTED.match(line)))
        return [
            f"time:{one[2]},{one[1]}:{one[3]}" if one[1] == first else f"{one[1]}:{one[3]}"
            for one in map(_PLOTTED.match, lines)
            if one
        ]
    if _most(lines, _BRACKETED):
        return [re.sub(r"[\[\](){}]", "", line) if _BRACKETED.search(line) else line for line in lines]
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
        if found is None or _LABELLED.match(rest.strip()):
            plain.append(line)
            continue
        separator = next((mark for mark in "\t;," if mark in rest), " ")
        is_header = bool(re.match(r"[A-Za-z]", rest.split(separator)[0].strip()))
        plain.append(f"{_HOST if is_header else found[1]}{separator}{rest}")
    return plain


def _without_prefixes(lines: list[str]) -> list[str]:
    """Return lines as ``[INFO] [12.345]: 0.1, 0.2`` without what a log puts before, with its time as the first cell.

    Lines that begin with different words, as ``acc: 0.1 0.2 9.8``, have three named cells each.
    """
    if not _most(lines, _PREFIXED):
        return lines
    found = {k: one for k, line in enumerate(lines) if len(line) <= _LONGEST and (one := _PREFIXED.match(line))}
    several = 1 < len({one[2] for one in found.values()}) <= _MOST_LABELS
    plain = list(lines)
    for place, one in found.items():
        stamp, cells = _stamp(one[1]), re.split(r"[\s,;]+", one[3])
        if several and len(cells) == 3:
            cells = [f"{one[2]} {axis}: {cell}" for axis, cell in zip("XYZ", cells, strict=True)]
        plain[place] = ";".join([stamp, *cells] if stamp else cells)
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
    """Return lines as ``t:88 ax:0.1`` as a header and lines of numbers; several kinds of lines in turn make one row."""
    looked = [line for line in lines[:_LOOKED_AT] if line.strip()]
    kinds = Counter(labels for line in looked if (labels := _labels(line)))
    if not kinds or sum(kinds.values()) <= _LEAST * len(looked):
        return lines
    often = max(kinds.values())
    order = [labels for labels in kinds if kinds[labels] >= _LEAST_OFTEN * often]
    order = [labels[labels[0] == _HOST and place > 0 :] for place, labels in enumerate(order)]
    if sum(len(labels) for labels in order) < 3:
        return lines
    names = [name for labels in order for name in labels]
    if len(set(names)) < len(names):
        return lines
    rows: list[dict[str, str]] = []
    for line in lines:
        labels = _labels(line)
        labels = labels if labels in order else labels[1:]
        if labels not in order:
            continue
        if labels == order[0] or not rows:
            rows.append({})
        stamp = _stamp(line)
        numbers = [number for _, number in _LABELLED.findall(line)]
        cells = [stamp, *numbers] if labels[0] == _HOST and stamp else numbers
        rows[-1] |= dict(zip(labels, cells, strict=True))
    before = [f"# {line}" for line in itertools.takewhile(lambda line: _labels(line) not in order, lines)]
    return [*before, ";".join(names), *(";".join(row.get(name, "") for name in names) for row in rows)]


def _stamp(text: str) -> str:
    """Return the time in front of a line: a date or time of day, or ms since the start as an ESP32 prints them."""
    found = _STAMP.search(text)
    tick = _TICK.match(text) or _SECONDS.search(text)
    return found[0] if found else tick[1] if tick else ""


def _labels(line: str) -> tuple[str, ...]:
    """Return the names of the numbers of a line, with the unit at its end; empty where not all of it is so."""
    found = list(_LABELLED.finditer(line)) if len(line) <= _LONGEST else []
    if not found:
        return ()
    before = line[: found[0].start()]
    stamp = _stamp(before)
    between = _LABELLED.sub("", line[found[0].start() : found[-1].end()])
    unit = _UNIT.fullmatch(line[found[-1].end() :].strip(" ,;|\t}"))
    if re.search(r"\w", between) or unit is None:
        return ()
    if not stamp and re.search(r"\w", before):
        return ()
    names: list[str] = []
    stem = ""
    for one in found:
        name = one[1].strip()
        if name.lower() in {"x", "y", "z"} and stem and name.lower() != "x":
            name = f"{stem} {name}"
        stem = name[:-1].strip() if name[-1:].lower() == "x" and len(name) > 1 else stem
        names.append(name)
    if unit[1] and len(found) <= 3:
        names = [f"{name} [{unit[1]}]" for name in names]
    return (_HOST, *names) if stamp else tuple(names)
