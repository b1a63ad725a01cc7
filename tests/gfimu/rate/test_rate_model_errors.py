"""Scale-factor and placement errors that the filter was told of, and acceleration that is sampled too coarsely."""

from __future__ import annotations

import numpy as np
import pytest
from rate_worlds import cube, measure, readings, rms, sensor_errors, tumble, turntable

from gfimu.rate import filter_rate, smooth_rate

RATE = 100.0
RUNS = 6


def displaced(array, rng, std):
    moved = array.chip_positions + std * rng.standard_normal(array.chip_positions.shape)
    return array.with_geometry(moved, [chip.axes for chip in array.chips])


@pytest.mark.study(
    only=["tumble-8-0.001-placement", "tumble-8-0.001-scale", "tumble-8-0.01-placement", "tumble-8-0.01-scale"]
)
@pytest.mark.parametrize("kind", ["scale", "placement"])
@pytest.mark.parametrize("size", [1e-3, 1e-2])
@pytest.mark.parametrize(("world", "speed"), [(turntable, 1), (turntable, 10), (tumble, 8)])
def test_truth_stays_within_three_sigma_and_beats_the_naive_filter(kind, size, world, speed):
    array, motion = cube(), world(RATE, 2 * np.pi * speed)
    rows = motion.t > 0.6
    told = {"scale_std": size} if kind == "scale" else {"placement_std": size * array.length_unit}
    aware, naive, inside = [], [], []
    for run in range(RUNS):
        rng = np.random.default_rng([7, run])
        world_array = displaced(array, rng, size * array.length_unit) if kind == "placement" else array
        values = measure(world_array, motion, rng, scale=size if kind == "scale" else 0.0)
        found = filter_rate(array, motion.t, values, sensor_errors(array, RATE, **told))
        plain = filter_rate(array, motion.t, values, sensor_errors(array, RATE))
        aware.append((found.omega - motion.omega)[rows])
        assert np.isfinite(found.omega).all()
        naive.append((plain.omega - motion.omega)[rows])
        inside.append(np.abs(aware[-1]) < 3 * found.std[rows])
    assert np.mean(inside) > 0.98
    # A filter that is not given the errors finds its innovations too large, so that it is hardly worse by now.
    dominate = world is turntable and speed == 10
    assert rms(aware) < (1.0 if dominate else 1.5) * rms(np.concatenate(naive))


def test_undersampled_acceleration_widens_the_uncertainty():
    """Shaking far above half the sample rate: α changes by itself between samples, and the filter notices."""
    rng = np.random.default_rng(0)
    array, motion = cube(), tumble(RATE, 2 * np.pi)
    shaken = motion.alpha + 20.0 * rng.standard_normal(motion.alpha.shape)
    motion_seen = type(motion)(motion.t, motion.omega, shaken, motion.p)
    rows = motion.t > 6
    error = {}
    for solve in (filter_rate, smooth_rate):
        found = solve(array, motion.t, measure(array, motion_seen, rng), sensor_errors(array, RATE))
        calm = solve(array, motion.t, measure(array, motion, rng), sensor_errors(array, RATE))
        error[solve] = np.mean(((found.omega - motion.omega)[rows] / found.std[rows]) ** 2)
        assert found.std[rows].mean() > 1.5 * calm.std[rows].mean()
        assert error[solve] < 6


@pytest.mark.study
def test_timing_errors_widen_the_uncertainty():
    array, fine = cube(), tumble(10_000.0, 2 * np.pi * 3, duration=10.0)
    rng = np.random.default_rng(1)
    place = np.arange(200, len(fine.t) - 200, 100)
    ideal = readings(array, fine)
    late = np.clip(place[:, None] + rng.normal(0, 20, (len(place), 12)).round().astype(int), 0, len(fine.t) - 1)
    errors = sensor_errors(array, RATE)
    values = ideal[late, np.arange(12)] + errors.noise_std * rng.standard_normal((len(place), 12))
    rows = fine.t[place] > 6
    told = filter_rate(array, fine.t[place], values, sensor_errors(array, RATE, timing_std=2e-3))
    untold = filter_rate(array, fine.t[place], values, errors)
    square = {
        name: np.mean(((found.omega - fine.omega[place])[rows] / found.std[rows]) ** 2)
        for name, found in (("told", told), ("untold", untold))
    }
    assert square["told"] < 3 < square["untold"]
