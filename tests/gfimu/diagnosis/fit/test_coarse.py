"""The equations on averaged rows are those of all rows, for what is slower than the averages."""

from __future__ import annotations

import numpy as np
import pytest
from few_effects import having

from gfimu import AccelerometerArray
from gfimu.diagnosis import prepare, starting_point, stretches_of
from gfimu.diagnosis.fit.coarse import WHOLE, coarse
from gfimu.diagnosis.fit.linear import linearise
from gfimu.diagnosis.terms.columns import Columns
from sim.trials import Measurement, measure
from sim.twin import Twin


@pytest.fixture(scope="module")
def posterior():
    twin = having(Twin(array=AccelerometerArray.load("cube12"), array_name="cube12"), "scale_factor")
    recording = measure(np.random.default_rng(5), twin, [], Measurement(duration=20.0))
    stretches = stretches_of(twin, prepare([recording], twin, ["run"]))
    return linearise(stretches, starting_point(stretches, 0.05)).posteriors[0]


def waves(posterior, hz):
    """A slow wave and a constant on two channels."""
    n, observations = posterior.observed.residual.shape
    wave = np.column_stack([np.cos(2.0 * np.pi * hz * 0.01 * np.arange(n)), np.ones(n)])
    empty = np.zeros(0, dtype=np.intp)
    places = tuple(np.array([2 * c, 2 * c + 1]) if c < 2 else empty for c in range(observations))
    return Columns(4, places, tuple(wave if c < 2 else np.zeros((n, 0)) for c in range(observations)))


def test_slow_columns_have_the_same_products(posterior):
    columns = waves(posterior, 0.8)
    short, rows = coarse(posterior, 4)
    assert len(short.observed.residual) < 0.3 * len(posterior.observed.residual)
    (gram, score, _), (other, right, _) = posterior.products(columns), short.products(rows.of_columns(columns))
    np.testing.assert_allclose(other, gram, rtol=0.02, atol=0.02 * gram.max())
    np.testing.assert_allclose(right, score, atol=0.3 * np.sqrt(gram.diagonal()).max())


def test_what_is_faster_than_the_averages_is_lost_and_not_made_up(posterior):
    columns = waves(posterior, 23.0)
    short, rows = coarse(posterior, 4)
    gram, other = posterior.products(columns)[0], short.products(rows.of_columns(columns))[0]
    assert other[0, 0] < 0.2 * gram[0, 0]


def test_one_row_each_is_the_posterior_itself(posterior):
    assert coarse(posterior, 1) == (posterior, WHOLE)


def test_white_noise_keeps_its_level(posterior):
    _, rows = coarse(posterior, 4)
    noise = np.random.default_rng(2).standard_normal((len(posterior.observed.residual), 3))
    assert rows.averaged(noise).std() == pytest.approx(1.0, abs=0.05)
