"""Files of judged answers: lines of JSON, packed (``.xz``) or not."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path

from gfimu.errors import InputError
from sim.benchmark.judge import POINTS, Judged
from sim.json_lines import read_lines, write_lines

__all__ = ["read_judged", "write_judged"]

_REMEDY = "give a file of gfimu benchmark judge --out"


def write_judged(judged: Iterable[Judged], path: str | Path) -> None:
    """Write judged answers as lines of JSON, packed where the name ends in ``.xz``."""
    write_lines(path, (json.dumps(one.to_dict()) for one in judged))


def read_judged(path: str | Path) -> list[Judged]:
    """Read judged answers; raises `InputError` if the file is not there or holds something else."""
    try:
        return [_judged(json.loads(line)) for line in read_lines(path, _REMEDY)]
    except InputError:
        raise
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{path}: no judged answers; {_REMEDY}") from None


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
