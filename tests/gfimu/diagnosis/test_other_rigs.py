"""Rigs that are no level table: a pendulum with an encoder or a tachometer, and a wheel on the road."""

from dataclasses import replace

import pytest

import gfimu
from sim.effects import ENCODER_EFFECTS, make_effect
from sim.scenarios import Scenario
from sim.twin import Twin


def found(scenario, twin, hidden="", parameters=None, changes=()):
    run = Scenario.load(scenario, changes=["sensor.errors=false", *changes])
    if hidden:
        run = replace(run, effects=(make_effect(hidden, parameters, run.array),))
    return gfimu.diagnose(gfimu.simulate(run, seed=5), twin)


@pytest.mark.study
def test_the_zero_of_a_pendulum_s_encoder_is_found():
    verdict = found("pendulum", "pendulum", "angle_zero", {"offset_rad": 0.01}, ["duration_s=24"])
    assert [cause.effect for cause in verdict.causes] == ["angle_zero"]
    value, std = verdict.causes[0].parameters["offset_rad"], verdict.causes[0].std["offset_rad"]
    assert abs(value - 0.01) < 4 * std < 2e-3


def test_a_gain_is_found_on_a_level_axis_with_a_tachometer():
    twin = replace(Twin.load("pendulum"), drive_source="tacho")
    verdict = found("pendulum", twin, "scale_factor", {"a11": 0.02}, ["duration_s=24", "motion.start_angle_rad=1.0"])
    assert [cause.effect for cause in verdict.causes] == ["scale_factor"]
    assert verdict.causes[0].parameters["a11"] == pytest.approx(0.02, abs=2e-3)


@pytest.mark.study
@pytest.mark.parametrize("side", [0.003, -0.002])
def test_a_lever_of_a_wheel_is_found_beside_the_gain_that_can_do_the_same(side):
    verdict = found("wheel", "wheel_pair", "sensor_position", {"a2_x_m": side})
    (cause,) = verdict.causes
    assert "sensor_position" in {cause.effect, *cause.not_distinguishable_from}


@pytest.mark.parametrize("noise", [0.001, 0.01])
def test_nothing_is_found_on_a_wheel_whose_hub_shakes(noise):
    verdict = found("wheel", "wheel_pair", changes=[f"reference.tacho_noise_std_rad_s={noise}"])
    assert verdict.verdict == "nothing_found"


def test_a_bias_is_found_beside_a_noisy_tachometer():
    changes = ["reference.tacho_noise_std_rad_s=0.03", "duration_s=24"]
    verdict = found("wheel", "wheel_pair", "bias", {"a12_m_s2": 0.05}, changes)
    (cause,) = verdict.causes
    assert cause.effect == "bias"
    # Of two chips only the difference shows.
    apart = cause.parameters.get("a12_m_s2", 0.0) - cause.parameters.get("a22_m_s2", 0.0)
    assert apart == pytest.approx(0.05, abs=5e-3)


def test_the_encoder_s_zero_is_no_effect_of_a_level_table():
    assert "angle_zero" in Twin.load("pendulum").families()
    assert "angle_zero" not in replace(Twin.load("pendulum"), axis_inclination=0.0).families()
    assert "angle_zero" not in replace(Twin.load("pendulum"), drive_source="tacho").families()
    assert "angle_zero" not in ENCODER_EFFECTS
