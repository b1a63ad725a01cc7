"""Base of the structs of results, and the types that they share."""

from __future__ import annotations

from typing import Annotated

import msgspec

from gfimu.files.schema import about

__all__ = ["Failed", "Fault", "Files", "Matrix", "Number", "Numbers", "Result"]

Number = float | None
"""A number; null where it is not finite or not known."""

Numbers = list[Number]
Matrix = list[list[Number]]
Files = Annotated[dict[str, str], about("Files and folders that were written, by what they are.")]


class Result(msgspec.Struct, forbid_unknown_fields=True):
    """A table of a result; it has these keys and no others."""


class Fault(Result, kw_only=True):
    """Why a command ended."""

    kind: Annotated[str, about("Kind of the error; Interrupted after Ctrl-C or SIGTERM.")]
    message: Annotated[str, about("One line that names the file or value, and the remedy.")]
    exit_code: Annotated[int, about("2 bad input, 130 after Ctrl-C, 143 after SIGTERM, 1 anything else.")]


class Failed(Result, kw_only=True):
    """A command that ended with an error."""

    error: Annotated[Fault, about("The error.")]
