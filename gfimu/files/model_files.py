"""Where the models (arrays, parts, scenarios, twins, MJCF) are found, in a checkout and in an installed wheel."""

from __future__ import annotations

import importlib.util
import json
import re
import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from gfimu.errors import InputError, unknown_name
from gfimu.files.input_file import check_input, is_ordinary

__all__ = [
    "EFFECT_CATALOGUE",
    "effect_catalogue",
    "find_model",
    "list_models",
    "models_directory",
    "parse_toml",
    "read_toml",
]

EFFECT_CATALOGUE = "effects/catalogue.json"
"""File of what was computed of each effect, below the folder of the models."""

_LONGEST_REASON = 160
_MOST_PARTS = 100  # numerical: of a dotted key


def models_directory() -> Path:
    """Directory of the models: ``sim/models`` in a wheel, ``models`` beside ``sim`` in a checkout.

    Raises
    ------
    InputError
        If neither exists (a broken installation).
    """
    spec = importlib.util.find_spec("sim")
    if spec is None or not spec.submodule_search_locations:
        raise InputError("the models are not installed: the package 'sim' is missing; reinstall gfimu")
    package = Path(next(iter(spec.submodule_search_locations)))
    for candidate in (package / "models", package.parent / "models"):
        if (candidate / "arrays").is_dir():
            return candidate
    raise InputError(f"no models beside or inside {package}; reinstall gfimu")


def list_models(kind: str, suffix: str = ".toml") -> list[str]:
    """Names of the models of one kind (``arrays``, ``scenarios``, ``twins``, ``parts``, ``mjcf``)."""
    return sorted(path.stem for path in (models_directory() / kind).glob(f"*{suffix}"))


@cache
def effect_catalogue() -> Mapping[str, Any]:
    """Return what was computed of each effect of gfimu, by name; empty where nothing is stored."""
    file = models_directory() / EFFECT_CATALOGUE
    return json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}


def find_model(kind: str, name: str | Path, *, beside: Path | None = None, suffix: str = ".toml") -> Path:
    """Path of a model given by name or by file path.

    Parameters
    ----------
    kind : str
        Folder under ``models``: ``arrays``, ``scenarios``, ``twins``, ``parts`` or ``mjcf``.
    name : str or Path
        A name in that folder, or the path of a file.
    beside : Path, optional
        Directory against which a relative path is tried first (the folder of the file that names it).
    suffix : str
        File name extension of the model.

    Raises
    ------
    InputError
        If neither a model of that name nor such a file exists; the message lists the valid names.
    """
    text = str(name)
    if text.endswith(suffix) or "/" in text or "\\" in text:
        candidates = ([beside / text] if beside is not None else []) + [Path(text)]
        for path in candidates:
            if is_ordinary(path):
                return path
        raise InputError(f"{_short(text)}: no such file; give a path or one of {', '.join(list_models(kind, suffix))}")
    path = models_directory() / kind / f"{text}{suffix}"
    if is_ordinary(path):
        return path
    raise unknown_name(kind.rstrip("s"), _short(text), list_models(kind, suffix))


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file; a syntax error or unreadable file becomes an `InputError` that names it."""
    check_input(path)
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not valid TOML ({error}); correct the file") from None
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}; check the path") from None
    return parse_toml(text, path)


def parse_toml(text: str, source: str | Path) -> dict[str, Any]:
    """Return the content of TOML text; a syntax error, nesting too deep or a number too long is an `InputError`."""
    for line in text.splitlines() if text.count(".") > _MOST_PARTS else ():
        if line.count(".") > _MOST_PARTS and any(_is_long_key(piece) for piece in re.split(r"[=,{}\[\]]", line)):
            raise InputError(f"{source}: not valid TOML (a key of more than {_MOST_PARTS} parts); correct the file")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{source}: not valid TOML (nested too deeply); correct the file") from None
    except ValueError as error:  # also of a whole number with thousands of digits
        reason = " ".join(str(error).split())[:_LONGEST_REASON]
        raise InputError(f"{source}: not valid TOML ({reason}); correct the file") from None


def _is_long_key(piece: str) -> bool:
    """Whether a piece of a line may be a dotted key of so many parts that its parser takes hours and gigabytes."""
    return piece.count(".") > _MOST_PARTS and all(part.strip() for part in piece.split("."))


def _short(text: str) -> str:
    return text if len(text) <= _LONGEST_REASON else f"{text[:_LONGEST_REASON]}…"
