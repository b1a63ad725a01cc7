"""The names of a package, declared once and loaded on first use, so that no import waits for numba or scipy."""

from __future__ import annotations

import ast
import importlib
import sys
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

from gfimu.base.optional_packages import require

__all__ = ["declared_names", "homes_of"]


def declared_names(
    package: str, *, needs: tuple[str, str] | None = None, without: Collection[str] = ()
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return ``__getattr__``, ``__dir__`` and ``__all__`` of a package that imports its names for type checkers only.

    The list is the block ``if TYPE_CHECKING:`` of the package's own source, which type checkers and editors read, so
    that a public name is one line: ``from gfimu.array.array import Chip as Chip``.

    Parameters
    ----------
    package : str
        Name of the package, ``__name__``.
    needs : tuple of str, optional
        What the names are for, and the optional package that they need (`gfimu.base.optional_packages.require`).
    without : collection of str
        Names that do without that package.
    """
    homes = homes_of(package)

    def load(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if needs is not None and name not in without:
            require(*needs)
        home = importlib.import_module(homes[name])
        return getattr(home, name) if hasattr(home, name) else importlib.import_module(f"{homes[name]}.{name}")

    names = sorted(homes)
    return load, lambda: names, names


def homes_of(package: str) -> dict[str, str]:
    """Return the module of each name that a package or module, which is imported, imports for type checkers only."""
    source = Path(str(sys.modules[package].__file__)).read_text(encoding="utf-8")
    blocks = [node for node in ast.parse(source).body if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node)]
    imports = [node for block in blocks for node in block.body if isinstance(node, ast.ImportFrom)]
    return {alias.asname or alias.name: str(node.module) for node in imports for alias in node.names}
