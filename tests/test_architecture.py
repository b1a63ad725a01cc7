"""The house rules that no type checker sees: who may import whom, no circles, every module says what it is."""

import ast
import graphlib
import importlib
import inspect
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

import gfimu
from gfimu.world_model import BodyModel
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
        lambda module: inside(module, "gfimu") and not inside(module, "gfimu.cli", "gfimu.commands", "gfimu.__main__"),
        lambda name: inside(
            name, "sim", "firmware_bridge", "gfimu.cli", "gfimu.commands", "mujoco", "serial", "unicorn"
        ),
    )


def test_the_functions_under_the_commands_print_nothing():
    assert not offences(
        lambda module: inside(module, "gfimu.commands"),
        lambda name: inside(name, "gfimu.cli", "typer", "rich", "serial", "unicorn"),
    )


BELOW = {module for module in FILES if inside(module, "gfimu") and not inside(module, "gfimu.cli", "gfimu.commands")}
"""Modules of gfimu below its commands."""


def names_imported_below() -> dict[str, set[str]]:
    return {one: set(imported_names(ast.parse(FILES[one].read_text(encoding="utf-8")))) for one in BELOW - {"gfimu"}}


def test_below_the_commands_the_package_itself_is_asked_for_its_version_only():
    asked = {
        module: names
        for module, imported in names_imported_below().items()
        if (names := {one for one in imported if one.rpartition(".")[0] in {"", "gfimu"} and inside(one, "gfimu")})
        and not names <= {"gfimu.__version__", *FILES} - {"gfimu"}
    }
    assert asked == {}


def test_only_methods_of_results_hand_themselves_to_a_command_above():
    found = {one for one, names in names_imported_below().items() if "gfimu.lazy_names.command_above" in names}
    assert found == {"gfimu.results.result", "gfimu.diagnosis.verdict.verdict"}


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
    methods = {name for name in dir(BodyModel) if not name.startswith("_")}
    assert {"predict", "predict_body", "families", "extended"} <= methods
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
            (inside(name, "sim") and not inside(name, "sim.chips.adxl345"))
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


COMMON = {
    "gfimu.plugins",
    "gfimu",
    "gfimu.errors",
    "gfimu.units",
    "gfimu.files.outputs",
    "gfimu.files.atomic_file",
    "gfimu.short_repr",
    "gfimu.lazy_names",
    "gfimu.results",
    "gfimu.optional_packages",
}
"""Modules that every room may import; of `gfimu` itself the version."""

ROOMS = {
    "gfimu.files": set(),
    "gfimu.parts": {"gfimu.files", "gfimu.geometry.array"},
    "gfimu.bounds": {"gfimu.geometry", "gfimu.rate.sensing"},
    "gfimu.geometry": {"gfimu.bounds.sample", "gfimu.files", "gfimu.parts.files"},
    "gfimu.importing": {"gfimu.files", "gfimu.geometry.array"},
    "gfimu.recording": {"gfimu.files", "gfimu.geometry", "gfimu.importing", "gfimu.parts", "gfimu.rate.integration"},
    "gfimu.array_search": {
        "gfimu.bounds.sample",
        "gfimu.files",
        "gfimu.geometry",
        "gfimu.integrity.detectable",
        "gfimu.parts",
        "gfimu.position_drift",
        "gfimu.visual.colours",
    },
    "gfimu.crash": {
        "gfimu.geometry",
        "gfimu.motion.estimate",
        "gfimu.motion.estimation",
        "gfimu.parts.limits",
        "gfimu.recording",
        "gfimu.visual.colours",
    },
    "gfimu.certification": {
        "gfimu.calibration",
        "gfimu.geometry.array",
        "gfimu.parts",
        "gfimu.recording",
        "gfimu.sensor_noise",
        "gfimu.visual.page",
    },
    "gfimu.exporting": {
        "gfimu.calibration",
        "gfimu.geometry",
        "gfimu.parts",
        "gfimu.recording",
        "gfimu.sensor_noise",
    },
    "gfimu.integrity": {"gfimu.geometry.array", "gfimu.rate"},
    "gfimu.joining": {"gfimu.files", "gfimu.importing", "gfimu.recording"},
    "gfimu.motion": {
        "gfimu.files",
        "gfimu.geometry",
        "gfimu.integrity",
        "gfimu.parts",
        "gfimu.rate",
        "gfimu.recording",
    },
    "gfimu.own_rig": {"gfimu.files", "gfimu.geometry.array", "gfimu.generic_basis", "gfimu.world_model"},
    "gfimu.position_drift": {
        "gfimu.geometry",
        "gfimu.motion",
        "gfimu.rate.integration",
        "gfimu.recording",
        "gfimu.sensor_noise",
        "gfimu.visual.colours",
    },
    "gfimu.results": {"gfimu.files", "gfimu.visual.colours"},
    "gfimu.tolerances": {
        "gfimu.bounds.sample",
        "gfimu.calibration",
        "gfimu.geometry",
        "gfimu.motion",
        "gfimu.parts",
        "gfimu.rate",
        "gfimu.recording",
        "gfimu.visual.colours",
    },
    "gfimu.uncertainty": {"gfimu.calibration", "gfimu.certification", "gfimu.files"},
    "firmware_bridge.adxl345": set(),
    "firmware_bridge.frames": {"gfimu.files", "gfimu.geometry.array", "gfimu.parts"},
    "firmware_bridge.host": {
        "firmware_bridge.frames",
        "firmware_bridge.sources",
        "gfimu.files",
        "gfimu.geometry.array",
        "gfimu.integrity",
        "gfimu.parts",
        "gfimu.rate",
        "gfimu.recording",
    },
    "firmware_bridge.loop": {
        "firmware_bridge.adxl345",
        "firmware_bridge.board.worker",
        "firmware_bridge.frames",
        "firmware_bridge.host",
        "firmware_bridge.lpc1768",
        "gfimu.geometry.array",
        "gfimu.recording",
        "sim.chips.adxl345",
    },
    "firmware_bridge.sender": {"firmware_bridge.lpc1768.build"},
    "firmware_bridge.sources": {"firmware_bridge.frames", "gfimu.geometry.array", "gfimu.importing.piece"},
    "firmware_bridge.strict": {
        "firmware_bridge.adxl345",
        "firmware_bridge.board",
        "firmware_bridge.loop",
        "firmware_bridge.lpc1768",
    },
    "gfimu.sensor_noise": {"gfimu.recording", "gfimu.visual.colours"},
    "firmware_bridge.lpc1768": set(),
    "sim.chips": {"gfimu.geometry.array", "gfimu.parts.part_file"},
    "sim.motions": {"gfimu.files.schema", "gfimu.geometry.smooth_ramp", "gfimu.world_model"},
    "sim.rigs": {
        "gfimu.files",
        "gfimu.geometry.array",
        "gfimu.world_model",
        "sim.earth",
        "sim.forward",
        "sim.motions.motion",
        "sim.truth",
        "sim.world",
    },
    "sim.worlds": {
        "gfimu.geometry.array",
        "gfimu.recording",
        "gfimu.sensor_noise.innovations",
        "gfimu.tolerances",
        "sim.chips.adxl345",
        "sim.effects",
        "sim.forward",
        "sim.motions",
        "sim.rigs.turntable",
        "sim.scenarios",
        "sim.truth",
        "sim.twin",
        "sim.world",
    },
}
"""Folders, and what of this project each may import besides itself and the common modules."""

LARGE_ROOMS = {
    "gfimu.calibration": {
        "gfimu.files",
        "gfimu.geometry",
        "gfimu.importing.guessing.likely_reference",
        "gfimu.parts",
        "gfimu.rate",
        "gfimu.recording",
        "gfimu.visual.colours",
    },
    "gfimu.known_axis": {
        "gfimu.geometry",
        "gfimu.motion",
        "gfimu.parts.part",
        "gfimu.rate.stream",
        "gfimu.recording",
        "gfimu.sensor_noise",
    },
    "gfimu.rate": {"gfimu.bounds.sample", "gfimu.files.column_file", "gfimu.geometry", "gfimu.parts"},
    "gfimu.visual": {
        "gfimu.files",
        "gfimu.geometry",
        "gfimu.integrity",
        "gfimu.known_axis.estimation",
        "gfimu.motion",
        "gfimu.recording",
    },
    "firmware_bridge.board": {"firmware_bridge.adxl345", "firmware_bridge.lpc1768", "gfimu.files.rerun_stream"},
    "sim.benchmark": {
        "gfimu.geometry.array",
        "gfimu.motion.body_drive",
        "gfimu.recording",
        "sim.effects",
        "sim.json_lines",
        "sim.motions.motion",
        "sim.rigs",
        "sim.sweep",
        "sim.twin",
        "sim.worlds",
    },
    "sim.effects": {
        "gfimu.files.model_files",
        "gfimu.generic_basis",
        "gfimu.geometry.array",
        "gfimu.own_rig.places",
        "gfimu.world_model",
        "sim.motions.motion",
        "sim.world",
    },
    "sim.study": {
        "gfimu.diagnosis",
        "gfimu.files.model_files",
        "gfimu.geometry.array",
        "gfimu.recording",
        "sim.benchmark",
        "sim.effects",
        "sim.json_lines",
        "sim.motions.motion",
        "sim.scenarios",
        "sim.simulation",
        "sim.sweep",
        "sim.twin",
        "sim.worlds",
    },
    "sim.sweep": {"gfimu.files", "gfimu.visual.colours", "gfimu.visual.page"},
}
"""The same of folders with more files, many of one kind: a method, an effect, a part of a chip each."""

MOST_FILES = 12
"""In one folder of a room."""


def room_imports(room: str) -> set[str]:
    """Modules of this project outside a room, and not common, that the room imports."""
    return {
        name
        for module, names in IMPORTS.items()
        if inside(module, room)
        for name in names
        if inside(name, *PACKAGES) and not inside(name, room) and name not in COMMON
    }


@pytest.mark.parametrize(("room", "allowed"), (ROOMS | LARGE_ROOMS).items())
def test_rooms_import_from_the_rooms_they_name_only(room, allowed):
    imported = room_imports(room)
    assert {name for name in imported if not inside(name, *allowed)} == set()
    assert {name for name in allowed if not any(inside(one, name) for one in imported)} == set()


DIAGNOSIS = ("data", "terms", "fit", "search", "criticism", "verdict", "report", "design")
"""Rooms of the diagnosis from the lowest floor up: each imports itself and those before it."""

BESIDE = {"gfimu.diagnosis.policy", "gfimu.generic_basis", "gfimu.geometry.array", "gfimu.world_model"}
"""What every room of the diagnosis may import besides."""

OUTSIDE = {
    "data": {"gfimu.importing.guessing.likely_reference", "gfimu.recording", "gfimu.motion.body_drive"},
    "terms": {"gfimu.motion.body_drive"},
    "criticism": {"gfimu.geometry.kinematics", "gfimu.motion.attitude"},
    "design": {"gfimu.recording", "gfimu.importing.oddities", "gfimu.geometry.smooth_ramp"},
    "verdict": {"gfimu.files.model_files"},
    "report": {"gfimu.recording", "gfimu.visual", "gfimu.geometry.turning_axis"},
}
"""What of this project a single room of the diagnosis may import besides."""


@pytest.mark.parametrize("room", DIAGNOSIS)
def test_arrows_of_the_diagnosis_go_down(room):
    below = [f"gfimu.diagnosis.{one}" for one in DIAGNOSIS[: DIAGNOSIS.index(room)]]
    outside = OUTSIDE.get(room, set())
    imported = room_imports(f"gfimu.diagnosis.{room}")
    assert {name for name in imported if not inside(name, *below, *BESIDE, *outside)} == set()
    assert {name for name in outside if not any(inside(one, name) for one in imported)} == set()


@pytest.mark.parametrize("room", [*ROOMS, *(f"gfimu.diagnosis.{one}" for one in DIAGNOSIS)])
def test_rooms_have_few_files(room):
    assert 1 < len([file for file in FILES.values() if file.parent == FILES[room].parent]) <= MOST_FILES


def test_the_report_sees_the_verdict_and_its_views_only():
    below = {"gfimu.diagnosis.verdict", "gfimu.diagnosis.criticism.views", *BESIDE}
    assert not [
        name
        for name in room_imports("gfimu.diagnosis.report")
        if inside(name, "gfimu.diagnosis") and not inside(name, *below)
    ]


def test_every_module_of_the_diagnosis_has_a_test_that_imports_it():
    tests = (ROOT / "tests" / "gfimu" / "diagnosis").rglob("test_*.py")
    imported = set().union(*(modules_imported(file.read_text(encoding="utf-8")) for file in tests))
    rooms = [f"gfimu.diagnosis.{room}" for room in DIAGNOSIS]
    modules = {module for module, file in FILES.items() if inside(module, *rooms) and file.name != "__init__.py"}
    assert modules - imported == set()


THRESHOLD_ROOMS = tuple(f"gfimu.diagnosis.{room}" for room in ("terms", "fit", "search", "criticism", "verdict"))

OUTSIDE_POLICY = {
    "gfimu.diagnosis.terms.drive": {"FIRST_ROUGHNESS", "LEAST_ROUGHNESS", "MARGIN", "ROUGH_FOR"},  # the drive's prior
}
"""Tuned numbers that are not in `Policy`."""


def numeric_constants(source: str) -> set[str]:
    """Return the module constants with a number in them that nothing near them calls numerical.

    Near is a comment on their lines, the comment block above and the string below.
    """
    lines, body, found = source.splitlines(), ast.parse(source).body, set()
    for place, node in enumerate(body):
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        names = {one.id for target in targets for one in ast.walk(target) if isinstance(one, ast.Name)}
        numbers = [
            one
            for one in ast.walk(node.value)
            if isinstance(one, ast.Constant) and isinstance(one.value, int | float) and not isinstance(one.value, bool)
        ]
        if not numbers or names <= {"__all__"}:
            continue
        first, last = node.lineno - 1, node.end_lineno
        while first > 0 and lines[first - 1].startswith("#"):
            first -= 1
        after = body[place + 1] if place + 1 < len(body) else None
        if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant) and isinstance(after.value.value, str):
            last = after.end_lineno
        if "numerical" not in "\n".join(lines[first:last]).lower():
            found |= names
    return found


def test_thresholds_of_the_diagnosis_are_in_its_policy():
    found = {
        module: names
        for module, file in FILES.items()
        if inside(module, *THRESHOLD_ROOMS) and (names := numeric_constants(file.read_text(encoding="utf-8")))
    }
    assert found == OUTSIDE_POLICY


def test_the_reader_of_constants_sees_every_form():
    source = """
__all__ = ["A"]
NAME = "text"
A = 3.0
B, C = 1, 2  # numerical
D: float = 4.0
# numerical: of a block
E = (1.0, 2.0)
F = 5.0
'''Numerical: a step.'''
G = True
H = -1.0 * A
"""
    assert numeric_constants(source) == {"A", "D", "H"}


FORMER = {
    "gfimu.array": "gfimu.geometry.array",
    "gfimu.kinematics": "gfimu.geometry.kinematics",
    "gfimu.estimation": "gfimu.motion.estimation",
    "gfimu.diagnosis.model": "gfimu.world_model",
}
"""Modules that keep a former name for the programs of users, and where their content is."""


@pytest.mark.parametrize("former", FORMER)
def test_former_names_of_modules_warn_where_they_are_imported(former, tmp_path):
    script = tmp_path / "old.py"
    script.write_text(f"import {former}\n", encoding="utf-8")
    done = subprocess.run([sys.executable, "-W", "default", script], capture_output=True, text=True, check=True)
    assert f"old.py:1: DeprecationWarning: {former} is removed in gfimu " in done.stderr
    assert f"; import {FORMER[former]}\n" in done.stderr


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
    bounds = importlib.import_module("gfimu.bounds")
    assert bounds.rate_bound is gfimu.rate_bound
    assert bounds.posterior_rate_bound is gfimu.posterior_rate_bound


def test_few_modules_are_in_no_room():
    loose = {module for module, file in FILES.items() if file.parent == FILES["gfimu"].parent} - {
        "gfimu",
        "gfimu.__main__",
        *FORMER,
    }
    assert loose == {
        "gfimu.errors",
        "gfimu.generic_basis",
        "gfimu.lazy_names",
        "gfimu.optional_packages",
        "gfimu.plugins",
        "gfimu.short_repr",
        "gfimu.units",
        "gfimu.world_model",
    }


def test_the_diagnosis_says_in_which_order_its_rooms_stand():
    listed = re.findall(r"`(\w+)`", ast.get_docstring(ast.parse(FILES["gfimu.diagnosis"].read_text(encoding="utf-8"))))
    assert tuple(listed[: len(DIAGNOSIS)]) == DIAGNOSIS


def test_each_room_stands_in_one_list_of_imports():
    rooms = {f"{package}.{file.parent.name}" for package in PACKAGES for file in (ROOT / package).glob("*/__init__.py")}
    above = {"gfimu.cli", "gfimu.commands", "gfimu.diagnosis"}  # what these may import is tested apart
    assert not ROOMS.keys() & LARGE_ROOMS.keys()
    assert rooms - above == ROOMS.keys() | LARGE_ROOMS.keys()


@pytest.mark.parametrize("package", PACKAGES)
def test_every_room_is_described(package):
    page = (ROOT / "docs" / "development" / "rooms.md").read_text(encoding="utf-8")
    rooms = {file.parent.name for file in (ROOT / package).glob("*/__init__.py")}
    rooms |= set(DIAGNOSIS) if package == "gfimu" else set()
    assert {room for room in rooms if f"`{room}`" not in page} == set()


def test_the_slow_tests_are_there():
    """A test that is renamed would run in the usual suite again, without a word."""
    lines = (ROOT / "tests" / "slow_tests.txt").read_text(encoding="utf-8").splitlines()
    names = [line for line in lines if not line.startswith("#")]
    assert len(names) == len(set(names))
    for name in names:
        file, _, test = name.partition("::")
        assert f"def {test.partition('[')[0]}(" in (ROOT / file).read_text(encoding="utf-8"), name
