"""The commands of the program by job; each stands in a file of its own, ``gfimu/commands/NAME.py``.

The line of help of a command is the first paragraph of its file, which is read as text, so that ``gfimu --help``
imports none of them and a command only its own.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

__all__ = ["COMMANDS", "JOBS", "declared_commands", "help_line"]

JOBS: dict[str, tuple[str, ...]] = {
    "First steps": ("demo", "start", "list", "show", "new", "schema"),
    "Bring a recording": ("inspect", "convert", "join", "record"),
    "Calibrate and estimate": ("calibrate", "certificate", "noise", "estimate", "impact", "live", "view"),
    "Find what a simulation gets wrong": ("check", "diagnose", "design", "benchmark"),
    "Design and simulate": ("score", "optimize", "drift", "tolerance", "simulate", "campaign", "firmware"),
}
"""Commands by job, in the order of the help."""

COMMANDS = tuple(name for names in JOBS.values() for name in names)
"""Commands in the order of the help."""


def help_line(name: str) -> str:
    """Return the line of help of a command."""
    source = (Path(__file__).parents[1] / f"{name}.py").read_text(encoding="utf-8")
    return source.partition('"""')[2].partition('"""')[0].partition("\n\n")[0].replace("\n", " ").strip()


def declared_commands(name: str) -> list[Any]:
    """Return what the file of a command declares: the command, or those of a group of commands."""
    # By its name, which is that of its file: a plain import of each would load them all for every call.
    module = importlib.import_module(f"gfimu.commands.{name}")
    found = [value.__command__ for value in vars(module).values() if hasattr(value, "__command__")]
    return [command for command in found if command.name.split()[0] == name]
