"""Files of judged answers: lines of JSON, packed (``.xz``) or not."""

from __future__ import annotations

import json
import lzma
import math
from collections.abc import Iterable
from pathlib import Path

from gfimu.errors import InputError
from gfimu.files.atomic_file import atomic_path
from sim.benchmark.judge import POINTS, Judged

__all__ = ["read_judged", "write_judged"]

_PACKED = ".xz"


def write_judged(judged: Iterable[Judged], path: str | Path) -> None:
    """Write judged answers as lines of JSON, packed where the name ends in ``.xz``."""
    text = "".join(json.dumps(one.to_dict()) + "\n" for one in judged).encode()
    with atomic_path(Path(path)) as part:
        part.write_bytes(lzma.compress(text, preset=9) if Path(path).suffix == _PACKED else text)


def read_judged(path: str | Path) -> list[Judged]:
    """Read judged answers; raises `InputError` if the file is not there or holds something else."""
    file = Path(path)
    try:
        content = file.read_bytes()
        lines = (lzma.decompress(content) if file.suffix == _PACKED else content).splitlines()
        return [_judged(json.loads(line)) for line in lines]
    except OSError as error:
        raise InputError(f"{file}: {error.strerror or error}; give a file of gfimu benchmark judge --out") from None
    except (lzma.LZMAError, ValueError, KeyError, TypeError):
        raise InputError(f"{file}: no judged answers; give a file of gfimu benchmark judge --out") from None


def _judged(entry: dict) -> Judged:
    if entry["outcome"] not in POINTS:
        raise ValueError(entry["outcome"])
    numbers = {
        name: math.nan if entry[name] is None else float(entry[name])
        for name in ("points", "removed", "expected_ratio", "processor_s")
    }
    return Judged(
        entry["world"],
        entry["method"],
        tuple(entry["hidden"]),
        tuple(entry["said"]),
        entry["outcome"],
        z=tuple(entry["z"]),
        **numbers,
    )
