"""The tables of measured accuracy and speed are those of the stored outcomes, and the speeds can be measured."""

import importlib.util
import sys

import pytest


def loaded(folder, name):
    specification = importlib.util.spec_from_file_location(name, folder / f"{name}.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def scripts(project_root):
    folder = project_root / "docs" / "scripts"
    sys.path.insert(0, str(folder))  # scripts import each other
    yield {name: loaded(folder, name) for name in ("make_measured_tables", "make_benchmark_table")}
    sys.path.remove(str(folder))


@pytest.fixture
def script(scripts):
    return scripts["make_measured_tables"]


@pytest.mark.parametrize("name", ["make_measured_tables", "make_benchmark_table"])
def test_the_tables_are_those_of_the_stored_outcomes(scripts, name):
    page = scripts[name].PAGE.read_text(encoding="utf-8")
    assert page == scripts[name].with_tables(page), f"run: python docs/scripts/{name}.py"


def test_a_changed_figure_is_seen(script):
    page = script.PAGE.read_text(encoding="utf-8").replace("92.0 (89–95)", "99.4 (98–99)")
    assert page != script.with_tables(page)


@pytest.mark.study
def test_every_job_of_the_speed_table_is_measured(script):
    measured = script.measured_speeds(length_s=30.0, repeats=1)
    page = script.PAGE.read_text(encoding="utf-8")
    assert all(f"| {job} |" in page for job in measured)
