"""JSON schemas and templates say what the schemas of the files say."""

import json
import re
import tomllib

import pytest
from every_item import every

from gfimu import InputError
from gfimu.base import find_model, list_models
from gfimu.base.files.model_files import read_toml
from gfimu.base.files.schema import json_schema
from gfimu.commands.file_kinds import FILE_KINDS, check_file, file_schema


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


def test_a_file_of_no_kind_is_refused():
    with pytest.raises(
        InputError, match=r"x\.toml: is no array, part, plan, frame, map, scenario, stage, brief, twin file"
    ):
        check_file({"colour": 1}, "x.toml")
    with pytest.raises(InputError, match=r"x\.toml: .*did you mean 'gravity_m_s2'\?"):
        check_file({"array": "cube12", "gravity_m_s": 9.8}, "x.toml")
