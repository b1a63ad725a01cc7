"""Packages that gfimu runs without: what each is for, the extra that installs it, the one refusal without it.

A module that needs such a package imports it inside the function that uses it, or stands in a package whose
``__init__`` calls `require`. A command calls `require`, or declares its output by `gfimu.base.files.outputs`, before
its work begins.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence

from gfimu.base.errors import MissingPackageError

__all__ = ["OPTIONAL", "install_command", "missing", "packages_of", "require"]

OPTIONAL: dict[str, tuple[str, str]] = {
    "mujoco": ("mujoco", "sim"),
    "rerun": ("rerun-sdk", "view"),
    "matplotlib": ("matplotlib", "plot"),
    "unicorn": ("unicorn", "firmware"),
    "ziglang": ("ziglang", "firmware"),
    "h5py": ("h5py", "formats"),
    "mcap": ("mcap", "formats"),
    "pyulog": ("pyulog", "formats"),
    "rosbags": ("rosbags", "formats"),
    "openpyxl": ("openpyxl", "formats"),
    "pandas": ("pandas", "tables"),
    "polars": ("polars", "tables"),
    "distributed": ("distributed", "cluster"),
    "dask_jobqueue": ("dask-jobqueue", "cluster"),
}
"""Names to import: the package that holds each on PyPI, and the extra of gfimu that installs it."""


def missing(*modules: str) -> list[str]:
    """Return those of some modules that are not installed; nothing is imported.

    Parameters
    ----------
    *modules : str
        Names to import, of `OPTIONAL`.
    """
    return [name for name in modules if not _is_installed(name)]


def require(what: str, *modules: str, instead: str = "") -> None:
    """Refuse work whose packages are not installed.

    Parameters
    ----------
    what : str
        What needs them, in the words of the user: the first words of the message.
    *modules : str
        Names to import, of `OPTIONAL`.
    instead : str
        What to do without them, as a clause.

    Raises
    ------
    MissingPackageError
        If one is not installed; the message names the packages and the command that installs them.
    """
    absent = missing(*modules)
    if not absent:
        return
    verb = "is" if len(absent) == 1 else "are"
    remedy = f"; or {instead}" if instead else ""
    raise MissingPackageError(
        f"{what} needs {packages_of(absent)}, which {verb} not installed; run: {install_command(absent)}{remedy}"
    )


def packages_of(modules: Sequence[str]) -> str:
    """Return the packages that hold some modules, as words."""
    *first, last = (OPTIONAL[name][0] for name in modules)
    return f"{', '.join(first)} and {last}" if first else last


def install_command(modules: Sequence[str]) -> str:
    """Return the command that installs what some modules belong to."""
    extras = ",".join(dict.fromkeys(OPTIONAL[name][1] for name in modules))
    return f"pip install 'gfimu[{extras}]'"


def _is_installed(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except (ImportError, ValueError):  # ValueError: a module without a specification stands in its place
        return False
