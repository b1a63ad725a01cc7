"""The page on installation states the bounds of pyproject.toml, its extras, and figures whose scripts run."""

from __future__ import annotations

import importlib.util
import re
import sys
import tomllib

import pytest


@pytest.fixture(scope="module")
def page(project_root):
    return (project_root / "docs" / "reference" / "installation.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def project(project_root):
    return tomllib.loads((project_root / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def load(path):
    specification = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module
    specification.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def matrix(project_root):
    return load(project_root / "tests" / "matrix.py")


def rows(page: str, heading: str) -> list[list[str]]:
    """Cells of the table whose first heading is given."""
    table = page.split(f"\n| {heading} |", 1)[1].split("\n\n", 1)[0]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()[2:]]


def test_bounds_are_those_of_the_project(page, matrix):
    table = page.split("| package | bounds |")[1]
    stated = dict(re.findall(r"^\| (\S+) \| (>=\S+) \|", table, re.MULTILINE))
    assert stated == matrix.bounds()
    assert len(stated) > 20


def test_only_what_moves_fast_has_an_upper_bound(matrix):
    assert {name for name, bound in matrix.bounds().items() if "<" in bound} == set(matrix.MOVING)


def test_extras_are_those_of_the_project(page, project):
    extras = {name: lines for name, lines in project["optional-dependencies"].items() if name not in {"test", "docs"}}
    stated = {cells[0].strip("`"): cells[1] for cells in rows(page, "extra")}
    assert set(stated) == set(extras)
    for name in set(extras) - {"demo", "all"}:
        assert stated[name].split(", ") == [line.split(">=")[0] for line in extras[name]]


def test_sizes_are_given_for_every_extra(page, matrix):
    assert [cells[0].strip("`") for cells in rows(page, "installed")] == ["core", *matrix.EXTRAS[1:]]


def test_python_versions_are_the_classifiers_and_the_matrix(page, project, project_root):
    versions = re.findall(r"Python :: (3\.\d+)", " ".join(project["classifiers"]))
    assert versions == ["3.11", "3.12", "3.13"]
    assert f"Python {', '.join(versions[:-1])} and {versions[-1]}" in page
    workflow = (project_root / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")
    assert f"python: [{', '.join(repr(one) for one in versions)}]".replace("'", '"') in workflow


def test_the_jobs_of_continuous_integration_exist(matrix, project_root):
    workflow = (project_root / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")
    called = set(re.findall(r"tests/matrix\.py (\w+)", workflow))
    assert called == set(matrix.JOBS) - {"sizes"}


def test_rooms_of_the_matrix_exist(matrix, project_root):
    assert [name for name in matrix.ROOMS if not (project_root / name).exists()] == []


def test_the_script_measures_what_the_table_shows(page, project_root, monkeypatch, capsys):
    script = load(project_root / "docs" / "scripts" / "measure_core.py")
    monkeypatch.setattr(script, "METHODS", ("integrate",))
    script.main(samples=300, rows=2000)
    printed = capsys.readouterr().out.splitlines()
    stated = [cells[0] for cells in rows(page, "what")]
    assert printed[0].startswith(f"| {stated[0]} |")
    assert printed[-1].startswith("| CSV file of 2000 samples |")
    assert stated[-1] == "CSV file of 200000 samples"
    for line in printed:
        assert re.fullmatch(r"\| [^|]+ \| [\d.e+]+ µ?s \| [\d.e+]+ µ?s \| \d+ \|", line)
