"""A file with a clock of its own: a tachometer, encoder angle or gyro, or another logger with channels."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from gfimu.base.errors import InputError
from gfimu.base.files.input_file import is_there
from gfimu.recording.formats import open_recording
from gfimu.recording.importing import ColumnMap, load_map
from gfimu.recording.importing.recognise import map_hint
from gfimu.recording.joining.series import TABLE_COLUMNS, ReferenceSeries
from gfimu.recording.mapped import mapped_reference
from gfimu.recording.quantities import REFERENCE_UNITS
from gfimu.recording.tables.column_file import open_columns

__all__ = ["open_reference"]

_CHANNEL = re.compile(r"[A-Za-z]+[0-9]+_(m_s2|g|mg|lsb)")  # a column of a channel


def open_reference(
    path: str | Path, column_map: ColumnMap | str | Path | None = None, else_by: ColumnMap | None = None
) -> ReferenceSeries:
    """Read a file of references or of another logger: columns as in a recording (``t_s`` …), or by a column map.

    ``else_by`` is the map of the channels' file, which may be that of this file too.

    Raises
    ------
    InputError
        If the file can't be read, or holds neither a reference nor channels.
    """
    if column_map is not None:
        return _without_channels(ReferenceSeries(str(path), *mapped_reference(path, load_map(column_map))))
    try:
        return _of_columns(path)
    except InputError as error:
        if else_by is None:
            raise
        try:
            return open_reference(path, else_by)
        except InputError:
            raise error from None


def _of_columns(path: str | Path) -> ReferenceSeries:
    """Read a file whose columns are named as in a recording."""
    try:
        table = open_columns(path)
    except InputError as error:
        hint = map_hint(path) if is_there(path) else ""
        raise InputError(f"{error}" + (f"; {hint} (here --reference-map)" if hint else "")) from None
    factors = {
        f"{name}_{unit}": (f"{name}_{next(iter(units))}", factor)
        for name, units in REFERENCE_UNITS.items()
        for unit, factor in units.items()
    }
    names = [name for name in table.names if name in factors and name != "t_s"]
    if "t_s" in table.names and any(_CHANNEL.fullmatch(name) for name in table.names):
        run = open_recording(path)
        channels = dict(zip(run.channels, run.readings.T, strict=True))
        origin = run.metadata.get("time_origin_s", 0.0)
        origin_s = float(origin) if isinstance(origin, int | float) else 0.0
        return _without_channels(ReferenceSeries(str(path), run.t_s, run.reference, origin_s, channels))
    if "t_s" not in table.names or not names:
        hint = map_hint(path)
        missing = (
            "column t_s is missing" if "t_s" not in table.names else "no reference; name one tacho_rpm, angle_deg …"
        )
        raise InputError(f"{path}: {missing}" + (f"; {hint} (here --reference-map)" if hint else ""))
    blocks = list(table.blocks(["t_s", *names]))
    if not blocks:
        raise InputError(f"{path}: no samples below the header; record again or give another file")
    t, *values = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    if not np.isfinite(t).all() or np.any(np.diff(t) <= 0):
        raise InputError(f"{path}: t_s does not increase throughout; sort by time or drop the repeated samples")
    columns = {factors[name][0]: value * factors[name][1] for name, value in zip(names, values, strict=True)}
    origin = table.metadata.get("time_origin_s", 0.0)
    return ReferenceSeries(str(path), t, columns, float(origin) if isinstance(origin, int | float) else 0.0)


def _without_channels(series: ReferenceSeries) -> ReferenceSeries:
    """Return the series without channels where they hold a table's rate, which then stands for the motion alone."""
    return replace(series, channels={}) if series.channels and set(TABLE_COLUMNS) & set(series.columns) else series
