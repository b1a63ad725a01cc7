"""What differs between a stored outcome and a new one, at the tolerances of its kind of call."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

__all__ = ["TOLERANCES", "Tolerance", "differences", "text"]


@dataclass(frozen=True)
class Tolerance:
    """How much a number may move. Integers, words, error lines and exit codes may not.

    Numbers in the texts of a fit are left out, as they stand beside it as values.

    Parameters
    ----------
    relative
        Share of the stored number, or of the largest in its list.
    digits
        Significant digits that are stored.
    absolute
        Below this, in the number's own unit, is rounding.
    stds
        Of a value beside its own standard deviation: multiple of it. 0: none.
    """

    relative: float
    digits: int
    absolute: float
    stds: float = 0.0


TOLERANCES = {
    "closed": Tolerance(1e-9, digits=12, absolute=1e-12),
    "filter": Tolerance(1e-6, digits=9, absolute=1e-9),
    "fit": Tolerance(1e-4, digits=7, absolute=1e-9, stds=3.0),
}
"""Kinds of calls: closed forms; filters and other sums over many samples; fits and what follows from one."""

NUMBER = re.compile(r"(?<![\w.])[-+−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.]*\w)")
"""Number in a text, but no part of a name."""

UNROUNDED = re.compile(r"(?<![\w.])-?\d+\.\d{9,}(?:e[-+]?\d+)?(?!\w)")
"""Number in a text with all its digits, which is compared as a number."""


def differences(stored: Any, found: Any, tolerance: Tolerance, place: str = "") -> Iterator[str]:
    """Yield a line for each value that moved: where it stands, what is stored, what was found."""
    if isinstance(stored, dict) and isinstance(found, dict):
        for key in sorted(stored.keys() | found.keys()):
            one = f"{place}.{key}" if place else key
            if key not in found or key not in stored:
                yield f"{one}: {'missing' if key in stored else 'new'}"
            elif not _within_stds(key, stored, found, tolerance):
                yield from differences(stored[key], found[key], tolerance, one)
    elif isinstance(stored, list) and isinstance(found, list) and len(stored) == len(found):
        scale = max((abs(one) for one in stored if _is_number(one)), default=0.0)
        for index, pair in enumerate(zip(stored, found, strict=True)):
            if not _close(*pair, tolerance, scale):
                yield from differences(*pair, tolerance, f"{place}[{index}]")
    elif not _close(stored, found, tolerance):
        yield f"{place}: {_short(stored)} -> {_short(found)}"


def text(outcome: Any, tolerance: Tolerance) -> str:
    """Return an outcome as it is stored: keys sorted, a value or a list of numbers a line, numbers rounded."""
    return f"{_lines(outcome, tolerance, '')}\n"


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _close(stored: Any, found: Any, tolerance: Tolerance, scale: float = 0.0) -> bool:
    if _is_number(stored) and _is_number(found) and (isinstance(stored, float) or isinstance(found, float)):
        return abs(found - stored) <= max(tolerance.absolute, tolerance.relative * max(abs(stored), scale))
    if isinstance(stored, str) and isinstance(found, str):
        number = NUMBER if tolerance.stds else UNROUNDED
        pairs = zip(number.findall(stored), number.findall(found), strict=False)
        same = tolerance.stds or all(_close(float(old), float(new), tolerance) for old, new in pairs)
        return bool(same) and number.sub("#", stored) == number.sub("#", found)
    return type(stored) is type(found) and stored == found


def _within_stds(key: str, stored: dict[str, Any], found: dict[str, Any], tolerance: Tolerance) -> bool:
    """Whether a value has its standard deviation beside it in both, and moved by less than the allowed multiple."""
    std = next((one for one in _names_of_std(key) if _is_number(stored.get(one)) and _is_number(found.get(one))), None)
    if std is None or not (_is_number(stored[key]) and _is_number(found[key])):
        return False
    return abs(found[key] - stored[key]) <= tolerance.stds * stored[std]


def _names_of_std(key: str) -> Iterator[str]:
    yield "std" if key == "value" else f"{key}_std"
    words = key.split("_")
    yield from ("_".join([*words[:cut], "std", *words[cut:]]) for cut in range(1, len(words)))


def _short(value: Any) -> str:
    line = json.dumps(value, ensure_ascii=False)
    return line if len(line) <= 200 else f"{line[:200]}…"


def _lines(value: Any, tolerance: Tolerance, indent: str) -> str:
    inner = f"{indent} "
    if isinstance(value, dict) and value:
        rows = [
            f"{inner}{json.dumps(key, ensure_ascii=False)}: {_lines(value[key], tolerance, inner)}"
            for key in sorted(value)
        ]
        return "{\n" + ",\n".join(rows) + f"\n{indent}}}"
    if isinstance(value, list) and not all(one is None or _is_number(one) for one in value):
        return "[\n" + ",\n".join(f"{inner}{_lines(one, tolerance, inner)}" for one in value) + f"\n{indent}]"
    if isinstance(value, list):
        return f"[{', '.join(_lines(one, tolerance, inner) for one in value)}]"
    if isinstance(value, float):
        value = float(f"{value:.{tolerance.digits}g}") if abs(value) >= tolerance.absolute else 0.0
    return json.dumps(value, ensure_ascii=False)
