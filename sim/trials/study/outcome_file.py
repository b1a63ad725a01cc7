"""Outcomes from the dataset of a run, and files of them: lines of JSON, packed, beside the tables made of them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gfimu.base.errors import InputError
from sim.json_lines import read_lines, six_digits, write_lines
from sim.trials.study.cases import find_case
from sim.trials.sweep.dataset import Dataset

__all__ = ["generator_name", "keep_outcomes", "outcome_of_row", "read_outcomes"]

_REMEDY = "give a folder of `python -m sim.trials.study run`"


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
            raise InputError(f"{file}: is another campaign; {_REMEDY}")
        return [outcome_of_row(row) for row in dataset.table().to_pylist()]
    if not file.exists():
        return []
    try:
        return [json.loads(line) for line in read_lines(file, _REMEDY)]
    except InputError:
        raise
    except ValueError:
        raise InputError(f"{file}: no file of outcomes; {_REMEDY}") from None


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
    file = Path(path)
    file.parent.mkdir(parents=True, exist_ok=True)
    write_lines(file, (json.dumps(six_digits(outcome)) for outcome in outcomes))
    return file
