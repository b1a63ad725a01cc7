"""The house rules that no type checker sees: who may import whom, no circles, figures that only fall."""

import ast
import graphlib
import importlib
import inspect
import re
from collections import Counter

import pytest
from every_item import every

import gfimu
from gfimu.base import homes_of
from gfimu.model import BodyModel
from sim.twin import Twin

from .figures import figures
from .house import IMPORTS, IMPORTS_BY_TYPES, MODULES, ROOMS, ROOT, imported_names, imports, inside, is_type_checking
from .limits import LIMITS
from .page import PAGE, page

COMMANDS = ("gfimu.commands", "gfimu.__main__")


def offences(importers, forbidden) -> list[str]:
    return [
        f"{module} imports {name}"
        for module, names in IMPORTS.items()
        if importers(module)
        for name in sorted(names)
        if forbidden(name)
    ]


@every("figure, value", figures().items())
def test_figures_only_fall(figure, value):
    assert value <= LIMITS[figure], f"{value}, limit {LIMITS[figure]}; python -m tests.house shows all"


def test_the_page_of_rooms_is_made_of_their_docstrings():
    assert PAGE.read_text(encoding="utf-8") == page(), "write it anew: python -m tests.house write"


@every("room", ROOMS[:-1])
def test_rooms_say_what_comes_in_and_what_goes_out(room):
    assert re.search(r"\n\nIn: .*\nOut: ", MODULES[room].docstring, re.DOTALL)


@every("module", MODULES)
def test_arrows_between_rooms_go_down(module):
    room = ROOMS.index(MODULES[module].room)
    above = {name for name in IMPORTS[module] & MODULES.keys() if ROOMS.index(MODULES[name].room) > room}
    assert above - ({"gfimu"} if module == "gfimu.__main__" else set()) == set()


def test_no_circular_imports_even_by_types():
    try:
        graphlib.TopologicalSorter(IMPORTS_BY_TYPES).prepare()
    except graphlib.CycleError as error:
        pytest.fail("circular import: " + " → ".join(error.args[1]))


def test_gfimu_imports_neither_the_world_nor_the_wire_except_its_commands():
    assert not offences(
        lambda module: inside(module, "gfimu") and not inside(module, *COMMANDS),
        lambda name: inside(name, "sim", "firmware_bridge", "mujoco", "serial", "unicorn", "typer", "rich"),
    )


def test_nobody_imports_the_public_face():
    assert not offences(lambda module: True, lambda name: name == "gfimu")


def test_the_world_knows_nothing_of_the_diagnosis_but_in_trials():
    assert not offences(
        lambda module: inside(module, "sim") and not inside(module, "sim.trials"),
        lambda name: inside(name, "gfimu.diagnosis", "sim.trials", "serial"),
    )


def test_the_wire_imports_recordings_and_the_chip_only():
    assert not offences(
        lambda module: inside(module, "firmware_bridge"),
        lambda name: (
            (inside(name, "sim") and not inside(name, "sim.chips.adxl345"))
            or inside(name, "gfimu.diagnosis", "gfimu.calibration", "gfimu.visual", "mujoco")
        ),
    )


def test_peripherals_know_the_bus_and_not_the_board():
    """The processor, the peripherals and the chips name neither the board nor each other's types for its sake."""
    above = {f"firmware_bridge.board.{name}" for name in ("board", "fast_board", "worker")}
    below = {name for name in MODULES if inside(name, "firmware_bridge.board")} - above
    assert {name: used for name in below if (used := IMPORTS_BY_TYPES[name] & above)} == {}


def test_importing_everything_leaves_the_public_names_alone():
    """A module of the package called like a public function would take its place once it is imported."""
    modules = {module.removeprefix("gfimu.").partition(".")[0] for module in MODULES if module.startswith("gfimu.")}
    assert not modules & set(gfimu.__all__)


def test_dir_lists_the_public_names():
    assert dir(gfimu) == sorted(gfimu.__all__)
    assert {"simulate", "estimate", "diagnose", "firmware", "Recording", "__version__"} <= set(dir(gfimu))


@every("name", gfimu.__all__)
def test_public_names_can_be_imported(name):
    assert getattr(gfimu, name) is not None


FACES = [name for name, module in MODULES.items() if " = declared_names(" in module.source]


@every("face", FACES)
def test_what_a_face_declares_can_be_imported_and_is_hidden_by_no_module(face):
    names = dir(importlib.import_module(face))
    assert not {f"{face}.{name}" for name in names} & MODULES.keys()
    assert [name for name in names if getattr(importlib.import_module(face), name) is None] == []


def test_unknown_public_name():
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        gfimu.nonsense  # noqa: B018


def test_only_packages_and_the_program_stand_beside_the_public_face():
    beside = {name for name, module in MODULES.items() if module.file.parent == MODULES["gfimu"].file.parent}
    assert beside == {"gfimu", "gfimu.__main__"}


def test_no_cast_makes_a_twin_a_world_model():
    cast = re.compile(r"cast\(\s*[\"'][^\"']*\b(?:WorldModel|BodyModel|Twin|Effect|EffectFamily|Spin|Size)\b")
    assert [name for name, module in MODULES.items() if cast.search(module.source)] == []


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


def test_the_reader_of_imports_sees_every_form():
    source = """
import sim.world
from typing import TYPE_CHECKING
if TYPE_CHECKING:
    import serial
else:
    import json
def f():
    from gfimu.array.array import Chip
    from gfimu import recording
"""
    run = {"sim.world", "typing.TYPE_CHECKING", "json", "gfimu.array.array", "gfimu.recording"}
    assert imports(ast.parse(source)) == run
    assert imports(ast.parse(source), by_types=True) == run | {"serial"}
    assert [is_type_checking(node) for node in ast.parse(source).body] == [False, False, True, False]


@every("module", MODULES)
def test_every_module_says_what_it_is(module):
    assert MODULES[module].docstring


def test_test_files_have_names_of_their_own():
    names = Counter(file.name for file in (ROOT / "tests").rglob("test_*.py"))
    assert [name for name, count in names.items() if count > 1] == []


MOST_FILES = 12
"""In one folder of the diagnosis."""

DIAGNOSIS = ("data", "terms", "fit", "search", "criticism", "verdict", "report", "design")
"""Rooms of the diagnosis from the lowest floor up: each imports itself and those before it."""


def imports_of_diagnosis(room: str) -> set[str]:
    """Return the modules of the other rooms of the diagnosis that a room of it imports."""
    own = f"gfimu.diagnosis.{room}"
    used = set().union(*(names for name, names in IMPORTS.items() if inside(name, own)))
    return {name for name in used if inside(name, "gfimu.diagnosis") and not inside(name, own)}


@every("room", DIAGNOSIS)
def test_arrows_of_the_diagnosis_go_down(room):
    below = [f"gfimu.diagnosis.{one}" for one in ("policy", "time_limit", *DIAGNOSIS[: DIAGNOSIS.index(room)])]
    assert {name for name in imports_of_diagnosis(room) if not inside(name, *below)} == set()


@every("room", DIAGNOSIS)
def test_rooms_of_the_diagnosis_have_few_files(room):
    folder = MODULES[f"gfimu.diagnosis.{room}"].file.parent
    assert 1 < len([module for module in MODULES.values() if module.file.parent == folder]) <= MOST_FILES


def test_the_report_sees_the_verdict_and_its_views_only():
    views = ("gfimu.diagnosis.verdict", "gfimu.diagnosis.criticism.views", "gfimu.diagnosis.policy")
    assert {name for name in imports_of_diagnosis("report") if not inside(name, *views)} == set()


def test_the_diagnosis_says_in_which_order_its_rooms_stand():
    listed = re.findall(r"`(\w+)`", MODULES["gfimu.diagnosis"].docstring.partition("Rooms, ")[2])
    assert tuple(listed[: len(DIAGNOSIS)]) == DIAGNOSIS


def test_every_module_of_the_diagnosis_has_a_test_that_imports_it():
    tests = (ROOT / "tests" / "gfimu" / "diagnosis").rglob("test_*.py")
    trees = [ast.parse(file.read_text(encoding="utf-8")) for file in tests]
    faces = ("gfimu", "gfimu.diagnosis")
    homes = {
        f"{face}.{name}": home
        for face in faces
        for name, home in homes_of(importlib.import_module(face).__name__).items()
    }
    by_face = {homes[name] for tree in trees for name in imported_names(tree, by_types=False) if name in homes}
    imported = by_face.union(*map(imports, trees))
    rooms = [f"gfimu.diagnosis.{room}" for room in DIAGNOSIS]
    modules = {name for name, one in MODULES.items() if inside(name, *rooms) and one.file.name != "__init__.py"}
    assert modules - imported == set()


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
    rooms = [f"gfimu.diagnosis.{room}" for room in ("terms", "fit", "search", "criticism", "verdict")]
    found = {
        module: names
        for module, one in MODULES.items()
        if inside(module, *rooms) and (names := numeric_constants(one.source))
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
