"""Scenario files and the recordings that come of them."""

import json

import numpy as np
import pytest

from gfimu import AccelerometerArray, InputError, specific_force
from gfimu.base import list_models
from gfimu.recording import Recording
from sim import prescribed_readings
from sim.effects import make_effect
from sim.scenarios import Scenario
from sim.simulation import simulate

SHIPPED = ["driven_run", "eccentric_mount", "motor_run", "paper_run", "rest", "speed_sweep", "tumble"]
PERFECT = "sensor.perfect=true"


def triple(recording, quantity, unit):
    return np.column_stack([recording.extra[f"truth_{quantity}_{axis}{unit}"] for axis in "xyz"])


def truth(recording):
    return triple(recording, "p", "_m_s2"), triple(recording, "alpha", "_rad_s2"), triple(recording, "omega", "_rad_s")


def test_all_scenarios_of_the_catalogue_are_listed_here():
    assert set(SHIPPED) <= set(list_models("scenarios"))


@pytest.mark.parametrize("name", SHIPPED)
def test_perfect_sensors_read_what_the_truth_implies(name):
    scenario = Scenario.load(name, changes=[PERFECT])
    recording = simulate(scenario, seed=2)
    array = scenario.world.array
    np.testing.assert_allclose(recording.for_array(array), specific_force(array, *truth(recording)), rtol=0, atol=1e-9)


def test_paper_run_is_the_papers():
    recording = simulate("paper_run", seed=1)
    assert len(recording) == 3000
    assert recording.sample_rate == pytest.approx(100.0)
    assert recording.channels == AccelerometerArray.load("cube12").channels
    rate = triple(recording, "omega", "_rad_s")[:, 2]
    assert rate.max() > 1.0
    assert rate.min() < -1.0
    assert np.mean(rate == 0.0) > 0.1
    np.testing.assert_allclose(recording.reference["command_rad_s"], rate, atol=1e-9)
    tacho_error = recording.reference["tacho_rad_s"] - rate
    assert tacho_error.std() == pytest.approx(0.005, rel=5 / np.sqrt(6000))
    assert recording.metadata["scenario"] == "paper_run"
    assert recording.metadata["mounting_rotvec_rad"] == [0.0, 0.0, 0.0]


def test_errors_of_real_chips_show_at_rest():
    recording = simulate("rest", seed=3)
    expected = np.array([recording.metadata["truth_bias_m_s2"][name] for name in recording.channels])
    up = np.tile([0.0, 0.0, 9.80665], 4)
    # Cross-axis and misalignment pick up 1 % of gravity, gain and curvature of the z axes as much: five times √2 %.
    np.testing.assert_allclose(recording.readings.mean(axis=0) - up, expected, atol=5 * 0.0142 * 9.81)
    assert np.all(np.abs(np.array(expected)) > 0)


def test_eccentric_mount_shows_its_offset_in_p():
    recording = simulate(Scenario.load("eccentric_mount", changes=[PERFECT]))
    p, _, omega = truth(recording)
    steady = np.abs(omega[:, 2] - 6.0) < 1e-9
    assert steady.any()
    np.testing.assert_allclose(p[steady], np.tile([-36 * 0.003, 36 * 0.002, 9.80665], (steady.sum(), 1)), atol=1e-9)


def test_driven_run_lags_its_command_and_feels_the_tilt():
    recording = simulate(Scenario.load("driven_run", changes=["reference.tacho_noise_std_rad_s=0"]))
    rate = triple(recording, "omega", "_rad_s")[:, 2]
    np.testing.assert_allclose(recording.reference["tacho_rad_s"], rate, atol=2e-5)
    assert 0.01 < np.abs(recording.reference["command_rad_s"] - rate).max() < 0.5
    p, _, _ = truth(recording)
    assert np.abs(p[:, :2]).max() == pytest.approx(9.80665 * np.hypot(0.003, 0.002), rel=0.02)


def test_a_seed_gives_the_same_recording_and_another_seed_another():
    first, again, other = (simulate("paper_run", seed=seed) for seed in (4, 4, 5))
    np.testing.assert_array_equal(first.readings, again.readings)
    assert np.mean(first.readings != other.readings) > 0.5
    assert first.metadata["truth_bias_m_s2"] != other.metadata["truth_bias_m_s2"]


def test_chips_seed_keeps_the_chips_from_run_to_run():
    scenario = Scenario.load("rest", changes=["sensor.chips_seed=9"])
    first, other = (simulate(scenario, seed=seed) for seed in (1, 2))
    assert first.metadata["truth_bias_m_s2"] == other.metadata["truth_bias_m_s2"]
    assert np.any(first.readings != other.readings)


def test_raw_counts_and_readings_are_the_same_recording(tmp_path):
    simulate("paper_run", seed=1, raw=True, out=tmp_path / "raw.csv")
    counts = Recording.read(tmp_path / "raw.csv", unit="lsb")
    assert np.all(counts.readings == np.round(counts.readings))
    readings = simulate("paper_run", seed=1, out=tmp_path / "run.parquet")
    np.testing.assert_allclose(Recording.read(tmp_path / "raw.csv").readings, readings.readings, atol=1e-12)
    back = Recording.read(tmp_path / "run.parquet")
    np.testing.assert_array_equal(back.readings, readings.readings)
    np.testing.assert_array_equal(back.extra["truth_omega_z_rad_s"], readings.extra["truth_omega_z_rad_s"])
    assert back.metadata["seed"] == 1


def test_perfect_sensors_have_no_counts():
    with pytest.raises(InputError, match="raw counts"):
        simulate(Scenario.load("rest", changes=[PERFECT]), raw=True)


@pytest.mark.parametrize(
    ("changes", "fraction"),
    [
        (["sensor.range_g=2", "mounting_rotvec_rad=[0.0, 0.0, 0.0]"], 0.0039),
        (["sensor.full_resolution=false"], 0.0312),
    ],
)
def test_sensor_settings_reach_the_converter(changes, fraction):
    recording = simulate(Scenario.load("rest", changes=changes))
    codes = recording.readings / (fraction * 9.80665)
    np.testing.assert_allclose(codes, np.round(codes), atol=1e-4)


@pytest.mark.parametrize(("rate", "expected"), [(100.0, 100.0), (120.0, 200.0), (800.0, 800.0), (3200.0, 3200.0)])
def test_output_data_rate_keeps_up_with_the_sample_rate(rate, expected):
    scenario = Scenario.load("rest", changes=[f"sample_rate_hz={rate}", "duration_s=0.5"])
    assert scenario.sensor.output_data_rate == expected
    assert len(simulate(scenario)) == round(0.5 * rate)


def test_mounting_turns_the_cube():
    changes = ["mounting_rotvec_rad=[1.5707963267948966, 0, 0]", PERFECT, "duration_s=1"]
    recording = simulate(Scenario.load("rest", changes=changes))
    np.testing.assert_allclose(recording.readings, np.tile([0.0, 9.80665, 0.0], (100, 4)), atol=1e-9)
    np.testing.assert_allclose(recording.mounting_rotvec, [np.pi / 2, 0, 0])


def test_lost_frames_leave_gaps_in_time():
    data = {
        "array": "cube12",
        "duration_s": 10.0,
        "motion": {"kind": "rest"},
        "effect": [{"name": "dropped_frames", "parameters": {"share": 0.05}}],
    }
    recording = simulate(Scenario.from_dict(data), seed=1)
    assert 900 < len(recording) < 1000
    assert len(recording.gaps) > 10
    assert not np.isnan(recording.readings).any()
    assert len(recording.extra["truth_p_x_m_s2"]) == len(recording.reference["tacho_rad_s"]) == len(recording)


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("bias", {"a11_m_s2": 0.5}),
        ("scale_factor", {"a23": 0.05}),
        ("table_tilt", {"x_rad": 0.02}),
        ("axis_wobble", {"amplitude_rad": 0.01}),
        ("channel_skew", {"per_chip_s": 0.004}),
        ("clock_error", {"ratio": 0.01}),
        ("cogging", {"amplitude_rad_s2": 2.0, "order": 6}),
        ("centrifugal_flex", {"stretch_s2_rad2": 1e-3}),
        ("sensor_lag", {"time_constant_s": 0.02}),
        ("sign_flip", {"channel": "a31"}),
    ],
)
def test_effects_change_what_the_channels_read(name, parameters):
    nominal = Scenario.load("paper_run", changes=[PERFECT])
    changed = Scenario.load("paper_run", changes=[PERFECT])
    object.__setattr__(changed, "effects", (make_effect(name, parameters, changed.array),))
    difference = simulate(changed).readings - simulate(nominal).readings
    assert np.abs(difference).max() > 0.01


def test_tacho_effects_change_the_reference_alone():
    nominal = Scenario.load("paper_run", changes=[PERFECT])
    late = Scenario.load("paper_run", changes=[PERFECT])
    object.__setattr__(late, "effects", (make_effect("tacho_latency", {"delay_s": 0.05}),))
    first, second = simulate(nominal), simulate(late)
    np.testing.assert_array_equal(first.readings, second.readings)
    moved = np.interp(second.t_s - 0.05, first.t_s, first.extra["truth_omega_z_rad_s"])
    assert np.abs(second.reference["tacho_rad_s"] - moved)[10:].max() < 6 * 0.005


def test_temperature_runs_from_start_to_end():
    changes = ["temperature.start_degC=20", "temperature.final_degC=40", "temperature.time_constant_s=10"]
    recording = simulate(Scenario.load("rest", changes=changes))
    temperature = recording.reference["temperature_degC"]
    assert temperature[0] == pytest.approx(20.0)
    assert temperature[1000] == pytest.approx(40 - 20 * np.exp(-1))


def test_a_twin_file_is_a_scenario(tmp_path):
    twin = tmp_path / "twin.toml"
    twin.write_text(
        'array = "cube12"\ngravity_m_s2 = 9.81\n[drive]\nsource = "tacho"\n[sensor]\nrange_g = 8\n'
        '[[effect]]\nname = "table_tilt"\nparameters = { x_rad = 0.004, y_rad = -0.002 }\n'
    )
    recording = simulate(twin)
    assert len(recording) == 3000
    assert recording.metadata["effects"][0]["name"] == "table_tilt"
    rest = np.abs(triple(recording, "omega", "_rad_s")[:, 2]) == 0
    assert triple(recording, "p", "_m_s2")[rest][0, 2] == pytest.approx(9.81, rel=1e-4)


def test_array_beside_the_scenario_is_found(tmp_path):
    (tmp_path / "mine.toml").write_text(AccelerometerArray.load("corners8").to_toml())
    (tmp_path / "run.toml").write_text('array = "mine.toml"\nduration_s = 0.5\n[motion]\nkind = "rest"\n')
    assert simulate(tmp_path / "run.toml").readings.shape == (50, 24)


def test_progress_reaches_one():
    seen = []
    simulate("rest", progress=seen.append)
    assert seen[-1] == 1.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (["motoin.kind=rest"], "unknown key 'motoin'; valid: array, "),
        (["motion.kind=spin"], "kind = 'spin' must be one of profile, rest, tumble"),
        (["sensor.range=8"], "unknown key 'range'; valid: bandwidth, "),
        (["sensor.range_g=5"], "unknown range_g 5; valid: 2, 4, 8, 16"),
        (["sensor.part=adxl999"], "unknown part 'adxl999'; valid: adxl345"),
        (["array=cube13"], "unknown array 'cube13'; valid: "),
        (["sample_rate_hz=-1"], "sample_rate_hz = -1 must be greater than 0"),
        (["sample_rate_hz=6400"], "at most 3200 Hz"),
        (["duration_s=0.005"], "fewer than two samples"),
        (["duration_s=nan"], "must be a finite number"),
        (["drive.mode=pushed"], "must be one of dcmotor, driven, prescribed"),
        (["reference.tacho_noise_std_rad_s=-1"], "must be at least 0"),
        (["effect=[{name='tilt'}]"], "unknown effect 'tilt'; valid: angle_zero"),
        (["effect=[{name='table_tilt', parameters={z_rad=1}}]"], "unknown parameter 'z_rad'; valid: x_rad, y_rad"),
        (["cube_offset_m=[1, 2]"], "must be a list of 3 finite numbers"),
        (["sensor.chips_seed=-1"], "must be a whole number"),
        (["sensor.noise=1"], "must be true or false"),
        (["array"], "write it as key=value"),
        (["array.x=1"], "array is not a table"),
    ],
)
def test_wrong_keys_and_values_are_named(changes, message):
    with pytest.raises(InputError) as error:
        Scenario.load("rest", changes=changes)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (["drive.mode=driven"], "no motor"),
        (["mounting_rotvec_rad=[1, 0, 0]"], "starts upright"),
        (["effect=[{name='table_tilt', parameters={x_rad=0.1}}]"], "change the table"),
        (["motion.inclination_rad=1.5"], "inclination_rad"),
    ],
)
def test_a_tumbling_body_has_no_table(changes, message):
    with pytest.raises(InputError, match=message):
        Scenario.load("tumble", changes=changes)


def test_unknown_scenario_lists_the_known_ones():
    with pytest.raises(InputError, match=r"unknown scenario 'papr_run'; valid: .*paper_run"):
        Scenario.load("papr_run")


def test_segments_are_checked():
    data = {"array": "cube12", "motion": {"segment": [{"kind": "ramp", "duration_s": 1.0}]}}
    with pytest.raises(InputError, match=r"\[\[segment\]\] 1: key 'to_rad_s' is missing"):
        Scenario.from_dict(data)
    data["motion"]["segment"] = [{"kind": "hold", "duration_s": 1.0, "rate": 3}]
    with pytest.raises(InputError, match="unknown key 'rate'; valid: duration_s, kind"):
        Scenario.from_dict(data)


def test_metadata_is_plain_json():
    json.dumps(dict(simulate(Scenario.load("eccentric_mount")).metadata))


def test_the_mean_of_a_sample_is_that_of_its_conversions():
    # At ten revolutions per second a tilted table turns gravity by 36° per sample: the bandwidth must show.
    data = {
        "array": "cube12",
        "duration_s": 2.0,
        "motion": {"start_rate_rad_s": 20 * np.pi, "segment": [{"kind": "hold", "duration_s": 2.0}]},
        "effect": [{"name": "table_tilt", "parameters": {"x_rad": 0.1}}],
        "sensor": {"errors": False, "noise": False, "quantisation": False},
    }
    scenario = Scenario.from_dict(data)
    recording = simulate(scenario)
    instant = prescribed_readings(scenario.world, scenario.motion, recording.t_s)
    swing = (recording.readings - recording.readings.mean(axis=0))[:, 0].std()
    ideal = (instant - instant.mean(axis=0))[:, 0].std()
    assert swing / ideal == pytest.approx(np.cos(np.pi * 10 / 200), rel=1e-6)


def test_a_late_reference_is_late_in_tacho_and_encoder():
    late = "effect=[{name='tacho_latency', parameters={delay_s=0.05}}]"
    recording = simulate(Scenario.load("paper_run", changes=[PERFECT, late, "reference.tacho_noise_std_rad_s=0"]))
    prompt = simulate(Scenario.load("paper_run", changes=[PERFECT, "reference.tacho_noise_std_rad_s=0"]))
    for column in ("tacho_rad_s", "angle_rad"):
        np.testing.assert_allclose(recording.reference[column][5:], prompt.reference[column][:-5], atol=1e-9)
    assert np.abs(recording.reference["angle_rad"] - prompt.reference["angle_rad"]).max() > 0.1


def test_noise_effects_reach_the_sensors():
    quiet = ["sensor.errors=false", "sensor.quantisation=false"]
    noisy = "effect=[{name='noise', parameters={factor=4.0}}]"
    walking = "effect=[{name='bias_random_walk', parameters={strength_m_s2_rts=0.1}}]"
    nominal, factor, walk = (
        simulate(Scenario.load("rest", changes=changes)).readings
        for changes in (quiet, [*quiet, noisy], [*quiet, walking])
    )
    tolerance = 5 / np.sqrt(2 * len(nominal))
    np.testing.assert_allclose(factor.std(axis=0), 4 * nominal.std(axis=0), rtol=2 * tolerance)
    # Increments over one second: a walk of 0.1 m/s² per √s and twice the white noise; 59 of them in 12 channels.
    steps = np.diff(walk[::100], axis=0)
    expected = np.sqrt(0.1**2 + 2 * nominal.var(axis=0).mean())
    assert np.sqrt(np.mean(steps**2)) == pytest.approx(expected, rel=5 / np.sqrt(2 * steps.size))
