"""Files of judged answers: lines of JSON, packed (``.xz``) or not."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path

import msgspec

from gfimu.base.declared import struct_of
from gfimu.base.errors import InputError
from sim.json_lines import read_lines, write_lines
from sim.trials.benchmark.judge import POINTS
from sim.trials.benchmark.judged import Judged

__all__ = ["read_judged", "write_judged"]

_REMEDY = "give a file of gfimu benchmark judge --out"


def write_judged(judged: Iterable[Judged], path: str | Path) -> None:
    """Write judged answers as lines of JSON, packed where the name ends in ``.xz``."""
    write_lines(path, (json.dumps(one.to_dict()) for one in judged))


def read_judged(path: str | Path) -> list[Judged]:
    """Read judged answers; raises `InputError` if the file is not there or holds something else."""
    try:
        return [_judged(msgspec.json.decode(line, type=struct_of(Judged))) for line in read_lines(path, _REMEDY)]
    except InputError:
        raise
    except (ValueError, RecursionError):
        raise InputError(f"{path}: no judged answers; {_REMEDY}") from None


def _judged(line: msgspec.Struct) -> Judged:
    known = {key: value for key, value in msgspec.structs.asdict(line).items() if value is not None}
    if known["outcome"] not in POINTS:
        raise ValueError(known["outcome"])
    lists = {key: tuple(known[key]) for key in ("hidden", "said", "z")}
    return Judged(**{"points": math.nan, **known, **lists})
