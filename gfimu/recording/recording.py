"""Recordings: the one thing that passes between the world, the wire and the mind.

A recording is a table of samples: time, the specific force along each sensing axis, and references (tachometer,
command, encoder angle, temperature, gyro). Files are CSV or Parquet with the unit in each column's name; in memory
everything is SI. Raw counts stay counts only when asked for (``unit="lsb"``).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError, UnitError
from gfimu.base.files.column_file import write_columns
from gfimu.base.files.memory import MemorySize, with_memory
from gfimu.base.files.table import ArrowStream
from gfimu.base.files.table_columns import TableColumns
from gfimu.base.results import Panel, PlottedResult, Series, axis_series
from gfimu.base.short_repr import joined, timing
from gfimu.recording.carried_array import array_metadata, carried_array, with_carried_array
from gfimu.recording.file import read_recording_file

__all__ = ["Recording"]

_ARRAYS = "NumPy arrays"
_BARE = re.compile(r"[A-Za-z]+[0-9]+")  # a channel's name without a unit
_UNIT_WORDS = {"m_s2": "m/s²", "lsb": "counts"}


def _few(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= 4 else f"{', '.join(names[:3])} and {len(names) - 3} more"


@dataclass(frozen=True)
class Recording(PlottedResult):
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
    unit_from : {"", "unit", "units", "column_map"}
        Which argument stated the unit of the numbers that it was made from, for messages; by default the columns' names
        did. It is not written to files.

    Examples
    --------
    >>> import gfimu
    >>> run = gfimu.simulate("rest", seed=1)
    >>> run.channels[:3], run.reference.keys() >= {"tacho_rad_s"}
    (('a11', 'a12', 'a13'), True)
    >>> gfimu.Recording.read(run.to_pandas()).channels == run.channels
    True
    """

    t_s: NDArray[np.float64]
    readings: NDArray[np.float64]
    channels: tuple[str, ...]
    reference: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    metadata: Mapping[str, Any] = field(default_factory=dict)
    extra: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    unit: str = "m_s2"
    unit_from: str = ""

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
        unit = _UNIT_WORDS.get(self.unit, self.unit)
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

    def _facts(self) -> list[tuple[str, str]]:
        name = self.metadata.get("array")
        corrupt, gaps = sum(self.corrupt.values()), len(self.gaps) if len(self) > 1 else 0
        facts = [
            ("array", name if isinstance(name, str) else "not named"),
            ("channels", f"{len(self.channels)} in {_UNIT_WORDS.get(self.unit, self.unit)}"),
            ("samples", timing(self.t_s)),
            ("references", ", ".join(self.reference) or "none"),
            ("further columns", _few(list(self.extra))),
            ("lost", f"{gaps} gaps in time" if gaps else ""),
            ("corrupt values left out", str(corrupt) if corrupt else ""),
        ]
        facts += [(key, str(self.metadata[key])) for key in ("scenario", "seed", "calibration") if key in self.metadata]
        return [(word, value) for word, value in facts if value]

    def _panels(self) -> list[Panel]:
        chips = list(dict.fromkeys(channel[:-1] for channel in self.channels))
        unit = _UNIT_WORDS.get(self.unit, self.unit)
        panels = []
        for axis in dict.fromkeys(channel[-1] for channel in self.channels):
            series = tuple(
                Series(name, self.readings[:, index], chip=chips.index(name[:-1]))
                for index, name in enumerate(self.channels)
                if name[-1] == axis
            )
            panels.append(Panel(f"axis {axis} of each chip", f"specific force, {unit}", series, self.t_s))
        rates = tuple(
            Series(name.removesuffix("_rad_s"), self.reference[name], style=style)
            for name, style in (("tacho_rad_s", "line"), ("command_rad_s", "dashes"))
            if name in self.reference
        )
        if rates:
            panels.append(Panel("reference rate", "rate, rad/s", rates, self.t_s))
        gyro = [self.reference.get(f"gyro_{axis}_rad_s") for axis in "xyz"]
        if all(one is not None for one in gyro):
            vectors = np.column_stack([one for one in gyro if one is not None])
            panels.append(Panel("reference gyro", "rate, rad/s", axis_series(vectors), self.t_s))
        for name, label in (("angle_rad", "angle, rad"), ("temperature_degC", "temperature, °C")):
            if name in self.reference:
                panels.append(Panel(label.partition(",")[0], label, (Series("", self.reference[name]),), self.t_s))
        return panels

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
        max_memory: MemorySize | None = None,
    ) -> Recording:
        """Read a recording from a CSV or Parquet file, or from a table of pandas, polars or pyarrow.

        Values that can be no measurement (infinite, or far beyond any part's range) become NaN with a
        `gfimu.base.errors.CorruptValueWarning`, and are counted in `corrupt`.

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
        max_memory : int or str, optional
            Memory that reading a file may take, bytes or ``"2GB"``; by default four times its size and 500 MB.

        Raises
        ------
        InputError
            If the file is missing, empty, malformed, lacks a column, or its time does not increase; the message
            names the file, the line or column and the remedy.
        """
        source = with_memory(path, max_memory) if isinstance(path, str | Path) else path
        content = read_recording_file(source, array, unit, needs_channels=needs_channels)
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
        for index, channel in enumerate(self.channels):
            columns[f"{channel}_{self.unit}"] = self.readings[:, index]
        return columns | dict(self.reference) | dict(self.extra)

    @classmethod
    def from_table(
        cls,
        table: ArrowStream,
        *,
        array: AccelerometerArray | str | None = None,
        units: str | Mapping[str, str] | None = None,
        unit: str = "m_s2",
    ) -> Recording:
        """Build a recording from a table of pandas, polars or pyarrow, with the checks of a file.

        Parameters
        ----------
        table : table
            One row per sample: ``t_s``, a column per channel with its unit in the name (``a11_m_s2``), references.
            The index of a pandas table that is named ``t_s`` is the time.
        array : AccelerometerArray or str, optional
            The array or its name; by default the one in the table's metadata.
        units : str or mapping of str to str, optional
            Units of columns that are named without one: one unit for all channels of the array (``"g"``), or one for
            each column (``{"t": "s", "a11": "g", "tacho": "rpm"}``).
        unit : {"m_s2", "lsb"}
            Unit of the readings in memory.

        Raises
        ------
        InputError
            As `Recording.read`; also if ``units`` names a column that the table lacks.

        Examples
        --------
        >>> import gfimu
        >>> run = gfimu.simulate("rest", seed=1)
        >>> gfimu.Recording.from_table(run.to_pandas()).readings.shape == run.readings.shape
        True
        """
        geometry = AccelerometerArray.load(array) if isinstance(array, str) else array
        columns = TableColumns(table)
        if isinstance(units, str):
            channels = None if geometry is None else geometry.channels
            bare = [name for name in columns.names if (name in channels if channels else _BARE.fullmatch(name))]
            columns.rename({name: f"{name}_{units}" for name in bare})
        elif units is not None:
            columns.rename({name: f"{name}_{one}" for name, one in units.items()})
        found = cls._read(columns, geometry, unit, "units" if isinstance(units, str) else "")
        return found if geometry is None else found.carrying(geometry)

    @classmethod
    def from_arrays(
        cls,
        t_s: ArrayLike,
        readings: ArrayLike,
        array: AccelerometerArray | str,
        *,
        reference: Mapping[str, ArrayLike] | None = None,
        metadata: Mapping[str, Any] | None = None,
        unit: str = "m_s2",
    ) -> Recording:
        """Build a recording from NumPy arrays, with the checks of a file.

        Parameters
        ----------
        t_s : array_like, shape (n,)
            Sample times, s, strictly increasing.
        readings : array_like, shape (n, c)
            Readings in the channel order of the array; NaN where a channel is missing in a sample.
        array : AccelerometerArray or str
            The array or its name.
        reference : mapping of str to array_like, shape (n,), optional
            References by column name with unit: ``tacho_rad_s``, ``gyro_x_rad_s``.
        metadata : mapping, optional
            Further metadata of the recording.
        unit : {"m_s2", "g", "mg", "lsb"}
            Unit of ``readings``; in memory all but ``lsb`` become m/s².

        Raises
        ------
        InputError
            If the shapes don't fit, the times do not increase, or most readings are impossible for their unit.

        Examples
        --------
        >>> import numpy as np
        >>> import gfimu
        >>> cube = gfimu.AccelerometerArray.load("cube12")
        >>> level = np.tile(cube.axes @ [0.0, 0.0, 1.0], (200, 1))
        >>> gfimu.Recording.from_arrays(np.arange(200) / 100.0, level, "cube12", unit="g")
        Recording(cube12, 12 channels in m/s², 200 samples, 1.99 s at 100 Hz)
        """
        geometry = AccelerometerArray.load(array) if isinstance(array, str) else array
        time, values = np.asarray(t_s, dtype=float), np.asarray(readings, dtype=float)
        if time.ndim != 1 or values.shape != (len(time), geometry.n_channels):
            raise InputError(
                f"{_ARRAYS}: times have shape {time.shape} and readings {values.shape}; array {geometry.name!r} needs "
                f"times (n,) and readings (n, {geometry.n_channels})"
            )
        columns: dict[str, Any] = {"t_s": time}
        columns |= {f"{name}_{unit}": values[:, index] for index, name in enumerate(geometry.channels)}
        columns |= {name: np.asarray(value, dtype=float) for name, value in (reference or {}).items()}
        for name, value in columns.items():
            if value.shape != time.shape:
                raise InputError(
                    f"{_ARRAYS}: {name} has shape {value.shape}; it needs one value per sample, {time.shape}"
                )
        table = TableColumns.of(columns, {**array_metadata(geometry), **(metadata or {})}, _ARRAYS)
        return cls._read(table, geometry, "lsb" if unit == "lsb" else "m_s2", "unit")

    @classmethod
    def _read(cls, table: TableColumns, array: AccelerometerArray | None, unit: str, unit_from: str) -> Recording:
        return replace(cls.read(cast("ArrowStream", table), array=array, unit=unit), unit_from=unit_from)
