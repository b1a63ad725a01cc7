"""Recordings: the one thing that passes between the world, the wire and the mind.

A recording is a table of samples: time, the specific force along each sensing axis, and references (tachometer,
command, encoder angle, temperature, gyro). Files are CSV or Parquet with the unit in each column's name; in memory
everything is SI. Raw counts stay counts only when asked for (``unit="lsb"``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.errors import InputError, UnitError
from gfimu.files.column_file import write_columns
from gfimu.files.table import ArrowStream, Tabular
from gfimu.geometry.array import AccelerometerArray
from gfimu.recording.carried_array import array_metadata, carried_array, with_carried_array
from gfimu.recording.file import read_recording_file
from gfimu.short_repr import joined, timing

__all__ = ["Recording"]


@dataclass(frozen=True)
class Recording(Tabular):
    """Samples of an accelerometer array and its references.

    Parameters
    ----------
    t_s : ndarray, shape (n,)
        Sample times on the board's clock, s, strictly increasing.
    readings : ndarray, shape (n, c)
        Specific force along each sensing axis, in ``unit``; NaN where a channel is missing in a sample.
    channels : tuple of str
        Names of the c columns.
    reference : mapping of str to ndarray, shape (n,)
        References by their SI column names: ``tacho_rad_s``, ``command_rad_s``, ``angle_rad``,
        ``temperature_degC``, ``gyro_x_rad_s`` and so on; NaN where one has no value.
    metadata : mapping
        Array (name and text of its file), part, sample rate, scenario, seed, software version, mounting.
    extra : mapping of str to ndarray
        Columns that the format does not know, kept as they came.
    unit : {"m_s2", "lsb"}
        Unit of ``readings``.
    """

    t_s: NDArray[np.float64]
    readings: NDArray[np.float64]
    channels: tuple[str, ...]
    reference: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    metadata: Mapping[str, Any] = field(default_factory=dict)
    extra: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    unit: str = "m_s2"

    def __post_init__(self) -> None:
        if self.readings.shape != (len(self.t_s), len(self.channels)):
            raise InputError(
                f"readings have shape {self.readings.shape}; "
                f"{len(self.t_s)} times and {len(self.channels)} channels need that many rows and columns"
            )

    def __len__(self) -> int:
        return len(self.t_s)

    def __repr__(self) -> str:
        name = self.metadata.get("array")
        unit = {"m_s2": "m/s²", "lsb": "counts"}.get(self.unit, self.unit)
        corrupt = sum(self.corrupt.values())
        return joined(
            self,
            [
                name if isinstance(name, str) else "no array",
                f"{len(self.channels)} channels in {unit}",
                timing(self.t_s),
                f"{corrupt} corrupt values left out" if corrupt else "",
                f"references {', '.join(self.reference)}" if self.reference else "",
            ],
        )

    @property
    def sample_period(self) -> float:
        """Nominal sample period, the median step of the times, s."""
        if len(self.t_s) < 2:
            raise InputError("a recording of fewer than two samples has no sample rate; record longer")
        return float(np.median(np.diff(self.t_s)))

    @property
    def sample_rate(self) -> float:
        """Nominal sample rate, Hz."""
        return 1.0 / self.sample_period

    @property
    def duration(self) -> float:
        """Time from the first to the last sample, s."""
        return float(self.t_s[-1] - self.t_s[0]) if len(self.t_s) else 0.0

    @cached_property
    def array(self) -> AccelerometerArray | None:
        """The array that the recording carries in its metadata, or only names there; None if it does neither.

        Raises `InputError` if its text is damaged or its name unknown.
        """
        return carried_array(self.metadata)

    @property
    def corrupt(self) -> dict[str, int]:
        """How many values were left out of each channel or reference as they can be no measurement; empty if none."""
        counts = self.metadata.get("corrupt_values")
        items = counts.items() if isinstance(counts, Mapping) else ()
        return {str(name): count for name, count in items if isinstance(count, int)}

    @property
    def dropped(self) -> dict[str, int]:
        """How many rows were left out on request or for their times, by the reason; empty if none."""
        counts = self.metadata.get("dropped_rows")
        items = counts.items() if isinstance(counts, Mapping) else ()
        return {str(kind): count for kind, count in items if isinstance(count, int)}

    @property
    def mounting_rotvec(self) -> NDArray[np.float64]:
        """Rotation vector by which the array was turned from upright before this run, rad, shape (3,)."""
        value = self.metadata.get("mounting_rotvec_rad", [0.0, 0.0, 0.0])
        try:
            vector = np.asarray(value, dtype=float)
        except (TypeError, ValueError):
            vector = np.empty(0)
        if vector.shape != (3,) or not np.isfinite(vector).all():
            raise InputError(f"metadata mounting_rotvec_rad is {value!r}; it must hold three numbers, in rad")
        return vector

    @property
    def gaps(self) -> NDArray[np.intp]:
        """Indices i with a gap (more than 1.5 sample periods) between samples i and i + 1."""
        return np.flatnonzero(np.diff(self.t_s) > 1.5 * self.sample_period)

    def slice(self, start: int | None = None, stop: int | None = None) -> Recording:
        """Return the samples from index ``start`` up to ``stop``, as views."""
        rows = slice(start, stop)
        return replace(
            self,
            t_s=self.t_s[rows],
            readings=self.readings[rows],
            reference={key: value[rows] for key, value in self.reference.items()},
            extra={key: value[rows] for key, value in self.extra.items()},
        )

    def between(self, start_s: float, stop_s: float) -> Recording:
        """Return the samples with start_s ≤ t < stop_s, as views."""
        first, last = np.searchsorted(self.t_s, [start_s, stop_s])
        return self.slice(int(first), int(last))

    def carrying(self, array: AccelerometerArray) -> Recording:
        """Return the recording with ``array`` as the one that it carries."""
        others = {key: value for key, value in self.metadata.items() if key != "parts_toml"}
        part = {"part": array.chips[0].part} if "part" in others else {}
        return replace(self, metadata=others | part | array_metadata(array))

    def for_array(self, array: AccelerometerArray) -> NDArray[np.float64]:
        """Return the readings in the channel order of ``array``, shape (n, c), m/s².

        Raises
        ------
        InputError
            If a channel of the array is not in the recording.
        UnitError
            If the readings are raw counts.
        """
        if self.unit != "m_s2":
            raise UnitError(f"readings are in {self.unit}; m/s² is needed here: read the file without unit='lsb'")
        if self.channels == array.channels:
            return self.readings
        missing = [name for name in array.channels if name not in self.channels]
        if missing:
            raise InputError(
                f"the recording lacks {', '.join(missing)} of array {array.name!r}; "
                f"it has {', '.join(self.channels)}: name the array it was made with"
            )
        return self.readings[:, [self.channels.index(name) for name in array.channels]]

    @classmethod
    def read(
        cls,
        path: str | Path | ArrowStream,
        *,
        array: AccelerometerArray | None = None,
        unit: str = "m_s2",
        needs_channels: bool = True,
    ) -> Recording:
        """Read a recording from a CSV or Parquet file, or from a table of pandas, polars or pyarrow.

        Values that can be no measurement (infinite, or far beyond any part's range) become NaN with a
        `gfimu.errors.CorruptValueWarning`, and are counted in `corrupt`.

        Parameters
        ----------
        path : str, Path or table
            ``.csv`` or ``.parquet`` file, one row per sample, unit in each column's name; or a table object with the
            same columns: a pandas table (``attrs`` are the metadata; an index named ``t_s`` is the time), or anything
            with ``__arrow_c_stream__``.
        array : AccelerometerArray, optional
            The array whose channels must be there; by default every channel found is read.
        unit : {"m_s2", "lsb"}
            Unit of the readings in memory; ``lsb`` keeps raw counts and refuses files without them.
        needs_channels : bool
            Refuse a file of references alone, such as that of a gyro on a rate table.

        Raises
        ------
        InputError
            If the file is missing, empty, malformed, lacks a column, or its time does not increase; the message
            names the file, the line or column and the remedy.
        """
        content = read_recording_file(path, array, unit, needs_channels=needs_channels)
        return cls(**{item.name: getattr(content, item.name) for item in fields(content)}, unit=unit)

    def write(self, path: str | Path) -> None:
        """Write to a CSV or Parquet file (by extension), whole or not at all.

        The file carries the array in its metadata; one of ``models/arrays`` that is only named is added.

        Raises
        ------
        InputError
            If the extension is neither ``.csv`` nor ``.parquet``, or the folder can't be written to.
        """
        write_columns(path, self.to_columns(), with_carried_array(self.metadata, self.channels))

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return the columns of the file, by name with unit."""
        columns: dict[str, NDArray[Any]] = {"t_s": self.t_s}
        for number, channel in enumerate(self.channels):
            columns[f"{channel}_{self.unit}"] = self.readings[:, number]
        return columns | dict(self.reference) | dict(self.extra)

    @classmethod
    def from_arrays(
        cls,
        t_s: ArrayLike,
        readings: ArrayLike,
        array: AccelerometerArray,
        *,
        reference: Mapping[str, ArrayLike] | None = None,
        metadata: Mapping[str, Any] | None = None,
    ) -> Recording:
        """Build a recording from times (n,), readings (n, c) in m/s² and references, each (n,)."""
        return cls(
            np.asarray(t_s, dtype=float),
            np.asarray(readings, dtype=float),
            array.channels,
            {key: np.asarray(value, dtype=float) for key, value in (reference or {}).items()},
            {**array_metadata(array), **(metadata or {})},
        )
