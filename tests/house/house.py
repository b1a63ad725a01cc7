"""The modules of the project, the rooms they stand in, and what imports what."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("gfimu", "sim", "firmware_bridge")

ROOMS = (
    "gfimu.base",
    "gfimu.array",
    "gfimu.recording",
    "gfimu.sensor_noise",
    "gfimu.rate",
    "gfimu.motion",
    "gfimu.model",
    "gfimu.visual",
    "gfimu.calibration",
    "gfimu.budget",
    "gfimu.diagnosis",
    "gfimu.array_search",
    "sim",
    "firmware_bridge",
    "gfimu.commands",
    "gfimu",
)
"""From the ground up: a room imports itself and rooms before it. ``gfimu`` is the public face alone."""


@dataclass(frozen=True)
class Module:
    """A module of the project and its source."""

    name: str
    file: Path

    @cached_property
    def source(self) -> str:
        return self.file.read_text(encoding="utf-8")

    @cached_property
    def tree(self) -> ast.Module:
        return ast.parse(self.source)

    @property
    def room(self) -> str:
        return next((room for room in ROOMS[:-1] if inside(self.name, room)), ROOMS[-1])

    @property
    def docstring(self) -> str:
        return ast.get_docstring(self.tree) or ""


def inside(name: str, *packages: str) -> bool:
    """Whether a module is one of these packages or in one."""
    return any(name == package or name.startswith(f"{package}.") for package in packages)


MODULES = {
    module.name: module
    for package in PACKAGES
    for file in sorted((ROOT / package).rglob("*.py"))
    for module in [Module(".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"), file)]
}
"""Modules by name."""


def is_type_checking(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)


def imported_names(node: ast.AST, *, by_types: bool):
    """Yield the dotted names that the code below a node imports, inside functions too."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import):
            yield from (alias.name for alias in child.names)
        elif isinstance(child, ast.ImportFrom):
            assert child.level == 0, "relative import: write the full name"
            yield from (f"{child.module}.{alias.name}" for alias in child.names)
        elif is_type_checking(child) and not by_types:
            yield from imported_names(ast.Module(child.orelse, []), by_types=False)
        else:
            yield from imported_names(child, by_types=by_types)


def imports(tree: ast.Module, *, by_types: bool = False) -> set[str]:
    """Return the modules that a source imports; a name inside a module of the project counts as that module.

    Parameters
    ----------
    tree : ast.Module
        The source.
    by_types : bool
        Whether imports for type checkers count.
    """
    found = set()
    for name in imported_names(tree, by_types=by_types):
        module = name
        while module not in MODULES and "." in module and module.split(".")[0] in PACKAGES:
            module = module.rpartition(".")[0]
        found.add(module)
    return found


IMPORTS = {name: imports(module.tree) for name, module in MODULES.items()}
"""What runs, by module; names of other projects too."""

IMPORTS_BY_TYPES = {name: imports(module.tree, by_types=True) & MODULES.keys() for name, module in MODULES.items()}
"""What runs or is read by type checkers, of this project."""


def arrows() -> set[tuple[str, str]]:
    """Return the pairs of rooms of which the first imports the second."""
    rooms = {
        (MODULES[name].room, MODULES[other].room)
        for name, others in IMPORTS.items()
        for other in others & MODULES.keys()
    }
    return {(room, other) for room, other in rooms if room != other}
