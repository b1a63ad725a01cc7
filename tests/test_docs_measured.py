"""The tables of measured accuracy and speed are those of the stored outcomes, and the speeds can be measured."""

import importlib.util

import pytest


@pytest.fixture(scope="module")
def script(project_root):
    path = project_root / "docs" / "scripts" / "make_measured_tables.py"
    specification = importlib.util.spec_from_file_location("make_measured_tables", path)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_the_tables_are_those_of_the_stored_outcomes(script):
    page = script.PAGE.read_text(encoding="utf-8")
    assert page == script.with_tables(page), "run: python docs/scripts/make_measured_tables.py"


def test_a_changed_figure_is_seen(script):
    page = script.PAGE.read_text(encoding="utf-8").replace("92.0 (89–95)", "99.4 (98–99)")
    assert page != script.with_tables(page)


@pytest.mark.study
def test_every_job_of_the_speed_table_is_measured(script):
    measured = script.measured_speeds(length_s=30.0, repeats=1)
    page = script.PAGE.read_text(encoding="utf-8")
    assert all(f"| {job} |" in page for job in measured)
