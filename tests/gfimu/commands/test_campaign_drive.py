"""Campaigns of kind ``drive``: cases together give what they give alone, and a case that fails is a row."""

from operator import itemgetter

import numpy as np
import pyarrow.parquet as pq
import pytest

import gfimu
from gfimu import InputError
from sim import drive
from sim.scenarios import Scenario
from sim.trials import Case, DriveWork, load_plan, run_batch

PLAN = """
kind = "drive"
repeats = 2
seed = 4
batch = {batch}
[factors]
duration_s = [4.0]
"drive.step_s" = [0.001]
"drive.motor.cogging_Nm" = [0.0, 0.01]
"drive.motor.viscous_Nms_rad" = [0.002, 100.0]
mount_std_m = [0.002]
tilt_std_rad = [0.01]
"""


def plan(folder, batch):
    file = folder / f"plan{batch}.toml"
    file.write_text(PLAN.format(batch=batch))
    return file


def rows(folder):
    """Return the rows in order, without the results that a failed case has not."""
    found = [row for file in folder.glob("*.parquet") for row in pq.read_table(file).to_pylist()]
    return [{key: one for key, one in row.items() if one is not None} for row in sorted(found, key=itemgetter("case"))]


def test_the_rows_do_not_depend_on_which_cases_are_together(tmp_path):
    given = load_plan(plan(tmp_path, 8))
    together = run_batch(given, DriveWork(), 0, 8)
    assert together == [row for number in range(8) for row in run_batch(given, DriveWork(), number, number + 1)]
    assert together == [*run_batch(given, DriveWork(), 0, 3), *run_batch(given, DriveWork(), 3, 8)]
    failed = [row for row in together if row["failure"]]
    assert [row["drive.motor.viscous_Nms_rad"] for row in failed] == [100.0] * 4
    assert all("did not stay finite" in row["failure"] for row in failed)


def test_a_campaign_holds_these_rows(tmp_path):
    result = gfimu.campaign(plan(tmp_path, 8), out=tmp_path / "out", workers=1)
    assert (result.done, result.cases) == (8, 8)
    assert rows(tmp_path / "out") == run_batch(load_plan(plan(tmp_path, 8)), DriveWork(), 0, 8)


def test_a_row_says_what_the_run_did():
    values = {"scenario": "driven_run", "duration_s": 5.0, "sample_rate_hz": 50.0}
    found = DriveWork()(Case(0, values, 9))
    scenario = Scenario.load("driven_run", changes=["duration_s=5.0"])
    run = drive(scenario.world, scenario.motion, 5.0)
    error = run.state.rate - scenario.motion.at(run.t).rate
    assert found["rate_error_rms_rad_s"] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-12)
    assert found["torque_peak_Nm"] == pytest.approx(np.abs(run.torque).max(), rel=1e-12)
    assert found["reading_change_peak_m_s2"] == pytest.approx(np.abs(run.readings - run.readings[0]).max(), rel=1e-12)


def test_seeds_draw_the_mounting():
    values = {"duration_s": 4.0, "drive.step_s": 1e-3, "mount_std_m": 0.01, "tilt_std_rad": 0.02}
    one, again, other = (DriveWork()(Case(0, values, seed)) for seed in (1, 1, 2))
    assert one == again
    assert one["reading_change_peak_m_s2"] != other["reading_change_peak_m_s2"]


@pytest.mark.parametrize(
    ("factor", "message"),
    [
        ('scenario = ["paper_run"]', "'paper_run': its table is not driven; set drive.mode to driven or dcmotor"),
        ('"drive.motor.cogging_Nmm" = [1.0]', "unknown key 'cogging_Nmm'"),
        ('mount_std_m = ["much"]', "mount_std_m = 'much': give a standard deviation of zero or above"),
        ("tilt_std_rad = [-0.1]", "tilt_std_rad = -0.1: give"),
    ],
)
def test_a_plan_that_cannot_be_set_up_is_one_line(tmp_path, factor, message):
    file = tmp_path / "plan.toml"
    file.write_text(f'kind = "drive"\n[factors]\n{factor}\n')
    with pytest.raises(InputError, match=message) as error:
        gfimu.campaign(file, out=tmp_path / "out")
    assert "\n" not in str(error.value)
    assert not (tmp_path / "out").exists()


def test_a_batch_that_fails_as_a_whole_is_rows(tmp_path, monkeypatch):
    def broken(*_, **__):
        raise RuntimeError("no threads left")

    monkeypatch.setattr("sim.rigs.driven.drive_all", broken)
    found = run_batch(load_plan(plan(tmp_path, 8)), DriveWork(), 0, 8)
    assert [row["failure"] for row in found] == ["RuntimeError: no threads left"] * 8
