"""Diagnosis of a linear axis: its drive follows the command, and what is hidden is found."""

from dataclasses import replace

import numpy as np
import pytest

import gfimu
from gfimu import InputError
from gfimu.diagnosis import Policy, check_runs, prepare, starting_point, stretches_of
from sim.effects import make_effect
from sim.scenarios import Scenario
from sim.twin import Twin

SHORT = ("duration_s=12", "sensor.errors=false")


def recorded(hidden="", parameters=None, changes=SHORT):
    run = Scenario.load("linear_axis", changes=list(changes))
    if hidden:
        run = replace(run, effects=(make_effect(hidden, parameters, run.array),))
    return gfimu.simulate(run, seed=3)


@pytest.mark.parametrize("source", ["carriage", "carriage_speed", "carriage_acceleration"])
def test_the_drive_follows_its_command_before_any_channel_is_looked_at(source):
    twin = replace(Twin.load("linear_axis"), drive_source=source)
    run = recorded()
    prepared = prepare([run], twin, ["run"])
    (stretch,) = stretches_of(twin, prepared)
    (drive,) = starting_point([stretch], Policy().knots).drives
    wanted = run.reference["carriage_acceleration_m_s2"]
    assert np.std(drive.spin.at(run.t_s).acceleration - wanted) < 0.02 * np.std(wanted)


def test_a_table_keeps_even_knots_as_its_tachometer_may_be_wrong_where_it_is_fast():
    scenario = Scenario.load("paper_run", changes=["duration_s=10", "sensor.errors=false"])
    ripple = make_effect("tacho_ripple", {"amplitude": 0.05, "order": 24, "phase_rad": 0.0}, scenario.array)
    run = gfimu.simulate(replace(scenario, effects=(ripple,)), seed=1)
    twin = Twin.load("cube12_turntable")
    (stretch,) = stretches_of(twin, prepare([run], twin, ["run"]))
    (drive,) = starting_point([stretch], Policy().knots).drives
    assert not drive.spline.halvings


@pytest.mark.study
def test_a_turned_mounting_is_found():
    hidden = {"x_rad": 0.03, "y_rad": -0.05, "z_rad": 0.06}
    verdict = gfimu.diagnose(recorded("mount_turn", hidden), "linear_axis")
    assert [cause.effect for cause in verdict.causes] == ["mount_turn"]
    for key, value in hidden.items():
        assert verdict.causes[0].parameters[key] == pytest.approx(value, abs=4 * verdict.causes[0].std[key])
    assert np.isnan(verdict.gain.rate_rmse_after)  # nothing turns


def test_a_command_in_millimetres_is_refused_with_its_unit():
    run = recorded()
    wrong = replace(run, reference={**run.reference, "carriage_m": 1e3 * run.reference["carriage_m"]})
    with pytest.raises(InputError, match="carriage_m is in mm"):
        gfimu.diagnose(wrong, "linear_axis")


def test_a_check_gives_speeds_in_metres_and_asks_for_no_turns():
    twin = Twin.load("linear_axis")
    found = check_runs([recorded()], twin, ["run"])
    facts = found.runs[0]
    assert 0.05 < facts.fastest_m_s < 0.25
    assert facts.turns is None
    assert not any("turn" in line.split(":")[0] for line in found.advice if "whole" in line)
