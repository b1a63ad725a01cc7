"""Pages, JSON schemas and templates say what the schemas of the files say."""

import json
import re
import tomllib

import pytest
from every_item import every

from gfimu import InputError
from gfimu.base import find_model, list_models
from gfimu.base.files.model_files import read_toml
from gfimu.base.files.schema_keys import json_schema, table_rows
from gfimu.commands.file_kinds import FILE_KINDS, check_file, file_schema

OWN = [kind for kind in FILE_KINDS if kind != "map"]  # the map's schema has no units of its own
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


def rows(kind):
    return [(table.heading, row) for table in table_rows(file_schema(kind)) for row in table.keys]


@every("kind", FILE_KINDS)
def test_every_key_has_a_meaning_and_a_type(kind):
    assert all(row.meaning.endswith(".") or kind == "map" for _, row in rows(kind))
    assert all(row.meaning and row.kind and row.default for _, row in rows(kind))
    assert all(table.text for table in table_rows(file_schema(kind)))


@every("kind", OWN)
def test_the_unit_of_a_key_is_its_ending(kind):
    for _, row in rows(kind):
        if row.unit.startswith("counts"):
            continue
        ending = row.name.rpartition("_")[2]
        if ending in SUFFIXES:
            assert SUFFIXES[ending].rstrip("²") in row.unit, row
        else:
            assert row.unit == "", row


def accepts(schema, value, root):
    """Whether a JSON schema of the few words used here takes a value; what a full validator would do."""
    if "$ref" in schema:
        return accepts(root["$defs"][schema["$ref"].rpartition("/")[2]], value, root)
    if "anyOf" in schema:
        return any(accepts(one, value, root) for one in schema["anyOf"])
    if "enum" in schema:
        return value in schema["enum"]
    kinds = {"string": str, "boolean": bool, "array": list, "object": dict, "integer": int, "null": type(None)}
    if schema.get("type") == "number":
        good = isinstance(value, int | float) and not isinstance(value, bool)
        return good and value > schema.get("exclusiveMinimum", float("-inf"))
    if "type" in schema and not isinstance(value, kinds[schema["type"]]):
        return False
    if isinstance(value, list):
        fits = schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value))
        return fits and all(accepts(schema.get("items", {}), one, root) for one in value)
    if isinstance(value, dict):
        known, others = schema.get("properties", {}), schema.get("additionalProperties", True)
        others = {} if others is True else others
        return set(schema.get("required", ())) <= set(value) and all(
            accepts(known[key], one, root) if key in known else others is not False and accepts(others, one, root)
            for key, one in value.items()
        )
    return True


@pytest.mark.parametrize("kind", FILE_KINDS)
def test_the_json_schema_takes_every_shipped_file_and_refuses_a_misspelt_key(kind):
    schema = json.loads(json_schema(file_schema(kind), kind))
    assert "prefixItems" not in json.dumps(schema)
    for name in list_models(f"{kind}s"):
        content = read_toml(find_model(f"{kind}s", name))
        assert accepts(schema, content, schema), name
        assert check_file(content, name) == kind
        assert accepts(schema, content | {"colour": 1}, schema) == (kind == "part")
    assert not accepts(schema, {"name": 3}, schema)


def test_the_kind_of_a_motion_may_be_left_out_where_it_is_the_usual_one():
    schema = json.loads(json_schema(file_schema("scenario"), "scenario"))
    assert accepts(schema, {"array": "cube12", "motion": {"segment": []}}, schema)
    assert not accepts(schema, {"array": "cube12", "motion": {"segment": [{"duration_s": 1.0}]}}, schema)
    assert dict(rows("scenario"))['`[motion]` with `kind = "rest"`'].name == "start_angle_rad"


def uncommented(text):
    """The template with every key in it that is commented out."""
    return re.sub(r"^# (?=\w+ = |\[+[\w.]+\]+)", "", text, flags=re.MULTILINE)


@every("kind", FILE_KINDS)
def test_a_template_holds_no_key_that_the_schema_has_not(kind):
    text = find_model("templates", kind).read_text(encoding="utf-8")
    assert text.startswith(f"#:schema ./{kind}.schema.json\n")
    for content in (text, uncommented(text)):
        assert check_file(tomllib.loads(content), kind) == kind
    assert len(tomllib.loads(uncommented(text))) > len(tomllib.loads(text))


@every("kind", FILE_KINDS)
def test_a_template_shows_every_key_of_the_schema(kind):
    """The kinds of motion that the template does not use are on the page alone."""
    text = find_model("templates", kind).read_text(encoding="utf-8")
    shown = {row.name for heading, row in rows(kind) if "with `kind" not in heading or '"profile"' in heading}
    assert {name for name in shown - {"source"} if not re.search(rf"\b{name}\b", text)} == set()


def test_a_file_of_no_kind_is_refused():
    with pytest.raises(
        InputError, match=r"x\.toml: is no array, part, plan, frame, map, scenario, stage, brief, twin file"
    ):
        check_file({"colour": 1}, "x.toml")
    with pytest.raises(InputError, match=r"x\.toml: .*did you mean 'gravity_m_s2'\?"):
        check_file({"array": "cube12", "gravity_m_s": 9.8}, "x.toml")
