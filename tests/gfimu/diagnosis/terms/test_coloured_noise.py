"""Slow noise in a cosine basis: whitening, against the spectrum of simulated noise."""

from itertools import pairwise

import numpy as np
from numpy.testing import assert_allclose
from scipy.signal import lfilter

from gfimu.diagnosis import CosineBasis, NoiseLevels

PERIOD = 0.01


def test_a_random_walk_is_white_at_every_frequency_once_whitened():
    rng = np.random.default_rng(2)
    n, channels, white, walk = 6000, 12, 0.027, 0.04
    steps = walk * np.sqrt(PERIOD) * rng.standard_normal((n, channels))
    noise = np.cumsum(steps, axis=0) + white * rng.standard_normal((n, channels))
    levels = NoiseLevels(np.append(np.full(channels, white), 0.02), np.zeros(channels + 1), walk)
    basis = CosineBasis(n, PERIOD)
    left = basis.whitened(np.column_stack([noise / white, rng.standard_normal(n)]), levels)
    power = basis.transform(left)[:, :-1] ** 2
    bands = np.array([0.1, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0])
    places = (2 * bands * n * PERIOD).astype(int)
    for first, last in pairwise(places):
        # A mean of χ² with one degree of freedom each.
        error = 4.0 * np.sqrt(2.0 / ((last - first) * channels))
        assert_allclose(power[first:last].mean(), 1.0, atol=error, err_msg=f"{first} to {last}")
    # Beyond the modes that are corrected in the fit there is slow noise too.
    assert basis.corrections(levels)[-1].max() > 0.3


def test_an_offset_of_a_run_cut_into_stretches_is_as_uncertain_as_bias_instability_makes_it():
    """Estimates of a constant from stretches that are taken for independent, over runs in which they are not."""
    rng = np.random.default_rng(5)
    stretches, n, period, runs = 8, 320, 0.2, 400
    white, level = 0.02, 0.01
    times = 0.25 * 3.2 ** np.arange(7)
    noise = white * rng.standard_normal((runs, stretches * n))
    for tau in times:  # first-order processes, equally strong
        keep = np.exp(-period / tau)
        steps = np.sqrt(1 - keep**2) * rng.standard_normal((stretches * n, runs))
        steps[0] = rng.standard_normal(runs)
        noise += level / np.sqrt(len(times)) * lfilter([1.0], [1.0, -keep], steps, axis=0).T
    levels = NoiseLevels(np.array([white, 0.02]), np.array([level, 0.0]))

    def spread_over_told(basis):
        """The spread of the estimates over what the weights of the stretches tell."""
        share = basis.corrections(levels)[0, 0]  # of the mean, which a constant is all of
        information = stretches * n * (1 - share) / white**2
        return noise.mean(axis=1).std() * np.sqrt(information)

    bound = 4.0 / np.sqrt(2 * runs)
    assert_allclose(spread_over_told(CosineBasis(n, period, stretches=stretches)), 1.0, atol=bound)
    # Had each stretch a bias of its own, an offset would be found where there is none.
    assert spread_over_told(CosineBasis(n, period)) > 1.5
