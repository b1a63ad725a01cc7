"""The site is whole: every page has its place in the contents, every public name its entry in the Python API."""

import importlib.util
import re

import pytest

import gfimu

BUILT = {"_build", "api"}  # folders that Sphinx writes


def toctree(page):
    """Pages that the contents of a page list."""
    blocks = re.findall(r"^```\{toctree\}\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    names = [line for block in blocks for line in block.splitlines() if line and not line.startswith(":")]
    return [page.parent / f"{name}.md" for name in names if not name.startswith("api/")]


def reached(page):
    yield page
    for child in toctree(page):
        yield from reached(child) if child.is_file() else [child.with_suffix(".ipynb")]


def test_the_contents_list_every_page_once(project_root):
    docs = project_root / "docs"
    pages = sorted(reached(docs / "index.md"))
    made = (*docs.rglob("*.md"), *docs.rglob("*.ipynb"))
    assert pages == sorted(page for page in made if not BUILT & set(page.relative_to(docs).parts))


@pytest.fixture(scope="module")
def api(project_root):
    path = project_root / "docs" / "scripts" / "make_api_reference.py"
    specification = importlib.util.spec_from_file_location("make_api_reference", path)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_every_public_name_is_documented_once(api, tmp_path):
    text = "\n".join(path.read_text(encoding="utf-8") for path in api.write_pages(tmp_path))
    entries = re.findall(r"^\.\. auto(?:class|function|module):: gfimu\.(?:commands\.)?(\w+)$", text, re.MULTILINE)
    assert sorted(entries) == sorted(gfimu._PUBLIC)
    assert not re.search(r"\| +\|$", text, re.MULTILINE), "a name without a line that says what it is for"


def test_names_of_the_other_packages_are_public_there(api):
    for _, _, modules in api.OTHERS.values():
        for module, names in modules.items():
            assert set(names) <= set(importlib.import_module(module).__all__)
