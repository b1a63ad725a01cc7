"""The house rules that no type checker sees: who may import whom, no circles, every module says what it is."""

import ast
import graphlib
import importlib
import inspect
import re
from collections import Counter
from pathlib import Path

import pytest

import gfimu
from gfimu.world_model import BodyModel, ModelWithModes, ModelWithPlay, ModelWithRipple
from sim.twin import Twin

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("gfimu", "sim", "firmware_bridge")
FILES = {
    ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): file
    for package in PACKAGES
    for file in sorted((ROOT / package).rglob("*.py"))
}


def is_type_checking(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)


def imported_names(node: ast.AST, *, by_types: bool = False):
    """Dotted names that the code below a node imports, inside functions too; for type checkers only ``by_types``."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import):
            yield from (alias.name for alias in child.names)
        elif isinstance(child, ast.ImportFrom):
            assert child.level == 0, "relative import: write the full name"
            yield from (f"{child.module}.{alias.name}" for alias in child.names)
        elif is_type_checking(child) and not by_types:
            yield from imported_names(ast.Module(child.orelse, []))
        else:
            yield from imported_names(child, by_types=by_types)


def modules_imported(source: str, *, by_types: bool = False) -> set[str]:
    """Modules that a source imports; names inside a project module count as that module."""
    found = set()
    for name in imported_names(ast.parse(source), by_types=by_types):
        module = name
        while module not in FILES and "." in module and module.split(".")[0] in PACKAGES:
            module = module.rpartition(".")[0]
        found.add(module)
    return found


IMPORTS = {module: modules_imported(file.read_text(encoding="utf-8")) for module, file in FILES.items()}


def inside(module: str, *packages: str) -> bool:
    return any(module == package or module.startswith(f"{package}.") for package in packages)


def offences(importers, forbidden) -> list[str]:
    return [
        f"{module} imports {name}"
        for module, names in IMPORTS.items()
        if importers(module)
        for name in sorted(names)
        if forbidden(name)
    ]


def test_gfimu_imports_neither_the_world_nor_the_wire_except_its_commands():
    assert not offences(
        lambda module: inside(module, "gfimu") and not inside(module, "gfimu.cli", "gfimu.commands"),
        lambda name: inside(
            name, "sim", "firmware_bridge", "gfimu.cli", "gfimu.commands", "mujoco", "serial", "unicorn"
        ),
    )


def test_the_functions_under_the_commands_print_nothing():
    assert not offences(
        lambda module: inside(module, "gfimu.commands"),
        lambda name: inside(name, "gfimu.cli", "typer", "rich", "serial", "unicorn"),
    )


def test_neither_the_world_nor_the_wire_imports_the_commands():
    assert not offences(
        lambda module: inside(module, "sim", "firmware_bridge"), lambda name: inside(name, "gfimu.commands")
    )


def test_importing_everything_leaves_the_public_names_alone():
    """A module of the package called like a public function would take its place once it is imported."""
    modules = {module.removeprefix("gfimu.").partition(".")[0] for module in FILES if module.startswith("gfimu.")}
    assert not modules & set(gfimu.__all__)


def type_checked_names() -> dict[str, str]:
    """Names that `gfimu/__init__.py` shows to type checkers, and the modules they come from."""
    tree = ast.parse(FILES["gfimu"].read_text(encoding="utf-8"))
    (block,) = (node for node in tree.body if is_type_checking(node) and isinstance(node.test, ast.Name))
    return {alias.asname: node.module for node in block.body for alias in node.names if alias.asname == alias.name}


def test_type_checkers_see_the_names_that_programs_see():
    assert type_checked_names() == gfimu._PUBLIC


def test_dir_lists_the_public_names():
    assert dir(gfimu) == sorted(gfimu.__all__)
    assert {"simulate", "estimate", "diagnose", "firmware", "Recording", "__version__"} <= set(dir(gfimu))


def test_sim_imports_neither_the_wire_nor_the_command_line():
    assert not offences(
        lambda module: inside(module, "sim"), lambda name: inside(name, "firmware_bridge", "gfimu.cli", "serial")
    )


def test_the_world_knows_nothing_of_the_diagnosis():
    """The study of the diagnosis (`sim.study`) stands above both, as the commands do."""
    assert not offences(
        lambda module: inside(module, "sim") and not inside(module, "sim.study"),
        lambda name: inside(name, "gfimu.diagnosis", "sim.study"),
    )


def test_no_cast_makes_a_twin_a_world_model():
    protocols = "WorldModel|BodyModel|Twin|Effect|EffectFamily|Spin|Size"
    casts = {
        module: found
        for module, file in FILES.items()
        if (found := re.findall(rf"cast\(\s*[\"'][^\"']*\b(?:{protocols})\b", file.read_text(encoding="utf-8")))
    }
    assert casts == {}


def test_a_twin_is_a_world_model_without_any():
    """`sim/twin.py` lets the type checker prove it; ``Any`` in a signature would make that proof empty."""
    protocols = (BodyModel, ModelWithModes, ModelWithPlay, ModelWithRipple)
    methods = {name for protocol in protocols for name in dir(protocol) if not name.startswith("_")}
    assert {"predict", "predict_body", "families", "play", "ripple", "modes", "extended"} <= methods
    untyped = [
        name
        for name in methods
        if inspect.isfunction(method := inspect.getattr_static(Twin, name, None))
        and re.search(r"\bAny\b", str(inspect.signature(method)))
    ]
    assert untyped == []


def test_firmware_bridge_imports_recordings_and_the_chip_only():
    assert not offences(
        lambda module: inside(module, "firmware_bridge"),
        lambda name: (
            (inside(name, "sim") and not inside(name, "sim.adxl345"))
            or inside(name, "gfimu.cli", "gfimu.diagnosis", "gfimu.calibration", "gfimu.visual", "mujoco")
        ),
    )


def refuse_circles(imports: dict[str, set[str]]) -> None:
    graph = {module: {name for name in names if name in FILES} for module, names in imports.items()}
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        pytest.fail("circular import: " + " → ".join(error.args[1]))


def test_no_circular_imports():
    refuse_circles(IMPORTS)


def test_no_circles_in_firmware_bridge_even_by_types():
    """A chip or peripheral knows the bus protocol, not the board that implements it."""
    refuse_circles(
        {
            module: modules_imported(file.read_text(encoding="utf-8"), by_types=True)
            for module, file in FILES.items()
            if inside(module, "firmware_bridge")
        }
    )


def test_peripherals_know_the_bus_and_not_the_board():
    """The processor, the peripherals and the chips name neither the board nor each other's types for its sake."""
    above = {"board", "fast_board", "worker"}
    for module, file in FILES.items():
        if inside(module, "firmware_bridge.board") and module.rpartition(".")[2] not in above:
            names = modules_imported(file.read_text(encoding="utf-8"), by_types=True)
            assert not names & {f"firmware_bridge.board.{name}" for name in above}, module


def test_the_reader_of_imports_sees_every_form():
    source = """
import sim.world
from typing import TYPE_CHECKING
if TYPE_CHECKING:
    import serial
else:
    import json
def f():
    from gfimu.geometry.array import Chip
    from gfimu import recording
"""
    run = {"sim.world", "typing.TYPE_CHECKING", "json", "gfimu.geometry.array", "gfimu.recording"}
    assert modules_imported(source) == run
    assert modules_imported(source, by_types=True) == run | {"serial"}


@pytest.mark.parametrize("module", FILES)
def test_every_module_says_what_it_is(module):
    assert ast.get_docstring(ast.parse(FILES[module].read_text(encoding="utf-8")))


@pytest.mark.parametrize("name", gfimu.__all__)
def test_public_names_can_be_imported(name):
    assert getattr(gfimu, name) is not None


def test_unknown_public_name():
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        gfimu.nonsense  # noqa: B018


def test_test_files_have_names_of_their_own():
    names = Counter(file.name for file in (ROOT / "tests").rglob("test_*.py"))
    assert [name for name, count in names.items() if count > 1] == []


COMMON = {"gfimu", "gfimu.errors", "gfimu.units", "gfimu.files.outputs", "gfimu.files.atomic_file", "gfimu.short_repr"}
"""Modules that every room may import; of `gfimu` itself the version."""

ROOMS = {
    "gfimu.files": set(),
    "gfimu.parts": {"gfimu.files", "gfimu.geometry.array"},
    "gfimu.geometry": {"gfimu.bounds", "gfimu.files", "gfimu.parts.files"},
    "gfimu.recording": {"gfimu.files", "gfimu.geometry", "gfimu.parts", "gfimu.rate.integration"},
    "gfimu.motion": {"gfimu.files", "gfimu.geometry", "gfimu.parts", "gfimu.rate", "gfimu.recording"},
    "gfimu.position_drift": {"gfimu.geometry", "gfimu.motion", "gfimu.rate.integration"},
    "gfimu.diagnosis.data": {
        "gfimu.world_model",
        "gfimu.diagnosis.segment",
        "gfimu.diagnosis.stretches",
        "gfimu.recording",
    },
    "gfimu.diagnosis.criticism": {"gfimu.diagnosis.coloured_noise", "gfimu.diagnosis.verdict"},
    "gfimu.diagnosis.verdict": {"gfimu.world_model", "gfimu.diagnosis.data.run"},
    "gfimu.diagnosis.report": {
        "gfimu.diagnosis.calibration_residue",
        "gfimu.diagnosis.criticism",
        "gfimu.diagnosis.verdict",
        "gfimu.recording",
        "gfimu.visual",
    },
    "gfimu.diagnosis.design": {
        "gfimu.diagnosis.causes",
        "gfimu.diagnosis.coloured_noise",
        "gfimu.diagnosis.data.run",
        "gfimu.diagnosis.drive",
        "gfimu.diagnosis.evidence",
        "gfimu.world_model",
        "gfimu.diagnosis.segment",
        "gfimu.diagnosis.signatures",
        "gfimu.diagnosis.stretches",
    },
}
"""Folders, and what of this project each may import besides itself and the common modules."""

MOST_FILES = 12
"""In one folder of `ROOMS`."""


def room_imports(room: str) -> set[str]:
    """Modules of this project outside a room, and not common, that the room imports."""
    return {
        name
        for module, names in IMPORTS.items()
        if inside(module, room)
        for name in names
        if inside(name, *PACKAGES) and not inside(name, room) and name not in COMMON
    }


@pytest.mark.parametrize("room", ROOMS)
def test_rooms_import_from_the_rooms_they_name_only(room):
    imported = room_imports(room)
    assert {name for name in imported if not inside(name, *ROOMS[room])} == set()
    assert {name for name in ROOMS[room] if not any(inside(one, name) for one in imported)} == set()


@pytest.mark.parametrize("room", ROOMS)
def test_rooms_have_few_files(room):
    assert 1 < len([file for file in FILES.values() if file.parent == FILES[room].parent]) <= MOST_FILES


FORMER = {
    "gfimu.array": "gfimu.geometry.array",
    "gfimu.kinematics": "gfimu.geometry.kinematics",
    "gfimu.estimation": "gfimu.motion.estimation",
    "gfimu.diagnosis.model": "gfimu.world_model",
}
"""Modules that keep a former name for the programs of users, and where their content is."""


@pytest.mark.parametrize("former", FORMER)
def test_former_names_of_modules_give_the_same_objects(former):
    old, new = importlib.import_module(former), importlib.import_module(FORMER[former])
    assert set(old.__all__) <= set(new.__all__)
    assert all(getattr(old, name) is getattr(new, name) for name in old.__all__)


def test_the_project_itself_imports_no_former_name():
    assert not offences(lambda module: True, lambda name: name in FORMER)


def test_packages_called_like_former_modules_hold_their_names():
    assert importlib.import_module("gfimu.recording").Recording is gfimu.Recording
    assert importlib.import_module("gfimu.position_drift").drift_budget is gfimu.drift_budget


def test_few_modules_are_in_no_room():
    loose = {module for module, file in FILES.items() if file.parent == FILES["gfimu"].parent} - {"gfimu", *FORMER}
    assert loose == {
        "gfimu.bounds",
        "gfimu.errors",
        "gfimu.generic_basis",
        "gfimu.short_repr",
        "gfimu.units",
        "gfimu.world_model",
    }
