"""The reference page of the files is the one that the schemas give."""

import importlib.util


def test_the_reference_of_the_files_is_the_present_one(project_root):
    specification = importlib.util.spec_from_file_location(
        "files_page", project_root / "docs/scripts/make_files_reference.py"
    )
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    page = (project_root / "docs" / "reference" / "files.md").read_text(encoding="utf-8")
    assert page == module.files_page(), "run: python docs/scripts/make_files_reference.py"
