"""Compare a call with what is stored of it, or store it anew."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .calls import Call, Outcome, run
from .compare import TOLERANCES, differences, text
from .digest import digest

__all__ = ["check", "write"]


def check(call: Call, folder: Path, see: Callable[[str, Outcome], None] = lambda *_: None) -> list[str]:
    """Run a call in a folder and return what differs from what is stored; ``see`` gets each line with its outcome."""
    found = _outcome(call, folder, see)
    stored = json.loads(call.expected.read_text(encoding="utf-8")) if call.expected.exists() else {}
    return list(differences(stored, found, TOLERANCES[call.tolerance]))


def write(call: Call, folder: Path) -> list[str]:
    """Run a call in a folder and return what moved by more than rounding; if anything did, store the outcome."""
    tolerance = dataclasses.replace(TOLERANCES[call.tolerance], stds=0.0)
    found = _outcome(call, folder, lambda *_: None)
    stored = json.loads(call.expected.read_text(encoding="utf-8")) if call.expected.exists() else {}
    moved = list(differences(stored, found, tolerance))
    if moved:
        call.expected.write_text(text(found, tolerance), encoding="utf-8")
    return moved


def _outcome(call: Call, folder: Path, see: Callable[[str, Outcome], None]) -> dict[str, Any]:
    found = {}
    for line, outcome in run(call, folder):
        see(line, outcome)
        found[line] = digest(outcome, folder)
    return found
