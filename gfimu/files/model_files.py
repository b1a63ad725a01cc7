"""Where the models (arrays, parts, scenarios, twins, MJCF) are found, in a checkout and in an installed wheel."""

from __future__ import annotations

import importlib.util
import tomllib
from pathlib import Path
from typing import Any

from gfimu.errors import InputError, unknown_name

__all__ = ["find_model", "list_models", "models_directory", "read_toml"]


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
            if path.is_file():
                return path
        raise InputError(f"{text}: no such file; give a path or one of {', '.join(list_models(kind, suffix))}")
    path = models_directory() / kind / f"{text}{suffix}"
    if path.is_file():
        return path
    raise unknown_name(kind.rstrip("s"), text, list_models(kind, suffix))


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file; a syntax error or unreadable file becomes an `InputError` that names it."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not valid TOML ({error}); correct the file") from None
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}; check the path") from None
