"""Errors of gains, axes, places and mounting: patterns by differences, σ that holds, gains that are learnt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rate_worlds import GRAVITY, cube, sensor_errors, smooth_step, total_noise_std
from scipy.spatial.transform import Rotation

import gfimu
from gfimu import AccelerometerArray, InputError, SensorErrors, estimate_rate
from gfimu.array import omega_products
from gfimu.rate import ChannelErrors, features_of

RATE = 100.0
CUBE = cube()
GAIN, AXIS, TURN = 0.01, 0.01, 0.004


def motion(name, rng, size, duration=12.0):
    """Rest for 2 s, then a table, or a tumble about all axes under gravity; or a spin from the first sample on."""
    t = np.arange(round(duration * 1000)) / 1000
    omega = np.zeros((len(t), 3))
    rise, _ = smooth_step(t, 2.0, 4.0)
    if name == "table":
        omega[:, 2] = rise * (3.0 + 2.5 * np.sin(rng.uniform(0.7, 1.0) * t + rng.uniform(0, 6)))
    elif name == "tumble":
        for axis in range(3):
            omega[:, axis] = rise * sum(size * rng.normal() * np.sin(rng.uniform(0.5, 4) * t) for _ in range(3))
    else:
        omega[:] = rng.normal([0.0, 0.0, 9.0])
    alpha = np.gradient(omega, 1e-3, axis=0)
    t, omega, alpha = t[::10], omega[::10], alpha[::10]
    attitude = Rotation.identity() if name == "table" else Rotation.from_rotvec(rng.normal(size=3))
    p = np.empty((len(t), 3))
    for k in range(len(t)):
        p[k] = attitude.inv().apply([0.0, 0.0, GRAVITY])
        attitude = attitude * Rotation.from_rotvec(omega[k] / RATE)
    return t, omega, alpha, p


def force(place, omega, alpha, p):
    return p + np.cross(alpha, place) + np.cross(omega, np.cross(omega, place))


def run(kind, name, seed, size=2.5):
    """Readings of a cube that is ideal, calibrated but turned as a whole, or uncalibrated; and what is stated of it."""
    rng = np.random.default_rng([seed, len(name)])
    t, omega, alpha, p = motion(name, rng, size)
    turn = TURN * rng.normal(size=3) if kind == "calibrated" else np.zeros(3)
    columns = []
    for chip in CUBE.chips:
        there = force(chip.position, omega, alpha, p)
        for axis in chip.axes:
            seen = axis + np.cross(turn, axis)
            if kind == "uncalibrated":
                tilt = AXIS * rng.normal(size=3)
                seen = axis * (1.0 + GAIN * rng.normal()) + tilt - axis * (tilt @ axis)
            columns.append(there @ seen)
    bias = 0.3 if kind == "uncalibrated" else 0.01
    noise = total_noise_std(CUBE, RATE)
    values = np.column_stack(columns) + bias * rng.normal(size=12) + noise * rng.normal(size=(len(t), 12))
    errors = replace(sensor_errors(CUBE, RATE), bias_std=np.full(12, bias), full_range=None, stuck_after=0)
    stated = {"uncalibrated": {"scale_std": GAIN, "axis_std": AXIS}, "calibrated": {"rotation_std": TURN}}
    return t, omega, values, replace(errors, **stated.get(kind, {}))


@pytest.mark.parametrize("field", ["scale_std", "axis_std", "rotation_std", "placement_std"])
def test_patterns_are_the_differences_of_the_readings(field):
    rng = np.random.default_rng(2)
    array = AccelerometerArray.load("mimu4444")
    omega, alpha, p = rng.normal(size=(3, 5, 3))
    features = np.hstack([alpha, p, omega_products(omega)])
    errors = SensorErrors.uniform(array, 0.03, **{field: 1e-3})
    patterns = ChannelErrors.stated(array, errors).patterns
    expected = []
    for chip in array.chips:
        for axis in chip.axes:
            there = force(chip.position, omega, alpha, p)
            moved = [force(chip.position + 1e-3 * e, omega, alpha, p) @ axis for e in np.eye(3)]
            expected.append(
                {
                    "scale_std": (1e-3 * there @ axis) ** 2,
                    "axis_std": 1e-6 * (np.sum(there**2, axis=1) - (there @ axis) ** 2),
                    "rotation_std": 1e-6 * (np.sum(there**2, axis=1) - (there @ axis) ** 2),
                    "placement_std": np.sum([(one - there @ axis) ** 2 for one in moved], axis=0),
                }[field]
            )
    squares = np.sum((patterns @ features.T) ** 2, axis=0)  # (c, 5)
    assert_allclose(squares, expected, rtol=1e-9)


def test_features_are_those_of_the_motion():
    rng = np.random.default_rng(3)
    omega, alpha, p = rng.normal(size=(3, 5, 3))
    values = np.hstack([force(chip.position, omega, alpha, p) @ chip.axes.T for chip in CUBE.chips])
    for gone in ([], [4]):
        present = ~np.isin(np.arange(12), gone)
        found = features_of(CUBE, values, present)
        if not gone:
            assert_allclose(found, np.hstack([alpha, p, omega_products(omega)]), atol=1e-10)
        assert found.shape == (5, 12)


def normalised(kind, name, method, runs):
    """Root mean square error over σ, and the share within 1.96 σ; a spin's sign left out."""
    squares, within = [], []
    for seed in range(runs):
        t, omega, values, errors = run(kind, name, seed)
        found = estimate_rate(CUBE, t, values, errors, method=method)
        side = np.sign(np.sum(found.omega * omega, axis=1, keepdims=True)) if name == "spin" else 1.0
        error = ((side * found.omega - omega) / found.std)[60:]
        known = np.isfinite(error).all(axis=1)
        squares.append(np.mean(error[known] ** 2))
        within.append(np.mean(np.abs(error[known]) < 1.96))
    return float(np.sqrt(np.mean(squares))), float(np.mean(within))


@pytest.mark.study(but=[
    "table-calibrated-filter", "tumble-uncalibrated-filter", "tumble-uncalibrated-smoother", "spin-uncalibrated-filter",
    "tumble-uncalibrated-ml", "table-uncalibrated-integrate",
])  # fmt: skip
@pytest.mark.parametrize("method", ["integrate", "ml", "filter", "smoother"])
@pytest.mark.parametrize("kind", ["ideal", "calibrated", "uncalibrated"])
@pytest.mark.parametrize("name", ["table", "tumble", "spin"])
def test_the_standard_deviation_carries_the_errors_of_the_channels(name, kind, method):
    if name == "spin" and method == "integrate":
        pytest.skip("the sign of a spin decides its error")
    size, within = normalised(kind, name, method, 12)
    # Errors of a run are of one draw of constants: 12 runs of some three each give 1 within 3/√(2·36).
    assert 0.65 < size < 1.35
    assert within > 0.88


def test_without_the_common_turn_a_calibrated_cube_is_too_sure():
    t, omega, values, errors = run("calibrated", "tumble", 0, size=9.0)
    sizes = [
        np.sqrt(np.mean(((found.omega - omega) / found.std)[60:] ** 2))
        for stated in (errors, replace(errors, rotation_std=0.0))
        for found in [estimate_rate(CUBE, t, values, stated, method="filter")]
    ]
    assert sizes[0] < 1.3
    assert sizes[1] > 1.3 * sizes[0]


def test_a_motion_about_all_axes_shows_the_gains():
    t, omega, values, errors = run("uncalibrated", "tumble", 1)
    found = estimate_rate(CUBE, t, values, errors, method="smoother")
    plain = estimate_rate(CUBE, t, values, replace(errors, scale_std=0.0, axis_std=0.0), method="smoother")
    assert np.sqrt(np.mean((found.omega - omega) ** 2)) < 0.3 * np.sqrt(np.mean((plain.omega - omega) ** 2))


def test_the_errors_of_a_recording_are_those_that_its_calibration_left():
    poses = gfimu.simulate("calibration_poses", seed=2)
    calibration = gfimu.calibrate("array", poses)
    array = poses.array
    raw, after = (
        SensorErrors.of_recording(array, one.metadata, RATE) for one in (poses, calibration.apply(poses))
    )  # fmt: skip
    sheet = SensorErrors.from_parts(array, RATE)
    assert (raw.scale_std, raw.rotation_std) == (0.01, 0.0)
    assert_allclose(raw.bias_std, sheet.bias_std)
    assert 0.0 < after.scale_std < 1e-3
    assert 0.0 < after.axis_std < 1e-3
    assert after.rotation_std == pytest.approx(np.sqrt(0.0017453293**2 + 0.01**2 / 2) / 2)  # four chips
    assert np.all(after.bias_std < 0.1 * sheet.bias_std)


@pytest.mark.parametrize("left", [{"scale": -1.0}, {"axis_rad": "wide"}, {"placement_m": 1e30}])
def test_metadata_that_state_no_errors_are_refused(left):
    metadata = {"bias_std_m_s2": dict.fromkeys(CUBE.channels, 0.01), "calibration_std": left}
    with pytest.raises(InputError, match="calibration_std"):
        SensorErrors.of_recording(AccelerometerArray.load("cube12"), metadata, RATE)
