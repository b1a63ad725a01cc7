"""Where the models (arrays, parts, scenarios, twins, MJCF) are found, and their TOML files: reading, setting a key."""

from __future__ import annotations

import importlib.util
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gfimu.base.errors import InputError, system_errors, unknown_name
from gfimu.base.files.input_file import LARGEST_TEXT, check_input, is_ordinary

__all__ = ["find_model", "list_models", "models_directory", "parse_toml", "read_toml", "set_key"]

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
    check_input(path, largest=LARGEST_TEXT)
    try:
        with system_errors(path):
            text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not valid TOML ({error}); correct the file") from None
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


def set_key(
    data: dict[str, Any],
    change: str,
    *,
    option: str,
    example: str,
    as_table: Callable[[Any, list[str]], Any] = lambda value, names: value,
) -> None:
    """Set one key of a table and of the tables within it.

    Parameters
    ----------
    data : dict
        Content of a file; changed in place.
    change : str
        ``table.key=value`` with the value as in TOML; a bare word is a string.
    option : str
        Option that holds it, for messages.
    example : str
        A change that is right, for messages.
    as_table : callable
        Called with what stands where a table is needed, and the names that lead there; returns the table of a short
        form, or the value as it is.

    Raises
    ------
    InputError
        If it is no ``key=value``, the value is no TOML, or a key lies within what is no table.
    """
    key, equals, text = change.partition("=")
    names = [name.strip() for name in key.split(".")]
    if not equals or not all(names):
        raise InputError(f"{option} {change!r}: write it as key=value, such as {example}")
    place = data
    for number, name in enumerate(names[:-1], start=1):
        found = place[name] = as_table(place.setdefault(name, {}), names[:number])
        if not isinstance(found, dict):
            raise InputError(f"{option} {change!r}: {name} is not a table; give it as a whole, {name}=value")
        place = found
    place[names[-1]] = _value(text, f"{option} {change!r}")


def _value(text: str, where: str) -> Any:
    """Return a value as TOML has it, or the text as it stands where it is none."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError as error:
        if text.lstrip()[:1] in {"{", "[", '"', "'"}:
            raise InputError(f"{where}: the value is not valid TOML ({error})") from None
        return text if text.isspace() else text.strip()


def _short(text: str) -> str:
    return text if len(text) <= _LONGEST_REASON else f"{text[:_LONGEST_REASON]}…"
