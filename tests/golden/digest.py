"""What is stored of an outcome: every word and number, and of long columns some values and the root mean square."""

from __future__ import annotations

import json
import math
import re
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from pyarrow import csv, parquet

import gfimu

from .calls import Outcome

__all__ = ["digest"]

MASKED_KEYS = {
    "software_version", "version", "python", "platform", "started_utc", "processor_s", "processor_s_median",
}  # fmt: skip
"""Keys whose values vary with the version, the machine and the day."""

MASKED_WORDS = (str(Path(gfimu.__file__).parents[1]), r"(?<=127\.0\.0\.1:)\d+", r"(?<=\"processor_s\":)[\d.]+")
"""Parts of texts that vary, besides the scratch folder: the checkout's place, a port, a time. Regular expressions."""

LONG = 24  # numbers; of a longer list `VALUES` are stored, evenly spread, with its shape and root mean square
VALUES = 20
MANY = 100  # objects; of a longer list `VALUES` are stored, with its length
TEXT = 300  # characters in metadata of a file; a longer text is stored by its checksum


def digest(outcome: Outcome, folder: Path) -> dict[str, Any]:
    """Return what is stored of the outcome of a command line that ran in a folder."""
    printed = _parsed(outcome.stdout)
    files = {file.relative_to(folder).as_posix(): _content(file) for file in outcome.files}
    for content in files.values():
        for key in content if isinstance(content, dict) and isinstance(printed, dict) else ():
            if key in printed and content[key] == printed[key]:
                content[key] = "as printed"
    whole = {"exit_code": outcome.code, "printed": printed, "stderr": outcome.stderr.splitlines(), "files": files}
    return _digest(whole, re.compile("|".join([re.escape(str(folder)), *MASKED_WORDS])))


def _parsed(text: str) -> Any:
    """Return the JSON of a text, or a list of objects where it has one a line."""
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return [json.loads(line) for line in text.splitlines()]


def _content(file: Path) -> Any:
    """Return what is stored of a file: of a table its columns, of a text its lines, of a picture that it is there."""
    match file.suffix:
        case ".json":
            return json.loads(file.read_text(encoding="utf-8"))
        case ".jsonl":
            return _parsed(file.read_text(encoding="utf-8"))
        case ".parquet":
            table = parquet.read_table(file)
            return _table(table, {key.decode(): one.decode() for key, one in (table.schema.metadata or {}).items()})
        case ".csv":
            lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
            comments = [line[1:].strip().partition(": ") for line in lines if line.startswith("#")]
            rows = "".join(line for line in lines if not line.startswith("#"))
            return _table(csv.read_csv(pa.BufferReader(rows.encode())), {key: one for key, _, one in comments})
        case ".toml" | ".yaml" | ".xml":
            return file.read_text(encoding="utf-8")
        case ".vcd" | ".bin":
            return f"crc32 {zlib.crc32(file.read_bytes()):08x}"
        case _:
            return "written"


def _table(table: pa.Table, metadata: dict[str, str]) -> dict[str, Any]:
    """Return a table's columns, and the metadata that is one word or number: the rest repeats what was printed."""
    found = {}
    for key, text in metadata.items():
        try:
            value = json.loads(text)
        except json.JSONDecodeError:
            value = text
        if not isinstance(value, dict | list):
            found[key] = f"crc32 {zlib.crc32(value.encode()):08x}" if len(str(value)) > TEXT else value
    return {"columns": {name: table[name].to_pylist() for name in table.column_names}, "metadata": found}


def _digest(value: Any, masked: re.Pattern[str]) -> Any:
    match value:
        case dict():
            return {key: "…" if key in MASKED_KEYS else _digest(one, masked) for key, one in value.items()}
        case list() if (numbers := _numbers(value)) is not None and numbers.size > LONG:
            flat = np.ravel(numbers)
            finite = flat[np.isfinite(flat)]
            return {
                "shape": list(numbers.shape),
                "missing": int(flat.size - finite.size),
                "rms": float(np.sqrt(np.mean(finite.astype(float) ** 2))) if finite.size else None,
                "values": [_digest(flat[index].item(), masked) for index in _places(flat.size)],
            }
        case list() if len(value) > MANY and isinstance(value[0], dict):
            return {"length": len(value), "some": [_digest(value[index], masked) for index in _places(len(value))]}
        case list():
            return [_digest(one, masked) for one in value]
        case str() if "\n" in value:
            return _digest(value.splitlines(), masked)
        case str():
            return masked.sub("…", value)
        case float() if not math.isfinite(value):
            return None
        case _:
            return value


def _numbers(values: list[Any]) -> np.ndarray | None:
    """Return a list of numbers, or of rows of numbers, as an array with NaN for None; any other list gives None."""
    try:
        array = np.array([math.nan if one is None else one for one in values])
    except ValueError:
        return None
    return array if array.dtype.kind in "fi" else None


def _places(count: int) -> list[int]:
    return sorted({round(place) for place in np.linspace(0, count - 1, VALUES)}) if count else []
