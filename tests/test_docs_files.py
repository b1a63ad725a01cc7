"""The reference page of the files and the published schemas are those that the code gives."""

import importlib
import re
import sys

import pytest
from every_item import every

KINDS = ("array", "part", "map", "twin", "scenario", "frame", "stage", "plan", "brief")
OWN = [kind for kind in KINDS if kind != "map"]  # the map's schema has no units of its own
SUFFIXES = {
    "m": "m",
    "s": "s",
    "rad": "rad",
    "hz": "Hz",
    "V": "V",
    "K": "K",
    "degC": "°C",
    "deg": "°",
    "s2": "s²",
    "rthz": "√Hz",
    "ohm": "Ω",
    "H": "H",
    "A": "A",
    "Nm": "N·m",
    "kgm2": "kg·m²",
}
REMEDY = "run: python docs/scripts/make_files_reference.py"


@pytest.fixture(scope="module")
def script(project_root):
    folder = str(project_root / "docs" / "scripts")
    sys.path.insert(0, folder)
    yield importlib.import_module("make_files_reference")
    sys.path.remove(folder)


def test_the_reference_of_the_files_is_the_present_one(script):
    assert script.PAGE.read_text(encoding="utf-8") == script.files_page(), REMEDY


def test_the_published_schemas_are_the_present_ones(script):
    published = {path.name: path.read_text(encoding="utf-8") for path in script.SCHEMAS.iterdir()}
    assert published == script.schema_files(), REMEDY


def test_every_kind_is_checked(script):
    assert list(script.FILE_KINDS) == list(KINDS)


def rows(script, kind):
    return [(table.heading, row) for table in script.table_rows(script.file_schema(kind)) for row in table.keys]


@every("kind", KINDS)
def test_every_key_has_a_meaning_and_a_type(script, kind):
    assert all(row.meaning.endswith(".") or kind == "map" for _, row in rows(script, kind))
    assert all(row.meaning and row.kind and row.default for _, row in rows(script, kind))
    assert all(table.text for table in script.table_rows(script.file_schema(kind)))


@every("kind", OWN)
def test_the_unit_of_a_key_is_its_ending(script, kind):
    for _, row in rows(script, kind):
        if row.unit.startswith("counts"):
            continue
        ending = row.name.rpartition("_")[2]
        if ending in SUFFIXES:
            assert SUFFIXES[ending].rstrip("²") in row.unit, row
        else:
            assert row.unit == "", row


@every("kind", KINDS)
def test_a_template_shows_every_key_of_the_schema(script, project_root, kind):
    """The kinds of motion that the template does not use are on the page alone."""
    text = (project_root / "models" / "templates" / f"{kind}.toml").read_text(encoding="utf-8")
    shown = {row.name for heading, row in rows(script, kind) if "with `kind" not in heading or '"profile"' in heading}
    assert {name for name in shown - {"source"} if not re.search(rf"\b{name}\b", text)} == set()


def test_the_first_key_of_a_table_with_kinds_is_that_of_its_usual_kind(script):
    assert dict(rows(script, "scenario"))['`[motion]` with `kind = "rest"`'].name == "start_angle_rad"
