"""Channel frequency classes against the formulas of the standards and against their corner frequencies."""

import math

import numpy as np
import pytest
from scipy.signal import butter, freqz

from gfimu import InputError
from gfimu.motion.impact.channel_class import CHANNEL_CLASSES, STANDARDS, channel_filter, filter_coefficients


def as_printed(channel_class: float, period_s: float) -> tuple[list[float], list[float]]:
    """SAE J211-1, appendix C, as printed."""
    wd = 2 * math.pi * channel_class * 2.0775
    wa = math.sin(wd * period_s / 2) / math.cos(wd * period_s / 2)
    scale = 1 + math.sqrt(2) * wa + wa**2
    a0 = wa**2 / scale
    b1 = -2 * (wa**2 - 1) / scale
    b2 = (-1 + math.sqrt(2) * wa - wa**2) / scale
    return [a0, 2 * a0, a0], [1.0, -b1, -b2]


@pytest.mark.parametrize("channel_class", CHANNEL_CLASSES)
@pytest.mark.parametrize("rate", [10_000.0, 20_000.0, 100_000.0])
def test_coefficients_are_those_of_the_standard(channel_class, rate):
    forward, back = filter_coefficients(channel_class, rate)
    np.testing.assert_allclose(forward, as_printed(channel_class, 1 / rate)[0], rtol=1e-12)
    np.testing.assert_allclose(back, as_printed(channel_class, 1 / rate)[1], rtol=1e-12)


@pytest.mark.parametrize("standard", STANDARDS)
def test_one_pass_is_a_butterworth_of_two_poles(standard):
    forward, back = filter_coefficients(180, 10_000.0, standard)
    expected = butter(2, STANDARDS[standard] * 180, fs=10_000.0)
    np.testing.assert_allclose(forward, expected[0], rtol=1e-12)
    np.testing.assert_allclose(back, expected[1], rtol=1e-11)


@pytest.mark.parametrize(("channel_class", "corner_hz"), [(60, 100.0), (180, 300.0), (600, 1000.0), (1000, 1650.0)])
def test_three_decibels_are_lost_at_the_corner_of_the_class(channel_class, corner_hz):
    """SAE J211-1, table 1: −3 dB frequency; both passes together, without the warping of a low sample rate."""
    _, response = freqz(*filter_coefficients(channel_class, 200_000.0), worN=[corner_hz], fs=200_000.0)
    assert 20 * math.log10(abs(response[0]) ** 2) == pytest.approx(-3.0, abs=0.15)


def test_the_filter_has_no_phase_and_keeps_constants_and_slopes():
    t = np.arange(2000) / 10_000.0
    wave = np.column_stack([np.sin(2 * np.pi * 20 * t), 3.0 + 2.0 * t])
    filtered = channel_filter(wave, 10_000.0, 600)
    np.testing.assert_allclose(filtered[:, 1], wave[:, 1], atol=1e-9)
    np.testing.assert_allclose(filtered[300:-300, 0], wave[300:-300, 0], atol=2e-4)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: filter_coefficients(1000, 3200.0), "needs 10000 samples per second, there are 3200; take class 180"),
        (lambda: filter_coefficients(60, 100.0), "record faster"),
        (lambda: filter_coefficients(0, 1e4), "above 0"),
        (lambda: filter_coefficients(float("nan"), 1e4), "above 0"),
        (lambda: filter_coefficients(60, 1e4, "din"), "choose among sae, iso"),
        (lambda: channel_filter(np.ones(50), 1e4, 60), "too few"),
        (lambda: channel_filter(np.full(500, np.nan), 1e4, 60), "readings are missing"),
    ],
)
def test_wrong_input_is_refused(call, message):
    with pytest.raises(InputError, match=message):
        call()
