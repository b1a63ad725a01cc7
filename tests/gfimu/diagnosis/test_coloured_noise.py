"""Slow noise in a cosine basis: whitening, against the spectrum of simulated noise."""

from itertools import pairwise

import numpy as np
from numpy.testing import assert_allclose

from gfimu.diagnosis.coloured_noise import CosineBasis, NoiseLevels

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
