"""The files that the arguments of a command name, so that no output may replace one of them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from gfimu.base.errors import InputError

__all__ = ["files_named"]

_MODELS = {
    "array": "arrays",
    "column_map": "maps",
    "scenario": "scenarios",
    "twin": "twins",
}
"""Arguments that may hold the name of a shipped model, and the folder of `models` where it lies."""


def files_named(arguments: Mapping[str, Any]) -> Iterator[Path]:
    """Yield the files that arguments name, and the array files that those name in turn; objects name none."""
    for name, value in arguments.items():
        for item in value if isinstance(value, list | tuple) else [value]:
            if isinstance(item, str | os.PathLike):
                path = _model_file(_MODELS.get(name, ""), os.fspath(item) if not isinstance(item, Path) else item)
                yield path
                yield from _named_inside(path)


def _model_file(kind: str, name: str | Path) -> Path:
    """Return the file behind a name; a name that is unknown is left for its reader to refuse."""
    if kind and isinstance(name, str):
        from gfimu.base.files.model_files import find_model

        try:
            return find_model(kind, name)
        except InputError:
            pass
    return Path(name)


def _named_inside(path: Path, seen: frozenset[Path] = frozenset()) -> Iterator[Path]:
    """Yield the files that a TOML file names (a twin its array, an array its part), and the verdict in a folder."""
    if path.is_dir():
        yield path / "verdict.json"
    if path.suffix != ".toml" or not path.is_file() or path in seen:
        return
    from gfimu.base.files.model_files import read_toml

    try:
        content = read_toml(path)
    except InputError:
        return  # its reader refuses it
    for text in _texts(content):
        if text.endswith(".toml"):
            for named in (path.parent / text, Path(text)):
                yield named
                yield from _named_inside(named, seen | {path})


def _texts(value: Any) -> Iterator[str]:
    """Yield all texts inside a TOML value."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _texts(item)
