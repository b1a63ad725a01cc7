"""The site is whole: each page has its place in the contents, each name and command its entry in the reference."""

import importlib.util
import re

import pytest
import typer

import gfimu

APART = {"_build", "api", "cli", "paper"}  # folders that Sphinx writes, and the paper, which has a form of its own


def toctree(page):
    """Pages that the contents of a page list."""
    blocks = re.findall(r"^```\{toctree\}\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    names = [line for block in blocks for line in block.splitlines() if line and not line.startswith(":")]
    return [page.parent / f"{name}.md" for name in names if name.split("/")[0] not in APART]


def reached(page):
    yield page
    for child in toctree(page):
        yield from reached(child) if child.is_file() else [child.with_suffix(".ipynb")]


def test_the_contents_list_every_page_once(project_root):
    docs = project_root / "docs"
    pages = sorted(reached(docs / "index.md"))
    made = (*docs.rglob("*.md"), *docs.rglob("*.ipynb"))
    assert pages == sorted(page for page in made if not APART & set(page.relative_to(docs).parts))


def load(project_root, name):
    """Import a script of the documentation."""
    specification = importlib.util.spec_from_file_location(name, project_root / "docs" / "scripts" / f"{name}.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def api(project_root):
    return load(project_root, "make_api_reference")


def test_every_public_name_is_documented_once(api, tmp_path):
    text = "\n".join(path.read_text(encoding="utf-8") for path in api.write_pages(tmp_path))
    entries = re.findall(r"^\.\. auto(?:class|function|module):: gfimu\.(?:commands\.)?(\w+)$", text, re.MULTILINE)
    assert sorted(entries) == sorted(set(gfimu.__all__) - {"__version__"})
    assert not re.search(r"\| +\|$", text, re.MULTILINE), "a name without a line that says what it is for"


def test_names_of_the_other_packages_are_public_there(api):
    for _, _, modules in api.OTHERS.values():
        for module, names in modules.items():
            assert set(names) <= set(importlib.import_module(module).__all__)


@pytest.fixture(scope="module")
def cli(project_root):
    return load(project_root, "make_cli_reference")


def test_every_command_and_option_has_its_row(cli, tmp_path):
    pages = {path.stem: path.read_text(encoding="utf-8") for path in cli.write_pages(tmp_path)}
    commands = typer.main.get_command(cli.program()).commands
    assert set(pages) == {*commands, "index"}
    for name, command in commands.items():
        assert f"({name}.md)" in pages["index"]
        for words, leaf in cli.leaves(name, command):
            assert f"\ngfimu {words} " in pages[name]
            for option in (
                word
                for one in leaf.params
                if not getattr(one, "hidden", False)
                for word in one.opts
                if word[:2] == "--"
            ):
                assert f"`{option}`" in pages[name], f"{words} {option}"


def test_examples_of_a_help_text_become_a_block(cli):
    block = "```sh\ngfimu noise run.csv\n# Of one channel\ngfimu noise run.csv --channel a11\n```"
    former = "Find it.\n\nExample: gfimu noise run.csv\n\nOf one channel: gfimu noise run.csv --channel a11"
    listed = "Find it.\n\nExamples\n--------\ngfimu noise run.csv\n# Of one channel\ngfimu noise run.csv --channel a11"
    assert block in cli.help_text(former)
    assert block in cli.help_text(listed)


def test_a_numbered_equation_has_one_line(project_root):
    """MathJax refuses a tag in an equation of several lines, and the site would show its complaint instead."""
    for page in (project_root / "docs" / "theory").glob("*.md"):
        for equation in re.findall(r"^ *\$\$\n(.*?)\$\$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE):
            assert not ("\\tag" in equation and "\\\\" in equation), f"{page.name}: {equation}"
