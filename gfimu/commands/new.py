"""Write a commented file to edit.

A sender is a folder of C files: with them a microcontroller of yours sends what gfimu record reads. Without --out the
file is printed. A file that is there is not replaced.

Examples
--------
gfimu new array --out my_array.toml --schema array.schema.json
# C files for a board of your own
gfimu new sender my_sender
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from gfimu.base.declared import Declared, FileText, figure
from gfimu.base.errors import InputError, unknown_name
from gfimu.base.files.outputs import OutputFile, OutputFolder
from gfimu.commands.file_kinds import FILE_KINDS, file_schema
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import SCHEMA_OUT

__all__ = ["SENDER", "TEMPLATES", "new"]

TEMPLATES = tuple(FILE_KINDS)
"""Files that can be begun."""

SENDER = "sender"
"""The folder that can be begun: C files with which a board of one's own sends frames."""

_BEGUN = (*TEMPLATES, SENDER)
_FOLDER = Option(
    "Of a sender: folder to write; without it, what to do with it is printed.", "[FOLDER]", argument=True,
    writes=OutputFolder(()), what=SENDER,
)  # fmt: skip
_OUT = Option("File to write (.toml); printed without it.", "FILE", writes=OutputFile("a TOML file", (".toml",)))


@dataclass(frozen=True)
class Begun(Declared):
    """A file to edit."""

    kind: Annotated[str, figure("Kind of the file.")]
    text: Annotated[str, figure("The file (TOML); of a sender, what to do with the folder.")]
    written: bool

    def shown(self) -> Iterator[FileText]:
        """Yield the text where it was not written."""
        if not self.written:
            yield FileText(self.text)


def _files(_: str, given: Any) -> dict[str, Path]:
    named = {given["kind"]: given["folder"] or given["out"], "schema": given["schema"]}
    return {what: path for what, path in named.items() if path is not None}


def _report(text: str, given: Any) -> Begun:
    return Begun(given["kind"], text, bool(_files(text, given)))


@command(report=_report, files=_files, results=lambda: (Begun,))
def new(
    kind: Annotated[str, Option(f"What to begin: {', '.join(_BEGUN)}.", "KIND", argument=True, offers=_BEGUN)],
    folder: Annotated[str | Path | None, _FOLDER] = None,
    *,
    out: Annotated[str | Path | None, _OUT] = None,
    schema: Annotated[str | Path | None, SCHEMA_OUT.also(", for completion in an editor")] = None,
) -> str:
    """Return a commented file to edit: an array, part, column map, twin, scenario, frame, stage, plan or brief.

    Of a sender it returns what to do with its C files. By a schema an editor with taplo (Even Better TOML) completes
    the keys; the first line of the file names it.

    Raises
    ------
    InputError
        If the kind is unknown, the file or folder is there already, or a file is asked for where a folder is written.

    Examples
    --------
    >>> import gfimu
    >>> print(gfimu.new("array").splitlines()[0])
    #:schema ./array.schema.json
    """
    from gfimu.base.files.atomic_file import write_text
    from gfimu.base.files.model_files import find_model
    from gfimu.base.files.schema import json_schema

    if kind == SENDER:
        if out is not None or schema is not None:
            raise InputError(
                "a sender is a folder of C files, without schema; name the folder: gfimu new sender FOLDER"
            )
        from firmware_bridge.sender.project import readme, write_project

        if folder is not None:
            write_project(folder)
        return readme(SENDER if folder is None else Path(folder).resolve().name)
    if kind not in TEMPLATES:
        raise unknown_name("kind", kind, _BEGUN)
    if folder is not None:
        raise InputError(f"a new {kind} is one file; name it with --out")
    text = find_model("templates", kind).read_text(encoding="utf-8")
    if out is not None and Path(out).exists():
        raise InputError(f"{out}: is there already; choose another name")
    if schema is not None:
        write_text(schema, json_schema(file_schema(kind), kind))
        near = os.path.relpath(schema, Path() if out is None else Path(out).parent).replace(os.sep, "/")
        text = text.replace(f"./{kind}.schema.json", near if near.startswith(".") else f"./{near}", 1)
    if out is not None:
        write_text(out, text)
    return text
