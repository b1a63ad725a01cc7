"""The `gfimu` program: collects the commands and turns every error into one line and an exit code."""

from __future__ import annotations

import contextlib
import json
import os
import sys
import tempfile
import traceback
from dataclasses import dataclass

import typer

import gfimu
from gfimu.cli import warning_lines
from gfimu.cli.command import CONTEXT
from gfimu.cli.command_group import JSON_ASKED, CommandGroup
from gfimu.cli.output import print_json
from gfimu.cli.stop_signals import INTERRUPTED, Stop, stop_signals
from gfimu.errors import GfimuError, InputError

__all__ = ["main", "program"]

_DEBUG = "--debug"
_JSON = "--json"
_DEBUG_VARIABLE = "GFIMU_DEBUG"
_LONGEST = 400  # characters of a foreign message
_STREAMS = "live"  # the command that prints JSON lines


def _version(ctx: typer.Context, show: bool) -> None:
    if not show:
        return
    if ctx.meta.get(JSON_ASKED):
        print_json({"name": "gfimu", "version": gfimu.__version__, "python": sys.version.split()[0]})
    else:
        typer.echo(f"gfimu {gfimu.__version__}")
    raise typer.Exit


def _options(
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Print the version; with --json as an object."
    ),
    debug: bool = typer.Option(
        False,
        _DEBUG,
        help=f"Show where an error came from; may stand after the command too, as may {_DEBUG_VARIABLE}=1.",
    ),
    json: bool = typer.Option(False, _JSON, hidden=True),
) -> None:
    """Collect the options of the program itself."""
    if json:
        raise InputError("--json stands after the command, or beside --version")
    warning_lines.install()


def program() -> typer.Typer:
    """Return the program with all its commands."""
    app = typer.Typer(
        name="gfimu",
        cls=CommandGroup,
        help="A gyro-free IMU in software: simulate, estimate, calibrate, diagnose.",
        epilog="gfimu COMMAND --help shows the options of a command, with examples; gfimu help COMMAND is the same.",
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,  # plain text: help must not wait for rich
        context_settings=CONTEXT,
    )
    app.callback()(_options)
    return app


def main() -> None:
    """Run the program: exit code 0 when done, 2 on bad input, 1 on anything else, with one line that says why.

    After Ctrl-C the code is 130, after SIGTERM 143, as shells have it.
    """
    arguments, debug = _without_debug(sys.argv[1:])
    sys.argv[1:] = arguments
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # Greek letters and odd file names must not end a command
            stream.reconfigure(errors="backslashreplace")
    report = _Report(debug=debug, as_json=_JSON in arguments, one_line=arguments[:1] == [_STREAMS])
    with stop_signals() as stop:
        try:
            code = program()(prog_name="gfimu", standalone_mode=False)
            if code == INTERRUPTED:
                code = report.stopped(stop)
            sys.stdout.flush()  # a full disk or a closed pipe shows here at the latest
        except KeyboardInterrupt:
            code = report.stopped(stop)
        except BaseException as error:  # noqa: BLE001  some libraries' own exceptions are no Exception
            code = report.stopped(stop) if stop.is_cause_of(error) else report.failed(error)
    raise SystemExit(code or 0)


def _without_debug(arguments: list[str]) -> tuple[list[str], bool]:
    """Take ``--debug`` out of the arguments, wherever it stands before a ``--``."""
    end = arguments.index("--") if "--" in arguments else len(arguments)
    kept = [argument for argument in arguments[:end] if argument != _DEBUG]
    asked = len(kept) < end or os.environ.get(_DEBUG_VARIABLE, "0") not in {"", "0"}
    return kept + arguments[end:], asked


@dataclass(frozen=True)
class _Report:
    """Prints why the program ends, and returns the exit code.

    Parameters
    ----------
    debug : bool
        Whether to print where an error came from.
    as_json : bool
        Whether to print an object for machines on standard output as well.
    one_line : bool
        Whether that object is one line, of a command that prints JSON lines.
    """

    debug: bool
    as_json: bool
    one_line: bool

    def stopped(self, stop: Stop) -> int:
        """Report Ctrl-C or SIGTERM."""
        self._print("Interrupted", stop.words, stop.code)
        return stop.code

    def failed(self, error: BaseException) -> int:
        """Report an error."""
        if isinstance(error, SystemExit):
            return error.code if isinstance(error.code, int) else int(error.code is not None)
        if self.debug:
            traceback.print_exception(error)
        if isinstance(error, BrokenPipeError):
            _close_stdout()
            return 1
        context = getattr(error, "ctx", None)
        if type(error).__name__ == "NoArgsIsHelpError" and context is not None:
            typer.echo(context.get_help())
            return 2
        text, code = _explained(error)
        self._print(type(error).__name__, text, code)
        return code

    def _print(self, kind: str, text: str, code: int) -> None:
        """Print one line on standard error and, for machines, an object on standard output, if that can be written."""
        text = " ".join(text.split())  # one line, whatever line ends the text has
        with contextlib.suppress(BrokenPipeError):
            sys.stderr.write(f"gfimu: {text}\n")
        if _close_stdout() and self.as_json:
            fault = {"kind": kind, "message": text, "exit_code": code}
            with contextlib.suppress(OSError):
                typer.echo(json.dumps({"error": fault}, indent=None if self.one_line else 2, ensure_ascii=False))
            _close_stdout()


def _explained(error: BaseException) -> tuple[str, int]:
    """Return what an error says to a user, and the exit code."""
    if isinstance(error, GfimuError):
        return str(error), 2 if isinstance(error, InputError) else 1
    if hasattr(error, "format_message"):  # a misspelt option or command
        context = getattr(error, "ctx", None)
        command = context.command_path if context is not None else "gfimu"
        return f"{error.format_message().rstrip('.')}; see {command} --help", getattr(error, "exit_code", 2)
    if isinstance(error, OSError):
        return _of_system(error), 1
    if isinstance(error, MemoryError):
        return "not enough memory; use a shorter recording or a machine with more", 1
    text = f"{type(error).__name__}: {error}"[:_LONGEST]
    file = _written(error)
    attached = f"the file {file}" if file else f"what the same command prints with {_DEBUG}"
    return f"unexpected {text}; please report it with {attached} ({_DEBUG} shows where it came from)", 1


def _written(error: BaseException) -> str:
    """Write where an error came from to a file to attach to a report; return its name, empty where that fails."""
    lines = [f"gfimu {gfimu.__version__}, Python {sys.version}, {sys.platform}\n", f"arguments: {sys.argv[1:]!r}\n\n"]
    try:
        handle, name = tempfile.mkstemp(prefix="gfimu-error-", suffix=".txt")
        with os.fdopen(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.writelines([*lines, *traceback.format_exception(error)])
    except Exception:  # noqa: BLE001  the report of an error must not become another one
        return ""
    return name


def _of_system(error: OSError) -> str:
    """Return what the operating system refused, with the file if it is known."""
    what = error.strerror or str(error)
    return f"{error.filename}: {what}" if error.filename is not None else f"{what}; free space, or write elsewhere"


def _close_stdout() -> bool:
    """Write out what standard output holds; where that fails, let the end of the program not stumble over it."""
    try:
        sys.stdout.flush()
    except (OSError, ValueError):
        with open(os.devnull, "w", encoding="utf-8") as nothing:  # noqa: PTH123
            os.dup2(nothing.fileno(), sys.stdout.fileno())
        return False
    return True
