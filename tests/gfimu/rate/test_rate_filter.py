"""The compiled filter against a plain numpy loop, live against block, and what a real stream throws at it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rate_worlds import cube, measure, readings, sensor_errors, tumble, turntable

from gfimu import AccelerometerArray, GeometryError, InputError, LiveRateFilter, SensorErrors, estimate_rate
from gfimu.array.quadrature import even_weights
from gfimu.rate import FilterSettings, Reference, filter_rate, smooth_rate
from gfimu.rate.body_rate import follow, smooth_back
from gfimu.rate.channel_sets import ChannelSets
from gfimu.rate.methods import RATE_METHODS
from gfimu.rate.result import joined_estimates

CUBE = cube()
RATE = 100.0
PLAIN = FilterSettings(rest=None)


@pytest.fixture(scope="module")
def run():
    motion = tumble(RATE, 12.0, duration=8.0)
    return motion, measure(CUBE, motion, np.random.default_rng(3)), sensor_errors(CUBE, RATE)


def test_one_compiled_form_serves_all_arrays():
    compiled = None
    for name, gyro in (("cube12", False), ("cube12", True), ("corners8", False), ("mimu4444", False)):
        array = AccelerometerArray.load(name)
        t = np.arange(80) / RATE
        for solve in (filter_rate, smooth_rate):
            errors = SensorErrors.from_parts(array, RATE)
            turning = [Reference.gyro(errors).measured(np.zeros((80, 3)), 80)] if gyro else []
            solve(array, t, np.zeros((80, array.n_channels)), errors, references=turning)
        # Other tests of this process may have compiled forms of their own.
        compiled = compiled or [len(one.signatures) for one in (follow, smooth_back)]
        assert [len(one.signatures) for one in (follow, smooth_back)] == compiled


def test_quadrature_weights():
    np.testing.assert_allclose(even_weights(2), [[0.5, 0.5]], rtol=1e-14)
    np.testing.assert_allclose(even_weights(4)[2] * 24, [1, -5, 19, 9], rtol=1e-12)  # Adams–Moulton
    np.testing.assert_allclose(even_weights(6)[2] * 1440, [11, -93, 802, 802, -93, 11], rtol=1e-10)


@pytest.mark.parametrize("start", [np.zeros(3), None], ids=["rest", "unknown"])
@pytest.mark.parametrize("sizes", [(1,), (7, 1, 50, 333)])
def test_samples_one_by_one_or_in_blocks_give_the_same(start, sizes):
    motion = tumble(RATE, 12.0, duration=8.0)
    first = 0 if start is not None else 450
    t, values = motion.t[first:], measure(CUBE, motion, np.random.default_rng(3), bias=0.01)[first:]
    values[60:64, 3] = np.nan
    values[100:110] = np.nan
    errors = replace(sensor_errors(CUBE, RATE), bias_std=np.full(12, 0.01))
    settings = FilterSettings(start_omega=start)
    whole = LiveRateFilter(CUBE, errors, 1 / RATE, settings)
    block = joined_estimates([whole.push(t, values), whole.finish()])
    live = LiveRateFilter(CUBE, errors, 1 / RATE, settings)
    parts, place, turn = [], 0, 0
    while place < len(t):
        size = sizes[turn % len(sizes)]
        parts.append(live.push(t[place : place + size], values[place : place + size]))
        place, turn = place + size, turn + 1
    other = joined_estimates([part for part in [*parts, live.finish()] if len(part)])
    for name in ("t_s", "omega", "covariance", "nis"):
        np.testing.assert_allclose(getattr(other, name), getattr(block, name), rtol=1e-7, atol=1e-7, err_msg=name)
    assert live.report == whole.report
    assert live.sign.state == whole.sign.state


def test_half_a_second_is_waited_for_then_the_lag_is_two_samples(run):
    motion, values, errors = run
    process = LiveRateFilter(CUBE, errors, 1 / RATE)
    ready = [len(process.push(motion.t[k], values[k])) for k in range(56)]
    assert ready == [0] * 51 + [50, 1, 1, 1, 1]
    assert len(process.finish()) == 2


def error_and_std(found, motion, rows):
    return np.abs(found.omega - motion.omega)[rows], found.std[rows]


@pytest.mark.parametrize("channel", [0, 2, 7])
def test_missing_channel_is_left_out(run, channel):
    motion, values, errors = run
    values = values.copy()
    hole = slice(500, 560)
    values[hole, channel] = np.nan
    found = filter_rate(CUBE, motion.t, values, errors)
    whole = filter_rate(CUBE, motion.t, run[1], errors)
    error, std = error_and_std(found, motion, slice(300, None))
    assert np.all(error < 5 * std)
    assert found.std[559].max() > whole.std[559].max()
    assert found.channels.missing == {CUBE.channels[channel]: 60}
    assert list(found.nis_dof[[499, 530, 561]]) == [6, 5, 6]


def test_missing_chip_and_missing_everything(run):
    motion, values, errors = run
    values = values.copy()
    values[500:520, 3:6] = np.nan  # nine channels see all motions still
    values[600:620] = np.nan
    found = filter_rate(CUBE, motion.t, values, errors)
    error, std = error_and_std(found, motion, slice(300, None))
    assert np.all(error < 5 * std)
    assert found.std[619].max() > 3 * found.std[599].max()
    assert found.channels.samples_without_alpha == 20
    assert np.all(found.nis_dof[600:620] == 0)


def test_gap_in_time(run):
    motion, values, errors = run
    kept = np.r_[0:500, 512 : len(motion.t)]
    found = filter_rate(CUBE, motion.t[kept], values[kept], errors)
    error = np.abs(found.omega - motion.omega[kept])[300:]
    assert np.all(error < 5 * found.std[300:])
    assert found.std[500].max() > 3 * found.std[499].max()
    assert found.channels.gaps == 1


@pytest.mark.study
def test_jittered_times(run):
    _, _, errors = run
    fine = tumble(10_000.0, 12.0, duration=8.0)
    rng = np.random.default_rng(5)
    rows = np.arange(0, len(fine.t) - 100, 100) + rng.integers(0, 30, 799)
    jittered = type(fine)(fine.t[rows], fine.omega[rows], fine.alpha[rows], fine.p[rows])
    values = readings(CUBE, jittered) + errors.noise_std * rng.standard_normal((len(rows), 12))
    found = filter_rate(CUBE, jittered.t, values, errors, PLAIN)
    error = (found.omega - jittered.omega)[300:]
    assert 0.7 < np.mean((error / found.std[300:]) ** 2) < 1.6
    even = filter_rate(CUBE, jittered.t[0] + np.arange(len(rows)) / RATE, values, errors, PLAIN)
    assert np.mean((even.omega - jittered.omega)[500:] ** 2) > 1.5 * np.mean(error[200:] ** 2)  # times matter


def test_saturated_channels(run):
    motion, values, errors = run
    limit = 0.93 * np.abs(values).max()
    clipped = np.clip(values, -limit, limit)
    told = replace(errors, full_range=np.full(12, limit))
    found = filter_rate(CUBE, motion.t, clipped, told)
    naive = filter_rate(CUBE, motion.t, clipped, replace(errors, full_range=None))
    error, std = error_and_std(found, motion, slice(300, None))
    assert found.channels.saturated
    assert np.all(error < 5 * std)
    assert np.abs(naive.omega - motion.omega)[300:].max() > 1.4 * error.max()


def test_stuck_channel_is_found_and_comes_back(run):
    motion, values, errors = run
    values = values.copy()
    values[500:700, 4] = values[500, 4]
    found = filter_rate(CUBE, motion.t, values, errors)
    count = found.channels.stuck[CUBE.channels[4]]
    assert 200 - 40 <= count <= 200 - 38
    naive = filter_rate(CUBE, motion.t, values, replace(errors, stuck_after=0))
    late = slice(560, 700)
    worst = np.abs(found.omega - motion.omega)[late].max()
    assert worst < 0.5 * np.abs(naive.omega - motion.omega)[late].max()
    assert not filter_rate(CUBE, motion.t, run[1], errors).channels.stuck


def test_array_whose_alpha_needs_omega(run):
    """Three triads in one corner region and one on top: ω² terms left in α are cleaned by the null space."""
    motion, _, _ = run
    array = AccelerometerArray.load("p3_three_plus_one")
    errors = SensorErrors.uniform(array, 0.03, 0.05)
    rng = np.random.default_rng(1)
    c = array.n_channels
    values = readings(array, motion) + 0.05 * rng.standard_normal(c) + 0.03 * rng.standard_normal((len(motion.t), c))
    found = filter_rate(array, motion.t, values, errors)
    error = (found.omega - motion.omega)[300:]
    assert 0.6 < np.mean((error / found.std[300:]) ** 2) < 1.6


@pytest.mark.parametrize("name", ["corners8"])
def test_any_array_that_sees_all_motions(name):
    motion = turntable(RATE, 6.0, duration=10.0)
    array = AccelerometerArray.load(name)
    c = array.n_channels
    errors = SensorErrors.uniform(array, 0.03, 0.05)
    rng = np.random.default_rng(1)
    values = readings(array, motion) + 0.05 * rng.standard_normal(c) + 0.03 * rng.standard_normal((len(motion.t), c))
    found = filter_rate(array, motion.t, values, errors)
    error = (found.omega - motion.omega)[100:]
    assert np.mean(np.abs(error) < 3 * found.std[100:]) > 0.98
    assert np.all(found.nis_dof[60:] == 6)  # the six rows that see products; the parity rows stay out of the filter


def test_gyro_is_fused_and_the_estimate_goes_on_through_its_saturation(run):
    motion, values, errors = run
    rng = np.random.default_rng(2)
    gyro = motion.omega + [0.2, -0.1, 0.3] + 0.01 * rng.standard_normal(motion.omega.shape)
    gyro[np.abs(motion.omega).max(axis=1) > 9.0] = np.nan  # saturated at 9 rad/s
    noisy_gyro = replace(errors, gyro_noise_std=0.01)
    measured = Reference.gyro(noisy_gyro).measured(gyro, len(gyro))
    fused = filter_rate(CUBE, motion.t, values, noisy_gyro, references=[measured])
    alone = filter_rate(CUBE, motion.t, values, noisy_gyro)
    rows = slice(300, None)
    inside = np.flatnonzero(np.isnan(gyro[:, 0]))
    assert len(inside) > 50
    assert np.all(np.abs(fused.omega - motion.omega)[rows] < 5 * fused.std[rows])
    assert np.mean((fused.omega - motion.omega)[rows] ** 2) < np.mean((alone.omega - motion.omega)[rows] ** 2)
    np.testing.assert_allclose(fused.bias[-3:], [0.2, -0.1, 0.3], atol=0.02)


@pytest.mark.parametrize("method", RATE_METHODS)
def test_all_methods_behind_one_call(run, method):
    motion, values, errors = run
    found = estimate_rate(CUBE, motion.t, values, errors, method=method)
    assert found.method == method
    assert found.omega.shape == (len(motion.t), 3)
    assert found.covariance.shape == (len(motion.t), 3, 3)
    assert len(found.nis) == len(found.nis_dof) == len(motion.t)
    rows = motion.t > 5.5
    error = (found.omega - motion.omega)[rows]
    assert 0.3 < np.sqrt(np.mean(error**2 / found.std[rows] ** 2)) < 2.2


def test_bad_input(run):
    motion, values, errors = run
    with pytest.raises(InputError, match="valid: algebraic, batch, filter, integrate, ml, smoother"):
        estimate_rate(CUBE, motion.t, values, errors, method="magic")
    with pytest.raises(InputError, match="can't use gyro"):
        estimate_rate(CUBE, motion.t, values, errors, method="ml", gyro=motion.omega)
    with pytest.raises(InputError, match="increase"):
        filter_rate(CUBE, motion.t[::-1], values, errors)
    with pytest.raises(InputError, match="readings have shape"):
        filter_rate(CUBE, motion.t, values[:, :9], errors)
    with pytest.raises(InputError, match="two samples"):
        filter_rate(CUBE, motion.t[:1], values[:1], errors)
    with pytest.raises(InputError, match="one per channel"):
        SensorErrors.uniform(CUBE, [0.1, 0.2])
    with pytest.raises(InputError, match="positive"):
        SensorErrors.uniform(CUBE, 0.0)
    with pytest.raises(InputError, match="valid: adams_moulton4"):
        FilterSettings(quadrature="simpson")
    flat = AccelerometerArray.load("p1_face_diagonals")
    flat_errors = SensorErrors.uniform(flat, 0.03)
    with pytest.raises(GeometryError, match="sees 0 products"):
        estimate_rate(flat, motion.t, values[:, :6], flat_errors, method="algebraic")


def test_an_integration_that_begins_in_motion_is_as_uncertain_as_its_sign(run):
    motion, values, errors = run
    found = estimate_rate(CUBE, motion.t[500:], values[500:], errors, method="integrate")
    error = np.linalg.norm(found.omega - motion.omega[500:], axis=1)[0]
    first = np.linalg.norm(motion.omega[500])
    assert found.start.kind == "motion"
    np.testing.assert_array_equal(found.sign_probability, 0.5)
    assert np.linalg.norm(found.std[0]) == pytest.approx(np.sqrt(2.0) * first, rel=0.2)
    assert min(error, abs(2.0 * first - error)) < 0.1 * first


def test_a_smaller_set_of_channels():
    noise = np.linspace(0.02, 0.05, 24)
    sets = ChannelSets(AccelerometerArray.load("corners8"), noise)
    design = sets.array.regression_matrix
    present = np.arange(24) != 5
    full, smaller = sets.full, sets.sets[sets.index(present)]
    rows, products = smaller.alpha_rows, smaller.product_rows
    assert smaller.rows == 6
    assert not rows[:, 5].any()
    assert not products[:, 5].any()
    np.testing.assert_allclose(rows @ design, np.eye(6)[:3], atol=1e-9)
    np.testing.assert_allclose(products @ design, 0, atol=1e-8)
    np.testing.assert_allclose(products * noise**2 @ products.T, np.eye(6), atol=1e-9)
    # Biases of the smaller set follow from those of the full one and of its parity rows.
    bias = np.random.default_rng(0).normal(size=24)
    seen, parity = full.product_rows @ bias, sets.parity_rows @ bias
    alpha = full.alpha_rows @ bias + smaller.alpha_bias @ seen + smaller.alpha_parity @ parity
    np.testing.assert_allclose(rows @ bias, alpha, atol=1e-9)
    carried = smaller.product_bias @ seen + smaller.product_parity @ parity
    np.testing.assert_allclose(products @ bias, carried, atol=1e-9)
    np.testing.assert_array_equal(sets.indices(np.array([present, present | True, present])), [1, 0, 1])
    few = np.zeros(24, dtype=bool)
    few[:5] = True
    assert sets.sets[sets.index(few)].rows == -1
