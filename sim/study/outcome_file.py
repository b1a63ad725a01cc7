"""Outcomes from the dataset of a run, and files of them: lines of JSON, packed, beside the tables made of them."""

from __future__ import annotations

import json
import lzma
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gfimu.errors import InputError
from gfimu.files.atomic_file import atomic_path
from sim.study.cases import find_case
from sim.sweep.dataset import Dataset

__all__ = ["generator_name", "keep_outcomes", "outcome_of_row", "read_outcomes"]

_PACKED = ".xz"


def generator_name(source: str) -> str:
    """Return the name of a generator wherever its file stands, such as ``independent_world:hide``."""
    file, _, function = source.rpartition(":")
    return f"{Path(file).stem}:{function}" if file else source


def read_outcomes(path: str | Path) -> list[dict[str, Any]]:
    """Read outcomes from the folder of a run, or from lines of JSON, packed (``.xz``) or not; none where nothing is.

    Raises
    ------
    InputError
        If it is another folder or file.
    """
    file = Path(path)
    if file.is_dir():
        dataset = Dataset.open(file)
        if dataset.plan.kind != "study":
            raise InputError(f"{file}: is another campaign; give a folder of `python -m sim.study run`")
        return [outcome_of_row(row) for row in dataset.table().to_pylist()]
    if not file.exists():
        return []
    try:
        content = file.read_bytes()
        lines = (lzma.decompress(content) if file.suffix == _PACKED else content).splitlines()
        return [json.loads(line) for line in lines]
    except (lzma.LZMAError, ValueError):
        raise InputError(f"{file}: no file of outcomes; give a folder of `python -m sim.study run`") from None


def outcome_of_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return the outcome that a row of the dataset holds; a case that failed is one with the verdict ``error``."""
    if not row["failure"]:
        return dict(json.loads(row["outcome"]))
    key, _, source = row["world"].partition(" ")
    method = {"method": row["method"]} if row["method"] else {}
    nothing: dict[str, Any] = {"causes": [], "share_of_excess_removed": None, "unexplained": False, "noise": {}}
    what = {"verdict": "error", "error": row["failure"], "signature": "", "wall_s": 0.0, "processor_s": 0.0}
    return {"key": key, "source": source or "sim.campaign", **method, **find_case(key).to_dict(), **nothing, **what}


def keep_outcomes(outcomes: Sequence[Mapping[str, Any]], path: str | Path) -> Path:
    """Write outcomes packed (``.xz``), numbers to six digits, to make the tables again from; return the path."""
    lines = [json.dumps(_rounded(outcome)) + "\n" for outcome in outcomes]
    file = Path(path)
    file.parent.mkdir(parents=True, exist_ok=True)
    with atomic_path(file) as temporary:
        temporary.write_bytes(lzma.compress("".join(lines).encode(), preset=9))
    return file


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value
