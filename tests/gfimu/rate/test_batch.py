"""The adjustment of a whole run against a dense least-squares solution, and what references add to it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from path_worlds import World
from rate_worlds import cube, measure, noise_std, readings, sensor_errors, tumble

import gfimu
from gfimu import AccelerometerArray, InputError, SensorErrors, estimate_rate
from gfimu.rate import FilterSettings, Reference, ReferencePolicy

CUBE = cube()
RATE = 100.0
SPREAD = AccelerometerArray(
    "spread",
    tuple(
        replace(chip, position=chip.position + np.array([0.011 * k, -0.007 * k * k, 0.004]))
        for k, chip in enumerate(CUBE.chips)
    ),
    CUBE.length_unit,
)
BIAS_STD = 0.05  # m/s²
START_STD = 0.05  # rad/s
TRAPEZOID = FilterSettings(np.zeros(3), START_STD, quadrature="trapezoid", rest=None, measure_noise=False)


class Oracle:
    """Every reading of a run as a function of ω at its start, of α and p at each sample, and of biases: solved densely.

    ω is the trapezoidal integral of α. Nothing is reduced: no null space, no filter.
    """

    def __init__(self, array, t, values, noise, start, tacho=None):
        self.array, self.t, self.values, self.noise, self.start, self.tacho = array, t, values, noise, start, tacho
        n, c = values.shape
        step = np.full((n, n), 0.0)
        for k in range(1, n):
            step[k] = step[k - 1]
            step[k, k - 1 : k + 1] += 0.5 * (t[k] - t[k - 1])
        self.integral = step  # (n, n)
        self.size = 3 + 6 * n + c + 2

    def parts(self, x):
        n, c = self.values.shape
        alpha, p = x[3 : 3 + 3 * n].reshape(n, 3), x[3 + 3 * n : 3 + 6 * n].reshape(n, 3)
        return x[:3] + self.integral @ alpha, alpha, p, x[3 + 6 * n : 3 + 6 * n + c], x[-2:]

    def system(self, x):
        """Residuals over their standard deviations, and their slopes."""
        n, c = self.values.shape
        omega, alpha, p, bias, (gain, delay) = self.parts(x)
        of_omega = np.zeros((3 * n, self.size))  # ω of all samples
        of_omega[:, :3] = np.tile(np.eye(3), (n, 1))
        of_omega[:, 3 : 3 + 3 * n] = np.kron(self.integral, np.eye(3))
        residuals, slopes = [], []
        for channel in range(c):
            chip = self.array.chip_of_channel[channel]
            r, axis = self.array.chips[chip].position, np.eye(3)[channel % 3]
            model = p + np.cross(alpha, r) + np.cross(omega, np.cross(omega, r))
            slope = np.zeros((n, self.size))
            for k in range(n):
                turning = omega[k] @ r * np.eye(3) + np.outer(omega[k], r) - 2 * np.outer(r, omega[k])
                slope[k] = axis @ turning @ of_omega[3 * k : 3 * k + 3]
                slope[k, 3 + 3 * k : 6 + 3 * k] += np.cross(r, axis)
                slope[k, 3 + 3 * n + 3 * k : 6 + 3 * n + 3 * k] += axis
            slope[:, 3 + 6 * n + channel] = 1.0
            residuals.append((self.values[:, channel] - model @ axis - bias[channel]) / self.noise[channel])
            slopes.append(slope / self.noise[channel])
        priors = np.zeros((3 + c + 2, self.size))
        priors[range(3), range(3)] = 1 / START_STD
        priors[range(3, 3 + c), range(3 + 6 * n, 3 + 6 * n + c)] = 1 / BIAS_STD
        policy = ReferencePolicy()
        priors[-2, -2], priors[-1, -1] = 1 / policy.gain_std, 1 / policy.delay_std_s
        residuals.append(-priors @ (x - np.r_[self.start, np.zeros(self.size - 3)]))
        slopes.append(priors)
        if self.tacho is not None:
            values, std = self.tacho
            slope = of_omega[2::3] * (1 + gain)
            slope[range(n), 3 + 3 * np.arange(n) + 2] += delay
            slope[:, -2], slope[:, -1] = omega[:, 2], alpha[:, 2]
            residuals.append((values - omega[:, 2] * (1 + gain) - delay * alpha[:, 2]) / std)
            slopes.append(slope / std)
        return np.concatenate(residuals), np.vstack(slopes), of_omega

    def solve(self, omega):
        """ω (n, 3) of the most probable run, and its standard deviations, from rates near it."""
        n = len(self.t)
        x = np.zeros(self.size)
        x[:3] = omega[0]
        x[3 : 3 + 3 * n] = np.gradient(omega, self.t, axis=0).ravel()
        for _ in range(20):
            residual, slope, of_omega = self.system(x)
            change = np.linalg.lstsq(slope, residual, rcond=None)[0]
            x += change
            if np.abs(of_omega @ change).max() < 1e-9:
                break
        covariance = np.linalg.inv(slope.T @ slope)
        spread = np.sqrt(np.einsum("ij,jk,ik->i", of_omega, covariance, of_omega))
        return self.parts(x)[0], spread.reshape(n, 3)


def piece(array, *, first=450, count=60, seed=1):
    """A stretch of a tumble, with noise, biases and a rate at its start that is known to START_STD."""
    rng = np.random.default_rng(seed)
    motion = tumble(RATE, 12.0, duration=8.0)
    rows = slice(first, first + count)
    noise = noise_std(array, RATE)
    values = readings(array, motion)[rows] + BIAS_STD * rng.standard_normal(12)
    values = values + noise * rng.standard_normal(values.shape)
    start = motion.omega[first] + START_STD * rng.standard_normal(3)
    return motion.t[rows], motion.omega[rows], values, noise, start, rng


@pytest.mark.parametrize("array", [CUBE, SPREAD], ids=["cube", "spread"])
@pytest.mark.parametrize("with_tacho", [False, True], ids=["alone", "tacho"])
def test_batch_is_the_dense_least_squares_solution(array, with_tacho):
    t, omega, values, noise, start, rng = piece(array)
    errors = SensorErrors.uniform(array, noise, BIAS_STD)
    tacho, references = None, []
    if with_tacho:
        shown = 1.01 * omega[:, 2] + 0.02 * rng.standard_normal(len(t))
        tacho = shown, 0.02
        references = [Reference.tachometer([0.0, 0.0, 1.0], 0.02).measured(shown[:, None], len(t))]
    settings = replace(TRAPEZOID, start_omega=start)
    found = estimate_rate(array, t, values, errors, method="batch", settings=settings, references=references)
    np.testing.assert_allclose(found.scale, 1.0)
    best, std = Oracle(array, t, values, noise, start, tacho).solve(omega)
    # At the first sample the filter takes the noise of α for independent of that of the null space; about rates given
    # it uses nearly all of what they share. The cube shares little.
    assert np.sqrt(np.mean(np.square((found.omega - best) / std))) < (0.015 if array is CUBE else 0.04)
    assert np.abs((found.omega - best) / std).max() < 0.15
    np.testing.assert_allclose(found.std, std, rtol=0.02)


def worlds(name, kind="uncalibrated", count=4):
    return [World(name, seed, kind) for seed in range(count)]


def sizes(scores):
    """Root mean square of normalised errors over several runs, by output."""
    return {name: np.sqrt(np.mean([np.nanmean(one[name][100:] ** 2) for one in scores])) for name in scores[0]}


def test_a_tachometer_and_a_fixed_axis_bring_the_rate_of_a_table_to_theirs():
    """The tachometer reads 1 % too much and 8 ms late; both are found, and the uncertainty says what is left."""
    tacho, axis = Reference.tachometer([0.0, 0.0, 1.0], 0.01), Reference.fixed_axis([0.0, 0.0, 1.0])
    alone, with_both, scores = [], [], []
    for seed, world in enumerate(worlds("table")):
        rate = 1.01 * np.interp(world.t - 0.008, world.t, world.omega[:, 2])
        rate += 0.01 * np.random.default_rng(seed).standard_normal(len(rate))
        found = world.estimate("batch", [(tacho, rate[:, None]), (axis, np.zeros((len(rate), 2)))])
        alone.append((world.estimate("batch").omega - world.omega)[300:])
        with_both.append((found.omega - world.omega)[300:])
        scores.append(world.scores(found) | {"omega": (found.omega - world.omega) / found.std})
    assert np.sqrt(np.mean(np.square(with_both))) < 0.6 * np.sqrt(np.mean(np.square(alone)))
    # Four runs, whose errors are constants for the most part, gains and delays: χ² of 4 to 12 degrees of freedom.
    for output, size in sizes(scores).items():
        assert 0.3 < size < 1.7, (output, size)


def test_an_encoder_bounds_the_angle_and_fixes_bound_the_position():
    encoder, fixes = Reference.encoder(1e-3), Reference.position(0.01)
    rng = np.random.default_rng(3)
    for method in ("filter", "batch"):
        angles, positions = [], []
        for world in worlds("table"):
            angle = (world.angle + 1e-3 * rng.standard_normal(len(world.t)))[:, None]
            angles.append(found := world.estimate(method, [(encoder, angle - angle[0])]))
            assert np.sqrt(np.mean(world.scores(found)["angle"] ** 2)) < 1.7
        for world in worlds("tumble"):
            position = world.position + 0.01 * rng.standard_normal(world.position.shape)
            position[np.arange(len(position)) % 20 > 0] = np.nan  # five a second
            positions.append(found := world.estimate(method, [(fixes, position - position[0])]))
            for output in ("position", "velocity", "tilt"):
                assert np.sqrt(np.mean(world.scores(found)[output][100:] ** 2)) < 2.0, output
        assert max(found.path.angle_std.max() for found in angles) < 0.2
        assert max(found.path.position_std.max() for found in positions) < 0.2


@pytest.mark.parametrize("method", ["filter", "smoother", "batch"])
def test_a_tachometer_tells_the_sign_of_a_spin_from_the_first_sample(method):
    world = World("table", 2)
    rows = slice(500, None)
    t, values, omega = world.t[rows], world.readings[rows], world.omega[rows]
    for sign, read, turned in ((1.0, values, omega), (-1.0, values[::-1], -omega[::-1])):  # backwards in time
        tacho = Reference.tachometer([0.0, 0.0, 1.0], 0.01).measured(turned[:, 2:], len(t))
        found = estimate_rate(CUBE, t, read, world.errors, method=method, references=[tacho])
        assert found.sign.state == "known"
        assert np.all(sign * found.omega[:, 2] > 0.0)


RUN = gfimu.simulate("paper_run", seed=3)


def test_references_of_a_recording_by_name():
    truth = RUN.reference["command_rad_s"]  # which the table follows
    found = {
        name: gfimu.estimate(RUN, method="batch", rest_bias=True, use=use)
        for name, use in (("alone", []), ("angle", ["angle"]), ("tacho and axis", ["tacho", "axis"]))
    }
    error = {name: np.sqrt(np.mean((one.omega[:, 2] - truth) ** 2)) for name, one in found.items()}
    assert error["angle"] < 0.3 * error["alone"]
    assert np.median(found["tacho and axis"].omega_std[:, 2]) < 0.5 * np.median(found["alone"].omega_std[:, 2])
    assert np.abs(found["tacho and axis"].omega[:, :2]).max() < np.abs(found["alone"].omega[:, :2]).max()


def test_an_encoder_whose_first_values_are_missing_has_an_unknown_offset():
    """From 12 s on: the angle since the first sample stays as uncertain as without it, and the rate does not."""
    angle = RUN.reference["angle_rad"].copy()
    angle[:1200] = np.nan
    late = replace(RUN, reference={**RUN.reference, "angle_rad": angle})
    alone, found = (gfimu.estimate(late, method="batch", rest_bias=True, use=use) for use in ([], ["angle"]))
    error = np.abs(found.angle - RUN.reference["angle_rad"] + RUN.reference["angle_rad"][0])
    assert np.all(error[1200:] < 4.0 * found.angle_std[1200:])
    assert found.angle_std[1200] > 0.3 * alone.angle_std[1200]
    assert found.omega_std[2000, 2] < 0.7 * alone.omega_std[2000, 2]


def test_batch_beats_the_smoother_where_alpha_and_null_space_share_noise():
    """An irregular array in a tumble: over two runs the error is 8 % smaller."""
    squares = {"smoother": [], "batch": []}
    motion = tumble(RATE, 12.0, duration=12.0)
    for seed in range(2):
        values = measure(SPREAD, motion, np.random.default_rng(seed))
        for method, found in squares.items():
            omega = estimate_rate(SPREAD, motion.t, values, sensor_errors(SPREAD, RATE), method=method).omega
            found.append(np.mean((omega - motion.omega)[300:] ** 2))
    assert np.sqrt(np.mean(squares["batch"]) / np.mean(squares["smoother"])) < 0.97


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"use": ["sextant"]}, "unknown reference 'sextant'; valid: angle, axis, gyro, position, tacho"),
        ({"use": ["position"]}, "the recording has no position_x_m, position_y_m, position_z_m; record them"),
        ({"use": ["tacho"], "method": "ml"}, "method 'ml' can't use tacho; use filter, smoother or batch"),
        ({"use": ["tacho"], "axis": "z"}, "--use has no use with --axis"),
    ],
)
def test_what_can_not_be_used_is_one_line_before_anything_is_compiled(monkeypatch, options, words):
    monkeypatch.setattr("gfimu.motion.estimation.watched_readings", None)
    with pytest.raises(InputError, match=words):
        gfimu.estimate(RUN, **{"method": "batch", **options})


def test_values_of_another_shape_are_refused():
    with pytest.raises(InputError, match=r"^gyro has shape \(5, 2\); 5 times need \(5, 3\)$"):
        Reference.gyro(SensorErrors.uniform(CUBE, np.ones(12), 1.0)).measured(np.zeros((5, 2)), 5)
