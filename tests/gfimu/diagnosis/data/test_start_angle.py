"""Where a table with a leaning axis began, found by gravity from a tachometer's motion."""

from dataclasses import replace

import numpy as np
import pytest

import gfimu
from gfimu.diagnosis import State, gravity_angle, make_stretches, prepare_run
from sim.scenarios import Scenario
from sim.twin import Twin

CHANGES = ["sensor.errors=false", "duration_s=12"]


def run_of(inclination, angle, **changes):
    more = [f"axis_inclination_rad={inclination}", f"motion.start_angle_rad={angle}"]
    scenario = Scenario.load("speed_sweep", changes=[*CHANGES, *more])
    recording = gfimu.simulate(replace(scenario, **changes), seed=2)
    twin = replace(Twin.load("cube12_turntable"), axis_inclination=inclination)
    return prepare_run(recording, twin), twin


@pytest.mark.parametrize("inclination", [0.3, 1.2, np.pi / 2, 2.5])
@pytest.mark.parametrize("angle", [-2.0, 0.0, 1.1, 3.0])
def test_gravity_gives_the_angle_at_the_start(inclination, angle):
    run, twin = run_of(inclination, angle)
    (stretch,) = make_stretches(twin, [run], [[]])
    off = (stretch.start_angle - angle + np.pi) % (2 * np.pi) - np.pi
    assert abs(off) < 0.01  # no biases: noise of three seconds of rest, times what each gravity has across the axis
    assert stretch.start_angle_std == pytest.approx(0.1)


def test_a_level_table_begins_at_zero():
    run, twin = run_of(0.0, 0.0)
    (stretch,) = make_stretches(twin, [run], [[]])
    assert stretch.start_angle == 0.0
    assert stretch.start_angle_std < 1e-2
    still = State(np.zeros(len(run.t)), np.zeros(len(run.t)), np.zeros(len(run.t)))
    assert gravity_angle(twin, run, still) is None


def test_a_run_that_begins_turning_is_read_within_half_a_radian():
    scenario = Scenario.load("speed_sweep", changes=[*CHANGES, "axis_inclination_rad=1.5", "motion.start_rate_rad_s=6"])
    recording = gfimu.simulate(scenario, seed=3)
    twin = replace(Twin.load("cube12_turntable"), axis_inclination=1.5)
    (stretch,) = make_stretches(twin, [prepare_run(recording, twin)], [[]])
    assert abs(stretch.start_angle) < 0.03


def test_without_readings_there_is_no_angle():
    run, twin = run_of(1.0, 0.5)
    still = State(np.zeros(len(run.t)), np.zeros(len(run.t)), np.zeros(len(run.t)))
    assert gravity_angle(twin, replace(run, valid=np.zeros_like(run.valid)), still) is None
