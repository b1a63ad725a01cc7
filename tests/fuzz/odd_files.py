"""Files that are none: devices, pipes, folders, links in a circle, names that are too long or no text."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

__all__ = ["ODD"]


def _device(name: str) -> Callable[[Path, str], Path]:
    def make(folder: Path, suffix: str) -> Path:
        link = folder / f"device{suffix}"
        link.unlink(missing_ok=True)
        link.symlink_to(f"/dev/{name}")
        return link

    return make


def _pipe(folder: Path, suffix: str) -> Path:
    pipe = folder / f"pipe{suffix}"
    if not pipe.exists():
        os.mkfifo(pipe)
    return pipe


def _folder(folder: Path, suffix: str) -> Path:
    (folder / f"folder{suffix}").mkdir(exist_ok=True)
    return folder / f"folder{suffix}"


def _circle(folder: Path, suffix: str) -> Path:
    link = folder / f"circle{suffix}"
    if not link.is_symlink():
        link.symlink_to(link.name)
    return link


def _long_name(folder: Path, suffix: str) -> Path:
    return folder / ("n" * 5000 + suffix)


def _no_name(folder: Path, suffix: str) -> Path:
    return folder / f"a\x00b{suffix}"


def _missing(folder: Path, suffix: str) -> Path:
    return folder / f"[red]missing{suffix}"


ODD: tuple[Callable[[Path, str], Path], ...] = (
    _device("zero"),
    _device("null"),
    _device("full"),
    _pipe,
    _folder,
    _circle,
    _long_name,
    _no_name,
    _missing,
)
