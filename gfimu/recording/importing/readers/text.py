"""Text files of numbers: CSV of any separator, columns between spaces, with or without names."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as pa_csv
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.base.files.memory import MemoryLimit
from gfimu.recording.importing.column_map import TextSpec
from gfimu.recording.importing.raw_table import RawFile, RawTable
from gfimu.recording.importing.readers.text_layout import COMMENT_MARKS, Layout, layout_of, trailer, upright
from gfimu.recording.importing.readers.text_lines import plain_lines
from gfimu.recording.reading import MOST_COLUMNS, read_bytes
from gfimu.recording.tables.arrow import as_found

__all__ = ["GROWS", "cell_values", "is_text", "read_text", "table_of_text"]

_NUMERIC = r"^[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$"
_INTEGER = r"^[+-]?(\d{1,18}|[1-8]\d{18})$"  # of 64 bits
_THOUSANDS = r"\.(\d{3})"  # a point between groups of digits, where a comma is the decimal mark
_NO_NUMBER = ["", "nan", "-nan", "+nan", "na", "n/a", "null", "none", "-"]
_INFINITE = r"^[+-]?inf(inity)?$"
_IS_NUMBERS = 0.5  # of the filled cells of a column
_MOST_PREAMBLE = 100  # numerical: lines
_LONGEST_STATED = 1000  # numerical: characters of a line that states something
_HEAD_LINES = 600  # by which the layout is found, and the preamble
_LAST = 4000  # numerical: characters in which lines after the numbers are looked for
_MOST_SERIES = 64  # numerical: lines of a file that may have a column per line, as columns of a matrix
_LOSSES = "(?:overflow|overrun|dropped|lost|missed)"
_LOST = re.compile(rf"{_LOSSES}\w*\W{{0,4}}[1-9]\d*|\b[1-9]\d* (?:samples? )?{_LOSSES}\w*", re.IGNORECASE)
_BLOCK = 8_000_000  # numerical: characters that are cut into lines at once
_ESCAPE = "\x1b"
GROWS = 3.0
"""Numerical: memory for a byte of text in columns, measured: 2.5 of numbers with point and sign."""
_NAMED_GROWS = 25.0  # numerical: the same where each cell has its name, measured: 22


def read_text(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read a text file, gzipped or not.

    Raises
    ------
    InputError
        If it is empty, not text, or no line holds numbers.
    """
    limit = MemoryLimit.of(path)
    return RawFile(str(path), "text", {"": table_of_text(read_bytes(path, grows=GROWS), str(path), text, limit)})


def table_of_text(data: bytes, source: str, text: TextSpec = TextSpec(), limit: MemoryLimit | None = None) -> RawTable:
    """Return the table that the bytes of a text file hold, if they fit into a limit of memory."""
    content = _decoded(data, source)
    del data
    if not content.strip():
        raise InputError(f"{source}: empty file; record again or give another file")
    if len(content) <= _BLOCK and content.count("\n") <= _MOST_SERIES:
        content = "\n".join(upright(content.split("\n")))
    head, rest = _first_lines(content)
    _check_widths(head, source)
    lines = plain_lines(head)
    is_plain = lines == head and not any(_ESCAPE in line for line in head)
    if limit is not None:
        limit.needs((GROWS if is_plain else _NAMED_GROWS) * len(content))
    if not is_plain:  # such as cells with names: their lines are made plain all together
        lines, rest = plain_lines(content.split("\n")), len(content)
    layout = layout_of(lines, separator=text.separator, decimal=text.decimal, skip=text.skip_lines, names=text.columns)
    if layout is None:
        raise InputError(
            f"{source}: no line holds numbers; give a recording, or the separator in a map (text.separator)"
        )
    if len(layout.names) > MOST_COLUMNS:
        raise _too_wide(source, len(layout.names))
    stated = trailer(content[-_LAST:].split("\n") if is_plain else lines[-_HEAD_LINES:], lines[layout.first], layout)
    table, left_out, repeated = _cells(_blocks(lines[layout.first :], content, rest), layout, lines, stated, source)
    del content
    notes = [f"{source}: left out {left_out} lines with another number of cells"] if left_out else []
    notes += [f"{source}: left out {repeated} lines that repeat one before the numbers"] if repeated else []
    columns: dict[str, NDArray[Any]] = {}
    for name in layout.names:
        values, unreadable = cell_values(table.column(name).combine_chunks(), layout.decimal)
        if values is None:
            continue  # an empty column, as after a separator that closes each line
        columns[name] = values
        if unreadable:
            notes.append(f"{source}: column {name}: {unreadable} cells are no numbers and count as missing")
    stated = [line[:_LONGEST_STATED] for line in (*_preamble(lines, layout), *stated)]
    notes += [f"{source}: states {lost[0]!r}, so samples were lost" for line in stated if (lost := _LOST.search(line))]
    return RawTable("", columns, tuple(notes), layout.named, tuple(stated))


def _first_lines(content: str) -> tuple[list[str], int]:
    """Return the lines by which the layout is found, and where the rest begins."""
    lines: list[str] = []
    place = 0
    while len(lines) < _HEAD_LINES and place <= len(content):
        end = content.find("\n", place)
        end = len(content) if end < 0 else end
        lines.append(content[place:end])
        place = end + 1
    return lines, place


def _check_widths(lines: Iterable[str], source: str) -> None:
    """Refuse lines of more cells than any recording has, before they are cut into cells."""
    for line in lines:
        most = max(map(line.count, ",;\t"))
        if line.count(" ") > MOST_COLUMNS:
            most = max(most, len(line.split(None, MOST_COLUMNS + 1)))
        if most > MOST_COLUMNS:
            raise _too_wide(source, most)


def _too_wide(source: str, columns: int) -> InputError:
    return InputError(f"{source}: has {columns} columns, more than {MOST_COLUMNS}; write those of the recording")


def _blocks(first: list[str], content: str, place: int) -> Iterator[list[str]]:
    """Yield the lines of a text piece by piece: the first ones, and those from a place on."""
    yield first
    while place < len(content):
        end = content.find("\n", place + _BLOCK)
        end = len(content) if end < 0 else end
        yield content[place:end].split("\n")
        place = end + 1


def _cells(
    blocks: Iterator[list[str]], layout: Layout, lines: list[str], after: list[str], source: str
) -> tuple[pa.Table, int, int]:
    """Return the cells of the lines of numbers as text, and how many lines are left out: of other widths, repeated."""
    left_out: list[Any] = []
    repeated = 0
    before = {line.strip() for line in lines[: layout.first]}
    closed: bool | None = None
    tables: list[pa.Table] = []

    def skip(row: Any) -> str:
        left_out.append(None)
        return "skip"

    for block in blocks:
        filled = [line for line in block if line.strip() and line.lstrip()[0] not in COMMENT_MARKS]
        kept = [line for line in filled if line.strip() not in before]
        repeated += len(filled) - len(kept)
        kept = [line for line in kept if line.strip() not in after]
        if not kept:
            continue
        if closed is None:
            closed = layout.separator not in " ;" and any(line.rstrip().endswith(";") for line in kept[:3])
        if layout.separator == " ":
            kept = [" ".join(line.split()) for line in kept]
        elif closed:
            kept = [line.rstrip().rstrip(";") for line in kept]
        try:
            table = pa_csv.read_csv(
                io.BytesIO(("\n".join(kept) + "\n").encode()),
                pa_csv.ReadOptions(column_names=list(layout.names), use_threads=False),
                pa_csv.ParseOptions(delimiter=layout.separator, invalid_row_handler=skip, newlines_in_values=False),
                pa_csv.ConvertOptions(column_types=dict.fromkeys(layout.names, pa.string()), strings_can_be_null=False),
            )
        except pa.ArrowException as error:
            why = str(error).splitlines()[0][:120]
            raise InputError(f"{source}: can't be read as text in columns ({why}); give its layout in a map") from None
        tables.append(table)
    if not sum(table.num_rows for table in tables):
        raise InputError(
            f"{source}: no line has the {len(layout.names)} cells of the columns {', '.join(layout.names[:6])}"
        )
    return pa.concat_tables(tables), len(left_out), repeated


def _preamble(lines: list[str], layout: Layout) -> tuple[str, ...]:
    """Return what stands before the numbers and in comments, for a sample rate that is stated there."""
    head = [line.strip() for line in lines[: layout.first]]
    rest = lines[layout.first : layout.first + _MOST_PREAMBLE]
    comments = [line.strip() for line in rest if line.strip() and line.lstrip()[0] in COMMENT_MARKS]
    return tuple(line for line in [*head, *comments] if line)[:_MOST_PREAMBLE]


def _decoded(data: bytes, source: str) -> str:
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace").replace("\r\n", "\n").replace("\r", "\n")
    if b"\x00" in data[:4096]:
        raise InputError(f"{source}: a binary file of unknown format; gfimu list formats has those that are known")
    try:
        content = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        content = data.decode("latin-1")
    return content.replace("\r\n", "\n").replace("\r", "\n")


def cell_values(cells: pa.Array, decimal: str) -> tuple[NDArray[Any] | None, int]:
    """Return the cells of a column as numbers if most are, else as text; None if all are empty."""
    plain = pc.utf8_trim_whitespace(cells)
    low = pc.utf8_lower(plain)
    empty = pc.is_in(low, value_set=pa.array(_NO_NUMBER))
    filled = len(cells) - pc.sum(empty).as_py()
    if filled == 0:
        # Cells that say "nan" are missing numbers; a column without a single sign is none.
        return (np.full(len(cells), np.nan), 0) if pc.any(pc.not_equal(plain, "")).as_py() else (None, 0)
    if decimal == ",":
        plain = pc.replace_substring(pc.replace_substring_regex(plain, _THOUSANDS, r"\1"), ",", ".")
    infinite = pc.match_substring_regex(low, _INFINITE)
    good = pc.match_substring_regex(plain, _NUMERIC)
    count = pc.sum(good).as_py() + pc.sum(infinite).as_py()
    if count < _IS_NUMBERS * filled:
        return as_found(cells.dictionary_encode()), 0
    if count == len(cells) and pc.all(pc.match_substring_regex(plain, _INTEGER)).as_py():
        return pc.cast(plain, pa.int64()).to_numpy(zero_copy_only=False), 0
    numbers = pc.cast(pc.if_else(good, plain, pa.scalar(None, pa.string())), pa.float64())
    values = np.array(numbers.to_numpy(zero_copy_only=False))
    mask = infinite.to_numpy(zero_copy_only=False)
    values[mask] = np.inf
    return values, filled - count


def is_text(head: bytes) -> bool:
    """Whether the first bytes of a file look like text."""
    return head[:2] in (b"\xff\xfe", b"\xfe\xff") or (
        b"\x00" not in head and not re.search(rb"[\x01-\x08\x0e-\x1a]", head)
    )
