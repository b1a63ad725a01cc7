"""Names that load on first use, so that an import waits for nothing heavy; former names of modules."""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable, Collection, Mapping
from typing import Any

from gfimu.optional_packages import require

__all__ = ["command_above", "former_name", "names_on_first_use"]


def names_on_first_use(
    package: str,
    homes: Mapping[str, str],
    *,
    needs: tuple[str, str] | None = None,
    without: Collection[str] = (),
) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a package whose names stand in its modules.

    Parameters
    ----------
    package : str
        Name of the package.
    homes : mapping of str to str
        Module inside the package by the name that it holds.
    needs : tuple of str, optional
        What the names are for, and the optional package that they need (`gfimu.optional_packages.require`).
    without : collection of str
        Names that do without that package.
    """

    def load(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if needs is not None and name not in without:
            require(*needs)
        return getattr(importlib.import_module(f"{package}.{homes[name]}"), name)

    return load


def command_above(name: str) -> Callable[..., Any]:
    """Return a command's function, a public name of gfimu, for the method of a result that hands itself to it.

    The commands stand above all results, so that no result may import them: this is the one way up.

    Parameters
    ----------
    name : str
        Public name, such as ``view``.
    """
    function: Callable[..., Any] = getattr(importlib.import_module("gfimu"), name)
    return function


def former_name(module: str, new: str, *, removed: str) -> None:
    """Warn that a module is imported by its former name; called by the module itself.

    Parameters
    ----------
    module : str
        The former name.
    new : str
        The module in its place.
    removed : str
        Version of gfimu that will not have the former name any more.
    """
    # Above this call and the module stand two frames of the import machinery's, which Python leaves out of the count.
    warnings.warn(f"{module} is removed in gfimu {removed}; import {new}", DeprecationWarning, stacklevel=3)
