"""The score of a function of the drive by the drive's own noise: as simulated, and taken off in the lack of fit."""

from __future__ import annotations

import numpy as np
import pytest
from made_fits import quiet

from gfimu.diagnosis.criticism.drive_noise import apart_from_noise, drive_covariance, expected_score
from gfimu.diagnosis.fit.linear import linearise


def jerk_of(spin, jerk):
    return np.column_stack([jerk, spin.rate])


def test_expected_scores_are_those_of_drives_drawn_from_the_posterior():
    """Fisher's identity: the mean of −(Jδ)ᵀ W φ(δ) over the posterior is minus the expected score."""
    stretches, fit = quiet()
    [posterior] = linearise(stretches, fit.point).posteriors
    found = expected_score(stretches[0], posterior, jerk_of)
    t, drive = stretches[0].run.t, posterior.drive
    rng = np.random.default_rng(1)
    root = np.linalg.cholesky(posterior.covariance)
    sums = np.zeros((2, *found.shape))
    draws = 400
    for _ in range(draws):
        step = root @ rng.standard_normal(len(root))
        seen = posterior.jacobian.times(step) * posterior.observed.weights  # (n, c + 1)
        moved = drive.spline.spin(step).at(t)
        values = np.column_stack([np.gradient(moved.acceleration, stretches[0].run.sample_period), moved.rate])
        one = seen.T @ values
        sums += [one, one**2]
    mean = sums[0] / draws
    std = np.sqrt(np.maximum(sums[1] / draws - mean**2, 0.0) / draws)
    np.testing.assert_array_less(np.abs(found - mean), 5.0 * std + 0.02 * np.abs(found) + 1e-9)
    assert np.abs(found[-1, 0]) > 10.0 * std[-1, 0]  # the jerk of the reference, which follows the noise most


def test_a_function_of_time_has_no_such_score():
    stretches, fit = quiet()
    [posterior] = linearise(stretches, fit.point).posteriors
    wave = np.cos(stretches[0].run.t)[:, None]
    assert np.all(expected_score(stretches[0], posterior, lambda spin, jerk: wave) == 0.0)


def test_the_covariance_is_that_of_the_spline():
    stretches, fit = quiet()
    [posterior] = linearise(stretches, fit.point).posteriors
    t = stretches[0].run.t
    shared, std = drive_covariance(posterior, t)
    first, rows = posterior.drive.spline.rows(t[500:501], 1)
    whole = np.zeros(posterior.drive.spline.size)
    whole[first[0] : first[0] + rows.shape[1]] = rows[0]
    assert std[1, 500] == pytest.approx(np.sqrt(whole @ posterior.covariance @ whole), rel=1e-9)
    seen = posterior.jacobian.times(posterior.covariance @ whole)
    np.testing.assert_allclose(shared[1, 500], seen[500], rtol=1e-9, atol=1e-12 * np.abs(seen[500]).max())


def test_what_noise_may_make_is_taken_off_in_one_share():
    rng = np.random.default_rng(3)
    columns = rng.standard_normal((40, 5))
    gram, expected = columns.T @ columns, rng.standard_normal(5)

    def size(score):
        return score @ np.linalg.solve(gram, score)

    assert apart_from_noise(0.6 * expected, expected, gram) == pytest.approx(np.zeros(5), abs=1e-12)
    assert apart_from_noise(-expected, expected, gram) == pytest.approx(-expected)
    assert apart_from_noise(3.0 * expected, expected, gram) == pytest.approx(2.0 * expected)
    for _ in range(20):
        score = rng.standard_normal(5)
        assert size(apart_from_noise(score, expected, gram)) <= size(score) * (1 + 1e-12)
    assert apart_from_noise(score, np.zeros(5), gram) is score
