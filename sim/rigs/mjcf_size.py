"""What an MJCF file becomes, before MuJoCo parses it: copies without end and files elsewhere are refused."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree as ET

from gfimu.base.errors import InputError
from gfimu.base.files.input_file import check_input, is_ordinary

__all__ = ["check_mjcf_size"]

_MOST_ELEMENTS = 50_000  # numerical: of the compiled model; an array has some tens of sites
_PARSED = {"include", "model", "flexcomp"}  # elements whose file is read to parse this one
_CELLS = 1000  # numerical: of a height field, that are as much as an element
_ENDLESS = 10**12


def check_mjcf_size(path: Path) -> None:
    """Refuse an MJCF file that would become larger than an array can need, or that takes in files of other folders.

    Files that it includes or attaches count too. What can't be parsed is left to MuJoCo, which says why.

    Raises
    ------
    InputError
        If the copies (``replicate``, ``composite``, ``flexcomp``, ``attach``) are too many, or a file to parse is no
        ordinary file in the folder of the model or below.
    """
    elements = 0
    for copies in _copies(path, path.parent.resolve(), ()):
        elements += copies
        if elements > _MOST_ELEMENTS:
            raise InputError(f"{path}: becomes more than {_MOST_ELEMENTS} elements or numbers; replicate fewer")


def _copies(path: Path, folder: Path, around: tuple[Path, ...]) -> Iterator[int]:
    """Yield of each element of a file, and of those that it takes in, how often it will be there."""
    if path in around:
        return
    try:
        root = ET.parse(path).getroot()  # noqa: S314  expat stops entities that grow
    except (ET.ParseError, OSError, ValueError, RecursionError):
        return
    models = {one.get("name", ""): _beside(path, one, folder) for one in root.iter("model") if one.get("file")}
    waiting = [(root, 1)]
    while waiting:
        element, copies = waiting.pop()
        inner = copies
        if element.tag in {"replicate", "composite", "flexcomp"}:
            numbers = [_whole(word) for word in element.get("count", "1").split()[:3]]
            inner = min(copies * max(math.prod(numbers), 1), _ENDLESS)
        yield inner + _whole(element.get("nrow", "0")) * _whole(element.get("ncol", "0")) // _CELLS
        taken = _beside(path, element, folder) if element.tag in _PARSED and element.get("file") else None
        if element.tag == "attach":
            taken = models.get(element.get("model", ""))
        if taken is not None and element.tag in {"include", "attach"}:
            yield from (copies * count for count in _copies(taken, folder, (*around, path)))
        waiting += [(one, inner) for one in element]


def _beside(path: Path, element: ET.Element, folder: Path) -> Path:
    """Return a file that an element takes in; it must lie in the folder of the model or below."""
    name = element.get("file", "")
    file = next((one for one in (path.parent / name, folder / name) if is_ordinary(one)), path.parent / name)
    if not file.resolve().is_relative_to(folder):
        raise InputError(f"{path}: {element.tag} {name[:80]!r} lies in another folder; copy it beside this file")
    return check_input(file)


def _whole(text: str) -> int:
    """Return a whole number, 0 for none; one of many digits is without end."""
    digits = text.strip().lstrip("+")
    if not digits.isascii() or not digits.isdigit():
        return 0
    return int(digits) if len(digits) < 13 else _ENDLESS
