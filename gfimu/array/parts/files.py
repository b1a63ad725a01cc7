"""Part files: where the data sheet of a chip's part is found, and its text that travels with an array.

A part is named either like a file in ``models/parts`` (``adxl345``) or by the path of a part file of one's own
(``part = "my_chip.toml"``). The text of such a file is kept with the array that names it, so that a recording which
carries its array can be read where the file isn't.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gfimu.base.files.input_file import is_ordinary
from gfimu.base.files.model_files import find_model, parse_toml, read_toml

__all__ = ["add_part_file", "is_part_file", "part_table"]


def is_part_file(name: str) -> bool:
    """Whether a part is named by the path of a file and not like one in ``models/parts``."""
    return name.endswith(".toml") or "/" in name or "\\" in name


def add_part_file(files: Mapping[str, str], name: str, beside: Path | None) -> tuple[dict[str, str], str]:
    """Read a part file and add its text to those that an array has already.

    Parameters
    ----------
    files : mapping of str to str
        Texts of part files by name.
    name : str
        Path of the file; relative to ``beside``, else to the current directory.
    beside : Path or None
        Folder of the file that names the part.

    Returns
    -------
    files : dict of str to str
        The texts with this one.
    name : str
        Name by which it is kept: the file's own name, without its folder.

    Raises
    ------
    InputError
        If there is no such file and none of that name is kept yet, or it is not valid TOML.
    """
    if name in files and not any(is_ordinary(folder / name) for folder in (beside or Path(), Path())):
        return dict(files), name
    path = find_model("parts", name, beside=beside)
    read_toml(path)  # a syntax error is reported with the path of the file
    text = path.read_text(encoding="utf-8")
    kept, number = path.name, 1
    while files.get(kept, text) != text:
        number += 1
        kept = f"{path.stem}-{number}{path.suffix}"
    return {**files, kept: text}, kept


def part_table(name: str, files: Mapping[str, str]) -> tuple[dict[str, Any], str]:
    """Return the content of a part's file, and how messages call it.

    Parameters
    ----------
    name : str
        A name in ``models/parts``, the name of one of ``files``, or the path of a part file.
    files : mapping of str to str
        Texts of part files by name, as an array carries them.

    Raises
    ------
    InputError
        If the part is unknown or its text is not valid TOML.
    """
    if name in files:
        return parse_toml(files[name], f"part {name!r}"), f"part {name!r}"
    path = find_model("parts", name)
    return read_toml(path), str(path)
