"""Attitude, velocity, position, angle, α and p in the state of the filter: right, and as uncertain as they say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from path_worlds import CUBE, World
from scipy.spatial.transform import Rotation

from gfimu import (
    AccelerometerArray,
    calibrate_array,
    estimate,
    estimate_rate,
    integrate_attitude,
    read_mimu4444,
)  # fmt: skip
from gfimu.rate import PathStart

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
