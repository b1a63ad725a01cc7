"""Chips on an axis whose levers, orientations and biases are not known exactly: estimated with the rotation."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats
from turning import NOISE, array_of, mounted

from gfimu import AccelerometerArray, InputError, TurningAxis
from gfimu.array import AxisUncertainty
from gfimu.motion import estimate_about_axis
from gfimu.rate.axis.channels import AxisChannels
from gfimu.rate.axis.mounting import Mounting
from gfimu.rate.axis.mounting_fit import fit_mounting
from gfimu.rate.axis.problem import AxisProblem, Settings
from gfimu.recording import Recording, mapped_recording

ONE = array_of((0.1, 0.0, 0.02))
TWO = array_of((0.02, 0.0, 0.0), (0.17, 0.0, 0.0))
BY_EYE = AxisUncertainty(0.003, 0.01, 0.003, 0.05, 0.2)

CASES = {
    "two chips on a wheel, start unknown": (TWO, "free", BY_EYE, {"tilt": 1.57, "hub": 0.7, "rest": False}),
    "one chip on an inclined table": (ONE, "fixed", AxisUncertainty(0, 0.01, 0.005, 0.03, 0.1), {"tilt": 0.5}),
    "two chips on an upright table": (TWO, "fixed", AxisUncertainty(0.002, 0.01, 0.003, 0.02, 0.05), {}),
}


@pytest.mark.study(but=["one chip on an inclined table"])
@pytest.mark.parametrize(("array", "hub", "doubt", "world"), CASES.values(), ids=CASES)
def test_rate_and_constants_agree_with_their_standard_deviations(array, hub, doubt, world):
    recording, rate, off = mounted(array, doubt, np.random.default_rng(11), duration=30.0, **world)
    axis = TurningAxis.of("z", hub=hub, uncertainty=doubt)
    found = estimate_about_axis(recording, array, axis, at_rest=world.get("rest", True))
    settled = slice(len(rate) // 4, None)
    missed, std = (found.omega[:, 2] - rate)[settled], found.omega_std[settled, 2]
    assert np.mean(np.abs(missed) < 3.0 * std) > 0.95
    assert np.sqrt(np.mean(missed**2)) < 1.6 * np.sqrt(np.mean(std**2))
    constants = found.metadata["mounting"]["constants"]
    deviations = [
        (one["value"] + (found.metadata["turning_axis"]["inclination_rad"] - one["value"]) * (one["name"][0] == "i"))
        - off[one["name"]]
        for one in constants
    ]
    normalised = np.array(deviations) / [one["std"] for one in constants]
    assert np.max(np.abs(normalised)) < stats.norm.ppf(1.0 - 0.0005 / len(normalised))
    assert min(one["std"] / one["prior_std"] for one in constants) < 0.2  # the data do say something


@pytest.mark.study
def test_two_chips_by_eye_are_far_better_with_the_mounting_estimated():
    recording, rate, _ = mounted(TWO, BY_EYE, np.random.default_rng(12), duration=30.0, tilt=1.57, hub=0.7)
    rms = []
    for doubt in (AxisUncertainty(), BY_EYE):
        axis = TurningAxis.of("z", hub="free", uncertainty=doubt)
        found = estimate_about_axis(recording, TWO, axis)
        rms.append(np.sqrt(np.mean((found.omega[1000:, 2] - rate[1000:]) ** 2)))
    assert rms[1] < 0.2 * rms[0]


def test_what_the_data_leave_open_is_named():
    """Along a wheel's axis, whose inclination is free, only the difference of the chips' biases shows."""
    recording, _, _ = mounted(TWO, BY_EYE, np.random.default_rng(13), duration=20.0, tilt=1.57, hub=0.7)
    found = estimate_about_axis(recording, TWO, TurningAxis.of("z", hub="free", uncertainty=BY_EYE))
    mounting = found.metadata["mounting"]
    assert mounting["determined_combinations"] < len(mounting["constants"])
    (line,) = (one for one in mounting["undetermined_combinations_in_prior_std"] if "a13_bias" in one)
    assert "a23_bias" in line
    assert "a23_bias_m_s2" not in line.split("−")[-1] or "−" not in line  # their sum, not their difference
    json.dumps(found.metadata)


@pytest.mark.parametrize("hub", ["fixed", "free"])
def test_the_gradient_is_that_of_the_likelihood(hub):
    shake = 0.7 * (hub == "free")
    recording, _, _ = mounted(TWO, AxisUncertainty(), np.random.default_rng(1), duration=8.0, tilt=1.2, hub=shake)
    axis = TurningAxis.of("z", hub=hub, uncertainty=BY_EYE)
    mounting = Mounting.of(TWO, axis, 1.2, free_inclination=True)
    problem = AxisProblem(recording.t_s, recording.readings, AxisChannels.of(TWO, axis), np.full(6, NOISE))
    settings = Settings(1.0, 300.0, shake, 1.2)
    covariance = np.diag([0.25, 1e-4, 1e-2])
    start = max(
        (np.array([phase, 0.0, 0.0]) for phase in np.arange(8) * np.pi / 4),
        key=lambda one: problem.likelihood(settings, one, covariance, 600),
    )
    at = 0.02 * mounting.prior_std * np.random.default_rng(2).normal(size=len(mounting.constants))

    def run(values, slopes=None):
        moved = replace(problem, channels=mounting.channels(values))
        return moved.run(replace(settings, inclination=mounting.tilt(values)), start, covariance, slopes=slopes)

    found = run(at, mounting.slopes(at))
    step = 1e-5 * np.eye(len(at))
    by_differences = [(run(at + one).likelihood - run(at - one).likelihood) / 2e-5 for one in step]
    # What the covariance of the state itself adds is left out: of mean zero at the truth, and small beside the rest.
    missed = (found.gradient - by_differences) / np.sqrt(np.diag(found.information))
    assert np.max(np.abs(missed)) < 1.5
    assert np.median(np.abs(missed)) < 0.05


def test_an_array_file_holds_the_uncertainty(tmp_path):
    text = ONE.to_toml() + "[turning_axis]\ndirection = [0, 0, 1]\nlever_std_m = 0.002\nrotation_std_rad = 0.03\n"
    (tmp_path / "few.toml").write_text(text)
    array = AccelerometerArray.load(tmp_path / "few.toml")
    assert array.turning_axis.uncertainty == AxisUncertainty(lever_std_m=0.002, rotation_std_rad=0.03)
    again = AccelerometerArray.from_dict({"name": "x", **array.to_dict()})
    assert again.turning_axis.uncertainty == array.turning_axis.uncertainty
    (tmp_path / "bad.toml").write_text(text.replace("0.03", "-1.0"))
    with pytest.raises(InputError, match="rotation_std_rad"):
        AccelerometerArray.load(tmp_path / "bad.toml")


@pytest.mark.study
def test_two_real_units_on_a_wheel_are_better_than_one(shared_data):
    """Two Xsens DOT on the wheel of a car, the turn between them not documented, against both gyros' magnitude."""
    folder = shared_data / "wid"
    if not folder.is_dir():
        pytest.skip("the Wheel Inertial Dataset is not here")
    near, far = (
        mapped_recording(folder / name, "xsens_dot") for name in ("trial08_IMU2.csv.gz", "trial08_IMU2_radial.csv.gz")
    )
    t = [one.t_s + one.metadata["time_origin_s"] for one in (near, far)]
    _, first, second = np.intersect1d(np.round(t[0] * 120.0), np.round(t[1] * 120.0), return_indices=True)
    first, second = first[6000:11000], second[6000:11000]  # 42 s, fast and slow
    readings = np.hstack([near.readings[first], far.readings[second]])
    rates = [
        np.column_stack([one.reference[f"gyro_{axis}_rad_s"][rows] for axis in "xyz"])
        for one, rows in ((near, first), (far, second))
    ]
    speed = np.mean([np.linalg.norm(one, axis=1) for one in rates], axis=0)
    gyro = np.sign(rates[0][:, 2]) * speed
    fast = speed > np.radians(60.0)
    doubt = AxisUncertainty(0.005, 0.03, 0.002, 0.05, 0.3)
    missed = {}
    for name, array, columns, uncertainty in (
        ("pair", array_of((0, 0, 0), (0.15, 0, 0)), slice(None), doubt),
        ("far", array_of((0.15, 0, 0)), slice(3, None), AxisUncertainty()),
    ):
        recording = Recording.from_arrays(t[0][first] - t[0][first[0]], readings[:, columns], array)
        axis = TurningAxis.of("z", hub="free", uncertainty=uncertainty)
        found = estimate_about_axis(recording, array, axis, at_rest=False)
        missed[name] = np.median(np.abs(found.omega[fast, 2] - gyro[fast]))
        if name == "pair":
            turn = {one["name"]: one["value"] for one in found.metadata["mounting"]["constants"]}
    assert missed["pair"] <= missed["far"]
    # Each gyro says where the axis lies in its unit: by the difference the units are turned to one another.
    lean = [np.linalg.svd(one[fast], full_matrices=False)[2][0] for one in rates]
    lean = [one[:2] / one[2] for one in lean]
    by_gyros = [lean[1][1] - lean[0][1], lean[0][0] - lean[1][0]]  # rotation about x and y
    by_chips = [turn[f"a2_rotation_{axis}_rad"] - turn[f"a1_rotation_{axis}_rad"] for axis in "xy"]
    assert by_chips == pytest.approx(by_gyros, abs=0.03)


@pytest.mark.parametrize("failing", ["raises", "is not finite"])
def test_constants_that_have_no_density_are_a_step_too_far(monkeypatch, failing):
    """The density is largest at 2 prior standard deviations and has no value beyond 1.5."""
    mounting = SimpleNamespace(prior_std=np.array([1.0]))

    def information(problem, given, settings, start, covariance, values):
        if values[0] > 1.5 and failing == "raises":
            raise np.linalg.LinAlgError("Singular matrix")
        likelihood = -50.0 * (values[0] - 2.0) ** 2 + 0.5 * values[0] ** 2 if values[0] <= 1.5 else np.nan
        gradient = -100.0 * (values - 2.0) + values
        return SimpleNamespace(likelihood=likelihood, gradient=gradient), 100.0 * np.eye(1)

    monkeypatch.setattr("gfimu.rate.axis.mounting_fit.mounting_information", information)
    found = fit_mounting(None, mounting, None, np.zeros(3), np.eye(3), np.zeros(1))
    assert 1.0 <= found.values[0] <= 1.5
