"""How large an MJCF file becomes, before MuJoCo compiles it: one that replicates without end is refused."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree as ET

from gfimu.errors import InputError

__all__ = ["check_mjcf_size"]

_MOST_ELEMENTS = 50_000  # numerical: of the compiled model; an array has some tens of sites
_MOST_CELLS = 50_000_000  # numerical: of a texture or height field
_MOST_MEMORY = 1 << 30  # bytes that a model may ask for
_UNITS = {"": 1, "K": 1 << 10, "M": 1 << 20, "G": 1 << 30, "T": 1 << 40, "P": 1 << 50, "E": 1 << 60}
_ENDLESS = 10**12


def check_mjcf_size(path: Path) -> None:
    """Refuse an MJCF file that would become larger than an array can need.

    Files that it includes count too. What can't be parsed is left to MuJoCo, which says why.

    Raises
    ------
    InputError
        If copies (``replicate``, ``composite``, ``flexcomp``), textures, height fields or the memory asked for are too
        large.
    """
    elements = 0
    for name, element, copies in _elements(path, set()):
        elements += copies
        if elements > _MOST_ELEMENTS:
            raise InputError(f"{path}: becomes more than {_MOST_ELEMENTS} elements; replicate fewer")
        cells = max(
            _number(element, "width") * _number(element, "height"), _number(element, "nrow") * _number(element, "ncol")
        )
        if cells > _MOST_CELLS:
            raise InputError(f"{path}: a {name} of more than {_MOST_CELLS} cells; make it smaller")
        asked = re.fullmatch(r"\s*(\d{1,18})([KMGTPE]?)\s*", element.get("memory", "0"))
        if asked and int(asked[1]) * _UNITS[asked[2]] > _MOST_MEMORY:
            raise InputError(f"{path}: asks for more than {_MOST_MEMORY >> 30} GB of memory; lower it")


def _elements(path: Path, seen: set[Path]) -> Iterator[tuple[str, ET.Element, int]]:
    """Yield the elements of a file and of those that it includes, each with how often it will be there."""
    if path in seen or len(seen) > 100:
        return
    seen.add(path)
    try:
        root = ET.parse(path).getroot()  # noqa: S314  expat stops entities that grow
    except (ET.ParseError, OSError, ValueError, RecursionError):
        return
    waiting = [(root, 1)]
    while waiting:
        element, copies = waiting.pop()
        inner = copies
        if element.tag in {"replicate", "composite", "flexcomp"}:
            numbers = [_whole(word) for word in element.get("count", "1").split()[:3]]
            inner = min(copies * max(math.prod(numbers), 1), _ENDLESS)
        yield str(element.tag), element, inner
        if element.tag == "include":
            yield from _elements(path.parent / element.get("file", ""), seen)
        waiting += [(one, inner) for one in element]


def _number(element: ET.Element, key: str) -> int:
    return _whole(element.get(key, "0"))


def _whole(text: str) -> int:
    """Return a whole number, 0 for none; one of many digits is without end."""
    digits = text.strip().lstrip("+")
    if not digits.isascii() or not digits.isdigit():
        return 0
    return int(digits) if len(digits) < 13 else _ENDLESS
