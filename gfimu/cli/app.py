"""The `gfimu` program: collects the commands and turns known errors into one line and an exit code."""

from __future__ import annotations

import importlib
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import typer

import gfimu
from gfimu.errors import CorruptValueWarning, GfimuError, InputError

__all__ = ["main", "program"]

COMMAND_FILES = (
    "demo",
    "score",
    "simulate",
    "estimate",
    "live",
    "convert",
    "diagnose",
    "drift",
    "design",
    "calibrate",
    "noise",
    "record",
    "firmware",
    "view",
)


def _version(show: bool) -> None:
    if show:
        typer.echo(f"gfimu {gfimu.__version__}")
        raise typer.Exit


def _options(
    version: bool = typer.Option(False, "--version", callback=_version, is_eager=True, help="Print the version."),
) -> None:
    """Collect the options of the program itself."""


def program() -> typer.Typer:
    """Return the program with all its commands."""
    app = typer.Typer(
        name="gfimu",
        help="A gyro-free IMU in software: simulate, estimate, calibrate, diagnose.",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode="markdown",
    )
    app.callback()(_options)
    for name in COMMAND_FILES:
        importlib.import_module(f"gfimu.cli.{name}").register(app)
    return app


@contextmanager
def _warnings_as_lines() -> Iterator[None]:
    """Print each warning about a file as one line, once."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", CorruptValueWarning)
        usual, printed = warnings.showwarning, set()

        def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
            if not issubclass(category, CorruptValueWarning):
                usual(message, category, *place, **more)
            elif str(message) not in printed:
                printed.add(str(message))
                sys.stderr.write(f"gfimu: warning: {message}\n")

        warnings.showwarning = show
        yield


def main() -> None:
    """Run the program: exit code 0 when done, 2 on bad input, 1 on anything else."""
    try:
        with _warnings_as_lines():
            program()()
    except InputError as error:
        sys.stderr.write(f"gfimu: {error}\n")
        raise SystemExit(2) from None
    except GfimuError as error:
        sys.stderr.write(f"gfimu: {error}\n")
        raise SystemExit(1) from None
    except BrokenPipeError:
        raise SystemExit(1) from None
    except KeyboardInterrupt:
        sys.stderr.write("gfimu: interrupted\n")
        raise SystemExit(1) from None
