"""Spectra of residuals: lines in time and in angle where they were put, with their amplitudes."""

from __future__ import annotations

import numpy as np
import pytest
from made_runs import PERIOD, SIGMA, made_view
from numpy.testing import assert_allclose
from scipy.fft import dct

from gfimu.diagnosis.criticism.views.residual_spectrum import order_spectrum, time_spectrum
from gfimu.diagnosis.criticism.views.whiteness import standardise, whitening_gain

N = 6000
T = PERIOD * np.arange(N)
CHANNELS = ("a11", "a12")
RATE = 6.0 + 2.0 * np.sin(0.5 * T)
ANGLE = np.cumsum(RATE) * PERIOD


def spectra(residual, rate=RATE):
    view = made_view(rate, residual)
    gain = whitening_gain(N, PERIOD, view.white, 0.0)
    both = tuple(view.measured - one for one in (view.before, view.after))
    standard = tuple(standardise(dct(one, type=2, norm="ortho", axis=0) * gain) for one in both)
    in_time = time_spectrum(view, CHANNELS, 0.0, both, standard)
    return in_time, order_spectrum(view, CHANNELS, both, standard, in_time.line_before)


def on_first(values):
    return np.column_stack([values, np.zeros(N)])


def test_a_tone_has_its_frequency_and_amplitude():
    # A whole number of cycles in the run: no leakage.
    frequency = 480 / (N * PERIOD)
    in_time, _ = spectra(on_first(0.06 * np.sin(2 * np.pi * frequency * T)))
    line = in_time.line_before
    assert line.significant
    assert line.place == pytest.approx(frequency)
    assert line.amplitude[0] == pytest.approx(0.06, abs=3 * SIGMA * np.sqrt(2.0 / N))
    assert f"{frequency:.4g} Hz" in in_time.sentence
    assert "in a11" in in_time.sentence
    assert in_time.line_after is None or not in_time.line_after.significant


def test_a_ripple_of_the_angle_is_one_order_though_the_rate_swings():
    in_time, in_angle = spectra(on_first(0.05 * np.cos(3.0 * ANGLE + 0.4)))
    line = in_angle.line_before
    assert line.significant
    assert line.place == pytest.approx(3.0, abs=1e-9)
    assert line.amplitude[0] == pytest.approx(0.05, rel=0.1)
    assert "3 cycles per revolution" in in_angle.sentence
    assert in_time.line_before is None or not in_time.line_before.significant  # smeared over frequencies


def test_one_order_is_one_cycle():
    _, in_angle = spectra(on_first(0.05 * np.cos(ANGLE)))
    assert "strongest at 1 cycle per revolution" in in_angle.sentence


def test_a_table_at_rest_adds_nothing_to_an_order():
    rate = np.where(np.arange(N) < N // 2, RATE, 0.0)
    angle = np.cumsum(rate) * PERIOD
    _, in_angle = spectra(on_first(0.05 * np.cos(3.0 * angle)), rate)
    assert in_angle.line_before.place == pytest.approx(3.0, abs=1e-9)
    assert in_angle.line_before.amplitude[0] == pytest.approx(0.05, rel=0.15)  # half of the noise's samples are lost


def test_noise_has_no_line_and_its_level():
    in_time, in_angle = spectra(np.zeros((N, 2)))
    assert in_time.sentence == in_angle.sentence == ""
    # White noise of σ has the one-sided density σ √(2 Δt).
    assert_allclose(in_time.noise, SIGMA * np.sqrt(2.0 * PERIOD))
    assert np.sqrt(np.mean(in_time.before**2)) == pytest.approx(SIGMA * np.sqrt(2.0 * PERIOD), rel=0.05)


def test_a_broad_hump_is_no_line():
    rng = np.random.default_rng(2)
    spectrum = np.fft.rfftfreq(N, PERIOD)
    shape = np.exp(-0.5 * ((spectrum - 10.0) / 0.6) ** 2)  # 36 frequencies wide
    hump = np.fft.irfft(np.fft.rfft(rng.standard_normal(N)) * shape, N)
    in_time, _ = spectra(on_first(0.1 * hump / hump.std()))
    assert in_time.line_before is None
    assert in_time.sentence == ""


def test_a_table_that_hardly_turns_has_no_orders():
    view = made_view(np.full(N, 0.05), np.zeros((N, 2)))  # half a turn
    both = (view.measured - view.before, view.measured - view.after)
    assert order_spectrum(view, CHANNELS, both, both, None) is None
