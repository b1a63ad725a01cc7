"""The figures of docs/how_to/tolerance.md are those of the commands that it names."""

from __future__ import annotations

import re

import pytest

import gfimu
from gfimu.budget import QUANTITIES, pay_for, room_for


@pytest.fixture(scope="module")
def page(project_root):
    return (project_root / "docs" / "how_to" / "tolerance.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def cube():
    return {
        "ADXL345": gfimu.tolerance("cube12", closed_form=True).budgets,
        "ADXL355": gfimu.tolerance("cube12", closed_form=True, part="adxl355", speed_rad_s=10.0).budgets,
    }


@pytest.mark.parametrize("part", ["ADXL345", "ADXL355"])
def test_tables(page, cube, part):
    head, _, *rows = re.search(rf"^\| {part} .*?(?=\n\n)", page, re.MULTILINE | re.DOTALL).group().splitlines()
    names = [cell.strip() for cell in head.strip("|").split("|")][1:]
    assert names == list(cube[part])
    assert len(rows) == len(QUANTITIES)
    for row, name in zip(rows, QUANTITIES, strict=True):
        words, *figures = [cell.strip() for cell in row.strip("|").split("|")]
        budgets = [budget.quantities[name] for budget in cube[part].values()]
        assert words == f"{budgets[0].meaning}, {budgets[0].unit}"
        assert figures == [f"{one.rms:.3g}" for one in budgets]


def test_the_simulated_position_without_calibration():
    found = gfimu.tolerance("cube12", calibrated=["none"], units=40, workers=1).comparisons["none"]["position"]
    assert found.rms == pytest.approx(22.0, abs=1.0 + 4.0 * found.ratio_std / found.ratio * found.rms)


def test_what_to_pay_for_as_printed(page, cube):
    omega = cube["ADXL345"]["poses+rest"].quantities["omega"]
    tolerances = gfimu.tolerance("cube12", closed_form=True, calibrated=["none"]).tolerances
    assert f"ω integrated: {pay_for(omega)}; {room_for(omega, tolerances)}\n" in page


def test_sentences(cube):
    first, quiet = cube["ADXL345"], cube["ADXL355"]
    assert first["none"].quantities["alpha"].shares["bias"] > 0.9
    assert first["poses"].quantities["omega"].shares["temperature"] == pytest.approx(0.98, abs=0.005)
    omega = first["poses+rest"].quantities["omega"]
    assert omega.shares["cross-axis"] + omega.shares["angles"] == pytest.approx(0.79, abs=0.005)
    assert omega.shares["placement"] == pytest.approx(0.04, abs=0.005)
    assert omega.halving["placement"] == pytest.approx(0.01, abs=0.005)
    assert first["poses+rest"].quantities["alpha"].shares["noise"] > 0.9
    alpha = quiet["poses+rest"].quantities["alpha"].shares
    assert alpha["angles"] + alpha["cross-axis"] == pytest.approx(0.95, abs=0.005)
    assert alpha["noise"] < 0.01
