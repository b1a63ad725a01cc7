"""Effects as factors of a campaign."""

import numpy as np
import pytest

from gfimu import AccelerometerArray, InputError
from sim.scenarios import Scenario
from sim.trials import Case
from sim.trials.campaign.cases import estimate_case
from sim.trials.campaign.effects import drawn_effects, names_effect

CUBE = AccelerometerArray.load("cube12")
SETTING = {"scenario": "paper_run", "duration_s": 6, "calibration": "rest", "method": "integrate"}


def test_keys_of_scenario_files_are_no_effects():
    assert names_effect("sensor_position.std_m")
    assert not names_effect("sensor.range_g")
    assert not names_effect("scale_factor")


def test_sizes_are_drawn_with_the_standard_deviation():
    draws = [
        np.array(list(effect.parameters.values()))
        for seed in range(100)
        for effect in drawn_effects({"scale_factor.std_ratio": 0.01}, CUBE, np.random.default_rng(seed))
    ]
    sizes = np.concatenate(draws)
    assert len(sizes) == 100 * 12
    assert sizes.std() == pytest.approx(0.01, rel=4.0 / np.sqrt(2.0 * len(sizes)))
    assert sizes.mean() == pytest.approx(0.0, abs=4.0 * 0.01 / np.sqrt(len(sizes)))


def test_a_parameter_is_taken_as_it_is():
    (effect,) = drawn_effects({"table_tilt.x_rad": 0.02, "size": 3}, CUBE, np.random.default_rng(0))
    assert effect.name == "table_tilt"
    assert effect.parameters["x_rad"] == 0.02


@pytest.mark.parametrize(
    ("factor", "value", "message"),
    [
        ("sensor_position.std_mm", 0.1, "sizes of sensor_position are drawn by std_m"),
        ("sensor_position.std_m", "wide", "'wide' is no number"),
        ("table_tilt.w_rad", 0.1, "unknown parameter 'w_rad'"),
    ],
)
def test_a_wrong_factor_is_one_line(factor, value, message):
    with pytest.raises(InputError, match=message):
        drawn_effects({factor: value}, CUBE, np.random.default_rng(0))


def test_an_estimate_suffers_from_an_effect_as_if_the_scenario_had_it(monkeypatch):
    """Chips 10 mm beside their places: the same world as with the effect in the scenario, and a worse rate."""
    key = "sensor_position.a1_x_m"
    plain = estimate_case(Case(0, SETTING, 3))
    moved = estimate_case(Case(0, {**SETTING, key: 0.01}, 3))
    assert moved["omega_rms_rad_s"] > plain["omega_rms_rad_s"]
    load = Scenario.load
    monkeypatch.setattr(
        Scenario,
        "load",
        lambda name, changes: load(
            name, changes=[*changes, 'effect=[{name="sensor_position", parameters={a1_x_m=0.01}}]']
        ),
    )
    assert estimate_case(Case(0, SETTING, 3)) == moved
