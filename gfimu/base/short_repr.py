"""Short forms of results for the terminal and the notebook: one line, shapes in place of numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sized
from dataclasses import fields
from typing import Any

import numpy as np

__all__ = ["joined", "short_repr"]

_LONGEST = 200
_LONGEST_TEXT = 40
_FEW = 3


def short_repr(result: Any) -> str:
    """Return a dataclass on one line: small values as they are, arrays by shape, collections by length.

    What is empty or None is left out. A class takes it by ``__repr__ = short_repr``.
    """
    parts = [
        f"{item.name}={text}"
        for item in fields(result)
        if item.repr and (text := _short(getattr(result, item.name))) not in {"", "None"}
    ]
    return joined(result, parts)


def joined(result: object, parts: list[str]) -> str:
    """Return ``Class(part, part)``, cut where it would flood a line."""
    text = ", ".join(part for part in parts if part)
    return f"{type(result).__name__}({text if len(text) <= _LONGEST else f'{text[: _LONGEST - 1]}…'})"


def _short(value: Any) -> str:
    if isinstance(value, np.ndarray):
        if value.ndim <= 1 and value.size <= _FEW and value.dtype.kind in "fiub":
            return "[" + ", ".join(f"{number:.4g}" for number in np.atleast_1d(value).tolist()) + "]"
        return f"<{' × '.join(map(str, value.shape))}>"
    if isinstance(value, float | np.floating):
        return f"{float(value):.4g}"
    if isinstance(value, str):
        text = value if len(value) <= _LONGEST_TEXT else f"{value[: _LONGEST_TEXT - 1]}…"
        return repr(text) if value else ""
    if isinstance(value, Mapping | tuple | list | set | frozenset):
        return _short_collection(value)
    text = " ".join(repr(value).split())
    return text if len(text) <= 2 * _LONGEST_TEXT else f"<{type(value).__name__}>"


def _short_collection(value: Sized) -> str:
    if not len(value):
        return ""
    if isinstance(value, tuple | list) and len(value) <= _FEW:
        texts = [_short(item) for item in value]
        if sum(map(len, texts)) <= 2 * _LONGEST_TEXT:
            return f"({', '.join(texts)})"
    return f"<{len(value)} {'entries' if isinstance(value, Mapping) else 'items'}>"
