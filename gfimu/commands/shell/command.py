"""What every command shares as a command: its help, and the nearest name of a wrong option."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from gfimu.base.errors import InputError, did_you_mean, nearest_name
from gfimu.base.units import SIZES, is_usable
from gfimu.commands.shell.help_text import write_help

__all__ = ["CONTEXT", "CommandApp", "GfimuCommand", "GfimuGroup", "with_width"]

CONTEXT: dict[str, Any] = {"help_option_names": ["--help", "-h"]}
"""Settings of every command's context: both words for help."""

_WIDEST, _NARROWEST = 100, 24  # columns of help
_ALIKE = 0.65  # numerical: of difflib; the two dashes that all options share make them more alike than names


def with_width(ctx: Any) -> None:
    """Let help use the width of the terminal, also a narrow one."""
    ctx.terminal_width = max(min(shutil.get_terminal_size((80, 24)).columns, _WIDEST), _NARROWEST) - 1


class _Parser:
    """What commands and groups of commands share: plain help with examples at its end, and errors that help."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse arguments; the error for a wrong option names the nearest, and unusable numbers are refused."""
        with_width(ctx)
        try:
            rest: list[str] = super().parse_args(ctx, args)  # type: ignore[misc]
        except Exception as error:
            _suggest_option(error, ctx.command.get_params(ctx))
            raise
        _check_numbers(ctx.command.get_params(ctx), ctx.params)
        return rest

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help."""
        write_help(self, ctx, formatter)


class GfimuCommand(_Parser, TyperCommand):
    """A command."""

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return the words of the usage line: an argument stands as its metavar."""
        arguments = [param for param in self.get_params(ctx) if param.param_type_name == "argument"]
        return ["[OPTIONS]", *(param.metavar or param.name.upper() for param in arguments)]

    def shell_complete(self, ctx: Any, incomplete: str) -> list[Any]:
        """Return the options that a shell offers."""
        return [item for item in super().shell_complete(ctx, incomplete) if item.value != "-h"]


class GfimuGroup(_Parser, TyperGroup):
    """A command with commands of its own."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find a command by its name; the error for a wrong one names the nearest."""
        name = args[0]
        if self.get_command(ctx, name) is None and not name.startswith("-") and not ctx.resilient_parsing:
            ctx.fail(f"No such command {name!r}{did_you_mean(name, self.list_commands(ctx))}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands with the first line of each one's help."""
        rows = [
            (name, (command.help or "").partition("\n")[0])
            for name in self.list_commands(ctx)
            if (command := self.get_command(ctx, name)) is not None
        ]
        with formatter.section("Commands"):
            formatter.write_dl(rows)


class RunGroup(GfimuGroup):
    """Commands of which one, ``run``, is called without its name too."""

    default = "run"

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments; what is neither a command nor an option goes to ``run``."""
        if args and args[0] not in {*self.commands, "--help", "-h"}:
            meant = nearest_name(args[0], self.commands)
            if meant and not Path(args[0]).exists():
                raise InputError(f"{args[0]}: neither a plan nor a command; did you mean {ctx.command_path} {meant}?")
            args = [self.default, *args]
        return super().parse_args(ctx, args)

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return the words of the usage line: those of ``run``, or a command."""
        run = self.get_command(ctx, self.default)
        words = [] if run is None else run.collect_usage_pieces(ctx)[1:]
        return [*words, "[OPTIONS]", "|", "COMMAND", "[ARGS]..."]


class CommandApp(typer.Typer):
    """A collection of commands that are all `GfimuCommand`."""

    def __init__(self, **settings: Any) -> None:
        settings.setdefault("cls", GfimuGroup)
        super().__init__(rich_markup_mode=None, context_settings=CONTEXT, **settings)

    def command(self, name: str | None = None, **settings: Any) -> Any:
        """Return the decorator that adds a command."""
        settings.setdefault("cls", GfimuCommand)
        return super().command(name, context_settings=CONTEXT, **settings)


def _check_numbers(params: Iterable[Any], values: Mapping[str, Any]) -> None:
    """Refuse numbers of options that nothing can be computed with."""
    wrong = []
    for param in params:
        value = values.get(param.name)
        several = value if isinstance(value, list | tuple) else [value]
        if any(isinstance(one, int | float) and not is_usable(one) for one in several):
            wrong.append(f"{param.opts[-1]} {' '.join(map(str, several)):.40}")
    if wrong:
        raise InputError(f"{', '.join(wrong)}: must be {SIZES}")


def _suggest_option(error: Exception, params: Iterable[Any]) -> None:
    """Put the nearest option into the error for one that there is not."""
    wrong = getattr(error, "option_name", None)
    if wrong is None or not hasattr(error, "possibilities"):
        return
    shown = [param for param in params if param.param_type_name == "option" and not param.hidden]
    names = [name for param in shown for name in (*param.opts, *param.secondary_opts) if name.startswith("--")]
    longer = [name for name in names if name.startswith(wrong.casefold())]
    near = longer[0] if len(longer) == 1 else nearest_name(wrong, names, _ALIKE)
    error.possibilities = None
    remedy = f"; did you mean {near}?" if near else ""
    error.message = f"No such option: {wrong}{remedy}"  # type: ignore[attr-defined]
