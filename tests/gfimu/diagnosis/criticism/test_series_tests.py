"""Noise that changes is found with what it changes with."""

from __future__ import annotations

import numpy as np
import pytest
from made_fits import DURATION, fitted, quiet, recorded

from gfimu.diagnosis.criticism.series_tests import changing_noise
from gfimu.diagnosis.fit.observed_at import observed_at

LIKELY = 10.0


def seen_of(stretches, fit):
    """A stretch, its residuals and its motion."""
    stretch, drive = stretches[0], fit.point.drives[0]
    return stretch, observed_at(stretches, fit.point)[0], drive.spin.at(stretch.run.t)


def test_noise_has_one_level():
    stretch, seen, state = seen_of(*quiet())
    assert changing_noise([stretch], [seen], [state]).log_odds < 5.0


@pytest.mark.parametrize("of", ["the rate", "time"])
def test_noise_that_grows_is_found_with_what_it_follows(of):
    rng = np.random.default_rng(3)

    def louder(t, spin, readings, reference):
        level = np.abs(spin.rate) / 10.0 if of == "the rate" else t / DURATION
        readings += 0.05 * level[:, None] * rng.standard_normal(readings.shape)

    stretch, seen, state = seen_of(*fitted(recorded(3, louder)))
    found = changing_noise([stretch], [seen], [state])
    assert found.log_odds > LIKELY
    assert found.signature == f"the noise of all channels changes with {of}"
    assert changing_noise([stretch] * 2, [seen] * 2, [state] * 2).log_odds == pytest.approx(
        found.log_odds - np.log(2.0)
    )
