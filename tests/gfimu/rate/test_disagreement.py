"""Noise measured from the residual: untouched where it is as stated, of the right size where it is larger."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rate_worlds import cube, measure, sensor_errors, tumble

from gfimu import estimate_rate
from gfimu.rate import filter_rate
from gfimu.rate.disagreement import measured_scale, sum_up_disagreement

RATE = 100.0


@pytest.mark.parametrize("freedom", [3.0, 15.0])
def test_stated_noise_is_left_as_it_is(freedom):
    rng = np.random.default_rng(0)
    n = 100_000
    scale = measured_scale(rng.chisquare(freedom, n), np.full(n, freedom), 0.01)
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


def test_missing_samples_take_the_noise_of_their_neighbours():
    squares = np.full(200, 9.0 * 15.0)
    squares[100] = np.nan
    scale = measured_scale(squares, np.full(200, 15.0), 0.01)
    np.testing.assert_allclose(scale, 3.0, rtol=1e-6)


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
        assert np.mean(found.scale[rows] > 1.05) < 0.01  # but for the noise measured over the run
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
    rows = motion.t > 6
    assert 0.5 < np.mean(((found.omega - motion.omega) / found.std)[rows] ** 2) < 2.0
    assert np.median(found.scale[rows]) == pytest.approx(3.0, rel=0.25)
    assert 0.9 < found.mean_nis < 1.5  # by a noise that half a second of innovations shows


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
