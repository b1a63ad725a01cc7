"""The `gfimu` program: collects the commands and turns known errors into one line and an exit code."""

from __future__ import annotations

import importlib
import sys

import typer

import gfimu
from gfimu.errors import GfimuError, InputError

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
    importlib.import_module("gfimu.cli.warning_lines").install()


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


def main() -> None:
    """Run the program: exit code 0 when done, 2 on bad input, 1 on anything else."""
    try:
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
