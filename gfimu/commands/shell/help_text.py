"""The text of `--help`: usage, what the command does, arguments, options by group, and examples to copy.

The help of a command is the docstring of its function: the first line says what it does, paragraphs follow, and below
the heading ``Examples`` stand commands, each behind a ``#`` line that says when to use it. An example that is longer
than the terminal is broken before an option, behind a backslash, so that it can be copied.
"""

from __future__ import annotations

import inspect
import re
import textwrap
from typing import Any

__all__ = ["examples_of", "write_help"]

_HEADING = "\nExamples\n--------\n"
_TYPE = re.compile("<([^>]*)>")
_PLAIN = {
    "float": "NUMBER",
    "float range": "NUMBER",
    "float,float": "X Y",
    "float,float,float": "X Y Z",
    "int": "N",
    "int range": "N",
    "list[path]": "FILE",
    "path": "FILE",
    "str": "NAME",
    "str,str": "NAME NAME",
}
"""What stands for a value in help, by its type; arguments have names of their own."""

_SHORT = 60  # columns below which a description stands under its option
_FIRST_COLUMN = 28  # columns of names before descriptions
_SHORT_FIRST_COLUMN = 4
_INDENT = "  "
_NO_BREAK = "\xa0"


def examples_of(help_text: str | None) -> list[tuple[str, str]]:
    """Return the examples in the help of a command: what each is for, and its command line."""
    _, found, text = inspect.cleandoc(help_text or "").partition(_HEADING)
    examples: list[tuple[str, str]] = []
    purpose = ""
    for line in text.splitlines() if found else ():
        if line.strip().startswith("#"):
            purpose = line.strip().removeprefix("#").strip()
        elif examples and examples[-1][1].endswith("\\"):
            before = examples[-1][1].removesuffix("\\").rstrip()
            examples[-1] = (examples[-1][0], f"{before} {line.strip()}")
        elif line.strip():
            examples.append((purpose, line.strip()))
            purpose = ""
    return examples


def write_help(command: Any, ctx: Any, formatter: Any) -> None:
    """Write the help of a command or group of commands."""
    command.format_usage(ctx, formatter)
    text = inspect.cleandoc(command.help or "").partition(_HEADING)[0]
    for paragraph in text.split("\n\n"):
        formatter.write_paragraph()
        with formatter.indentation():
            formatter.write_text(paragraph)
    for title, rows in _sections(command, ctx).items():
        with formatter.section(title):
            formatter.write_dl(rows, col_max=_FIRST_COLUMN if formatter.width >= _SHORT else _SHORT_FIRST_COLUMN)
    if hasattr(command, "format_commands"):
        command.format_commands(ctx, formatter)
    _write_examples(formatter, examples_of(command.help))
    if command.epilog:
        formatter.write_paragraph()
        formatter.write_text(command.epilog)


def _sections(command: Any, ctx: Any) -> dict[str, list[tuple[str, str]]]:
    """Return the arguments and the groups of options with their descriptions; the usual options stand first."""
    sections: dict[str, list[tuple[str, str]]] = {"Arguments": [], "Options": []}
    for param in command.get_params(ctx):
        record = param.get_help_record(ctx)
        if record is not None:
            name = _TYPE.sub(lambda found: _PLAIN.get(found[1], ""), record[0]).replace("...", "").strip()
            record = (name.replace(" FILE", " FOLDER") if record[1].startswith("Folder") else name, record[1])
            argument = param.param_type_name == "argument"
            title = "Arguments" if argument else getattr(param, "rich_help_panel", None) or "Options"
            sections.setdefault(title, []).append(record)
    return {title: rows for title, rows in sections.items() if rows}


def _write_examples(formatter: Any, examples: list[tuple[str, str]]) -> None:
    if not examples:
        return
    formatter.write_paragraph()
    formatter.write("Examples:\n")
    for purpose, line in examples:
        if purpose:
            formatter.write(f"{_INDENT}# {purpose}\n")
        for piece in _pieces(line, formatter.width - len(_INDENT)):
            formatter.write(f"{_INDENT}{piece}\n")


def _pieces(line: str, width: int) -> list[str]:
    """Break a command line between words so that each piece fits, all but the last ending in a backslash."""
    units = (option.replace(" ", _NO_BREAK) for option in re.split(" (?=--)", line))  # an option with its values
    pieces = textwrap.wrap(
        " ".join(units), width - 2, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False
    )
    return " \\\n".join(pieces).replace(_NO_BREAK, " ").splitlines()
