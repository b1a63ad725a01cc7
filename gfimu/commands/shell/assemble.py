"""The command of the program from a declaration: what Typer asks for, and the call with what was given."""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from gfimu.commands.shell.declare import Command, Option, choices_of, marked
from gfimu.commands.shell.printing import print_report

__all__ = ["shell_command"]

_IS_PATH = re.compile(r"\bPath\b(?!\])")  # and no list of paths


def shell_command(declared: Command) -> Callable[..., None]:
    """Return the function of which Typer makes the command of the program: options in, printed results out."""
    declared = _with_parts(declared)
    given: dict[str, inspect.Parameter] = {}  # what the shell asks for, the options of groups in their place
    for name, parameter in declared.parameters.items():
        group = declared.groups.get(name)
        given |= {name: parameter} if group is None else group.parameters
    given |= declared.shell_only
    made = {name: list(group.parameters) for name, group in declared.groups.items()}
    marks = marked(given, Option)
    parameters = [_shell_parameter(name, given[name], mark) for name, mark in marks.items() if mark.shell]
    json = Option("Print one JSON object instead of tables; gfimu schema COMMAND describes it.")
    flag = inspect.Parameter("json", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=Annotated[bool, json])
    parameters.append(_shell_parameter("json", flag, json))
    defaults = {one.name: given[one.name].default if one.name in given else one.default for one in parameters}

    def run(**values: Any) -> None:
        as_json = values.pop("json")
        values = {name: defaults[name] if value is None else value for name, value in values.items()}
        of_shell = {name: values.pop(name) for name in declared.shell_only}
        parts = {group: {name: values.pop(name) for name in names} for group, names in made.items()}
        read = {name: value for part in parts.values() for name, value in part.items() if marks[name].reads}
        declared.check(values, read)  # before a group reads its file
        values |= {group: declared.groups[group].make(**part) for group, part in parts.items()}
        if declared.run is not None:
            declared.run(values, as_json, **of_shell)
        else:
            print_report(declared, values, as_json=as_json)

    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {one.name: one.annotation for one in parameters}
    return run


def _with_parts(declared: Command) -> Command:
    """Return a command whose function has the parameters of its parts too, none of which must be given."""
    parameters = dict(declared.parameters)
    for part in declared.parts:
        for name, parameter in part.__command__.parameters.items():  # type: ignore[attr-defined]
            needed = parameter.default is inspect.Parameter.empty
            parameters.setdefault(name, parameter.replace(default=None) if needed else parameter)
    together = functools.partial(declared.function)
    ordered = [one.replace(kind=inspect.Parameter.KEYWORD_ONLY) for one in parameters.values()]
    together.__signature__ = inspect.Signature(ordered)  # type: ignore[attr-defined]
    return replace(declared, function=together)


def _shell_parameter(name: str, parameter: inspect.Parameter, option: Option) -> inspect.Parameter:
    """Return a parameter as Typer takes it."""
    annotated = parameter.annotation.__origin__
    kind = option.kind or (Path if _IS_PATH.search(str(annotated)) else annotated)
    default = inspect.Parameter.empty if option.needed else None if parameter.default == () else parameter.default
    words_only = str if choices_of(parameter) else kind
    optional: Any = words_only | None if default is None else words_only
    annotation = Annotated[optional, option.parameter(name, kind)]
    return parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=annotation, default=default)
