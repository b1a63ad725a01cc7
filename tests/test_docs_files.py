"""The reference page of the files and the published schemas are those that the code gives."""

import importlib.util

import pytest

REMEDY = "run: python docs/scripts/make_files_reference.py"


@pytest.fixture(scope="module")
def script(project_root):
    specification = importlib.util.spec_from_file_location(
        "files_page", project_root / "docs/scripts/make_files_reference.py"
    )
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_the_reference_of_the_files_is_the_present_one(script):
    assert script.PAGE.read_text(encoding="utf-8") == script.files_page(), REMEDY


def test_the_published_schemas_are_the_present_ones(script):
    published = {path.name: path.read_text(encoding="utf-8") for path in script.SCHEMAS.iterdir()}
    assert published == script.schema_files(), REMEDY
