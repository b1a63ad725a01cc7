"""Residual views: each speaks of what was put into the data, and none of what was not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_diagnoses import SETTING, made_run
from numpy.testing import assert_allclose
from scipy.signal import lfilter

from gfimu.diagnosis.criticism.views.residuals import residual_views
from gfimu.diagnosis.criticism.views.whiteness import cumulative_periodogram, ljung_box, standardise, whitening_gain
from sim.effects import make_effect

CHANNELS = tuple(f"a{chip}{axis}" for chip in range(1, 5) for axis in range(1, 4))
BIAS_INSTABILITY = SETTING.bias_instability


def views(name: str = "", *, seed: int = 1, **parameters):
    effects = [make_effect(name, parameters)] if name else []
    return residual_views(made_run(effects, seed=seed), CHANNELS, bias_instability=BIAS_INSTABILITY)


def test_noise_alone_says_nothing():
    # Every view promises one false sentence in a thousand; eight runs have about a dozen views each.
    told = [views(seed=seed).sentences for seed in range(8)]
    assert told == [()] * 8


def test_size_is_the_rms_against_the_noise():
    run = made_run([make_effect("bias", {"a21_m_s2": 0.1})])
    size = residual_views(run, CHANNELS, bias_instability=BIAS_INSTABILITY).size
    assert_allclose(size.before, np.sqrt(np.mean((run.measured - run.before) ** 2, axis=0)))
    assert_allclose(size.floor, np.hypot(run.white, BIAS_INSTABILITY))
    assert "a21" in size.sentence
    assert "a11" not in size.sentence
    assert size.after[3] < 1.1 * size.floor[3] < size.before[3]


@pytest.mark.parametrize(
    ("effect", "parameters", "quantity", "channels"),
    [
        ("table_tilt", {"x_rad": 0.004}, "the angle within a revolution", {"1", "2"}),
        ("centrifugal_flex", {"stretch_s2_rad2": 8e-5}, "the rate", {"1", "2"}),
        ("eccentricity", {"x_m": 1e-3, "y_m": 0.0}, "the rate", {"1"}),
        ("bias_temperature", {"a21_m_s2_K": 0.02}, "the temperature", {"1"}),
    ],
)
def test_the_form_of_an_error_is_over_what_orders_it_and_what_was_added_follows(effect, parameters, quantity, channels):
    form = views(effect, **parameters).form
    assert form.quantity == quantity
    assert form.channel[2] in channels
    assert form.share > 0.4
    assert (np.abs(form.mean - form.form) < 5.0 * form.std).mean() > 0.9
    assert np.abs(form.form).max() > 5.0 * np.median(form.std)


def test_noise_has_no_form():
    assert all(views(seed=seed).form is None for seed in range(4))


def test_the_angle_speaks_with_the_right_order_and_amplitude():
    found = views("table_tilt", x_rad=0.004, y_rad=-0.002)
    line = found.orders.line_before
    assert line.significant
    assert line.place == pytest.approx(1.0, abs=1e-9)
    # Gravity across the axis: g · |tilt|, known to about 2σ/√n = 1e-3 m/s² per channel; the largest of eight.
    assert line.amplitude.max() == pytest.approx(9.80665 * np.hypot(0.004, 0.002), abs=3e-3)
    assert not found.orders.line_after or not found.orders.line_after.significant
    assert sum("per revolution" in sentence for sentence in found.sentences) == 1


def test_cogging_is_told_by_its_order_and_not_as_a_tone():
    found = views("cogging", amplitude_rad_s2=1.0, order=7, phase_rad=1.0)
    assert found.orders.line_before.place == pytest.approx(7.0, abs=0.05)
    assert found.orders.sentence
    assert not found.spectrum.sentence


def test_a_tone_is_told_by_its_frequency_and_not_as_a_ripple():
    found = views("interference_tone", amplitude_m_s2=0.02, frequency_hz=11.3, phase_rad=1.0)
    line = found.spectrum.line_before
    assert line.place == pytest.approx(11.3, abs=1 / SETTING.duration)
    # Between two lines of the spectrum a tone loses up to 36 % of its amplitude.
    assert 0.6 * 0.02 < np.median(line.amplitude) < 1.05 * 0.02
    assert "all channels" in found.spectrum.sentence
    assert not found.orders.sentence


def test_bias_instability_is_noise_and_not_a_discrepancy():
    level = 0.5e-3 * 9.80665  # the most that chips of this kind have
    run = made_run([], seed=3, setting=replace(SETTING, bias_instability=level))
    assert residual_views(run, CHANNELS, bias_instability=level).sentences == ()
    assert residual_views(run, CHANNELS, bias_instability=0.0).whiteness.sentence


def test_a_dead_channel_and_a_gap_are_left_out():
    run = made_run([make_effect("table_tilt", {"x_rad": 0.004})])
    valid, measured = run.valid.copy(), run.measured.copy()
    valid[:, 4] = False
    valid[1000:1400] = False
    measured[~valid] = 1e6  # whatever stands there must not count
    found = residual_views(replace(run, valid=valid, measured=measured), CHANNELS, bias_instability=BIAS_INSTABILITY)
    assert np.isnan(found.size.before[4])
    assert np.isfinite(np.delete(found.size.before, 4)).all()
    assert found.size.before[0] < 0.1
    assert found.form.quantity == "the angle within a revolution"


def test_a_table_that_hardly_turns_has_no_orders():
    run = made_run()
    rest = replace(run, angle=np.full_like(run.t, 0.3), rate=np.zeros_like(run.t), acceleration=np.zeros_like(run.t))
    found = residual_views(rest, CHANNELS, bias_instability=BIAS_INSTABILITY)
    assert found.orders is None
    assert found.sentences == ()


def test_ljung_box_against_the_formula_written_out():
    rng = np.random.default_rng(5)
    series = rng.standard_normal((300, 1))
    p_value, _ = ljung_box(series, lags=3)
    x = series[:, 0]
    rho = [np.sum(x[lag:] * x[:-lag]) / np.sum(x**2) for lag in (1, 2, 3)]
    statistic = 300 * 302 * sum(value**2 / (300 - lag) for lag, value in zip((1, 2, 3), rho, strict=True))
    # Survival of χ² with three degrees of freedom in closed form.
    from math import erfc, exp, pi, sqrt

    expected = erfc(sqrt(statistic / 2)) + sqrt(2 * statistic / pi) * exp(-statistic / 2)
    assert p_value[0] == pytest.approx(expected, rel=1e-9)


def test_whiteness_tests_are_calibrated_and_see_colour():
    rng = np.random.default_rng(6)
    white = rng.standard_normal((2000, 400))
    for test in (lambda x: ljung_box(x)[0], lambda x: cumulative_periodogram(x)[0]):
        # 400 p-values below 0.1: 40 ± 6; Kolmogorov's limit is a little conservative at 1000 points.
        assert 20 <= np.sum(test(white) < 0.1) <= 60
        assert (test(lfilter([1.0], [1.0, -0.2], white, axis=0)) < 1e-3).mean() > 0.9
    assert ljung_box(lfilter([1.0], [1.0, 0.3], white, axis=0))[1].mean() == pytest.approx(-0.3, abs=0.01)


def test_whitening_makes_coloured_noise_white():
    from scipy.fft import dct

    from sim.trials import bias_instability

    rng = np.random.default_rng(7)
    white = np.array([0.03, 0.02])
    noise = white * rng.standard_normal((6000, 2)) + bias_instability(rng, 6000, 2, 0.01)
    gain = whitening_gain(6000, 0.01, white, 0.01)
    series = standardise(dct(noise, type=2, norm="ortho", axis=0) * gain)
    assert_allclose(series.std(axis=0), 1.0, atol=0.05)
    assert (ljung_box(noise)[0] < 1e-6).all()
    assert (ljung_box(series)[0] > 1e-3).all()
