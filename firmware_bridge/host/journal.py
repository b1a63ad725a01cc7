"""A recording that can be read at any moment while it is being written.

Samples are appended as lines of text, only whole lines in each write, and no write longer than a memory page: when the
process is killed, the file ends behind a whole sample. `finish` puts the proper file in its place.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq
from numpy.typing import NDArray

from gfimu.base.errors import GfimuError, InputError
from gfimu.base.files.atomic_file import atomic_path

__all__ = ["Journal", "JournalError"]

_PAGE = 4096
_BLOCK_BYTES = 1 << 22
_TEMPERATURE = "temperature_degC"


class JournalError(GfimuError):
    """The disk is full or failed while a recording was being written; what was written is left readable."""


class Journal:
    """Appends samples to a file and turns it into a recording in the end.

    Parameters
    ----------
    path : str or Path
        ``.csv`` or ``.parquet``; until `finish` the file holds text under either name, which `Recording.read` reads.
    channels : tuple of str
        Names of the channels; their columns are raw counts, ``…_lsb``.
    metadata : mapping
        Metadata known at the start.
    has_temperature : bool
        Whether the samples have a temperature: then there is a column for it.

    Raises
    ------
    InputError
        If the extension is unknown or the file can't be written.
    JournalError
        If the disk is full.
    """

    def __init__(
        self, path: str | Path, channels: tuple[str, ...], metadata: Mapping[str, Any], *, has_temperature: bool = False
    ) -> None:
        self.path = Path(path)
        if self.path.suffix not in {".csv", ".parquet"}:
            raise InputError(f"{path}: unknown recording format {self.path.suffix!r}; use .csv or .parquet")
        self.samples = 0
        self._has_temperature = has_temperature
        self.columns = ["t_s", *(f"{channel}_lsb" for channel in channels), "status"]
        self.columns += [_TEMPERATURE] if has_temperature else []
        lines = [f"# {key}: {json.dumps(value)}\n" for key, value in metadata.items()]
        try:
            flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND | getattr(os, "O_BINARY", 0)
            self._file = os.open(self.path, flags, 0o666)
        except OSError as error:
            raise InputError(f"{path}: {error.strerror or error}; choose a file that can be written") from None
        self._metadata = dict(metadata)
        self._header = ",".join(self.columns) + "\n"
        self._header_lines = len(lines) + 1
        self._size = 0
        self._is_narrow = True  # every count fits into 16 bits
        try:
            self._write(("".join(lines) + self._header).encode())
        except JournalError:
            os.close(self._file)
            self.path.unlink(missing_ok=True)
            raise
        self.samples = 0  # the lines so far are the header

    def append(
        self,
        t_s: NDArray[np.float64],
        counts: NDArray[np.float64],
        status: NDArray[np.uint16],
        temperature_degC: NDArray[np.float64] | None = None,
    ) -> None:
        """Append samples: times (n,), s, counts (n, c), status bits, temperatures, °C; NaN where one is missing."""
        if not len(t_s):
            return
        columns: list[Any] = [pa.array(np.round(t_s, 7))]
        missing = np.isnan(counts)
        whole = np.where(missing, 0, counts).astype(np.int32)
        self._is_narrow &= bool(np.abs(whole).max(initial=0) < 1 << 15)
        for index in range(counts.shape[1]):
            mask = missing[:, index]
            columns.append(pa.array(whole[:, index], mask=mask if mask.any() else None))
        columns.append(pa.array(status))
        if self._has_temperature:
            warm = np.full(len(t_s), np.nan) if temperature_degC is None else temperature_degC
            columns.append(pa.array(np.round(warm, 4), mask=np.isnan(warm)))
        sink = io.BytesIO()
        options = pa_csv.WriteOptions(include_header=False, quoting_style="none")
        pa_csv.write_csv(pa.table(columns, names=self.columns), sink, options)
        self._write(sink.getvalue())

    def _write(self, text: bytes) -> None:
        start = 0
        while start < len(text):
            end = len(text) if len(text) - start <= _PAGE else text.rfind(b"\n", start, start + _PAGE) + 1
            end = end or text.find(b"\n", start) + 1  # a line longer than a page
            self._write_lines(text[start:end])
            start = end

    def _write_lines(self, lines: bytes) -> None:
        """Write whole lines; when the disk is full, the file ends behind the last whole write."""
        written = 0
        try:
            while written < len(lines):
                written += os.write(self._file, lines[written:])
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self._file, self._size)
            raise self._failed(error) from None
        self._size += len(lines)
        self.samples += lines.count(b"\n")

    def _failed(self, error: BaseException) -> JournalError:
        number = getattr(error, "errno", None)
        reason = os.strerror(number) if number else str(error).splitlines()[0]
        left = (
            f"{self.samples} samples are in the file and can be read" if self.samples > 0 else "no sample was written"
        )
        return JournalError(f"{self.path}: {reason}; {left}; free space and record again")

    def finish(self, metadata: Mapping[str, Any]) -> None:
        """Close the journal and replace it with the recording, with its final metadata; whole or not at all.

        Raises
        ------
        JournalError
            If the disk is full; the journal stays in place.
        """
        os.close(self._file)
        final = {**self._metadata, **metadata}
        try:
            with atomic_path(self.path) as temporary:
                if self.path.suffix == ".csv":
                    self._finish_csv(temporary, final)
                else:
                    self._finish_parquet(temporary, final)
        except InputError as error:  # no temporary file
            raise self._failed(error.__context__ or error) from None
        except OSError as error:
            raise self._failed(error) from None

    def _finish_csv(self, target: Path, metadata: Mapping[str, Any]) -> None:
        with self.path.open("rb") as journal, target.open("wb") as file:
            for _ in range(self._header_lines):
                journal.readline()
            for key, value in metadata.items():
                file.write(f"# {key}: {json.dumps(value)}\n".encode())
            file.write(self._header.encode())
            while block := journal.read(_BLOCK_BYTES):
                file.write(block)

    def _finish_parquet(self, target: Path, metadata: Mapping[str, Any]) -> None:
        count = pa.int16() if self._is_narrow else pa.int32()
        types = {name: pa.float64() if name in {"t_s", _TEMPERATURE} else count for name in self.columns}
        types["status"] = pa.uint16()
        described = {key.encode(): json.dumps(value).encode() for key, value in metadata.items()}
        schema = pa.schema(list(types.items()), metadata=described)
        with pq.ParquetWriter(target, schema, compression="zstd") as writer:
            if not self.samples:
                return
            read = pa_csv.ReadOptions(
                column_names=self.columns, skip_rows=self._header_lines, block_size=_BLOCK_BYTES, use_threads=False
            )
            convert = pa_csv.ConvertOptions(column_types=types, null_values=[""])
            # By its path: the reader's own thread outlives the loop, and with an open file of Python's it would reach
            # for an interpreter that may be gone by then, which ends the process with an abort.
            with pa_csv.open_csv(self.path, read_options=read, convert_options=convert) as batches:
                for batch in batches:
                    writer.write_batch(batch)
