"""A look at a file of unknown layout: its columns, what they seem to be, what is odd, and a map to start from."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.declared import Declared, FileText, Line, figure
from gfimu.base.declared import table as table_of
from gfimu.base.errors import InputError, one_line
from gfimu.base.results import TableResult, columns_of, text_column
from gfimu.recording.doubts.doubt import Doubt
from gfimu.recording.doubts.samples import sample_doubts
from gfimu.recording.doubts.stamps import stamp_doubts
from gfimu.recording.importing.clock import Times, times_of
from gfimu.recording.importing.column_map import ColumnMap, TimeSpec, map_toml
from gfimu.recording.importing.guessing.likely_reference import likely_references
from gfimu.recording.importing.guessing.suggestion import roles_by_map, suggest, with_shipped
from gfimu.recording.importing.raw_table import RawFile, RawTable
from gfimu.recording.importing.readers import read_foreign
from gfimu.recording.importing.readers.tables import table_file
from gfimu.recording.importing.recognise import fitting_maps, own_chips
from gfimu.recording.quantities import REFERENCE_UNITS, TIME_COLUMNS, reference_quantity
from gfimu.recording.tables.arrow import ArrowStream

__all__ = ["ColumnView", "Inspection", "inspect_file"]


_MOST_COLUMNS, _MOST_TABLES = 600, 200  # of a file whose layout is guessed
_SHOWN_COLUMNS = 40  # numerical: rows of a table that people still read


@dataclass(frozen=True)
class ColumnView(Declared):
    """A column as it looks."""

    name: Annotated[str, figure("Its name in the file.", head="column")]
    least: Annotated[float, figure("Least of its numbers; null: it has none.", head="least", form=".6g")]
    most: Annotated[float, figure("Largest of its numbers.", head="most", form=".6g")]
    median: Annotated[float, figure("Median of its numbers.", head="median", form=".6g")]
    missing: Annotated[int, figure("Cells without a number.", head="missing")]
    role: Annotated[str, figure("What it seems to be.", head="seems to be")] = ""


@dataclass(frozen=True, kw_only=True)
class Inspection(Declared, TableResult):
    """What a file seems to hold: the proposed meaning of its columns, with the evidence for it.

    ``column_map`` is the map to start from, None if no accelerations were found; ``is_own`` whether it is a recording
    of gfimu's, which needs no map; ``shows_map`` whether people see the map too.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.inspect("log.csv").fitting  # doctest: +SKIP
    """

    source: Annotated[str, figure("The file.")]
    format: Annotated[str, figure("Its format.", head="format")]
    table: Annotated[str, figure("The table that was looked at; empty for the file itself.")]
    tables: Annotated[tuple[str, ...], figure("All tables of the file, with their rows.")]
    rows: Annotated[int, figure("Rows of that table.", head="rows")]
    sample_rate_hz: Annotated[float, figure("Sample rate by the times; null if unknown.", "Hz", head="sample rate")] = (
        math.nan
    )
    chips: Annotated[int, figure("Triads of accelerations.", head="triads of accelerations")] = 0
    columns: Annotated[tuple[ColumnView, ...], figure("The columns as they look.")]
    fitting: Annotated[
        tuple[str, ...],
        figure("Column maps that come with gfimu and fit, the most plausible first.", key="fitting_maps", head="maps"),
    ] = ()
    notes: tuple[str, ...] = ()
    doubts: Annotated[tuple[Doubt, ...], figure("What is doubtful in its times and readings.")] = ()
    reasons: Annotated[tuple[str, ...], figure("What the proposed map rests on, one line each.")] = ()
    column_map: ColumnMap | None = None
    is_own: bool = False
    shows_map: bool = True

    @property
    def findings(
        self,
    ) -> Annotated[
        tuple[str, ...], figure("What is odd: gaps, rails, corrupt values, noisy channels.", before="doubts")
    ]:
        """What was left out on reading, and what is doubtful, one line each."""
        return (*self.notes, *(one.text for one in self.doubts))

    @property
    def map_toml(
        self,
    ) -> Annotated[str, figure("A column map to start from (TOML); empty where none was found.")]:
        """The suggested map as a TOML file with the reasons as comments."""
        if self.column_map is None:
            return ""
        lines = (f"Suggested by gfimu inspect for {self.source}", *self.reasons)
        return "".join(f"# {one_line(line)}\n" for line in lines) + map_toml(self.column_map)

    @property
    def summary(self) -> str:
        """Format, rows, rate and chips in one line."""
        rate = f", {self.sample_rate_hz:.5g} Hz" if math.isfinite(self.sample_rate_hz) else ""
        chips = f"{self.chips} chip{'' if self.chips == 1 else 's'}" if self.chips else "no accelerations found"
        return f"{self.source}: {self.format}, {self.rows} rows{rate}, {chips}"

    def shown(self) -> Iterator[Any]:
        """Yield the columns, the evidence for the map, and the map."""
        if len(self.tables) > 1:
            yield f"Tables: {'; '.join(self.tables)}. Shown: {self.table or 'the file'}."
        more = len(self.columns) - _SHOWN_COLUMNS
        note = f"and {more} further columns" if more > 0 else ""
        columns = self.columns[:_SHOWN_COLUMNS]
        yield table_of(self.summary, columns, "name role least median most missing", left=2, note=note)
        yield from (f"- {line}" for line in self.reasons)
        if self.findings:
            yield Line("Odd:", style="bold")
            yield from (f"- {line}" for line in self.findings)
        if self.fitting:
            maps = ", ".join(f"--map {name}" for name in self.fitting)
            yield Line(f"Maps that come with gfimu and fit: {maps}", style="bold")
        if self.shows_map and self.column_map is not None:
            yield Line("A column map to start from (--out FILE.toml writes it):", style="bold")
            yield FileText(f"{self.map_toml}\n")

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per column of the file: range, median, missing values, and what it seems to be."""
        names = {"column": text_column(column.name for column in self.columns)}
        return names | columns_of(self.columns, "least median most missing role")

    def _heading(self) -> str:
        return f"Inspection of {self.source}"

    def _notes(self) -> tuple[str, ...]:
        return self.findings


def inspect_file(path: str | Path | ArrowStream, *, table: str = "") -> Inspection:
    """Look at a file of unknown layout.

    Parameters
    ----------
    path : str, Path or table
        The file, of any format that has a reader, or a table of pandas, polars or pyarrow.
    table : str
        Table of the file to look at; by default the one with the most triads of accelerations.

    Raises
    ------
    InputError
        If the file can't be read at all, or it is neither a path nor a table.
    """
    raw = read_foreign(path) if isinstance(path, str | Path) else table_file(path)
    widest = max(raw.tables.values(), key=lambda one: len(one.columns))
    if len(widest.columns) > _MOST_COLUMNS or len(raw.tables) > _MOST_TABLES:
        what = f"{len(widest.columns)} columns" if len(widest.columns) > _MOST_COLUMNS else f"{len(raw.tables)} tables"
        raise InputError(
            f"{raw.source}: has {what}, too many to guess what they are; name those of the recording in a map"
        )
    plain = raw.table(table) if table else next(iter(raw.tables.values()))
    own = own_chips(list(plain.columns))
    if own:
        return _own_recording(RawFile(raw.source, raw.format, {plain.name: plain}), plain, own)
    found = suggest(raw, table=table, name=Path(raw.source).name.partition(".")[0] or "map")
    fitting = tuple(fitting_maps(raw))
    suggested, reasons = found.column_map, found.reasons
    time, is_rate_known, roles = found.time.spec, found.time.is_rate_known, found.roles
    if suggested is not None and len(fitting) == 1 and fitting_maps(raw, fully=True):
        suggested, differences = with_shipped(found, suggested, fitting[0])
        reasons = (f"the map {fitting[0]} that comes with gfimu fits: columns, rate, gravity at rest", *differences)
        time, is_rate_known = suggested.time, True
        roles = roles_by_map(suggested, found.table)
    times, notes, doubts = _times(found.table, time, raw.source)
    notes += [note.removeprefix(f"{raw.source}: ") for note in found.table.notes]
    columns = {name: one.numbers(name) for one, triad in found.chips for name in triad.columns}
    doubts += sample_doubts(columns, [triad.columns for _, triad in found.chips])
    seen = _seen(found.raw, found.table, times if is_rate_known else None, roles, reasons)
    return replace(
        seen,
        chips=len(found.chips),
        fitting=fitting,
        notes=tuple(notes),
        doubts=tuple(doubts),
        column_map=suggested,
    )


def _seen(
    raw: RawFile, table: RawTable, times: Times | None, roles: Mapping[str, str], reasons: Sequence[str]
) -> Inspection:
    """Return what a look at the columns of a table shows."""
    return Inspection(
        source=raw.source,
        format=raw.format,
        table=table.name,
        tables=tuple(f"{name or 'the file'} ({len(one)} rows)" for name, one in raw.tables.items()),
        rows=len(table),
        sample_rate_hz=math.nan if times is None else times.rate_hz,
        columns=tuple(_view(table, name, roles.get(name, "")) for name in table.columns),
        reasons=tuple(reasons),
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
    times, notes, doubts = _times(table, TimeSpec("t_s"), raw.source, drop=("duplicates", "unordered"))
    notes += [f"{one.reference} is not there; {one.remedy}" for one in likely]
    if times is not None and times.dropped:
        notes.append("with such rows it is refused; gfimu convert --drop duplicates,unordered leaves them out")
    doubts += sample_doubts({name: table.numbers(name) for name in channels}, list(chips.values()))
    why = "its columns carry their units: a recording of gfimu's, which needs no column map"
    seen = _seen(raw, table, times, roles, [why])
    return replace(seen, chips=len(chips), notes=tuple(notes), doubts=tuple(doubts), is_own=True)


def _is_reference(name: str) -> bool:
    return name in TIME_COLUMNS.values() or any(
        name == f"{quantity}_{unit}" for quantity, units in REFERENCE_UNITS.items() for unit in units
    )


def _view(table: RawTable, name: str, role: str) -> ColumnView:
    values = table.numbers(name) if table.columns[name].dtype.kind != "M" else np.full(len(table), np.nan)
    known = values[np.isfinite(values)]
    if not len(known):
        return ColumnView(name, np.nan, np.nan, np.nan, len(values), role or "text")
    missing = int(len(values) - len(known))
    return ColumnView(name, float(known.min()), float(known.max()), float(np.median(known)), missing, role)


def _times(
    table: RawTable, spec: TimeSpec, source: str, *, drop: Sequence[str] = ()
) -> tuple[Times | None, list[str], list[Doubt]]:
    """Return the times of a table, what was left out for them, and what is odd about them."""
    try:
        times = times_of(table, spec, source, drop=drop)
    except InputError as error:
        return None, [str(error).removeprefix(f"{source}: ")], []
    notes = [note.removeprefix(f"{source}: ") for note in times.notes]
    return times, notes, [] if spec.column is None else stamp_doubts(times.t_s)
