"""Non-linearity as unknowns of a calibration, and standard deviations that hold on parts as data sheets have them."""

import importlib.util
import sys
from dataclasses import replace

import numpy as np
import pytest
from calibration_cases import GRAVITY, MULTI, chips_in_gauge, poses_of, simulate

from gfimu import AccelerometerArray
from gfimu.calibration import ErrorModel
from gfimu.calibration.array_static import array_static, bias_places, same_specific_force
from gfimu.calibration.fit_quality import covariance_scale, mean_factor
from gfimu.calibration.multi_position import magnitude_condition, multi_position
from gfimu.calibration.nonlinearity import quadratic_std, with_quadratic
from gfimu.recording import Recording
from sim import SensorSettings


def without_quadratic(readings, bias, quadratic):
    """Return the straight readings b + y of bent ones b + y + q y², to second order: l − q (l − b)², shape (..., c)."""
    return np.asarray(readings - np.asarray(quadratic) * (readings - np.asarray(bias)) ** 2, dtype=np.float64)


@pytest.fixture(scope="module")
def study(project_root):
    path = project_root / "docs" / "scripts" / "calibration_consistency.py"
    spec = importlib.util.spec_from_file_location("calibration_consistency", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules["calibration_consistency"] = module
    spec.loader.exec_module(module)
    return module


def test_bent_model_reads_and_corrects():
    model = ErrorModel(np.diag([25.0, 24.0, 26.0]), np.array([3.0, -2.0, 1.0]), np.array([1e-6, -2e-6, 0.0]))
    a = np.random.default_rng(0).uniform(-100, 100, (50, 3))
    np.testing.assert_allclose(model.correct(model.read(a)), a, rtol=1e-12, atol=1e-9)
    straight = replace(model, quadratic=np.zeros(3))
    np.testing.assert_allclose(straight.read(a), a @ model.sensitivity.T + model.bias)
    bent = model.read(a) - straight.read(a)
    y = a @ model.sensitivity.T
    np.testing.assert_allclose(bent, model.quadratic * y**2, atol=3 * (2e-6) ** 2 * 2.5e3**3)
    np.testing.assert_allclose(
        without_quadratic(model.read(a), model.bias, model.quadratic), straight.read(a), atol=1e-6
    )


@pytest.mark.parametrize("kind", ["triad", "array"])
def test_jacobians_of_the_bent_condition(kind):
    rng = np.random.default_rng(1)
    if kind == "triad":
        condition, biases, own = magnitude_condition(GRAVITY, "x_axis"), np.arange(6, 9), 9
        start = np.concatenate([[1, 0.01, 1, 0.02, 0.01, 1], rng.normal(0, 0.1, 3)])
    else:
        array = AccelerometerArray.load("cube12")
        condition, biases, own = (
            same_specific_force(np.array([c.axes for c in array.chips]), GRAVITY),
            bias_places(4),
            48,
        )
        start = np.concatenate([model.parameters("array") for model in chips_in_gauge(array, rng)])
    bent = with_quadratic(condition, biases)
    x = np.concatenate([start, rng.normal(0, 1e-3, len(biases))])
    readings = rng.normal(0, 5, (4, len(biases)))
    _, a, b = bent(x, readings)
    for column in rng.choice(own + len(biases), 12, replace=False):
        step = 1e-6 * np.eye(len(x))[column]
        slope = (bent(x + step, readings)[0] - bent(x - step, readings)[0]) / 2e-6
        np.testing.assert_allclose(slope, a[:, :, column], rtol=1e-5, atol=1e-5)
    for column in range(0, len(biases), 2):
        step = 1e-6 * np.eye(len(biases))[column]
        slope = (bent(x, readings + step)[0] - bent(x, readings - step)[0]) / 2e-6
        np.testing.assert_allclose(slope, b[:, :, column], rtol=1e-5, atol=1e-5)


def test_the_prior_is_that_of_the_data_sheet():
    cube = AccelerometerArray.load("cube12")
    recording = Recording(np.arange(3.0), np.zeros((3, 12)), cube.channels)
    np.testing.assert_allclose(quadratic_std(recording, cube), 0.005 / 156.9064)
    counts = replace(recording, unit="lsb", metadata={"part": "adxl345"})
    np.testing.assert_allclose(quadratic_std(counts), 0.005 / 156.9064 * 0.038245935)
    assert not quadratic_std(recording).any()  # nobody says what part it is
    assert not quadratic_std(replace(recording, metadata={"part": "no such part"})).any()


def test_straight_axes_have_no_coefficients(triad):
    rng = np.random.default_rng(2)
    observations = simulate(triad, MULTI, rng)
    plain = multi_position(observations, gravity=GRAVITY)
    zero = multi_position(replace(observations, quadratic_std=np.zeros(3)), gravity=GRAVITY)
    np.testing.assert_array_equal(plain.values, zero.values)
    assert not any("_q_" in name for name in plain.names)


def test_bends_are_found_where_the_poses_show_them():
    """Of chips that bend by ten times their noise, the coefficients come out, and the biases with them."""
    cube = AccelerometerArray.load("cube12")
    rng = np.random.default_rng(3)
    models = chips_in_gauge(cube, rng)
    q = rng.normal(0, 3e-4, 12)
    straight = poses_of(cube, models, MULTI, rng, 1e-4)
    y = straight.readings - np.concatenate([model.bias for model in models])
    bent = replace(straight, readings=straight.readings + q * y**2, quadratic_std=np.full(12, 3e-4))
    result = array_static(bent, cube, gravity=GRAVITY)
    found = np.array([result.value(f"{chip.name}_q_{axis}") for chip in cube.chips for axis in "xyz"])
    std = np.array([result.std_of(f"{chip.name}_q_{axis}") for chip in cube.chips for axis in "xyz"])
    assert np.abs((found - q) / std).max() < 4.0
    assert std.max() < 1e-5
    bias = np.concatenate([result.models[chip.name].bias for chip in cube.chips])
    assert np.abs(bias - np.concatenate([model.bias for model in models])).max() < 2e-3
    blind = array_static(replace(bent, quadratic_std=None), cube, gravity=GRAVITY)
    assert blind.statistics["variance_factor"] > 50.0
    assert result.statistics["variance_factor"] < 1.5


@pytest.mark.parametrize(("dof", "kappa"), [(36, 0.0), (36, 10.0), (135, 0.0), (135, 0.3), (135, 3.0), (9, 30.0)])
def test_the_factor_makes_errors_of_unit_variance(dof, kappa):
    rng = np.random.default_rng(4)
    factors = np.array([mean_factor((1 + kappa) * rng.chisquare(dof) / dof, dof) for _ in range(400)])
    assert 0.9 < np.sqrt(np.mean((1 + kappa) / factors)) < 1.1


def test_a_misfit_that_known_errors_explain_leaves_the_noise_as_it_is():
    """Of a misfit of 70 that is expected, the factor leaves little; of one that is not, most."""
    rng = np.random.default_rng(5)
    misfits = 70.0 * rng.chisquare(30, 200) / 30
    assert np.median([mean_factor(misfit, 30, 69.0) for misfit in misfits]) < 4.0
    assert 60.0 < np.median([mean_factor(misfit, 30) for misfit in misfits]) < 80.0
    assert abs(mean_factor(70.0, 30, 10.0) / (mean_factor(70.0, 30) - 10.0) - 1.0) < 0.05


def test_a_factor_learned_elsewhere_is_used():
    assert covariance_scale(1.0, 9, 2.5)[0] == 2.5
    assert covariance_scale(float("nan"), 0)[0] == 1.0
    assert "disagree with the model 3.0 times" in covariance_scale(9.0, 20)[1][0]


@pytest.mark.parametrize("case", [("array", "cube12", None), ("six-position", "cube12", 12)])
def test_standard_deviations_hold_on_simulated_parts(study, case):
    """A few runs of docs/scripts/calibration_consistency.py: without the bend in the model, biases are 2 to 3 σ off."""
    method, name, parameters = case
    poses = study.Poses.of(AccelerometerArray.load(name), "faces" if method == "six-position" else "faces_edges")
    errors = study.normalised_errors(method, poses, parameters, 6, seed=7)
    for kind, limit in (("M", 0.15), ("b", 0.3), ("q", 0.3)):  # 6 runs of 36, 12 and 12
        assert np.sqrt(np.mean(errors[kind] ** 2)) == pytest.approx(1.0, abs=limit)


@pytest.mark.study
@pytest.mark.parametrize("settings", [SensorSettings(), SensorSettings(bias_instability=0.005)])
def test_standard_deviations_hold_for_every_method(study, settings):
    """300 runs each: RMS of error over standard deviation 1 ± 0.1, also where biases flicker between the rests."""
    for method, name, parameters in study.CASES:
        poses = study.Poses.of(AccelerometerArray.load(name))
        for kind, errors in study.normalised_errors(method, poses, parameters, 300, settings).items():
            if settings.bias_instability and kind == "b":
                continue  # the truth of a flickering bias is that of no moment
            assert np.sqrt(np.mean(errors**2)) == pytest.approx(1.0, abs=0.1), (method, name, kind)
