"""The layout of a text file of numbers: separator, decimal mark, names of the columns, first line of numbers."""

from __future__ import annotations

import csv
import itertools
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from gfimu.recording.units import kind_of, unit_of_name

__all__ = ["COMMENT_MARKS", "Layout", "cells_of", "layout_of", "trailer", "upright"]

COMMENT_MARKS = "#;%/*"
_SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}
_NUMBER = {
    ".": re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE),
    ",": re.compile(
        r"[+-]?(\d{1,3}(\.\d{3})+,\d+|\d+,?\d*|,\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE
    ),
}
_STAMP = re.compile(r"(\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4})?[T _]*(\d{1,2}:\d\d(:\d\d([.,:]\d+)?)?)?\s*([AaPp][Mm]|Z)?")
_NOTHING = re.compile(r"n/?a|null|none|-", re.IGNORECASE)
_NO_UNITS = {"", "-", "1", "raw", "cal", "counts", "lsb", "%", "mv", "v", "ut", "gauss", "hpa", "pa", "local_flux"}


@dataclass(frozen=True)
class LayoutPolicy:
    """Thresholds by which the layout of a text file is found; each by choice."""

    looked_at: int = 400  # lines
    quoted_at: int = 20  # of these, at the end, that show whether numbers stand in quotes
    longest_cell: int = 100  # characters of a number or time
    least_numbers: float = 0.5  # of the filled cells of a line of data
    least_flat: int = 20  # numbers of a line with a name before them, from which each line is a column
    flat: int = 5  # times the lines: numbers of lines without names, from which each line is a column
    most_header: int = 4  # lines of names, units and groups
    most_last: int = 20  # lines after the numbers


_POLICY = LayoutPolicy()


@dataclass(frozen=True)
class Layout:
    """How a text file is laid out.

    Parameters
    ----------
    separator : str
        One character; a space stands for any number of spaces and tabs.
    decimal : str
        ``.`` or ``,``.
    first : int
        Number of lines before the first line of numbers.
    names : tuple of str
        Names of the columns, one per cell of a line.
    named : bool
        Whether the file has these names itself.
    """

    separator: str
    decimal: str
    first: int
    names: tuple[str, ...]
    named: bool


def layout_of(
    lines: Sequence[str], *, separator: str = "", decimal: str = "", skip: int | None = None, names: Sequence[str] = ()
) -> Layout | None:
    """Find the layout of a text file from its first lines; None if no line holds numbers.

    Parameters
    ----------
    lines : sequence of str
        First lines of the file.
    separator, decimal : str
        Known ones; found from the lines if empty.
    skip : int, optional
        Known number of lines before the first line of numbers.
    names : sequence of str
        Known names of the columns.
    """
    looked = list(lines[: _POLICY.looked_at])
    quoted = any('"' in line for line in looked[-_POLICY.quoted_at :])
    best: tuple[tuple[int, float, int], Layout] | None = None
    there = set().union(*looked)
    marks = [one for one in _SEPARATORS.values() if one in there or one == " "]
    for mark in [_SEPARATORS.get(separator, separator)] if separator else marks:
        for point in [decimal] if decimal else [".", ","] if "," in there else ["."]:
            if point == mark and not quoted:
                continue
            data = _data_lines(looked, mark, point, skip or 0)
            if not data:
                continue
            counted = [(number, len(cells)) for number, cells in data]
            (width, lines_so), *_ = Counter(count for _, count in counted).most_common(1)
            first = next(number for number, count in counted if count == width) if skip is None else skip
            row_name = cells_of(looked[first], mark)[0]
            header = _header(looked[:first], mark, width, row_name) if not names else None
            numbered = tuple(f"column_{place}" for place in range(1, width + 1))
            # Names may end before the cells do, as where a separator closes each line.
            known = tuple(names) + numbered[len(names) :] if names else header or numbered
            unread = _unread([cells for _, cells in data if len(cells) == width], point)
            # Spaces part dates from times and words of names too: another mark goes before them where it reads as much.
            score = (lines_so, -unread, width if mark != " " else 1)
            # A point is the usual decimal mark: a comma has to read more lines, or more cells of them.
            if best is None or score > best[0]:
                best = score, Layout(mark, point, first, known, bool(names) or header is not None)
    return None if best is None else best[1]


def cells_of(line: str, separator: str) -> list[str]:
    """Split a line; a space stands for any number of spaces and tabs, and a last ``;`` closes the line."""
    if separator == " ":
        return line.split()
    closed = line.rstrip(" \r\n")
    if separator != ";":
        closed = closed.rstrip(";")
    if '"' in closed:  # a cell in quotes may hold the separator
        try:
            return [cell.strip() for cell in next(csv.reader([closed], delimiter=separator, skipinitialspace=True), [])]
        except csv.Error:  # a cell longer than any, or a return in it
            pass
    return [cell.strip() for cell in closed.split(separator)]


def upright(lines: Sequence[str]) -> list[str]:
    """Return the lines of a text file that has a column per line, a name or none before its numbers, as usual ones."""
    filled = [line for line in lines if line.strip() and line.lstrip()[0] not in COMMENT_MARKS]
    if len(filled) < 2:
        return list(lines)
    mark = max(_SEPARATORS.values(), key=lambda one: len(cells_of(filled[-1], one)))
    rows = [cells_of(line, mark) for line in filled]
    width = len(rows[-1])
    rows = [row for row in rows if len(row) == width]
    named = not any(_is_datum(row[0]) for row in rows)
    if width - named < (1 if named else _POLICY.flat) * max(_POLICY.least_flat, len(rows)) or 2 * len(rows) < len(
        filled
    ):
        return list(lines)
    if not all(_is_datum(row[1]) for row in rows):
        return list(lines)  # a line of names above
    rest = [line for line in lines if line not in filled or len(cells_of(line, mark)) != width]
    return [*(f"# {line}" for line in rest if line.strip()), *("\t".join(cells) for cells in zip(*rows, strict=True))]


def trailer(last: Sequence[str], row: str, layout: Layout) -> list[str]:
    """Return the lines after the numbers that state something: words in them where a row has numbers."""
    pattern = [_is_datum(cell) for cell in cells_of(row, layout.separator)]
    found: list[str] = []
    for line in reversed(last[-_POLICY.most_last :]):
        cells = cells_of(line, layout.separator)
        is_row = len(cells) == len(pattern) and all(
            _is_datum(cell) or not known for cell, known in zip(cells, pattern, strict=True)
        )
        if is_row or (line.strip() and not re.search(r"[A-Za-z]{2}", line)):
            break
        found += [line.strip()] if line.strip() else []
    return found[::-1]


def _is_datum(cell: str) -> bool:
    """Whether a cell may be one of a row of numbers: a number with either decimal mark, a date or time, or nothing."""
    plain = cell.strip('"')[: _POLICY.longest_cell]
    return any(one.fullmatch(plain) for one in (*_NUMBER.values(), _STAMP, _NOTHING))


def _data_lines(lines: Sequence[str], separator: str, decimal: str, skip: int) -> list[tuple[int, list[str]]]:
    """Return the lines that hold numbers, with their places."""
    number = _NUMBER[decimal]
    found = []
    for index, line in enumerate(lines):
        if index < skip or not line.strip() or line.lstrip()[0] in COMMENT_MARKS:
            continue
        cells = cells_of(line, separator)
        filled = [cell for cell in cells if cell]
        numeric = sum(len(cell) <= _POLICY.longest_cell and number.fullmatch(cell) is not None for cell in filled)
        if numeric and numeric >= _POLICY.least_numbers * len(filled):
            found.append((index, cells))
    return found


def _unread(lines: Sequence[Sequence[str]], decimal: str) -> float:
    """Return how many cells of a line are no number, date or time of day, to a hundredth."""
    filled = [cell for cells in lines for cell in cells if cell]
    short = [cell for cell in filled if len(cell) <= _POLICY.longest_cell]
    read = sum(_NUMBER[decimal].fullmatch(cell) is not None or _STAMP.fullmatch(cell) is not None for cell in short)
    return round((len(filled) - read) / max(len(lines), 1), 2)


def _header(before: Sequence[str], separator: str, width: int, row_name: str) -> tuple[str, ...] | None:
    """Return the names in the lines before the numbers, if there are some for each cell.

    They are in the last line, or above a line of units. Names that repeat have their group in a line above them.
    """
    is_row_named = row_name[:1] == '"' or not _is_datum(row_name)
    rows: list[list[str]] = []
    for line in filter(str.strip, reversed(before)):
        cells = _named_cells(line, separator, width, is_row_named=is_row_named)
        if cells is None or len(rows) == _POLICY.most_header:
            break
        rows.append(cells)
    if not rows:
        return None
    units = next((place for place, cells in enumerate(rows) if _are_units(cells)), len(rows))
    place = units + 1 if units + 1 < len(rows) else 0
    names, *above = rows[place:]
    if above and above[0][0] and len({*names}) < len(names) - above[0].count("") // 2:
        groups: Iterator[str] = itertools.accumulate(above[0], lambda group, cell: str(cell or group))
        names = [f"{group} {name}" for group, name in zip(groups, names, strict=True)]
    return _names(names, rows[units] if units < len(rows) and units != place else [])


def _named_cells(line: str, separator: str, width: int, *, is_row_named: bool) -> list[str] | None:
    """Return the cells of a line of names, one for each cell of a line of numbers; None where the numbers differ."""
    cells = cells_of(line.lstrip().lstrip(COMMENT_MARKS).lstrip(), separator)
    if len(cells) == width + 1:  # the line says what it is: ";Headers, time, Ax"; or it ends in a separator
        cells = cells[1:] if cells[-1] else cells[:-1]
    if len(cells) < width - 1 or len(cells) > width:
        return None
    if is_row_named and len(cells) < width:
        return ["", *(cell.strip('"') for cell in cells)]
    return cells + [""] * (width - len(cells))


def _are_units(cells: Sequence[str]) -> bool:
    """Whether cells hold units: ``ms``, ``[mg]``, ``deg/s``; all that are filled, and not numbers of axes."""
    plain = [cell.strip(" []()*").lower() for cell in cells]
    known = [bool(kind_of(cell)) for cell in plain]
    others = [cell for one, cell in zip(known, plain, strict=True) if not one and cell not in _NO_UNITS]
    return sum(known) >= 2 and len(others) < sum(known) and all("/" in cell for cell in others)  # km/h


def _names(cells: Sequence[str], units: Sequence[str]) -> tuple[str, ...]:
    """Return names of the columns, each only once, with their units in brackets where a line of them stands below."""
    names = [cell or f"column_{place}" for place, cell in enumerate(cells, start=1)]
    if units:
        below = [unit.strip(" []()*") for unit in units]
        names = [
            f"{name} [{unit}]" if kind_of(unit) and not unit_of_name(name)[1] else name
            for name, unit in zip(names, below, strict=True)
        ]
    repeated = Counter(names)
    return tuple(
        re.sub(r"( *[\[(][^\[(]*)?$", rf"_{place}\1", name, count=1) if repeated[name] > 1 else name
        for place, name in enumerate(names, start=1)
    )
