"""The `gfimu` program: collects the commands and turns every error into one line and an exit code."""

from __future__ import annotations

import importlib
import json
import os
import sys
import tempfile
import traceback

import typer

import gfimu
from gfimu.cli.command_group import CommandGroup
from gfimu.errors import GfimuError, InputError

__all__ = ["main", "program"]

_DEBUG = "--debug"
_JSON = "--json"
_DEBUG_VARIABLE = "GFIMU_DEBUG"
_LONGEST = 400  # characters of a foreign message
_INTERRUPTED = 130  # what typer makes of Ctrl-C


def _version(show: bool) -> None:
    if show:
        typer.echo(f"gfimu {gfimu.__version__}")
        raise typer.Exit


def _options(
    version: bool = typer.Option(False, "--version", callback=_version, is_eager=True, help="Print the version."),
    debug: bool = typer.Option(
        False,
        _DEBUG,
        help=f"Show where an error came from; may stand after the command too, as may {_DEBUG_VARIABLE}=1.",
    ),
) -> None:
    """Collect the options of the program itself."""
    importlib.import_module("gfimu.cli.warning_lines").install()


def program() -> typer.Typer:
    """Return the program with all its commands."""
    app = typer.Typer(
        name="gfimu",
        cls=CommandGroup,
        help="A gyro-free IMU in software: simulate, estimate, calibrate, diagnose.",
        epilog="gfimu COMMAND --help shows the options of a command, with examples.",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,  # plain text: the list of commands must not wait for rich
    )
    app.callback()(_options)
    return app


def main() -> None:
    """Run the program: exit code 0 when done, 2 on bad input, 1 on anything else, with one line that says why."""
    arguments, debug = _without_debug(sys.argv[1:])
    sys.argv[1:] = arguments
    if hasattr(sys.stdout, "reconfigure"):  # Greek letters and odd file names must not end a command
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        code = program()(prog_name="gfimu", standalone_mode=False)
        if code == _INTERRUPTED:
            code = _report(KeyboardInterrupt(), debug=False, as_json=_JSON in arguments)
        sys.stdout.flush()  # a full disk or a closed pipe shows here at the latest
    except BaseException as error:  # noqa: BLE001  some libraries' own exceptions are no Exception
        code = _report(error, debug=debug, as_json=_JSON in arguments)
    raise SystemExit(code or 0)


def _without_debug(arguments: list[str]) -> tuple[list[str], bool]:
    """Take ``--debug`` out of the arguments, wherever it stands before a ``--``."""
    end = arguments.index("--") if "--" in arguments else len(arguments)
    kept = [argument for argument in arguments[:end] if argument != _DEBUG]
    asked = len(kept) < end or os.environ.get(_DEBUG_VARIABLE, "0") not in {"", "0"}
    return kept + arguments[end:], asked


def _report(error: BaseException, *, debug: bool, as_json: bool) -> int:
    """Print an error as one line, for machines as one object too, and where it came from if asked; return the code."""
    if isinstance(error, SystemExit):
        return error.code if isinstance(error.code, int) else int(error.code is not None)
    if debug:
        traceback.print_exception(error)
    if isinstance(error, BrokenPipeError):
        _close_stdout()
        return 1
    context = getattr(error, "ctx", None)
    if type(error).__name__ == "NoArgsIsHelpError" and context is not None:
        typer.echo(context.get_help())
        return 2
    text, code = _explained(error)
    text = " ".join(text.split())  # one line, whatever line ends the text has
    sys.stderr.write(f"gfimu: {text}\n")
    if isinstance(error, OSError):
        _close_stdout()
    elif as_json:
        fault = {"kind": type(error).__name__, "message": text, "exit_code": code}
        typer.echo(json.dumps({"error": fault}, indent=2, ensure_ascii=False))
    return code


def _explained(error: BaseException) -> tuple[str, int]:
    """Return what an error says to a user, and the exit code."""
    if isinstance(error, KeyboardInterrupt):
        return "interrupted", 1
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


def _close_stdout() -> None:
    """Let the end of the program not stumble over a standard output that can't be written."""
    try:
        sys.stdout.flush()
    except (OSError, ValueError):
        with open(os.devnull, "w", encoding="utf-8") as nothing:  # noqa: PTH123
            os.dup2(nothing.fileno(), sys.stdout.fileno())
