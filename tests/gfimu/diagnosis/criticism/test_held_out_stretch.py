"""Gain on held-out stretches: shares of the excess and their errors in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gfimu.diagnosis import Policy
from gfimu.diagnosis.criticism.held_out_stretch import Measured, gain_of

POLICY = Policy()
ONE = Measured(
    before=5000.0,
    after=2000.0,
    carried=3000.0,
    floor=1000.0,
    floor_variance=400.0,
    fitted=900.0,
    squares=(90.0, 40.0),
    samples=1000,
    rows=500,
    blocks=np.array([2.0, 4.0]),
    rates=(0.3, 0.1),
    drifts=(4.0, 1.0),
)


def test_the_share_is_of_the_excess_over_the_floor():
    gain = gain_of([ONE], POLICY, label="blocks")
    # (5000 − 2000)/(5000 − 1000) of the excess; without what is of one recording (5000 − 3000)/4000.
    assert gain.share_of_excess_removed == pytest.approx(0.75)
    assert gain.share_in_any_recording == pytest.approx(0.5)
    # Its error: √((share · error of the floor)² + 4 after + 4 before (1 − share)²)/before, of the excesses.
    assert gain.share_std == pytest.approx(np.sqrt((0.75 * 20.0) ** 2 + 4 * 1000.0 + 4 * 4000.0 * 0.25**2) / 4000.0)
    assert (gain.rms_before, gain.rms_after) == pytest.approx((0.3, 0.2))
    assert gain.log_likelihood_per_sample == pytest.approx(0.5 * 3000.0 / 500)
    assert gain.log_likelihood_std == pytest.approx(np.sqrt(2.0) / np.sqrt(2.0))
    assert gain.held_out == "blocks"


def test_stretches_add_up():
    other = replace(ONE, before=3000.0, squares=(10.0, 60.0), rates=(0.5, 0.1), drifts=(2.0, 3.0))
    gain = gain_of([ONE, other], POLICY, label="")
    assert gain.share_of_excess_removed == pytest.approx(1.0 - 2000.0 / 6000.0)
    assert (gain.rms_before, gain.rms_after) == pytest.approx((np.sqrt(0.05), np.sqrt(0.05)))
    assert gain.rate_rmse_before == pytest.approx(np.sqrt((0.3**2 + 0.5**2) / 2.0))
    assert (gain.drift_before, gain.drift_after) == (3.0, 2.0)


def test_the_floor_rises_to_the_fitted_part_within_its_error_only():
    error = np.sqrt(ONE.floor_variance)
    near = gain_of([replace(ONE, fitted=1000.0 + 0.5 * error)], POLICY, label="")
    assert near.share_of_excess_removed == pytest.approx(3000.0 / (4000.0 - 0.5 * error))
    far = gain_of([replace(ONE, fitted=1900.0)], POLICY, label="")
    assert far.share_of_excess_removed == pytest.approx(3000.0 / (4000.0 - POLICY.noise_stds * error))


@pytest.mark.parametrize(("error", "excess", "counts"), [(20.0, 79.0, False), (20.0, 81.0, True), (1.0, 9.0, False)])
def test_an_excess_counts_beyond_its_error_and_the_accuracy_of_the_floor(error, excess, counts):
    # 4 standard errors, and a hundredth of the floor.
    one = replace(ONE, before=1000.0 + excess, after=1000.0, fitted=0.0, floor_variance=error**2)
    assert np.isfinite(gain_of([one], POLICY, label="").share_of_excess_removed) == counts


def test_nothing_held_out():
    assert gain_of([replace(ONE, samples=0)], POLICY, label="blocks").held_out == ""
    alone = gain_of([replace(ONE, blocks=np.array([2.0]))], POLICY, label="")
    assert np.isnan(alone.log_likelihood_std)
