"""The `gfimu` program: collects the commands and turns every error into one line and an exit code."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import sys
import tempfile
import traceback
import warnings
from dataclasses import dataclass
from typing import Any

import typer

from gfimu.base.errors import GfimuError, GfimuWarning, InputError, one_line, printable
from gfimu.base.version import __version__
from gfimu.commands.shell.command import CONTEXT
from gfimu.commands.shell.command_group import JSON_ASKED, CommandGroup
from gfimu.commands.shell.output import print_json
from gfimu.commands.shell.stop_signals import INTERRUPTED, Stop, stop_signals

__all__ = ["main", "program", "set_environment"]

_DEBUG = "--debug"
_JSON = "--json"
_DEBUG_VARIABLE = "GFIMU_DEBUG"
_LONGEST = 400  # characters of a foreign message
_READER_LEFT = 141
_OF_NAMES = {errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.EACCES, errno.EPERM, errno.ELOOP, errno.ENAMETOOLONG}
"""What the system says of a file that was named wrongly, or has vanished."""
_OF_STDOUT = {errno.ENOSPC, errno.EDQUOT, errno.EBADF}
"""What it says of standard output: where a file can't be written, the error names it."""
_STREAMS = "live"  # the command that prints JSON lines


_ENVIRONMENT = {
    # Small products on few cores collapse with several BLAS threads.
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    # Where the environment has neither, numba takes both from a .numba_config.yaml of the current folder, and runs what
    # is in them.
    "NUMBA_CACHE_DIR": "",
    "NUMBA_CACHE_LOCATOR_CLASSES": "",
    # MuJoCo would look for a window system, by a process of its own that Ctrl-C ends with a traceback.
    "MUJOCO_GL": "disable",
}
"""What libraries read when they are loaded; the user's own settings win."""


def set_environment() -> None:
    """Set what libraries read when they are loaded, where the user has not."""
    for name, value in _ENVIRONMENT.items():
        os.environ.setdefault(name, value)


def _version(ctx: typer.Context, show: bool) -> None:
    if not show:
        return
    if ctx.meta.get(JSON_ASKED):
        print_json({"name": "gfimu", "version": __version__, "python": sys.version.split()[0]})
    else:
        typer.echo(f"gfimu {__version__}")
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
    _warn_in_lines()


def _warn_in_lines() -> None:
    """Print each warning of gfimu once, as one line on standard error; others as Python does."""
    printed: set[str] = set()

    def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
        if not issubclass(category, GfimuWarning):
            sys.stderr.write(printable(warnings.formatwarning(message, category, *place[:2])))
        elif str(message) not in printed:
            printed.add(str(message))
            sys.stderr.write(f"gfimu: warning: {one_line(str(message))}\n")

    warnings.simplefilter("ignore", RuntimeWarning)  # of numbers without end: what follows from them is refused
    warnings.simplefilter("always", GfimuWarning)
    warnings.showwarning = show


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

    After Ctrl-C the code is 130, after SIGTERM 143, where the reader of a pipe has left 141, as shells have it.
    """
    set_environment()
    arguments, debug = _without_debug(sys.argv[1:])
    sys.argv[1:] = arguments
    sys.stderr = sys.stderr or open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115  closed, as by 2>&-
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # Greek letters and odd file names must not end a command
            stream.reconfigure(errors="backslashreplace")
    report = _Report(debug=debug, as_json=_JSON in arguments, one_line=arguments[:1] == [_STREAMS])
    with stop_signals() as stop:
        try:
            if sys.stdout is None:  # the next file that is opened would take its place
                raise InputError("standard output is closed; send it to a file, or to /dev/null")  # noqa: TRY301
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
        if isinstance(error, BrokenPipeError) or isinstance(
            error.__context__, BrokenPipeError
        ):  # click has an exit of it
            _close_stdout()
            return _READER_LEFT
        if isinstance(error, SystemExit):
            return error.code if isinstance(error.code, int) else int(error.code is not None)
        if self.debug:
            sys.stderr.write(printable("".join(traceback.format_exception(error))))
        context = getattr(error, "ctx", None)
        if type(error).__name__ == "NoArgsIsHelpError" and context is not None:
            typer.echo(context.get_help())
            return 2
        text, code = _explained(error)
        self._print(type(error).__name__, text, code)
        return code

    def _print(self, kind: str, text: str, code: int) -> None:
        """Print one line on standard error and, for machines, an object on standard output, if that can be written."""
        text = one_line(text).strip()
        with contextlib.suppress(OSError):
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
        return _of_system(error)
    if isinstance(error, UnicodeEncodeError):
        return f"{error.object!r:.{_LONGEST}}: is not text in {error.encoding}; use another name", 2
    if isinstance(error, MemoryError):
        return "not enough memory; use a shorter recording or a machine with more", 1
    text = f"{type(error).__name__}: {error}"[:_LONGEST]
    file = _written(error)
    attached = f"the file {file}" if file else f"what the same command prints with {_DEBUG}"
    return f"unexpected {text}; please report it with {attached} ({_DEBUG} shows where it came from)", 1


def _written(error: BaseException) -> str:
    """Write where an error came from to a file to attach to a report; return its name, empty where that fails."""
    lines = [f"gfimu {__version__}, Python {sys.version}, {sys.platform}\n", f"arguments: {sys.argv[1:]!r}\n\n"]
    try:
        handle, name = tempfile.mkstemp(prefix="gfimu-error-", suffix=".txt")
        with os.fdopen(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.writelines([*lines, *traceback.format_exception(error)])
    except Exception:  # noqa: BLE001  the report of an error must not become another one
        return ""
    return name


def _of_system(error: OSError) -> tuple[str, int]:
    """Return what the operating system refused, with the file if it is known, and the exit code."""
    what = error.strerror or str(error)
    if error.filename is not None:
        return f"{error.filename}: {what}", 2 if error.errno in _OF_NAMES else 1
    if error.errno in _OF_STDOUT:
        return f"standard output: {what}; free space, or send it elsewhere", 2
    return f"{what}; free space, or write elsewhere", 1


def _close_stdout() -> bool:
    """Write out what standard output holds; where that fails, let the end of the program not stumble over it."""
    if sys.stdout is None:
        return False
    try:
        sys.stdout.flush()
    except (OSError, ValueError):
        with open(os.devnull, "w", encoding="utf-8") as nothing:  # noqa: PTH123
            os.dup2(nothing.fileno(), sys.stdout.fileno())
        return False
    return True
