"""Noise measured from the residual: untouched where it is as stated, of the right size where it is larger."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rate_worlds import cube, measure, sensor_errors, tumble

from gfimu import AccelerometerArray, estimate_rate
from gfimu.rate import FilterSettings, MeasuredNoise, filter_rate
from gfimu.rate.disagreement import lasting_scale, measured_scale, sum_up_disagreement
from gfimu.rate.refinement import parity_scale

RATE = 100.0


@pytest.mark.parametrize("freedom", [3.0, 15.0])
@pytest.mark.parametrize("causal", [False, True])
def test_stated_noise_is_left_as_it_is(freedom, causal):
    rng = np.random.default_rng(0)
    n = 100_000
    scale = measured_scale(rng.chisquare(freedom, n), np.full(n, freedom), 0.01, causal=causal)
    # One in a thousand by the sample, as many by the second; neighbours share their excess.
    assert np.mean(scale > 1.0) < 0.004
    assert scale.min() == 1.0


def test_a_noise_larger_by_a_factor_is_found():
    rng = np.random.default_rng(1)
    n = 20_000
    factor = np.where(np.arange(n) % 400 < 200, 1.0, 5.0)
    scale = measured_scale(factor**2 * rng.chisquare(15, n), np.full(n, 15.0), 0.01)
    inside = np.arange(n) % 400
    large = (inside > 210) & (inside < 390)
    assert np.mean(scale[large] ** 2) == pytest.approx(25.0, rel=0.02)
    # Amid the noisy stretches a quiet sample can't exclude a little of it.
    assert np.mean(scale[(inside > 10) & (inside < 190)] < 1.6) > 0.99
    # ν s̃²/σ² with the neighbours' four degrees of freedom is narrower than χ²(15) and wider than χ²(60).
    spread = np.var(scale[large] ** 2 / 25.0)
    assert 2 / 60 < spread < 2 / 15


def test_a_small_lasting_disagreement_shows_over_a_second():
    rng = np.random.default_rng(2)
    n = 20_000
    squares = 1.3**2 * rng.chisquare(3, n)
    each = measured_scale(squares, np.full(n, 3.0), 0.01)
    assert np.mean(each > 1.0) > 0.9
    lasting = lasting_scale(squares, np.full(n, 3.0), 0.01)
    assert np.mean(lasting[100:-100]) == pytest.approx(1.3, abs=0.02)


def test_missing_samples_take_the_noise_of_their_neighbours():
    squares = np.full(200, 9.0 * 15.0)
    squares[100] = np.nan
    scale = measured_scale(squares, np.full(200, 15.0), 0.01)
    np.testing.assert_allclose(scale, 3.0, rtol=1e-6)


def test_causal_noise_does_not_look_ahead():
    squares = np.full(200, 15.0)
    squares[100:] = 1500.0
    scale = measured_scale(squares, np.full(200, 15.0), 0.01, causal=True)
    assert np.all(scale[:100] == 1.0)
    assert np.all(scale[102:] > 8.0)


@pytest.mark.parametrize("method", ["ml", "algebraic"])
@pytest.mark.parametrize("factor", [1.0, 4.0])
def test_normalised_errors_of_single_samples(method, factor):
    """Normalised errors of a noise ``factor`` times the stated one are as they should be, in simulation."""
    array = cube()
    motion = tumble(RATE, 2 * np.pi, duration=30.0)
    errors = sensor_errors(array, RATE)
    smaller = replace(errors, noise_std=errors.noise_std / factor, bias_std=np.full(12, 0.01))
    values = measure(array, motion, np.random.default_rng(3), bias=0.0)
    found = estimate_rate(array, motion.t, values, smaller, method=method)
    rows = motion.t > 6
    square = np.mean(((found.omega - motion.omega) / found.std)[rows] ** 2)
    if factor == 1.0:
        assert np.mean(found.scale[rows] > 1.0) < 0.01
        # 7200 errors of unit variance; the chips' steps are in the stated noise.
        assert square == pytest.approx(1.0, abs=4 * np.sqrt(2 / 7200) + 0.03)
    else:
        # Three degrees of freedom with four of their neighbours: s̃ scatters, so the squares are t-like, above 1.
        assert 0.9 < square < 1.8
        assert np.median(found.scale[rows]) == pytest.approx(factor, rel=0.15)


def test_a_filter_takes_the_noise_that_it_measures():
    array = cube()
    motion = tumble(RATE, 2 * np.pi, duration=20.0)
    errors = sensor_errors(array, RATE)
    values = measure(array, motion, np.random.default_rng(4), bias=0.0)
    smaller = replace(errors, noise_std=errors.noise_std / 3.0, bias_std=np.full(12, 0.01))
    found = filter_rate(array, motion.t, values, smaller)
    stated = FilterSettings(noise=MeasuredNoise.as_stated(motion.t))
    naive = filter_rate(array, motion.t, values, smaller, stated)
    rows = motion.t > 6
    squares = [np.mean(((one.omega - motion.omega) / one.std)[rows] ** 2) for one in (naive, found)]
    assert squares[0] > 5.0
    assert 0.5 < squares[1] < 2.0
    # The consistency test is to see the stated noise.
    assert found.mean_nis == pytest.approx(naive.mean_nis)
    assert found.mean_nis > 5.0


def test_parity_needs_no_motion():
    array = AccelerometerArray.load("corners8")
    rng = np.random.default_rng(5)
    errors = sensor_errors(array, RATE)
    n = 2000
    motion = rng.normal(size=(n, 12)) * np.repeat([50.0, 5.0, 50.0], [3, 3, 6])
    design = np.hstack([array.regression_matrix, array.centripetal_matrix])
    noise = 3.0 * errors.noise_std * rng.standard_normal((n, array.n_channels))
    inside = replace(errors, full_range=None)
    scale = parity_scale(array, motion @ design.T + noise + 0.3, inside, 0.01, causal=False)
    assert np.sqrt(np.mean(scale**2)) == pytest.approx(3.0, rel=0.02)
    assert parity_scale(cube(), np.zeros((n, 12)), sensor_errors(cube(), RATE), 0.01, causal=False) is None


def test_the_sentence_has_the_numbers():
    scale = np.where(np.arange(1000) < 400, 6.0, 1.0)
    omega = np.outer(np.where(np.arange(1000) < 400, 20.0, 2.0), [1.0, 0.0, 0.0])
    found = sum_up_disagreement(scale, omega)
    (text,) = found.sentences()
    assert "6 times more" in text
    assert "40% of the samples" in text
    assert "gfimu calibrate array" in text
    assert type(found).from_dict(found.to_dict()) == found
    assert sum_up_disagreement(np.ones(1000), omega).sentences() == []
