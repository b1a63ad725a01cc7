"""Slow noise as coarse readings see it: modes against dense covariances, and what it does to an offset."""

from dataclasses import replace

import numpy as np
import pytest
from core_cases import lively, part_of, small_twin, stretches_of
from numpy.testing import assert_allclose

from gfimu.diagnosis import CosineBasis, NoiseLevels, starting_point
from gfimu.diagnosis.data.rounding import Steps, rounded_likelihood
from gfimu.diagnosis.fit.posterior import condition
from gfimu.diagnosis.terms.coloured_noise import likeliest_flicker
from gfimu.diagnosis.terms.slow_modes import SlowModes, WeighedModes, WeighedPowers
from sim.effects import make_effect

PERIOD = 0.01
WHITE, FLICKER = 0.03, 0.005


def levels(channels, *, walk=0.0):
    return NoiseLevels(np.full(channels + 1, WHITE), np.append(np.full(channels, FLICKER), 0.0), walk)


def weighed(modes, share, n, column):
    """Q diag(s) Qᵀ of one observation, (n, n)."""
    low = modes.of(np.eye(n), column)  # (n, K)
    return (low * share[:, column]) @ low.T


def test_of_samples_that_count_alike_the_modes_are_the_cosines():
    basis, n = CosineBasis(500, PERIOD), 500
    common, each = SlowModes(basis, levels(2)), WeighedModes(basis, levels(2), np.ones((n, 3)))
    for column in range(3):
        assert_allclose(
            weighed(each, each.share, n, column), weighed(common, common.share, n, column), atol=0.06
        )  # modes below a share of 0.05 are cut apart from each other
    assert each.log_determinant == pytest.approx(common.log_determinant, rel=1e-3)


@pytest.mark.parametrize("walk", [0.0, 0.01])
def test_modes_whiten_what_the_weights_make_of_slow_noise(walk):
    rng = np.random.default_rng(1)
    n = 500
    basis, noise = CosineBasis(n, PERIOD), levels(1, walk=walk)
    weight = np.column_stack([rng.uniform(0.02, 1.0, n) * (np.arange(n) > 200), np.ones(n)])
    modes = WeighedModes(basis, noise, weight)
    count = len(basis.frequency)
    scaled = basis.matrix(count) * weight[:, [0]]
    covariance = WHITE**2 * np.eye(n) + (scaled * basis.variances(noise, count)[:, 0]) @ scaled.T
    precision = (np.eye(n) - weighed(modes, modes.share, n, 0)) / WHITE**2
    # What is cut has a share of 0.05 at most.
    values = np.linalg.eigvalsh(np.linalg.cholesky(covariance).T @ precision @ np.linalg.cholesky(covariance))
    assert values.min() > 0.99
    assert values.max() < 1.06
    assert modes.log_determinant == pytest.approx(np.linalg.slogdet(covariance)[1], abs=0.5)


def test_each_and_all_observations_agree():
    rng = np.random.default_rng(2)
    n = 400
    modes = WeighedModes(CosineBasis(n, PERIOD), levels(3), rng.uniform(0.0, 1.0, (n, 4)))
    values = rng.standard_normal((n, 4))
    low = modes.of_each(values)
    for column in range(4):
        assert_allclose(modes.of(values[None, :, column], column)[0], low[:, column], rtol=1e-10, atol=1e-12)
    sizes = rng.standard_normal(low.shape)
    assert np.sum(modes.back(sizes) * values) == pytest.approx(np.sum(sizes * low))


def test_products_of_cosines_under_weights():
    rng = np.random.default_rng(7)
    basis = CosineBasis(240, PERIOD)
    count = len(basis.frequency)
    weights = rng.uniform(0.0, 1.0, (240, 3))
    cosines = basis.matrix(count)
    expected = np.einsum("nc,nk,nl->ckl", weights, cosines, cosines)
    assert_allclose(basis.products(weights, count), expected, atol=1e-14)


@pytest.mark.parametrize("walk", [0.0, 0.01])
def test_slow_noise_and_what_it_takes_are_those_of_the_dense_covariance(walk):
    rng = np.random.default_rng(8)
    n = 300
    basis, noise = CosineBasis(n, PERIOD), levels(1, walk=walk)
    count = len(basis.frequency)
    weight = rng.uniform(0.02, 1.0, (n, 2))
    values = rng.standard_normal((n, 2))
    modes = WeighedModes(basis, noise, weight)
    slow = (basis.matrix(count) * basis.variances(noise, count)[:, 0]) @ basis.matrix(count).T
    covariance = WHITE**2 * np.eye(n) + np.outer(weight[:, 0], weight[:, 0]) * slow
    known = np.linalg.solve(covariance, values[:, 0])
    assert_allclose(modes.slow_noise(values)[:, 0], slow @ (weight[:, 0] * known), atol=1e-3 * np.abs(values).max())
    taken = values[:, 0] @ values[:, 0] - WHITE**2 * values[:, 0] @ known
    assert modes.explained(values)[0] == pytest.approx(taken, rel=1e-2)
    left_out = modes.explained(values)[0] - SlowModes.explained(modes, values)[0]
    assert -1e-9 < left_out < 0.05 * values[:, 0] @ values[:, 0]  # modes that are cut have a share of 0.05 at most
    assert modes.explained(values)[1] == 0.0


@pytest.mark.parametrize("step", [0.0, 0.3])
def test_the_drive_in_the_modes_is_its_jacobian_in_them(step):
    """Of readings finer than the noise, whose observations share the modes, and of coarse ones."""
    rounding = [make_effect("coarse_resolution", {"step_m_s2": step})] if step else []
    (whole,) = stretches_of(small_twin(), rounding, seed=3, duration=6.0, motion=lively())
    stretch = replace(part_of(whole, 250), steps=Steps(channels=step))
    white = stretch.first_levels.white
    noise = NoiseLevels(white, np.append(np.full(len(white) - 1, 0.03), 0.0))
    drive = starting_point([stretch], 0.1).drives[0]
    posterior = condition(stretch, drive, [], noise)
    modes, weights = posterior.observed.modes, posterior.observed.weights
    assert isinstance(modes, WeighedModes) == (step > 0.0)
    unit = np.eye(posterior.jacobian.size)
    dense = np.stack([posterior.jacobian.times(one) for one in unit], axis=-1)  # (n, c + 1, m)
    each = [modes.of(dense[:, c].T, c) for c in range(len(weights))]
    for c, expected in enumerate(each):
        assert_allclose(posterior.jacobian_modes[c], expected, atol=1e-9 * np.abs(expected).max())
    taken = sum(weights[c] * (one * modes.share[:, c]) @ one.T for c, one in enumerate(each))
    white_only = np.einsum("ncm,c,nck->mk", dense, weights, dense)
    precision = drive.add_precision(np.zeros_like(taken))
    information = np.tril(posterior.root) @ np.tril(posterior.root).T
    assert np.abs(taken).max() > 1e-3 * np.abs(white_only).max()
    assert_allclose(information, precision + white_only - taken, atol=2e-6 * np.abs(taken).max())


def bias_instability(rng, basis, channels):
    """1/f noise (n, c) of unit size."""
    count = len(basis.frequency)
    return basis.matrix(count) @ (np.sqrt(basis.flicker_spectrum)[:, None] * rng.standard_normal((count, channels)))


def coarse_residual(rng, basis, channels, step):
    """Working residual and weight, each (n, c + 1), of channels that are known but for their noise."""
    n = basis.n
    t = PERIOD * np.arange(n)
    motion = np.outer(np.where(t < 0.4 * t[-1], 0.0, 3.0 * np.sin(0.3 * t)), np.ones(channels))
    motion += rng.uniform(-step, step, channels)
    noisy = motion + FLICKER * bias_instability(rng, basis, channels) + WHITE * rng.standard_normal((n, channels))
    told = rounded_likelihood(np.round(noisy / step) * step - motion, step, np.full(channels, WHITE))
    empty = np.zeros((n, 1))
    return np.hstack([told.residual, empty]), np.hstack([told.weight, empty + 1.0])


def offset_in_standard_deviations(modes, residual, weight, column):
    """The most probable constant in a channel over its standard deviation."""
    constant = weight[:, column]
    low = modes.of(constant[None], column)[0]
    whitened = (
        constant - modes.back(np.eye(modes.share.shape[1])[column] * (modes.share[:, column] * low)[:, None])[:, column]
    )
    return float(residual[:, column] @ whitened / WHITE / np.sqrt(constant @ whitened))


@pytest.mark.study
def test_an_offset_is_as_uncertain_as_slow_noise_at_the_edges_of_steps_makes_it():
    rng = np.random.default_rng(4)
    basis, channels = CosineBasis(6000, PERIOD), 12
    known = NoiseLevels(np.full(channels + 1, WHITE), np.append(np.full(channels, FLICKER), 0.0))
    found: dict[str, list[float]] = {"weighed": [], "alike": [], "known": []}
    for _ in range(40):
        residual, weight = coarse_residual(rng, basis, channels, 0.3)
        slow = WeighedPowers.of(basis, residual[:, :-1], weight[:, :-1])
        size = np.append(likeliest_flicker(slow.power, np.full(channels, WHITE), slow.flicker), 0.0)
        noise = NoiseLevels(np.full(channels + 1, WHITE), size)
        each = {
            "weighed": WeighedModes(basis, noise, weight),
            "alike": SlowModes(basis, noise),
            "known": WeighedModes(basis, known, weight),
        }
        for name, modes in each.items():
            found[name] += [offset_in_standard_deviations(modes, residual, weight, c) ** 2 for c in range(channels)]
    # 480 squares of mean 1 have a mean within 0.07 of it; the modes are cut, and noise that is estimated varies.
    assert 0.8 < np.mean(found["known"]) < 1.2
    assert 0.6 < np.mean(found["weighed"]) < 1.5
    assert np.mean(found["alike"]) > 3.0


def test_bias_instability_is_found_where_few_samples_tell_of_it():
    rng = np.random.default_rng(5)
    basis, channels = CosineBasis(6000, PERIOD), 12
    weight = np.where(np.arange(6000)[:, None] % 2000 < 400, 1.0, 0.05) * np.ones(channels)
    residual = weight * FLICKER * 2.0 * bias_instability(rng, basis, channels)
    residual += WHITE * rng.standard_normal(residual.shape) + 0.05 * weight  # a bias is none of it
    slow = WeighedPowers.of(basis, residual, weight)
    found = likeliest_flicker(slow.power, np.full(channels, WHITE), slow.flicker)
    assert np.sqrt(np.mean(found**2)) == pytest.approx(2.0 * FLICKER, rel=0.25)


def test_a_random_walk_that_is_known_is_not_taken_for_bias_instability():
    rng = np.random.default_rng(6)
    basis, channels = CosineBasis(6000, PERIOD), 12
    walk = np.cumsum(0.01 * np.sqrt(PERIOD) * rng.standard_normal((6000, channels)), axis=0)
    weight = rng.uniform(0.2, 1.0, (6000, 1)) * np.ones(channels)
    residual = weight * walk + WHITE * rng.standard_normal(walk.shape)
    slow = WeighedPowers.of(basis, residual, weight)
    white = np.full(channels, WHITE)
    unknown = likeliest_flicker(slow.power, white, slow.flicker)
    known = likeliest_flicker(slow.power, white, slow.flicker, slow.walk * 0.01**2)
    assert np.median(known) < 0.2 * np.median(unknown)
