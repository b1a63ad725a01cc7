"""Attitude, velocity, position, angle, α and p in the state of the filter: right, and as uncertain as they say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rate_worlds import GRAVITY, cube, sensor_errors, smooth_step, total_noise_std
from scipy.spatial.transform import Rotation

from gfimu import (
    AccelerometerArray,
    calibrate_array,
    estimate,
    estimate_rate,
    integrate_attitude,
    level,
    read_mimu4444,
)  # fmt: skip
from gfimu.rate import PathStart

RATE = 100.0
CUBE = cube()
GAIN, BIAS = 0.01, 0.3


class World:
    """A body that rests for 2 s and then tumbles, turns on a table or comes to rest again; what it reads."""

    def __init__(self, name, seed, kind="uncalibrated", *, noise=1.0, duration=12.0, size=2.5):
        rng = np.random.default_rng([seed, len(name)])
        fine = np.arange(round(1000 * duration)) / 1000.0
        rise, _ = smooth_step(fine, 2.0, 4.0)
        fall, _ = smooth_step(fine, 6.0, 8.0)
        omega, force = np.zeros((2, len(fine), 3))
        if name == "table":
            omega[:, 2] = rise * (3.0 + 2.5 * np.sin(rng.uniform(0.7, 1.0) * fine + rng.uniform(0, 6)))
        else:
            for axis in range(3):
                omega[:, axis] = sum(size * rng.normal() * np.sin(rng.uniform(0.5, 4) * fine) for _ in range(3))
                force[:, axis] = rise * 2.0 * rng.normal() * np.sin(rng.uniform(1, 6) * fine)
            omega *= rise[:, None]
        if name == "stop":
            omega, force = omega * (1.0 - fall[:, None]), 0.0 * force
        alpha = np.gradient(omega, 1e-3, axis=0)
        turned = Rotation.from_quat(integrate_attitude(fine, omega, alpha)[:, [1, 2, 3, 0]])
        first = Rotation.identity() if name == "table" else Rotation.from_rotvec(0.5 * rng.normal(size=3))
        upright = level(first.inv().apply([0.0, 0.0, GRAVITY]))
        attitude = Rotation.from_quat(upright[[1, 2, 3, 0]]) * turned
        p = attitude.inv().apply(force + np.array([0.0, 0.0, GRAVITY]))
        velocity = _sum(force)
        every = slice(None, None, 10)
        self.t, self.omega, self.alpha, self.p = fine[every], omega[every], alpha[every], p[every]
        self.attitude, self.velocity, self.position = attitude[every], velocity[every], _sum(velocity)[every]
        self.angle = _sum(omega[:, 2:])[every, 0]
        columns = []
        for chip in CUBE.chips:
            w = self.omega
            there = self.p + np.cross(self.alpha, chip.position) + np.cross(w, np.cross(w, chip.position))
            for axis in chip.axes:
                tilt = GAIN * rng.normal(size=3)
                seen = axis * (1.0 + GAIN * rng.normal()) + tilt - axis * (tilt @ axis)
                columns.append(there @ (seen if kind == "uncalibrated" else axis))
        bias = BIAS if kind == "uncalibrated" else 0.01
        white = noise * total_noise_std(CUBE, RATE) * rng.normal(size=(len(self.t), 12))
        self.readings = np.column_stack(columns) + (noise > 0) * bias * rng.normal(size=12) + white
        stated = {"scale_std": GAIN, "axis_std": GAIN} if kind == "uncalibrated" else {}
        errors = replace(sensor_errors(CUBE, RATE), bias_std=np.full(12, bias), full_range=None, stuck_after=0)
        self.errors = replace(errors, **stated)

    def estimate(self, method):
        return estimate_rate(CUBE, self.t, self.readings, self.errors, method=method, path=PathStart())

    def scores(self, found):
        """Errors over their standard deviations, by output."""
        path = found.path
        turn = (Rotation.from_quat(path.quaternion[:, [1, 2, 3, 0]]) * self.attitude.inv()).as_rotvec()
        return {
            "tilt": (turn / np.maximum(path.attitude_std, 1e-12))[:, :2],
            "velocity": (path.velocity - self.velocity) / np.maximum(path.velocity_std, 1e-12),
            "position": (path.position - self.position) / np.maximum(path.position_std, 1e-12),
            "angle": ((path.angle - self.angle) / np.maximum(path.angle_std, 1e-12))[:, None],
            "alpha": (path.alpha - self.alpha) / path.alpha_std,
            "p": (path.p - self.p) / path.p_std,
        }


def _sum(values):
    return np.vstack([np.zeros(values.shape[1]), np.cumsum(0.5e-3 * (values[1:] + values[:-1]), axis=0)])


CELLS = [("filter", "tumble"), ("smoother", "stop"), ("integrate", "table"), ("ml", "tumble")]
STUDY = [(method, name) for method in ("integrate", "ml", "filter", "smoother") for name in ("table", "tumble", "stop")]


def cells():
    for kind in ("ideal", "uncalibrated"):
        for method, name in STUDY:
            marks = () if (method, name) in CELLS else pytest.mark.study
            yield pytest.param(method, name, kind, marks=marks, id=f"{method}-{name}-{kind}")


@pytest.mark.parametrize(("method", "name", "kind"), cells())
def test_every_output_is_as_uncertain_as_it_says(method, name, kind):
    runs, squares = 10, {}
    for seed in range(runs):
        world = World(name, seed, kind)
        for output, score in world.scores(world.estimate(method)).items():
            squares.setdefault(output, []).append(np.nanmean(score[100:] ** 2))
    size = {output: float(np.sqrt(np.mean(values))) for output, values in squares.items()}
    # α and p of 1100 samples are nearly independent. The others are integrals of noise: ten runs of three axes are some
    # 20 independent squares, whose root mean has a standard deviation of 16 %, and 10 of the angle, 22 %; three of them
    # are allowed.
    limits = {"alpha": (0.8, 1.2), "p": (0.6, 1.4), "angle": (0.3, 1.7)}
    for output, value in size.items():
        low, high = limits.get(output, (0.5, 1.5))
        assert low < value < high, f"{output}: {value:.2f} of {size}"


@pytest.mark.parametrize("method", ["integrate", "filter", "smoother"])
def test_without_noise_the_path_is_the_true_one(method):
    world = World("tumble", 3, "ideal", noise=0.0)
    path = world.estimate(method).path
    turn = (Rotation.from_quat(path.quaternion[:, [1, 2, 3, 0]]) * world.attitude.inv()).as_rotvec()
    # At 100 Hz α up to 30 rad/s² changes within some tenths of a second: the stencils leave parts in 10⁴ of the motion.
    assert np.abs(turn).max() < 2e-3
    assert_allclose(path.velocity, world.velocity, atol=0.05)
    assert_allclose(path.position, world.position, atol=0.2)
    assert_allclose(path.angle, world.angle, atol=2e-3)


def test_rest_stops_and_levels_the_body():
    world = World("stop", 1, "ideal", duration=14.0)
    path = world.estimate("filter").path
    # The rest that begins at 8 s counts from 12 s on, as rest after a motion takes four seconds.
    turn = (Rotation.from_quat(path.quaternion[:, [1, 2, 3, 0]]) * world.attitude.inv()).as_rotvec()
    assert np.abs(turn[-1, :2]).max() < 5e-3 < path.attitude_std[1150, :2].max()
    assert np.abs(path.velocity[-1]).max() < 5e-3 < path.velocity_std[1150, :2].max()
    smoothed = world.estimate("smoother").path
    assert smoothed.position_std[1000].max() < 0.5 * path.position_std[1000].max()


def test_a_tilt_that_is_lost_is_found_anew_at_rest():
    world = World("stop", 2, "ideal", noise=8.0, duration=20.0)
    errors = replace(world.errors, noise_std=8.0 * world.errors.noise_std)
    found = estimate_rate(CUBE, world.t, world.readings, errors, method="filter", path=PathStart())
    tilt = found.path.attitude_std[:, :2].max(axis=1)
    assert tilt[1100] > 0.3
    assert tilt[-1] < 0.05
    turn = (Rotation.from_quat(found.path.quaternion[:, [1, 2, 3, 0]]) * world.attitude.inv()).as_rotvec()
    assert np.abs(turn[-1, :2]).max() < 4.0 * tilt[-1]


@pytest.mark.filterwarnings("ignore:.*positions by up to")
@pytest.mark.parametrize(("method", "least"), [("filter", 0.85), ("smoother", 0.93)])
def test_a_recorded_attitude_is_as_uncertain_as_it_says(method, least, shared_data):
    """Both recordings of the MIMU4444, calibrated by each other, against its gyros, whose bias at rest is taken off."""
    squares, within = [], []
    drawn = AccelerometerArray.load("mimu4444")
    runs = [read_mimu4444(shared_data / "mimu4444" / f"exp_{number}.bin.gz") for number in (1, 2)]
    for raw, other in (runs, runs[::-1]):
        calibration = calibrate_array(other, drawn, gravity=9.81)
        array, run = calibration.calibrated_array(drawn), calibration.apply(raw)
        gyro = np.column_stack([run.reference[f"gyro_{axis}_rad_s"] for axis in "xyz"])
        known = np.isfinite(gyro).all(axis=1)
        rate = np.column_stack([np.interp(run.t_s - 1.5e-3, run.t_s[known], gyro[known, axis]) for axis in range(3)])
        rate -= np.median(rate[np.linalg.norm(rate, axis=1) < 0.07], axis=0)
        for start in range(0, len(run.t_s) - 1250, 6 * 1250):
            part = run.slice(start, start + 1250)
            found = estimate(part, array, method=method)
            turned = Rotation.from_quat(integrate_attitude(part.t_s, rate[start : start + 1250])[:, [1, 2, 3, 0]])
            here = Rotation.from_quat(found.quaternion[:, [1, 2, 3, 0]])
            error = (here[30] * turned[30].inv() * turned * here.inv()).as_rotvec()[90:]
            score = error / np.hypot(found.attitude_std[90:], found.attitude_std[30])
            squares.append(np.median(np.abs(score)) / 0.6745)
            within.append(np.mean(np.abs(score) < 3.0))
    # The filter's median is 1.5 in windows whose start moves; the smoother's below 1.
    assert 0.4 < np.median(squares) < 1.8
    assert np.mean(within) > least
