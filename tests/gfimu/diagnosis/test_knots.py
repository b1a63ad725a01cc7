"""Knots are set closer where a drive bends sharply, as far as samples and arms can tell, the sharpest bends first."""

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.ndimage import gaussian_filter1d

from gfimu.diagnosis.drive import AngleSpline
from gfimu.diagnosis.knots import KNOT_SPACING, intervals_to_cut
from gfimu.diagnosis.roughness import Roughness
from sim.motion import SpinState

PERIOD = 0.01
INTERVALS = 200


def chosen(bend, *, widths=None, acuity=2.0, reference_noise=0.02):
    widths = np.full(len(bend), KNOT_SPACING) if widths is None else widths
    return intervals_to_cut(
        widths, bend, sample_period=PERIOD, acuity=acuity, reference_noise=reference_noise, is_angle=False
    )


def test_only_sharp_bends_are_cut():
    bend = np.full(INTERVALS, 10.0)
    bend[[20, 70]] = 1e4
    assert np.flatnonzero(chosen(bend)).tolist() == [20, 70]


def test_longer_arms_and_less_noise_ask_for_more():
    bend = np.geomspace(1.0, 1e6, INTERVALS)
    assert chosen(bend, acuity=20.0).sum() > chosen(bend).sum()
    assert chosen(bend, acuity=1e-9, reference_noise=1e-4).sum() > chosen(bend, acuity=1e-9).sum()


def test_an_interval_within_a_sample_is_left():
    bend, widths = np.zeros(INTERVALS), np.full(INTERVALS, KNOT_SPACING)
    bend[:20] = 1e12
    widths[:10], widths[10:20] = 0.5 * PERIOD, 0.3 * PERIOD
    assert np.flatnonzero(chosen(bend, widths=widths)).tolist() == list(range(10))


def test_of_too_many_the_sharpest_are_cut():
    bend = 1e9 * (1.0 + np.arange(INTERVALS))
    cut = chosen(bend, widths=np.full(INTERVALS, 0.5 * KNOT_SPACING))
    assert 0 < cut.sum() < INTERVALS
    assert np.flatnonzero(cut).min() == INTERVALS - cut.sum()
    assert not chosen(bend, widths=np.full(INTERVALS, 0.3 * KNOT_SPACING)).any()


def cut_times(rate, t):
    """Where the spline that follows a rate would be cut, s."""
    spline = AngleSpline.uniform(t[0], t[-1], KNOT_SPACING)
    turned = SpinState(cumulative_trapezoid(rate, t, initial=0.0), rate, np.gradient(rate, t))
    bend = Roughness(spline, 1.0).bend(spline.through(t, turned))
    inner = (spline.interval_centres() > t[0] + 0.5) & (spline.interval_centres() < t[-1] - 0.5)
    return spline.interval_centres()[chosen(bend) & inner]


def test_a_swift_sine_is_followed_and_a_corner_is_not():
    t = np.arange(0.0, 10.0, 1e-3)
    assert not len(cut_times(6.0 * np.sin(2 * np.pi * 1.1 * t), t))
    ramp = gaussian_filter1d(np.clip(t - 4.0, 0.0, 2.0) * 40.0, 10.0)
    corners = cut_times(ramp, t)
    assert np.abs(corners[:, None] - [4.0, 6.0]).min(axis=1).max() < 0.2
    assert len(corners) >= 2
