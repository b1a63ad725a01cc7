"""Figures that only fall: how much there is, and how tangled it is."""

from __future__ import annotations

import ast
from collections import Counter

from .house import IMPORTS_BY_TYPES, MODULES, ROOMS, ROOT, Module, arrows, inside

MOST_PARAMETERS = 8
PLAIN_NUMBERS = {0, 1, 2, 3, 4, 6, 9, 12, -1, 0.5, -0.5, 100.0, 180.0, 1e3}
"""Numbers that say nothing tuned: counts of axes, halves, percent, degrees."""

NUMBERED_ROOMS = ("gfimu.diagnosis", "gfimu.rate", "gfimu.recording", "gfimu.calibration", "gfimu.array_search")


def code_lines(module: Module) -> int:
    """Return the lines of a module without docstrings, comments and blank lines."""
    strings = {
        line
        for node in ast.walk(module.tree)
        if isinstance(getattr(node, "body", None), list)
        for child in node.body
        if isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant) and isinstance(child.value.value, str)
        for line in range(child.lineno, child.end_lineno + 1)
    }
    lines = enumerate(module.source.splitlines(), 1)
    return sum(1 for number, line in lines if line.strip() and line.lstrip()[0] != "#" and number not in strings)


def tuned_numbers(module: Module) -> int:
    """Return how many literals outside a policy class no comment on their line calls numerical."""
    policies = (
        node for node in ast.walk(module.tree) if isinstance(node, ast.ClassDef) and node.name.endswith("Policy")
    )
    in_policy = {id(child) for policy in policies for child in ast.walk(policy)}
    lines = module.source.splitlines()
    return sum(
        1
        for node in ast.walk(module.tree)
        if isinstance(node, ast.Constant)
        and type(node.value) in (int, float)
        and node.value not in PLAIN_NUMBERS
        and id(node) not in in_policy
        and "numerical" not in lines[node.lineno - 1].lower()
    )


def functions(module: Module):
    return (node for node in ast.walk(module.tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef))


def calls(module: Module):
    """Yield name and number of arguments of each call."""
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Call):
            yield getattr(node.func, "id", getattr(node.func, "attr", "")), len(node.args)


def modules_in_circles() -> int:
    """Return how many modules are in a circle of imports, those for type checkers included, or lead into one."""
    reach = {name: set(others) for name, others in IMPORTS_BY_TYPES.items()}
    while True:  # leaves, and what imports only leaves, can't be in a circle
        free = {name for name, others in reach.items() if not others}
        if not free:
            return len(reach)
        reach = {name: others - free for name, others in reach.items() if name not in free}


def deep_tests() -> int:
    """Return how many test files import a module deeper than a room's face: more than two names with dots."""

    def deep(tree: ast.Module) -> bool:
        names = [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
        return any(name.count(".") > 1 and inside(name, "gfimu", "sim", "firmware_bridge") for name in names)

    return sum(deep(ast.parse(file.read_text(encoding="utf-8"))) for file in (ROOT / "tests").rglob("*.py"))


def figures() -> dict[str, int]:
    """Return the figures by name."""
    modules = MODULES.values()
    lines: Counter[str] = Counter()
    for module in modules:
        lines[module.room] += code_lines(module)
    called = Counter(name for module in modules for name, _ in calls(module))
    private = Counter(
        node.name
        for module in modules
        for node in functions(module)
        if node.name.startswith("_") and not node.name.startswith("__")
    )
    commands = [module for module in modules if module.room == "gfimu.commands"]
    numbers: Counter[str] = Counter()
    for module in modules:
        numbers[module.room] += tuned_numbers(module)
    return {
        "code lines": sum(lines.values()),
        **{f"code lines of {room}": lines[room] for room in ROOMS},
        "arrows up": sum(ROOMS.index(room) < ROOMS.index(other) for room, other in arrows()),
        "modules in circles": modules_in_circles(),
        "functions of commands with more than 8 parameters": sum(
            len(node.args.args) + len(node.args.kwonlyargs) > MOST_PARAMETERS
            for module in commands
            for node in functions(module)
        ),
        "getattr with a default": sum(
            name == "getattr" and size == 3 for module in modules for name, size in calls(module)
        ),
        **{f"numbers outside policies in {room}": numbers[room] for room in NUMBERED_ROOMS},
        "private functions called once": sum(size == 1 and called[name] == 1 for name, size in private.items()),
        "test files that import deeper than a room": deep_tests(),
    }
