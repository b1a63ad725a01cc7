"""Dependence of residuals on the motion: amplitudes and chances against what was put in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_runs import PERIOD, SIGMA, made_view
from numpy.testing import assert_allclose

from gfimu.diagnosis import RunView
from gfimu.diagnosis.criticism.views.dependence import dependences, fingerprint, listed, quantities
from gfimu.diagnosis.criticism.views.whiteness import whitening_gain

N = 4000
CHANNELS = ("a11", "a12", "a13")
RATE = (
    4.0
    + 3.0 * np.sin(2 * np.pi * 0.11 * PERIOD * np.arange(N))
    + 1.5 * np.sin(2 * np.pi * 0.37 * PERIOD * np.arange(N))
)


def looked_at(view: RunView):
    gain = whitening_gain(len(view.t), PERIOD, view.white, 0.0)
    before, after = (np.where(view.valid, view.measured - one, 0.0) for one in (view.before, view.after))
    return gain, before, after


def residual(**of_channel):
    out = np.zeros((N, len(CHANNELS)))
    for name, values in of_channel.items():
        out[:, CHANNELS.index(name)] = values
    return out


def test_what_follows_the_rate_squared_has_the_amplitude_that_was_put_in():
    view = made_view(RATE, residual(a12=4e-3 * RATE**2))
    gain, before, after = looked_at(view)
    found = {one.view: one for one in dependences(view, CHANNELS, gain, before, after) if one.view != "angle"}
    one = found["rate squared"]
    # The constant is projected out; the noise turns the coefficient by σ/√n over the spread of the rate squared.
    assert one.amplitude_before[1] == pytest.approx(4e-3 * np.std(RATE**2), abs=4 * SIGMA / np.sqrt(N))
    assert one.share_before[1] == pytest.approx(1.0, abs=0.1)
    assert one.p_before[1] < 1e-30
    assert min(one.p_before[0], one.p_before[2], *one.p_after) > 1e-3 / one.looks
    assert one.looks == len(quantities(view)) * 3
    assert "the rate squared in a12" in one.sentence
    assert one.sentence.endswith("after: gone.")
    # Bins of the quantity show the parabola as a straight line.
    known = np.isfinite(one.before[:, 1])
    slope = np.polyfit(one.centres[known, 1], one.before[known, 1], 1)[0]
    assert slope == pytest.approx(4e-3, rel=0.05)
    assert one.strength == pytest.approx(np.sum(one.amplitude_before**2))


def test_noise_follows_nothing():
    view = made_view(RATE, residual())
    assert not any(one.sentence for one in dependences(view, CHANNELS, *looked_at(view)))


def test_invalid_samples_do_not_count():
    bad = residual(a11=0.02 * RATE)
    view = made_view(RATE, bad)
    valid = view.valid.copy()
    valid[::3, 0] = False
    measured = np.where(valid, view.measured, 1e3)
    view = replace(view, valid=valid, measured=measured)
    rate = next(one for one in dependences(view, CHANNELS, *looked_at(view)) if one.view == "rate")
    assert rate.amplitude_before[0] == pytest.approx(0.02 * np.std(RATE[valid[:, 0]]), rel=0.05)
    dead = replace(view, valid=view.valid & np.array([False, True, True]))
    rate = next(one for one in dependences(dead, CHANNELS, *looked_at(dead)) if one.view == "rate")
    assert (rate.amplitude_before[0], rate.p_before[0]) == (0.0, 1.0)
    assert rate.looks == len(quantities(dead)) * 2


def test_quantities_that_vary():
    view = made_view(RATE, residual())
    names = [one.view for one in quantities(view)]
    assert names[:5] == ["time", "rate", "rate squared", "acceleration", "reading"]
    assert names[5:] == ["angle"] * 12
    slow = made_view(np.full(N, 0.1), residual())  # 4 rad, less than a turn, at one rate
    assert [one.view for one in quantities(slow)] == ["time", "reading"]
    warm = replace(view, temperature=np.linspace(20.0, 25.0, N))
    assert "temperature" in [one.view for one in quantities(warm)]


def test_the_fingerprint_is_a_coefficient_over_its_error():
    view = made_view(RATE, residual(a13=2e-3 * (RATE**2 - np.mean(RATE**2))))
    gain, before, after = looked_at(view)
    found = fingerprint(view, CHANNELS, gain, before, after)
    place = found.terms.index("ω²")
    # By least squares on all terms at once, the noise known.
    terms = [np.ones(N), view.t - view.t.mean(), RATE, RATE**2, RATE**4, view.acceleration, RATE * view.acceleration]
    waves = [f(k * view.angle) for k in (1, 2) for f in (np.cos, np.sin)]
    design = np.column_stack([*terms, *waves])
    design = design / np.linalg.norm(design, axis=0)
    covariance = np.linalg.inv(design.T @ design)
    expected = covariance @ design.T @ before[:, 2] / (SIGMA * np.sqrt(covariance.diagonal()))
    assert_allclose(found.before[2], expected, rtol=0.02, atol=0.05)
    assert found.before[2, place] > 4.0 > np.abs(found.after).max()


def test_lists_in_words():
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "c"]) == "a, b and c"
    assert listed(list("abcdef")) == "a, b, c, d and 2 more"
