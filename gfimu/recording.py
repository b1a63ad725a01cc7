"""Recordings: the one thing that passes between the world, the wire and the mind.

A recording is a table of samples: time, the specific force along each sensing axis, and references (tachometer,
command, encoder angle, temperature, gyro). Files are CSV or Parquet with the unit in each column's name; in memory
everything is SI. Raw counts stay counts only when asked for (``unit="lsb"``).
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq
from numpy.typing import ArrayLike, NDArray

from gfimu.array import AccelerometerArray
from gfimu.atomic_file import atomic_path
from gfimu.errors import InputError, UnitError
from gfimu.model_files import find_model, read_toml
from gfimu.units import READING_UNITS, REFERENCE_UNITS, STANDARD_GRAVITY

__all__ = ["Recording"]

_CHANNEL = re.compile(r"^([A-Za-z]+[0-9]+)_(.+)$")
_METADATA_KEY = b"gfimu"
_BLOCK_BYTES = 1 << 23
_DEFAULT_LSB = 0.0039 * STANDARD_GRAVITY


@dataclass(frozen=True)
class Recording:
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
        Array, part, sample rate, scenario, seed, software version, mounting.
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

    @property
    def sample_period(self) -> float:
        """Nominal sample period: the median step of the times, s."""
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

    @property
    def mounting_rotvec(self) -> NDArray[np.float64]:
        """Rotation vector by which the cube was turned from upright before this run, rad, shape (3,)."""
        value = np.asarray(self.metadata.get("mounting_rotvec_rad", [0.0, 0.0, 0.0]), dtype=float)
        if value.shape != (3,):
            raise InputError("metadata mounting_rotvec_rad must hold three numbers")
        return value

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
    def read(cls, path: str | Path, *, array: AccelerometerArray | None = None, unit: str = "m_s2") -> Recording:
        """Read a recording from a CSV or Parquet file.

        Parameters
        ----------
        path : str or Path
            ``.csv`` or ``.parquet`` file, one row per sample, unit in each column's name.
        array : AccelerometerArray, optional
            The array whose channels must be there; by default every channel found is read.
        unit : {"m_s2", "lsb"}
            Unit of the readings in memory; ``lsb`` keeps raw counts and refuses files without them.

        Raises
        ------
        InputError
            If the file is missing, empty, malformed, lacks a column, or its time does not increase; the message
            names the file, the line or column and the remedy.
        """
        file = Path(path)
        if not file.is_file():
            raise InputError(f"{file}: no such file; check the path")
        if file.stat().st_size == 0:
            raise InputError(f"{file}: empty file; record again or give another file")
        with file.open("rb") as stream:
            magic = stream.read(4)
        table = _ParquetTable(file) if magic == b"PAR1" else _CsvTable(file)
        return _assemble(cls, file, table, array, unit)

    def write(self, path: str | Path) -> None:
        """Write to a CSV or Parquet file (by extension), whole or not at all.

        Raises
        ------
        InputError
            If the extension is neither ``.csv`` nor ``.parquet``.
        """
        file = Path(path)
        columns = self.to_columns()
        if file.suffix == ".parquet":
            table = pa.table({name: pa.array(values, from_pandas=False) for name, values in columns.items()})
            table = table.replace_schema_metadata({_METADATA_KEY: json.dumps(dict(self.metadata)).encode()})
            with atomic_path(file) as temporary:
                pq.write_table(table, temporary, compression="zstd")
        elif file.suffix == ".csv":
            table = pa.table({name: pa.array(values, from_pandas=True) for name, values in columns.items()})
            with atomic_path(file) as temporary, temporary.open("wb") as stream:
                for key, value in self.metadata.items():
                    stream.write(f"# {key}: {json.dumps(value)}\n".encode())
                pa_csv.write_csv(table, stream, pa_csv.WriteOptions(quoting_style="none"))
        else:
            raise InputError(f"{file}: unknown recording format {file.suffix!r}; use .csv or .parquet")

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
            {"array": array.name, **(metadata or {})},
        )


class _ParquetTable:
    """Columns of a Parquet file, read block by block."""

    def __init__(self, file: Path) -> None:
        try:
            self.parquet = pq.ParquetFile(file, memory_map=True)
        except (pa.ArrowException, OSError) as error:
            raise InputError(f"{file}: not a readable Parquet file ({_first_line(error)}); write it again") from None
        self.names: list[str] = list(self.parquet.schema_arrow.names)
        raw = (self.parquet.schema_arrow.metadata or {}).get(_METADATA_KEY)
        self.metadata: dict[str, Any] = json.loads(raw) if raw else {}
        self.rows: int | None = self.parquet.metadata.num_rows
        self.file = file

    def blocks(self, columns: Sequence[str]) -> Iterator[pa.RecordBatch]:
        try:
            yield from self.parquet.iter_batches(batch_size=1 << 17, columns=list(columns))
        except (pa.ArrowException, OSError) as error:
            raise InputError(f"{self.file}: damaged Parquet file ({_first_line(error)}); write it again") from None


class _CsvTable:
    """Columns of a CSV file with optional leading ``# key: value`` lines, read block by block."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.metadata: dict[str, Any] = {}
        self.skip = 0
        self.rows: int | None = None
        try:
            with file.open(encoding="utf-8-sig") as stream:
                header = ""
                for line in stream:
                    if not line.startswith("#") and line.strip():
                        header = line
                        break
                    self.skip += 1
                    key, colon, value = line.lstrip("# ").partition(":")
                    if colon:
                        self.metadata[key.strip()] = _metadata_value(value.strip())
                if "\x00" in header:
                    raise InputError(f"{file}: binary data, not a recording; give a .csv or .parquet file")
                self.names = [name.strip().strip('"') for name in header.strip().split(",")]
        except UnicodeDecodeError:
            raise InputError(f"{file}: binary data, not a recording; give a .csv or .parquet file") from None
        if not header:
            raise InputError(f"{file}: no header line; the first line must name the columns, t_s first")
        duplicates = {name for name in self.names if self.names.count(name) > 1}
        if duplicates:
            raise InputError(f"{file}: column {min(duplicates)!r} appears twice; keep one")

    def blocks(self, columns: Sequence[str]) -> Iterator[pa.RecordBatch]:
        convert = pa_csv.ConvertOptions(
            include_columns=list(columns),
            column_types=dict.fromkeys(columns, pa.float64()),
            null_values=["", "nan", "NaN", "NA", "null"],
        )
        read = pa_csv.ReadOptions(column_names=self.names, skip_rows=self.skip + 1, block_size=_BLOCK_BYTES)
        try:
            with pa_csv.open_csv(self.file, read_options=read, convert_options=convert) as reader:
                yield from reader
        except (pa.ArrowException, OSError) as error:
            if "Empty CSV" in str(error):
                return
            raise self._locate(columns, error) from None

    def _locate(self, columns: Sequence[str], error: Exception) -> InputError:
        """Find the line and column that the CSV reader refused."""
        wanted = {self.names.index(name): name for name in columns}
        with self.file.open(encoding="utf-8-sig", errors="replace") as stream:
            for number, line in enumerate(stream, start=1):
                if number <= self.skip + 1 or not line.strip():
                    continue
                cells = line.rstrip("\r\n").split(",")
                if len(cells) != len(self.names):
                    return InputError(
                        f"{self.file}: line {number} has {len(cells)} columns, the header {len(self.names)}; "
                        "the file is cut off or damaged there"
                    )
                for place, name in wanted.items():
                    if cells[place].strip() and _is_text(cells[place]):
                        return InputError(
                            f"{self.file}: line {number}, column {name}: {cells[place].strip()!r} is not a number; "
                            "leave the cell empty where a value is missing"
                        )
        return InputError(f"{self.file}: not a readable CSV file ({_first_line(error)}); write it again")


def _is_text(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return True
    return False


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0][:120] if str(error) else type(error).__name__


def _metadata_value(text: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return text


def _assemble(
    cls: type[Recording],
    file: Path,
    table: _ParquetTable | _CsvTable,
    array: AccelerometerArray | None,
    unit: str,
) -> Recording:
    """Read the columns of a table into one recording, block by block into preallocated arrays."""
    if unit not in {"m_s2", "lsb"}:
        raise UnitError(f"unknown unit {unit!r} for readings; valid: m_s2, lsb")
    channels, factors, sources = _channel_columns(file, table, array, unit)
    references = _reference_columns(file, table.names)
    if "t_s" not in table.names:
        raise InputError(f"{file}: column t_s is missing; every recording needs the sample time in seconds")
    known = {"t_s", *sources, *references}
    extra_names = [name for name in table.names if name not in known]
    columns = ["t_s", *sources, *references]
    n = table.rows if table.rows is not None else _count_rows(file, table.skip)
    time = np.empty(n)
    readings = np.empty((n, len(channels)))
    reference = {_si_name(name): np.empty(n) for name in references}
    filled = 0
    for block in table.blocks(columns):
        rows = slice(filled, filled + block.num_rows)
        time[rows] = _as_float(file, "t_s", block.column(0))
        for place, (source, factor) in enumerate(zip(sources, factors, strict=True)):
            readings[rows, place] = _as_float(file, source, block.column(1 + place))
            if factor != 1.0:
                readings[rows, place] *= factor
        for place, name in enumerate(references):
            values = _as_float(file, name, block.column(1 + len(sources) + place))
            reference[_si_name(name)][rows] = values * _reference_factor(name)
        filled += block.num_rows
    if filled == 0:
        raise InputError(f"{file}: no samples below the header; record again or give another file")
    if filled < n:
        time, readings = time[:filled], readings[:filled]
        reference = {name: values[:filled] for name, values in reference.items()}
    _check_time(file, time)
    for place, source in enumerate(sources):
        bad = np.isinf(readings[:, place])
        if bad.any():
            raise InputError(f"{file}: column {source}, sample {int(np.argmax(bad)) + 1}: infinite; leave it empty")
    extra = _extra_columns(file, table, extra_names)
    return cls(time, readings, channels, reference, table.metadata, extra, unit)


def _channel_columns(
    file: Path, table: _ParquetTable | _CsvTable, array: AccelerometerArray | None, unit: str
) -> tuple[tuple[str, ...], list[float], list[str]]:
    """Channels to read, their factors to the unit wanted, and their column names."""
    found: dict[str, tuple[str, str]] = {}
    wanted = None if array is None else set(array.channels)
    for name in table.names:
        match = _CHANNEL.match(name)
        if match is None or (wanted is not None and match[1] not in wanted):
            continue
        if match[2] not in READING_UNITS:
            if wanted is not None or re.fullmatch(r"a[0-9]{2}", match[1]):
                valid = ", ".join(f"{match[1]}_{valid_unit}" for valid_unit in READING_UNITS)
                raise UnitError(f"{file}: column {name!r}: unknown unit {match[2]!r}; valid: {valid}")
            continue
        if match[1] in found:
            raise InputError(f"{file}: channel {match[1]} appears as {found[match[1]][0]} and {name}; keep one")
        found[match[1]] = (name, match[2])
    channels = tuple(found) if array is None else array.channels
    missing = [name for name in channels if name not in found]
    if missing or not channels:
        names = ", ".join(f"{name}_m_s2" for name in missing) or "a11_m_s2 …"
        raise InputError(f"{file}: column {names} is missing; add it (or _g, _mg, _lsb) or name another array")
    factors = []
    for channel in channels:
        source, channel_unit = found[channel]
        if (unit == "lsb") != (channel_unit == "lsb") and unit == "lsb":
            raise UnitError(f"{file}: column {source} is in {channel_unit}; raw counts ({channel}_lsb) are needed")
        factor = READING_UNITS[channel_unit]
        if factor is None:
            factor = 1.0 if unit == "lsb" else _lsb_size(array, channel, table.metadata)
        factors.append(factor)
    return channels, factors, [found[channel][0] for channel in channels]


def _lsb_size(array: AccelerometerArray | None, channel: str, metadata: Mapping[str, Any]) -> float:
    """Size of one count, m/s²: from the metadata, the array's part, or the ADXL345's 3.9 mg."""
    if "lsb_m_s2" in metadata:
        return float(metadata["lsb_m_s2"])
    part = metadata.get("part")
    if array is not None:
        part = next(chip.part for chip in array.chips if channel in chip.channels)
    if part is None:
        return _DEFAULT_LSB
    return float(read_toml(find_model("parts", str(part)))["lsb_m_s2"])


def _reference_columns(file: Path, names: Sequence[str]) -> list[str]:
    """Columns that hold references; a known quantity in an unknown unit is an error."""
    columns: dict[str, str] = {}
    for name in names:
        quantity = next((q for q in REFERENCE_UNITS if name.startswith(f"{q}_")), None)
        if quantity is None or name == "t_s":
            continue
        suffix = name[len(quantity) + 1 :]
        if suffix not in REFERENCE_UNITS[quantity]:
            if quantity == "t" and not re.fullmatch(r"(m|u|n)?s|min|h|us|ticks", suffix):
                continue
            valid = ", ".join(f"{quantity}_{unit}" for unit in REFERENCE_UNITS[quantity])
            raise UnitError(f"{file}: column {name!r}: unknown unit {suffix!r}; valid: {valid}")
        if quantity in columns:
            raise InputError(f"{file}: {quantity} appears as {columns[quantity]} and {name}; keep one")
        columns[quantity] = name
    return list(columns.values())


def _reference_factor(column: str) -> float:
    quantity = next(q for q in REFERENCE_UNITS if column.startswith(f"{q}_"))
    return REFERENCE_UNITS[quantity][column[len(quantity) + 1 :]]


def _si_name(column: str) -> str:
    quantity = next(q for q in REFERENCE_UNITS if column.startswith(f"{q}_"))
    return f"{quantity}_{next(iter(REFERENCE_UNITS[quantity]))}"


def _as_float(file: Path, name: str, column: pa.Array) -> NDArray[np.float64]:
    """Numbers of an Arrow column; nulls become NaN."""
    if not (pa.types.is_floating(column.type) or pa.types.is_integer(column.type)):
        raise InputError(f"{file}: column {name} holds {column.type}, not numbers; write it as numbers")
    return np.asarray(column.to_numpy(zero_copy_only=False), dtype=float)


def _count_rows(file: Path, skip: int) -> int:
    """Upper bound of the sample count of a CSV file: its lines after the header."""
    lines = 0
    with file.open("rb") as stream:
        while block := stream.read(_BLOCK_BYTES):
            lines += block.count(b"\n")
    return lines + 1 - skip


def _check_time(file: Path, time: NDArray[np.float64]) -> None:
    bad = ~np.isfinite(time)
    if bad.any():
        raise InputError(f"{file}: t_s is missing in sample {int(np.argmax(bad)) + 1}; every sample needs a time")
    backwards = np.diff(time) <= 0
    if backwards.any():
        place = int(np.argmax(backwards))
        raise InputError(
            f"{file}: t_s does not increase at sample {place + 2} ({time[place]:.9g} s, then {time[place + 1]:.9g} s); "
            "sort the file by time or drop the repeated samples"
        )


def _extra_columns(file: Path, table: _ParquetTable | _CsvTable, names: list[str]) -> dict[str, NDArray[Any]]:
    """Read the unknown columns as they are (numbers where they are numbers, text otherwise)."""
    if not names:
        return {}
    if isinstance(table, _ParquetTable):
        columns = table.parquet.read(columns=names)
    else:
        read = pa_csv.ReadOptions(column_names=table.names, skip_rows=table.skip + 1)
        columns = pa_csv.read_csv(file, read_options=read, convert_options=pa_csv.ConvertOptions(include_columns=names))
    return {name: columns.column(name).to_numpy(zero_copy_only=False) for name in names}
