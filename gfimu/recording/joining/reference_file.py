"""A file with a clock of its own: a tachometer, encoder angle or gyro, or another logger with channels."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.base.files.input_file import is_there
from gfimu.recording.formats import open_recording
from gfimu.recording.importing import ColumnMap, load_map
from gfimu.recording.importing.recognise import map_hint
from gfimu.recording.joining.basis import Basis
from gfimu.recording.mapped import mapped_reference
from gfimu.recording.quantities import GYRO_COLUMNS, REFERENCE_UNITS
from gfimu.recording.tables.column_file import open_columns

__all__ = ["ReferenceSeries", "open_reference"]

TABLE_COLUMNS = ("tacho_rad_s", "command_rad_s", "angle_rad")
"""References of a table's rate or angle, the first that is there being used."""
_FEWEST = 8  # values of a reference
_CHANNEL = re.compile(r"[A-Za-z]+[0-9]+_(m_s2|g|mg|lsb)")  # a column of a channel


@dataclass(frozen=True)
class ReferenceSeries:
    """References, and channels of another logger, on a clock of their own.

    Parameters
    ----------
    source : str
        Where they come from, for messages.
    t_s : ndarray, shape (m,)
        Times, s, strictly increasing.
    columns : mapping of str to ndarray, shape (m,)
        References by their name in a recording, SI.
    origin_s : float
        Time on the file's clock at which ``t_s`` is zero, s.
    channels : mapping of str to ndarray, shape (m,)
        Accelerations of a logger by channel, m/s².
    """

    source: str
    t_s: NDArray[np.float64]
    columns: Mapping[str, NDArray[np.float64]]
    origin_s: float = 0.0
    channels: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)

    @property
    def period(self) -> float:
        """Median step of the times, s."""
        return float(np.median(np.diff(self.t_s)))

    @property
    def gyro(self) -> NDArray[np.float64] | None:
        """Rates of a whole gyro, (m, 3), rad/s; None without one."""
        names = [name for name in GYRO_COLUMNS if name in self.columns]
        return np.column_stack([self.columns[name] for name in names]) if len(names) == 3 else None

    def basis(self) -> Basis:
        """Return the functions of the reference that the readings of a file on the same body are linear in.

        Raises
        ------
        InputError
            If there is neither a tachometer, an angle, a command, a whole gyro nor a channel.
        """
        name = next((one for one in TABLE_COLUMNS if one in self.columns), None)
        if name is not None:
            t, values = self._known(self.columns[name][:, None])
            is_angle = name == "angle_rad"
            return Basis.of_table(t, np.unwrap(values[:, 0]) if is_angle else values[:, 0], is_angle=is_angle)
        if self.gyro is None and not self.channels:
            raise InputError(
                f"{self.source}: no angular rate among {', '.join(self.columns) or 'its columns'}; "
                "a tachometer, angle, command, gyro of three axes or accelerations are needed"
            )
        known = [*([] if self.gyro is None else [self.gyro]), *(one[:, None] for one in self.channels.values())]
        t, values = self._known(np.column_stack(known))
        channels = dict(zip(self.channels, values[:, values.shape[1] - len(self.channels) :].T, strict=True))
        return Basis.of_body(t, None if self.gyro is None else values[:, :3], channels)

    def _known(self, values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        rows = np.isfinite(values).all(axis=1)
        if rows.sum() < _FEWEST:
            raise InputError(f"{self.source}: only {int(rows.sum())} values of the reference; record longer")
        return self.t_s[rows], values[rows]


def open_reference(path: str | Path, column_map: ColumnMap | str | Path | None = None) -> ReferenceSeries:
    """Read a file of references or of another logger: columns as in a recording (``t_s`` …), or by a column map.

    Raises
    ------
    InputError
        If the file can't be read, or holds no reference.
    """
    if column_map is not None:
        chosen = load_map(column_map)
        return _without_channels(ReferenceSeries(str(path), *mapped_reference(path, chosen)))
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
