"""A look at a file of unknown layout: its columns, what they seem to be, what is odd, and a map to start from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.errors import InputError
from gfimu.files.table import ArrowStream
from gfimu.importing.clock import Times, times_of
from gfimu.importing.column_map import ColumnMap, TextSpec, TimeSpec, map_toml
from gfimu.importing.guessing.likely_reference import likely_references
from gfimu.importing.guessing.suggestion import roles_by_map, suggest, with_shipped
from gfimu.importing.oddities import oddities
from gfimu.importing.raw_table import RawFile, RawTable
from gfimu.importing.readers import read_foreign
from gfimu.importing.readers.tables import table_file
from gfimu.importing.recognise import fitting_maps, own_chips
from gfimu.results import TableResult, text_column
from gfimu.units import REFERENCE_UNITS, TIME_COLUMNS, reference_quantity

__all__ = ["ColumnView", "Inspection", "inspect_file"]


_MOST_COLUMNS, _MOST_TABLES = 600, 200  # of a file whose layout is guessed


@dataclass(frozen=True)
class ColumnView:
    """A column as it looks.

    Parameters
    ----------
    name : str
        Its name in the file.
    least, most, median : float
        Of its numbers; NaN for text.
    missing : int
        Cells without a number.
    role : str
        What it seems to be.
    """

    name: str
    least: float
    most: float
    median: float
    missing: int
    role: str = ""


@dataclass(frozen=True)
class Inspection(TableResult):
    """Proposed meaning of the columns of a file, with the evidence for it.

    Parameters
    ----------
    source, format, table : str
        The file, its format, and the table that was looked at.
    tables : tuple of str
        All tables of the file with their rows.
    rows : int
        Of that table.
    columns : tuple of ColumnView
        As they look.
    fitting : tuple of str
        Maps that come with gfimu and fit, the most plausible first.
    column_map : ColumnMap, optional
        A map to start from; None if no accelerations were found.
    reasons : tuple of str
        What the map rests on, one line each.
    findings : tuple of str
        What is odd: gaps, rails, corrupt values, noisy channels.
    sample_rate_hz : float
        By the times; NaN if unknown.
    chips : int
        Triads of accelerations.
    is_own : bool
        Whether it is a recording of gfimu's, which needs no map.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.inspect("log.csv").fitting  # doctest: +SKIP
    """

    source: str
    format: str
    table: str
    tables: tuple[str, ...]
    rows: int
    columns: tuple[ColumnView, ...]
    fitting: tuple[str, ...]
    column_map: ColumnMap | None
    reasons: tuple[str, ...] = ()
    findings: tuple[str, ...] = ()
    sample_rate_hz: float = float("nan")
    chips: int = 0
    is_own: bool = False

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per column of the file: range, median, missing values, and what it seems to be."""
        numbers = {
            key: np.array([getattr(one, key) for one in self.columns]) for key in ("least", "median", "most", "missing")
        }
        return {
            "column": text_column(one.name for one in self.columns),
            **numbers,
            "role": text_column(one.role for one in self.columns),
        }

    def _heading(self) -> str:
        return f"Inspection of {self.source}"

    def _facts(self) -> list[tuple[str, str]]:
        return [
            ("format", self.format),
            ("rows", str(self.rows)),
            ("sample rate", f"{self.sample_rate_hz:.4g} Hz"),
            ("triads of accelerations", str(self.chips)),
            ("maps that fit", ", ".join(self.fitting) or "none"),
        ]

    def _notes(self) -> tuple[str, ...]:
        return self.findings

    def map_text(self) -> str:
        """Return the suggested map as a TOML file with the reasons as comments."""
        if self.column_map is None:
            return ""
        head = "".join(f"# {line}\n" for line in (f"Suggested by gfimu inspect for {self.source}", *self.reasons))
        return head + map_toml(self.column_map)

    def to_dict(self) -> dict[str, Any]:
        """Return all as JSON holds it."""
        return {
            "source": self.source,
            "format": self.format,
            "table": self.table,
            "tables": list(self.tables),
            "rows": self.rows,
            "sample_rate_hz": self.sample_rate_hz,
            "chips": self.chips,
            "columns": [vars(one) for one in self.columns],
            "fitting_maps": list(self.fitting),
            "findings": list(self.findings),
            "reasons": list(self.reasons),
            "map_toml": self.map_text(),
        }


def inspect_file(path: str | Path | ArrowStream, *, table: str = "", text: TextSpec = TextSpec()) -> Inspection:
    """Look at a file of unknown layout.

    Parameters
    ----------
    path : str, Path or table
        The file, of any format that has a reader, or a table of pandas, polars or pyarrow.
    table : str
        Table of the file to look at; by default the one with the most triads of accelerations.
    text : TextSpec
        Layout of a text file, where it is known.

    Raises
    ------
    InputError
        If the file can't be read at all, or it is neither a path nor a table.
    """
    raw = read_foreign(path, text=text) if isinstance(path, str | Path) else table_file(path)
    widest = max(raw.tables.values(), key=lambda one: len(one.columns))
    if len(widest.columns) > _MOST_COLUMNS or len(raw.tables) > _MOST_TABLES:
        what = f"{len(widest.columns)} columns" if len(widest.columns) > _MOST_COLUMNS else f"{len(raw.tables)} tables"
        raise InputError(
            f"{raw.source}: has {what}, too many to guess what they are; name those of the recording in a map"
        )
    plain = raw.table(table) if table else next(iter(raw.tables.values()))
    own = own_chips(list(plain.columns))
    if own:
        return _own_recording(raw, plain, own)
    found = suggest(raw, table=table, name=_map_name(raw.source), text=text)
    fitting = tuple(fitting_maps(raw))
    suggested, reasons = found.column_map, found.reasons
    time, is_rate_known, roles = found.time.spec, found.time.is_rate_known, found.roles
    if suggested is not None and len(fitting) == 1 and fitting_maps(raw, fully=True):
        suggested, differences = with_shipped(found, suggested, fitting[0])
        reasons = (f"the map {fitting[0]} that comes with gfimu fits: columns, rate, gravity at rest", *differences)
        time, is_rate_known = suggested.time, True
        roles = roles_by_map(suggested, found.table)
    times, findings = _times(found.table, time, raw.source)
    findings += [note.removeprefix(f"{raw.source}: ") for note in found.table.notes]
    findings += oddities({name: one.numbers(name) for one, triad in found.chips for name in triad.columns})
    return Inspection(
        raw.source,
        raw.format,
        found.table.name,
        tuple(f"{name or 'the file'} ({len(one)} rows)" for name, one in found.raw.tables.items()),
        len(found.table),
        tuple(_view(found.table, name, roles.get(name, "")) for name in found.table.columns),
        fitting,
        suggested,
        reasons,
        tuple(findings),
        _rate(times) if is_rate_known else float("nan"),
        len(found.chips),
    )


def _own_recording(raw: RawFile, table: RawTable, chips: dict[str, list[str]]) -> Inspection:
    """Return what a recording in gfimu's own columns holds; it needs no map."""
    channels = [name for names in chips.values() for name in names]
    roles = {name: f"{name.partition('_')[0]}, {name.partition('_')[2]}" for name in channels} | {"t_s": "time"}
    roles |= {name: "reference" for name in table.columns if _is_reference(name) and name != "t_s"}
    have = {reference_quantity(name) for name, role in roles.items() if role == "reference"}
    further = {name: values for name, values in table.columns.items() if name not in roles}
    likely = [one for one in likely_references(further) if reference_quantity(one.reference) not in have]
    roles |= {one.column: f"{reference_quantity(one.reference)}? {one.unit}" for one in likely}
    times, findings = _times(table, TimeSpec("t_s"), raw.source, drop=("duplicates", "unordered"))
    findings += [f"{one.reference} is not there; {one.remedy}" for one in likely]
    if times is not None and times.dropped:
        findings.append("with such rows it is refused; gfimu convert --drop duplicates,unordered leaves them out")
    findings += oddities({name: table.numbers(name) for name in channels})
    return Inspection(
        raw.source,
        raw.format,
        table.name,
        (f"{table.name or 'the file'} ({len(table)} rows)",),
        len(table),
        tuple(_view(table, name, roles.get(name, "")) for name in table.columns),
        (),
        None,
        ("its columns carry their units: a recording of gfimu's, which needs no column map",),
        tuple(findings),
        _rate(times),
        len(chips),
        True,
    )


def _is_reference(name: str) -> bool:
    return name in TIME_COLUMNS.values() or any(
        name == f"{quantity}_{unit}" for quantity, units in REFERENCE_UNITS.items() for unit in units
    )


def _rate(times: Times | None) -> float:
    return 1.0 / float(np.median(np.diff(times.t_s))) if times is not None and len(times.t_s) > 1 else float("nan")


def _map_name(source: str) -> str:
    return Path(source).name.partition(".")[0] or "map"


def _view(table: RawTable, name: str, role: str) -> ColumnView:
    values = table.numbers(name) if table.columns[name].dtype.kind != "M" else np.full(len(table), np.nan)
    known = values[np.isfinite(values)]
    if not len(known):
        return ColumnView(name, np.nan, np.nan, np.nan, len(values), role or "text")
    missing = int(len(values) - len(known))
    return ColumnView(name, float(known.min()), float(known.max()), float(np.median(known)), missing, role)


def _times(table: RawTable, spec: TimeSpec, source: str, *, drop: Sequence[str] = ()) -> tuple[Times | None, list[str]]:
    """Return the times of a table, and what is odd about them."""
    try:
        times = times_of(table, spec, source, drop=drop)
    except InputError as error:
        return None, [str(error).removeprefix(f"{source}: ")]
    found = [note.removeprefix(f"{source}: ") for note in times.notes]
    if spec.column is None or len(times.t_s) < 3:
        return times, found
    steps = np.diff(times.t_s)
    usual = float(np.median(steps))
    gaps = steps > 1.5 * usual
    if gaps.any():
        lost = float(np.sum(steps[gaps] - usual))
        place = times.t_s[int(np.argmax(gaps))] - times.t_s[0]
        found.append(f"{int(gaps.sum())} gaps, {lost:.3g} s in all, the first {place:.4g} s after the start")
    jitter = float(np.std(steps[~gaps]) / usual)
    if jitter > 0.02:
        found.append(f"the sample period scatters by {100 * jitter:.2g}% of itself")
    return times, found
