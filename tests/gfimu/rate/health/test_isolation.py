"""What explains the innovations: information and score of faults, without what errors of the model may explain."""

import numpy as np
import pytest

from gfimu.rate.health.recursion.isolation import deflate


@pytest.fixture
def evidence():
    rng = np.random.default_rng(3)
    factor = rng.standard_normal((12, 9))
    return 1e3 * factor @ factor.T, 30.0 * rng.standard_normal(12), rng.uniform(0.01, 0.2, 12)


def test_errors_of_the_model_are_taken_out_as_by_the_inverse(evidence):
    """Information on faults beside unknown constants of variance M²: (C⁻¹ + M²)⁻¹, here of a C without an inverse."""
    information, score, std = evidence
    cleaned, left = deflate(information, score, std)
    weight = np.linalg.inv(np.eye(12) + information * std**2)
    np.testing.assert_allclose(cleaned, weight @ information, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(left, weight @ score, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1e9])
def test_information_of_a_filter_that_ran_away_is_refused(evidence, bad):
    information, score, std = evidence
    information[3, 3] = bad
    with pytest.raises(np.linalg.LinAlgError):
        deflate(information, score, std)
