"""Which of the shipped maps a file of unknown origin fits."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np

from gfimu.base.errors import GfimuError, InputError
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.recording.importing.clock import times_of
from gfimu.recording.importing.column_map import ColumnMap, list_maps, load_map
from gfimu.recording.importing.guessing.times import RATES
from gfimu.recording.importing.guessing.units import NEAR, rest_windows
from gfimu.recording.importing.raw_table import RawFile, RawTable
from gfimu.recording.importing.readers import read_foreign
from gfimu.recording.quantities import READING_UNITS
from gfimu.recording.units import bracketed_unit, factor_of, kind_of

__all__ = ["fitting_maps", "map_hint", "own_chips"]

_FULLY = 3  # rate and gravity
_FAR = 20.0  # times gravity, or its inverse, at rest by a map: the units are others
_CHANNEL = re.compile(rf"([A-Za-z]+[0-9]*)[0-9]_({'|'.join(READING_UNITS)})")


def own_chips(columns: Sequence[str]) -> dict[str, list[str]]:
    """Return the channels of each chip where columns are named as in a recording of gfimu's (t_s, a11_m_s2 …)."""
    chips: dict[str, list[str]] = {}
    for name in columns if "t_s" in columns else ():
        found = _CHANNEL.fullmatch(name)
        if found is not None:
            chips.setdefault(found[1], []).append(name)
    return chips


def map_hint(path: str | Path) -> str:
    """Return how a file that is no recording of gfimu's may be read, for a message; empty if there is no way."""
    try:
        raw = read_foreign(path)
    except GfimuError:
        return ""
    if any(table.find("t_s") for table in raw.tables.values()):
        return ""  # a recording of gfimu's with another fault
    fitting = fitting_maps(raw)
    if fitting:
        return f"it looks like a file for --map {' or '.join(fitting[:2])}"
    return f"gfimu inspect {path} shows what it holds and prints a column map for --map"


def fitting_maps(raw: RawFile, *, fully: bool = False) -> list[str]:
    """Return the shipped maps that a file has all columns of and that give the most plausible rate and gravity.

    A map that makes gravity at rest wrong by a factor of twenty, as one in counts does of readings in g, fits none.
    ``fully``: only maps that make both the rate and gravity right.
    """
    found = []
    for name, column_map in _shipped_maps().items():
        if column_map.format and column_map.format != raw.format:
            continue
        tables = [one for key, one in raw.tables.items() if not column_map.table or key == column_map.table]
        score = max((_score(table, column_map) for table in tables), default=0)
        plausible = _plausibility(raw, column_map) if score else None
        if plausible is not None:
            found.append((plausible, score, name))
    best = max((plausible for plausible, *_ in found), default=0)
    if fully and best < _FULLY:
        return []
    return [name for plausible, _, name in sorted(found, key=lambda one: (-one[1], one[2])) if plausible == best]


@cache
def _shipped_maps() -> dict[str, ColumnMap]:
    """Return the shipped maps by name, which every file of unknown origin is compared with."""
    return {name: load_map(name) for name in list_maps()}


def _score(table: RawTable, column_map: ColumnMap) -> int:
    """Return how many columns of a map a table has; 0 if it lacks one that is needed."""
    if column_map.text.columns:  # the file itself has no names: their number has to do
        return len(table.columns) if not table.named and len(table.columns) == len(column_map.text.columns) else 0
    if not table.named:
        return 0
    columns = {**column_map.channels, **column_map.reference}
    present = [name for name, spec in columns.items() if table.find(spec.column) is not None]
    missing = [
        name
        for name, spec in columns.items()
        if name not in present and column_map.is_required(name) and not spec.table
    ]
    has_time = column_map.time.column is None or table.find(column_map.time.column) is not None
    return 0 if missing or not has_time else len(present) + 1


def _plausibility(raw: RawFile, column_map: ColumnMap) -> int | None:
    """Return how well rate (1) and gravity (2) are as they should be by a map; None where gravity is far off."""
    for found in raw.tables.values():
        table = found
        if column_map.text.columns and len(found.columns) == len(column_map.text.columns):
            table = RawTable(found.name, dict(zip(column_map.text.columns, found.columns.values(), strict=True)))
        three = [(table.find(spec.column), spec) for spec in list(column_map.channels.values())[:3]]
        if any(name is None for name, _ in three):
            continue
        units = [bracketed_unit(str(name))[1] for name, _ in three]
        if any(
            unit and _step(unit) != spec.scale * _step(spec.unit) for unit, (_, spec) in zip(units, three, strict=True)
        ):
            return None
        values = np.column_stack(
            [
                (table.numbers(str(name)) - spec.offset) * spec.scale * factor_of(spec.unit, "acceleration")
                for name, spec in three
            ]
        )
        windows = rest_windows(values)
        length = float(np.median(np.linalg.norm(windows, axis=1))) if len(windows) else 0.0
        if length and not 1.0 / _FAR < length / STANDARD_GRAVITY < _FAR:
            return None
        gravity = abs(length / STANDARD_GRAVITY - 1.0) < NEAR
        if column_map.text.columns and not gravity:
            return None  # without names gravity alone speaks for a map
        try:
            rate = times_of(table, column_map.time, raw.source).rate_hz
        except InputError:
            return 2 * gravity
        return 2 * gravity + (RATES[0] <= rate <= RATES[1])
    return 0


def _step(unit: str) -> float:
    return factor_of(unit, "acceleration") if kind_of(unit) == "acceleration" else 0.0
