"""A body thrown about: worlds from MuJoCo, motion unknown but for a gyro. `hidden_table` hides single effects in it."""

import copy
from types import SimpleNamespace

import numpy as np
import pytest
from rerun.chunk import RrdReader

from gfimu import InputError
from gfimu.base import find_model
from gfimu.base.files.model_files import read_toml
from gfimu.diagnosis import diagnose, prepare, write_picture
from gfimu.diagnosis.data.body.run import prepare_body_run
from gfimu.diagnosis.data.body.stretch import make_body_stretches
from gfimu.diagnosis.terms.hand.drive import HandDrive
from gfimu.motion import BodyDrive, to_rotation
from sim.effects import BODY_EFFECTS, EFFECTS, NOT_OF_A_BODY
from sim.scenarios import Scenario
from sim.simulation import simulate
from sim.twin import Twin

TUMBLE = read_toml(find_model("scenarios", "tumble"))
SENSOR = {"errors": False, "bandwidth": False, "bias_instability_m_s2": 5e-4}


def tumble(*effects, seed=1, array="mimu4444", duration=20.0, rate=12.0, sensor=SENSOR):
    """Recording of a torque-free tumble, by MuJoCo."""
    data = copy.deepcopy(dict(TUMBLE))
    data |= {"array": array, "duration_s": duration, "sensor": sensor}
    data["motion"] = dict(data["motion"], rate_rad_s=rate)
    data["effect"] = [{"name": name, "parameters": parameters} for name, parameters in effects]
    return simulate(Scenario.from_dict(data), seed=seed)


def twin(array="mimu4444"):
    part = "mpu9150" if array == "mimu4444" else "adxl345"
    return Twin.from_dict({"array": array, "drive": {"source": "gyro"}, "sensor": {"part": part}})


@pytest.mark.study(but=["2-cube12-6.0"])
@pytest.mark.parametrize(("seed", "array", "rate"), [(1, "mimu4444", 12.0), (2, "cube12", 6.0), (3, "mimu4444", 25.0)])
def test_nothing_hidden_nothing_named(seed, array, rate):
    verdict = diagnose([tumble(seed=seed, array=array, rate=rate)], twin(array))
    assert (verdict.verdict, verdict.causes) == ("nothing_found", ())


@pytest.mark.study(only=["3-mimu4444-2.0"])
@pytest.mark.parametrize(("seed", "array", "rate"), [(2, "cube12", 1.0), (1, "cube12", 3.0), (3, "mimu4444", 2.0)])
def test_the_noise_of_the_gyro_in_a_slow_motion_is_no_cause(seed, array, rate):
    """The derivative of the gyro is mostly noise here, and the residual holds the same noise."""
    verdict = diagnose([tumble(seed=seed, array=array, rate=rate)], twin(array))
    assert (verdict.verdict, verdict.causes) == ("nothing_found", ())
    assert verdict.unexplained.log_odds < 8


def test_what_drives_the_twin_is_the_gyro_smoothed():
    recording = tumble(seed=2, array="cube12", rate=3.0)
    (stretch,) = make_body_stretches(twin("cube12"), [prepare_body_run(recording, twin("cube12"))], [[]])
    drive = HandDrive.of(stretch).spin
    truth, gyro = (
        np.column_stack([values[name.format(axis)] for axis in "xyz"])
        for values, name in ((recording.extra, "truth_omega_{}_rad_s"), (recording.reference, "gyro_{}_rad_s"))
    )
    raw, smooth = (
        BodyDrive(recording.t_s, rate - truth, truth).acceleration[20:-20].std() for rate in (gyro, drive.rate)
    )
    assert smooth < 0.1 * raw


@pytest.mark.study
def test_a_slow_motion_shows_the_size_of_an_effect_on_the_angular_acceleration():
    """Noise in the regressor would make the displacement smaller than it is."""
    hidden = ("sensor_position", {"a2_x_m": 4e-3, "a2_y_m": -6e-3})
    verdict = diagnose([tumble(hidden, seed=4, array="cube12", rate=3.0)], twin("cube12"))
    (cause,) = verdict.causes
    assert (cause.effect, cause.place) == ("sensor_position", "chip a2")
    for key, value in hidden[1].items():
        assert abs(cause.parameters[key] - value) < 4 * cause.std[key]


@pytest.mark.study(but=["1-cube12"])
@pytest.mark.parametrize(("seed", "array"), [(1, "cube12"), (2, "mimu4444")])
def test_the_average_of_the_conversions_in_a_fast_motion_is_no_cause(seed, array):
    """Chips that average over a sample read less of a fast motion: a fraction of a percent, in the shape of others."""
    sensor = dict(SENSOR, bandwidth=True)
    verdict = diagnose([tumble(seed=seed, array=array, rate=25.0, sensor=sensor)], twin(array))
    assert (verdict.verdict, verdict.causes) == ("nothing_found", ())
    assert verdict.unexplained.log_odds < 8


def test_the_picture_shows_the_body_turning_and_no_table(tmp_path):
    recording = tumble(seed=2, array="cube12", rate=6.0, sensor={"perfect": True})
    verdict = diagnose([recording], twin("cube12"))
    attitude = to_rotation(verdict.runs[0].attitude)
    truth = to_rotation(np.column_stack([recording.extra[f"truth_q_{axis}"] for axis in "wxyz"]))
    # Gravity says nothing of the heading; the noise of the gyro walks by 0.002 rad/s × √(20 s × 0.01 s) per axis.
    up, expected = attitude.inv().apply([0, 0, 1.0]), truth.inv().apply([0, 0, 1.0])
    assert np.abs(up - expected).max() < 5 * 0.002 * np.sqrt(20 * 0.01) + 1e-3
    write_picture(tmp_path / "free.rrd", verdict)
    entities = {chunk.entity_path for chunk in RrdReader(str(tmp_path / "free.rrd")).stream().to_chunks()}
    assert any(name.startswith("/scene/cube") for name in entities)
    assert not any("/table" in name or "/base" in name for name in entities)


@pytest.mark.study
def test_two_effects_are_both_found_and_the_extended_twin_has_nothing_left():
    hidden = [("bias", {"m32_m_s2": 0.3}), ("sensor_position", {"m6_x_m": 1.5e-3})]
    one, other = tumble(*hidden, seed=5), tumble(*hidden, seed=6, rate=9.0)
    verdict = diagnose([one], twin(), held_out=[other])
    assert {cause.effect for cause in verdict.causes} == {"bias", "sensor_position"}
    assert verdict.gain.held_out == "another recording"
    assert verdict.gain.share_of_excess_removed > 0.98
    assert verdict.gain.log_likelihood_per_sample > 5 * verdict.gain.log_likelihood_std
    again = Twin.from_dict({**verdict.twin.to_dict()})
    assert diagnose([other], again).verdict == "nothing_found"


@pytest.mark.study
def test_what_the_library_does_not_have_is_unknown_and_told():
    recording = tumble(seed=7)
    recording.readings[:, 4] += 0.1 * np.sin(2 * np.pi * 11.3 * recording.t_s)
    verdict = diagnose([recording], twin())
    assert verdict.verdict == "unknown"
    assert "channel m22 has a tone at 11.3" in verdict.unexplained.signature


@pytest.mark.study
def test_sampling_at_random_instants_is_told_as_disagreement_in_motion():
    """Each chip is late by some milliseconds, anew in every sample: no effect, but noise that grows with the motion."""
    rng = np.random.default_rng(8)
    steady = [tumble(("channel_skew", {"per_chip_s": s}), seed=8, rate=20.0).readings for s in (0.0, 1e-3)]
    recording = tumble(seed=8, rate=20.0)
    slope = (steady[1] - steady[0]) / (1e-3 * np.maximum(twin().array.chip_of_channel, 1))
    late = rng.normal(0, 2e-3, (len(recording.t_s), 8))[:, twin().array.chip_of_channel]
    recording.readings[:] = recording.readings + slope * late * (twin().array.chip_of_channel > 0)
    verdict = diagnose([recording], twin())
    assert verdict.verdict == "unknown"
    assert not verdict.causes
    assert "disagree from sample to sample" in verdict.unexplained.signature


def test_the_twin_predicts_what_mujoco_measures():
    """Analytic readings from the true rate and specific force, against MuJoCo's, effects of geometry and time in."""
    hidden = [
        ("sensor_position", {"m2_x_m": 2e-3}),
        ("misalignment", {"m5_z_rad": 0.05}),
        ("chip_delay", {"m7_s": 3e-3}),
    ]
    recording = tumble(*hidden, sensor={"perfect": True}, rate=9.0)
    world = Twin.from_dict(
        {**twin().to_dict(), "effect": [{"name": name, "parameters": parameters} for name, parameters in hidden]}
    )
    plain = tumble(sensor={"perfect": True}, rate=9.0)
    omega = np.column_stack([recording.extra[f"truth_omega_{axis}_rad_s"] for axis in "xyz"])
    # The specific force of the origin: the mean of eight chips about it, the tangential parts cancel.
    array = twin().array
    still = world.predict_body(BodyDrive(plain.t_s, omega, np.zeros_like(omega)), plain.t_s, effects=[])
    nominal = twin().predict_body(BodyDrive(plain.t_s, omega, np.zeros_like(omega)), plain.t_s)
    force = (plain.readings - nominal) @ np.linalg.pinv(array.axes).T
    predicted = world.predict_body(BodyDrive(plain.t_s, omega, force), plain.t_s)
    inside = slice(20, -20)
    assert np.abs(still - nominal)[inside].max() > 0.1
    # Cubic splines of the samples at 100 Hz stand for the motion between them.
    assert np.abs(predicted - recording.readings)[inside].max() < 2e-3


def test_every_effect_is_looked_for_or_left_out_for_a_reason():
    assert set(EFFECTS) | {"chip_delay", "gyro_latency", "gyro_scale", "gyro_misalignment"} == set(BODY_EFFECTS) | set(
        NOT_OF_A_BODY
    )
    assert not set(BODY_EFFECTS) & set(NOT_OF_A_BODY)
    assert all(NOT_OF_A_BODY.values())


def test_rest_is_found_and_the_gyro_bias_with_it():
    recording = tumble(seed=9)
    recording.reference["gyro_x_rad_s"][:] += 0.03
    body = prepare_body_run(recording, twin())
    assert recording.t_s[body.rest].max() < 2.1
    assert body.rest[recording.t_s < 1.5].mean() > 0.9
    assert body.gyro_bias == pytest.approx([0.03, 0, 0], abs=4 * 0.002 / np.sqrt(body.rest.sum()))


def test_a_recording_without_its_gyro_is_refused():
    recording = tumble(seed=9)
    del recording.reference["gyro_y_rad_s"]
    with pytest.raises(InputError, match=r"column gyro_y_rad_s is missing, but the twin's drive source is 'gyro'"):
        diagnose([recording], twin())


def test_a_simulation_that_predicts_no_free_body_is_refused():
    model = SimpleNamespace(drive_source="gyro")
    with pytest.raises(InputError, match="the simulation predicts no free body"):
        prepare([], model, [])
