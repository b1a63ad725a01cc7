"""Write the pages of the command-line reference, docs/reference/cli/, from the commands themselves.

Sphinx runs this before it reads the pages (docs/conf.py), so the pages are those of the program as it stands.

Run ``python docs/scripts/make_cli_reference.py``.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator, Mapping
from enum import Enum
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

import typer

from gfimu.commands.shell.command_list import JOBS, help_line
from gfimu.commands.shell.program import program

_KINDS = {Path: "PATH", str: "TEXT", int: "N", float: "NUMBER", bool: ""}
FOLDER = Path(__file__).resolve().parents[1] / "reference" / "cli"

INDEX = """\
# Command line
Each page holds what `gfimu COMMAND --help` prints. The function under each command, what may be written where, and
errors are in [Commands and functions](../commands.md).

| exit code | meaning |
|---|---|
| 0 | done, whatever the finding: a verdict `unknown` is a result |
| 1 | could not be done: a full disk, a lost port, an error that was not foreseen |
| 2 | bad input: a file, value or option that can't be used; the message names it and the remedy |

Every error is one line on standard error. With `--json` standard output holds one JSON object, also for an error:
`{"error": {"kind": …, "message": …, "exit_code": …}}`.
"""


def leaves(name: str, command: Any) -> Iterator[tuple[str, Any]]:
    """Yield the commands under a command with their words; the command itself where it has none."""
    if not hasattr(command, "commands"):
        yield name, command
        return
    for inner, below in command.commands.items():
        yield (name if inner == getattr(command, "default", "") else f"{name} {inner}"), below


def command_page(name: str, command: Any) -> str:
    """Return the page of a command, with a section for each command under it."""
    parts = [f"# gfimu {name}\n"]
    inside = list(leaves(name, command))
    if len(inside) > 1 and command.help:
        parts.append(help_text(command.help))
    for words, leaf in inside:
        parts += [f"## gfimu {words}\n"] if len(inside) > 1 else []
        parts += [f"```\n{usage(words, leaf)}\n```\n", help_text(leaf.help or ""), *parameter_tables(leaf)]
        parts += python_line(words)
        parts += json_section(words) if any("--json" in one.opts for one in leaf.params) else []
    return "\n".join(parts)


def usage(words: str, command: Any) -> str:
    """Return the line of usage: arguments, and the options that have to be given."""
    hints = _hints(command)
    required = [f"{one.opts[0]} {_metavar(one, hints)}" for one in command.params if _is_option(one) and one.required]
    arguments = [
        _metavar(one, hints) if one.required else f"[{_metavar(one, hints)}]"
        for one in command.params
        if not _is_option(one)
    ]
    return " ".join(["gfimu", words, *arguments, *required, "[OPTIONS]"])


def help_text(text: str) -> str:
    """Return a help text as Markdown: its examples as blocks to copy.

    An example is a paragraph ``what for: gfimu …``, or a line of the section ``Examples`` below a ``#`` line that
    says what for.
    """
    described, *listed = re.split(r"\nExamples:?\n(?:-+\n)?", inspect.cleandoc(text), maxsplit=1)
    lines = [line.strip() for line in "".join(listed).splitlines()]
    kept = []
    for paragraph in described.replace("\f", "").split("\n\n"):
        example = re.fullmatch(r"(.*?): (gfimu .*)", " ".join(paragraph.split()))
        if example and example[1] == "Example":
            lines.append(example[2])
        elif example:
            lines += [f"# {example[1]}", example[2]]
        else:
            kept.append(escape(paragraph))
    if any(lines):
        kept.append("**Examples**\n\n```sh\n" + "\n".join(line for line in lines if line) + "\n```")
    return "\n\n".join(kept) + "\n"


def parameter_tables(command: Any) -> list[str]:
    """Return the tables of arguments and options, options by their groups."""
    hints = _hints(command)
    groups: dict[str, list[str]] = {}
    for one in command.params:
        if not getattr(one, "hidden", False):
            group = getattr(one, "rich_help_panel", None) or ("Options" if _is_option(one) else "Arguments")
            groups.setdefault(group, []).append(_row(one, hints))
    return [
        "\n".join(
            [
                f"**{group}**\n",
                f"| {'argument' if group == 'Arguments' else 'option'} | meaning | default |",
                "|---|---|---|",
                *rows,
            ]
        )
        + "\n"
        for group, rows in sorted(groups.items(), key=lambda item: (item[0] != "Arguments", item[0] != "Options"))
    ]


def json_section(words: str) -> list[str]:
    """Return what ``--json`` holds, where the program publishes a schema of it (`gfimu schema`)."""
    if find_spec("gfimu.commands.schema") is None:
        return []
    published = import_module("gfimu.commands.schema")
    if words not in published.schema_names():
        return []
    whole = published.schema(words)
    parts = [f"**JSON**\n\n`gfimu schema {words}` prints the schema of what `--json` writes.\n"]
    for option in whole.get("anyOf", [whole]):
        result = whole["$defs"][option["$ref"].rpartition("/")[2]] if "$ref" in option else option
        keys = result.get("properties", {})
        if set(keys) - {"error"}:
            rows = [f"| `{key}` | {escape(one.get('description', ''))} |" for key, one in keys.items()]
            parts.append(
                "\n".join([f"{escape(result.get('description', ''))}\n", "| key | meaning |", "|---|---|", *rows, ""])
            )
    return parts


def python_line(words: str) -> list[str]:
    """Return the sentence that names the function under a command."""
    name = {"list": "catalogue"}.get(words, words)
    for path in (f"gfimu.{name.replace(' ', '_')}", f"gfimu.commands.{name.replace(' ', '.')}"):
        module, _, function = path.rpartition(".")
        if find_spec(module) and callable(getattr(import_module(module), function, None)):
            return [f"In Python: {{py:obj}}`{path.replace('gfimu.commands.', 'gfimu.')} <{path}>`.\n"]
    return []


def escape(text: str) -> str:
    """Return a text whose bars and brackets are no Markdown, with options as code."""
    text = text.replace("|", "\\|").replace("<", "&lt;").replace("[", "\\[")
    return re.sub(r"(?<![`\w-])(--[a-z][\w-]*)", r"`\1`", text)


def _hints(command: Any) -> dict[str, Any]:
    return get_type_hints(inspect.unwrap(command.callback))


def _row(one: Any, hints: Mapping[str, Any]) -> str:
    flag = getattr(one, "is_flag", False)
    names = ", ".join(f"`{name}`" for name in (*one.opts, *one.secondary_opts)) if _is_option(one) else ""
    shown = names + ("" if flag else f" {escape(_metavar(one, hints))}")
    default = "required" if one.required else _default(one)
    return f"| {shown.strip()} | {escape(getattr(one, 'help', None) or '')} | {default} |"


def _default(one: Any) -> str:
    value = one.default
    if value is None or value is False or value == () or callable(value):
        return ""
    value = getattr(value, "value", value)
    return f"`{value}`"


def _metavar(one: Any, hints: Mapping[str, Any]) -> str:
    """What stands for the value of a parameter: its own word, else the kind of its values."""
    if one.metavar or not _is_option(one):
        return one.metavar or one.name.upper()
    return _words(hints[one.name])


def _words(kind: Any) -> str:
    """Name the values of a type: those of a list, of a choice, or of what is not None in a union."""
    if get_origin(kind) is Literal:
        return "|".join(map(str, get_args(kind)))
    if inside := [inner for inner in get_args(kind) if inner not in {type(None), ...}]:
        return " ".join(map(_words, inside))
    return "|".join(str(choice.value) for choice in kind) if issubclass(kind, Enum) else _KINDS[kind]


def _is_option(one: Any) -> bool:
    return one.param_type_name == "option"


def pages() -> dict[str, str]:
    """Return the text of every page by its name."""
    commands = typer.main.get_command(program()).commands  # type: ignore[attr-defined]
    texts = {name: command_page(name, command) for name, command in commands.items()}
    contents = []
    for job, names in JOBS.items():
        contents += [f"## {job}\n", "| command | |", "|---|---|"]
        contents += [f"| [`gfimu {name}`]({name}.md) | {escape(help_line(name))} |" for name in names]
        contents.append("")
    tree = "\n".join(["```{toctree}", ":hidden:", *texts, "```", ""])
    return texts | {"index": "\n".join([INDEX, *contents, tree])}


def write_pages(folder: Path = FOLDER) -> list[Path]:
    """Write the pages whose text has changed, remove those of commands that are no more; return all."""
    folder.mkdir(parents=True, exist_ok=True)
    texts = pages()
    for old in folder.glob("*.md"):
        if old.stem not in texts:
            old.unlink()
    made = []
    for name, text in texts.items():
        path = folder / f"{name}.md"
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
        made.append(path)
    return made


if __name__ == "__main__":
    write_pages()
