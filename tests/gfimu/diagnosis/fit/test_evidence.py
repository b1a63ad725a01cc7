"""The evidence is the ratio of marginal likelihoods, and hardly asks in which units a prior was written."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, norm

from gfimu.diagnosis.fit.evidence import _SCALE_WEIGHTS, SCALES, log_evidence, log_evidence_each


def test_the_weights_of_the_scales_are_a_prior():
    assert np.exp(_SCALE_WEIGHTS).sum() == pytest.approx(1.0)
    assert len(SCALES) == len(_SCALE_WEIGHTS)


def test_it_is_the_ratio_of_marginal_likelihoods():
    rng = np.random.default_rng(1)
    columns = rng.standard_normal((30, 3))
    y = columns @ [0.5, -0.2, 1.0] + rng.standard_normal(30)
    nothing = multivariate_normal.logpdf(y, cov=np.eye(30))
    each = [multivariate_normal.logpdf(y, cov=np.eye(30) + k**2 * columns @ columns.T) - nothing for k in SCALES]
    truth = logsumexp(np.array(each) + _SCALE_WEIGHTS)
    assert log_evidence(columns.T @ columns, columns.T @ y) == pytest.approx(truth, abs=1e-9)


@pytest.mark.parametrize("score", [-3.0, 2.0, 9.0])
def test_a_size_of_one_sign_has_half_a_normal_prior(score):
    information = 6.0
    each = [
        2.0 * quad(lambda z, k=k: norm.pdf(z, scale=k) * np.exp(score * z - 0.5 * information * z**2), 0.0, 8.0)[0]
        for k in SCALES
    ]
    truth = float(logsumexp(np.log(each) + _SCALE_WEIGHTS))
    positive = np.array([True])
    assert log_evidence(np.array([[information]]), np.array([score]), positive) == pytest.approx(truth, abs=1e-3)
    several = log_evidence_each(np.array([information]), np.array([score]), positive)
    assert several[0] == pytest.approx(truth, abs=1e-3)


@pytest.mark.parametrize("size", np.geomspace(0.02, 10.0, 7))
def test_a_prior_in_other_units_changes_little(size):
    """Twelve sizes at eight standard deviations: a rival must not win because its prior happens to be narrower."""
    information, sizes = (8.0 / size) ** 2, np.full(12, size)
    values = [
        log_evidence(np.eye(12) * information * unit**2, information * unit * sizes)
        for unit in np.geomspace(1.0, 4.0, 9)
    ]
    assert np.ptp(values) < 4.0
