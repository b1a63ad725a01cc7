"""The group of all commands: a command's file is imported when the command is called, not before."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping
from typing import Any

import typer
from typer.completion import install_callback, show_callback

from gfimu.base.errors import check_name
from gfimu.commands.shell.assemble import shell_command
from gfimu.commands.shell.command import CommandApp, GfimuGroup, RunGroup
from gfimu.commands.shell.command_list import COMMANDS, JOBS, declared_commands, help_line
from gfimu.commands.shell.completion import Offer
from gfimu.commands.shell.declare import module_help

__all__ = ["JSON_ASKED", "CommandGroup"]

_HELP = "help"
_COMPLETION = {"--install-completion": install_callback, "--show-completion": show_callback}
_SHELLS = ("bash", "zsh", "fish", "powershell", "pwsh")

JSON_ASKED = "gfimu.json"
"""Key of a context: whether the arguments hold --json."""


class CommandGroup(GfimuGroup):
    """The program: commands that load on their first use, listed by job."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands = _Commands()  # type: ignore[assignment]

    def shell_complete(self, ctx: Any, incomplete: str) -> list[Any]:
        """Return the commands that begin so, without importing any, or the options of the program."""
        if incomplete.startswith("-"):
            return super().shell_complete(ctx, incomplete)
        return [Offer(name, help_line(name)) for name in COMMANDS if name.startswith(incomplete)]

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments; ``help COMMAND`` is ``COMMAND --help``, and a shell may be named for its completion."""
        ctx.meta[JSON_ASKED] = "--json" in args
        if len(args) == 2 and args[0] in _COMPLETION:  # Typer would ignore the name and take the shell that it detects
            check_name("shell", args[1], _SHELLS)
            _COMPLETION[args[0]](ctx, None, args[1])  # type: ignore[arg-type]
        if args and args[0] == _HELP:
            args = [*args[1:], "--help"]
        return super().parse_args(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands of each job, without importing any."""
        del ctx
        width = max(map(len, COMMANDS))
        for job, names in JOBS.items():
            with formatter.section(job):
                formatter.write_dl([(name.ljust(width), help_line(name)) for name in names])


class _Commands(Mapping[str, Any]):
    """Commands by name, each made when it is asked for."""

    def __getitem__(self, name: str) -> Any:
        if name not in COMMANDS:
            raise KeyError(name)
        return _made(name)

    def __iter__(self) -> Iterator[str]:
        return iter(COMMANDS)

    def __len__(self) -> int:
        return len(COMMANDS)


@functools.cache
def _made(name: str) -> Any:
    """Return the command of a file; several are a group, in which the one of its name is called run."""
    declared, app = declared_commands(name), CommandApp()
    app.callback()(lambda: None)  # a group even where a file registers one command
    if [one.name for one in declared] == [name]:
        app.command(name=name, help=declared[0].help)(shell_command(declared[0]))
    else:
        kind = RunGroup if any(one.name == name for one in declared) else GfimuGroup
        group = CommandApp(cls=kind, help=module_help(declared[0].function), no_args_is_help=True)
        app.add_typer(group, name=name)
        for one in declared:
            inner = one.name.removeprefix(name).strip() or RunGroup.default
            group.command(name=inner, help=one.help)(shell_command(one))
    return typer.main.get_command(app).commands[name]  # type: ignore[attr-defined]
