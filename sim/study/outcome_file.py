"""Files of outcomes: lines of JSON, packed where they are kept beside the tables made of them."""

from __future__ import annotations

import json
import lzma
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gfimu.errors import InputError
from gfimu.files.atomic_file import atomic_path

__all__ = ["generator_name", "keep_outcomes", "read_outcomes"]

_PACKED = ".xz"


def generator_name(source: str) -> str:
    """Return the name of a generator wherever its file stands, such as ``independent_world:hide``."""
    file, _, function = source.rpartition(":")
    return f"{Path(file).stem}:{function}" if file else source


def read_outcomes(path: str | Path) -> list[dict[str, Any]]:
    """Read the outcomes of a study, packed (``.xz``) or not; a last line cut off by an interruption is left out."""
    file = Path(path)
    if not file.exists():
        return []
    try:
        packed = file.suffix == _PACKED
        text = lzma.decompress(file.read_bytes()).decode() if packed else file.read_text(encoding="utf-8")
    except (lzma.LZMAError, UnicodeDecodeError):
        raise InputError(f"{file}: not a file of outcomes; give one that `python -m sim.study run` wrote") from None
    outcomes = []
    for line in text.splitlines():
        try:
            outcomes.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return outcomes


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
