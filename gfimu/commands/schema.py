"""Print the JSON schema of what a command prints with --json: every key with its meaning and unit.

Examples
--------
gfimu schema estimate
# Of a command of a command, to a file
gfimu schema campaign table --out table.schema.json
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from gfimu.base.declared import Declared, figure, struct_of, structs_of
from gfimu.base.errors import check_name
from gfimu.base.files.schema import about
from gfimu.commands.shell.command_list import COMMANDS, declared_commands
from gfimu.commands.shell.completion import beginning
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import SCHEMA_OUT

__all__ = ["schema", "schema_names"]

Files = Annotated[dict[str, str], about("Files and folders that were written, by what they are.")]


@dataclass(frozen=True)
class Fault(Declared):
    """Why a command ended."""

    kind: Annotated[str, figure("Kind of the error; Interrupted after Ctrl-C or SIGTERM.")]
    message: Annotated[str, figure("One line that names the file or value, and the remedy.")]
    exit_code: Annotated[int, figure("2 bad input, 130 after Ctrl-C, 143 after SIGTERM, 1 anything else.")]


@dataclass(frozen=True)
class Failed(Declared):
    """A command that ended with an error."""

    error: Annotated[Fault, figure("The error.")]


_DIALECT = "https://json-schema.org/draft/2020-12/schema"
_STREAMS = {"live"}
_CERTIFICATE = "certificate"  # whose schema is published with its format


def schema_names() -> tuple[str, ...]:
    """Return the commands whose results have a schema."""
    return tuple(sorted(one.name for file in COMMANDS for one in declared_commands(file)))


def _kinds(name: str) -> tuple[list[Any], list[Any], dict[str, bool]]:
    """Return what a command prints, the structs that this names by reference only, and to which files are added.

    A command of several results does not write with each, so that theirs may lack the key ``files``: the value there.
    """
    declared = next(one for one in declared_commands(name.split(maxsplit=1)[0]) if one.name == name)
    whole = [declared, *(part.__command__ for part in declared.parts)]
    results = [(one, kind) for one in whole for kind in one.results()]
    kinds, parts, with_files = [], [], {}
    for one, kind in results:
        if not (isinstance(kind, type) and issubclass(kind, Declared)):
            kinds.append(kind)
            continue
        root, *inner = structs_of(kind)
        kinds.append(root)
        parts += [part for part in inner if part not in kinds]
        if one.names_files(kind):
            with_files[root.__name__] = len(one.results()) == 1
    return kinds, parts, with_files


def _offers(incomplete: str) -> list[tuple[str, str]]:
    """Offer the commands whose results have a schema."""
    return beginning(incomplete, dict.fromkeys(name.partition(" ")[0] for name in schema_names()))


_COMMAND = Option("Command: estimate, or campaign table.", "COMMAND...", kind=list[str], argument=True, offers=_offers)


def _run(given: Mapping[str, Any], as_json: bool) -> None:
    from gfimu.commands.shell.output import print_json, print_paths

    content = schema(" ".join(given["command"]), out=given["out"])
    if given["out"] is None or as_json:
        print_json(content)
    else:
        print_paths([("schema", given["out"])])


@command(run=_run, results=lambda: (dict[str, Any],))
def schema(
    command: Annotated[str, _COMMAND],
    *,
    out: Annotated[str | Path | None, SCHEMA_OUT.also("; printed without it")] = None,
) -> dict[str, Any]:
    """Return the JSON schema (2020-12) of a command's output with ``--json``, errors included.

    Raises
    ------
    InputError
        If there is no such command.

    Examples
    --------
    >>> import gfimu
    >>> sorted(gfimu.schema("check")["$defs"])[:2]
    ['CheckedRun', 'EffectView']
    """
    import msgspec

    from gfimu.base.files.atomic_file import write_text

    name = " ".join(command.split())
    check_name("command", name, schema_names())
    kinds, parts, with_files = _kinds(name)
    references, definitions = msgspec.json.schema_components(
        [*kinds, struct_of(Failed), *parts], ref_template="#/$defs/{name}"
    )
    found = list(references[: len(kinds) + 1])
    if name == _CERTIFICATE:
        from gfimu.calibration.certificate.schema import certificate_schema

        found.insert(0, {"$ref": "#/$defs/Certificate"})
        definitions = json.loads(certificate_schema())["$defs"] | definitions
        with_files = {"Certificate": True}
    for kind, always in with_files.items():
        definitions[kind]["properties"]["files"] = msgspec.json.schema(Files)
        if always:
            definitions[kind].setdefault("required", []).append("files")
    what = "Each line that" if name in _STREAMS else "What"
    content: dict[str, Any] = {
        "$schema": _DIALECT,
        "title": f"gfimu {name} --json",
        "description": f"{what} `gfimu {name} --json` prints: a result, or an error. A number that is not finite or "
        "not known is null; keys carry their units.",
        "anyOf": found,
        "$defs": definitions,
    }
    if out is not None:
        write_text(out, json.dumps(content, indent=1, ensure_ascii=False) + "\n")
    return content
