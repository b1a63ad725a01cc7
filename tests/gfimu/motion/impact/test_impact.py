"""An impact on the nine-accelerometer package: figures against the motion that was put in."""

from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray, InputError, specific_force
from gfimu.base import STANDARD_GRAVITY
from gfimu.motion.impact.criteria import head_injury_criterion
from gfimu.motion.impact.event import ImpactSettings, measure_impact, time_zero
from gfimu.recording import Recording

RATE_HZ, START_S, PULSE_S = 20_000.0, 0.05, 0.010
PEAK_P = 100.0 * STANDARD_GRAVITY * np.array([0.96, 0.28, 0.0])  # 100 g
PEAK_ALPHA = np.array([0.0, 2000.0, -5000.0])
NAP = AccelerometerArray.load("nap_3_2_2_2")


def blow(array=NAP, *, seed=0, gain_std=0.0, rate=RATE_HZ):
    """Half-sines of 10 ms in p and α, with biases, noise, gravity along z; ω by the exact integral."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 0.12, 1.0 / rate)
    phase = np.clip((t - START_S) / PULSE_S, 0.0, 1.0) * np.pi
    pulse = np.sin(phase)[:, None]
    omega = PEAK_ALPHA * (PULSE_S / np.pi) * (1.0 - np.cos(phase))[:, None]
    readings = specific_force(array, PEAK_P * pulse + [0.0, 0.0, STANDARD_GRAVITY], PEAK_ALPHA * pulse, omega)
    readings *= 1.0 + gain_std * rng.standard_normal(array.n_channels)
    readings += rng.normal(0.0, 0.3, readings.shape) + rng.normal(0.0, 2.0, array.n_channels)
    return Recording.from_arrays(t, readings, array)


@pytest.mark.parametrize("name", ["nap_3_2_2_2", "cube12", "p1_face_diagonals"])
@pytest.mark.parametrize("channel_class", [1000, 180])
def test_peaks_are_those_of_the_motion(name, channel_class):
    array = AccelerometerArray.load(name)
    found = measure_impact(blow(array), array, ImpactSettings(channel_class))
    assert found.peak_p_m_s2 == pytest.approx(100.0 * STANDARD_GRAVITY, rel=0.01)
    assert found.peak_alpha_rad_s2 == pytest.approx(np.linalg.norm(PEAK_ALPHA), rel=0.05)
    assert found.peak_omega_rad_s == pytest.approx(np.linalg.norm(PEAK_ALPHA) * 2 * PULSE_S / np.pi, rel=0.02)
    np.testing.assert_allclose(found.velocity_change_m_s, PEAK_P * 2 * PULSE_S / np.pi, rtol=0.02, atol=0.02)
    assert found.time_zero_s == pytest.approx(START_S, abs=3e-4)
    assert found.peak_p_time_s == pytest.approx(PULSE_S / 2, abs=4e-4)
    assert found.duration_s == pytest.approx(PULSE_S, abs=6e-4)


def test_the_standard_deviation_of_the_peak_covers_noise_and_gains():
    peaks = [measure_impact(blow(seed=seed, gain_std=0.01), NAP) for seed in range(60)]
    errors = [(one.peak_alpha_rad_s2 - np.linalg.norm(PEAK_ALPHA)) / one.peak_alpha_std_rad_s2 for one in peaks]
    assert np.std(errors) == pytest.approx(1.0, abs=3.0 / np.sqrt(2 * len(errors)))


def test_a_reversed_array_is_a_warning_where_the_direction_is_known():
    right = measure_impact(blow(), NAP, ImpactSettings(direction="+x"))
    assert not any("polarity" in one for one in right.warnings)
    turned = measure_impact(blow(), NAP, ImpactSettings(direction="-x"))
    assert "accelerated along +x, not -x" in turned.warnings[0]


@pytest.mark.parametrize("name", ["nap_3_2_2_2", "cube12"])
@pytest.mark.parametrize("number", [1, 5, 7])
def test_a_reversed_channel_is_named_among_those_with_its_signature(name, number):
    array = AccelerometerArray.load(name)
    run = blow(array, gain_std=0.01)
    readings = run.readings.copy()
    readings[:, number] *= -1.0
    (remark,) = (one for one in measure_impact(replace(run, readings=readings), array).warnings if "range" not in one)
    assert array.channels[number] in remark
    assert "turn the sign" in remark
    assert len(remark.split(" or ")) <= 2


@pytest.mark.parametrize("seed", range(5))
def test_gain_errors_of_the_data_sheet_are_no_reversal(seed):
    assert not any("rigid body" in one for one in measure_impact(blow(seed=seed, gain_std=0.01), NAP).warnings)


def test_a_cut_off_peak_is_a_warning():
    assert any("at the end of the range" in one for one in measure_impact(blow(), NAP).warnings)  # ADXL345: ±16 g


def test_time_zero_is_behind_the_last_quiet_sample():
    changes = np.array([0.0, 6.0, 1.0, 2.0, 7.0, 30.0, 9.0, 1.0])[:, None]
    assert time_zero(changes, 5.0) == 4


def test_head_injury_criterion_of_a_square_and_of_a_half_sine():
    square = np.zeros(1000)
    square[200:401] = 50.0  # 50 g for 10 ms at 20 kHz
    assert head_injury_criterion(square, 5e-5) == pytest.approx(0.010 * 50.0**2.5, rel=0.01)
    t = np.arange(0, 0.01, 1e-5)
    found = head_injury_criterion(100.0 * np.sin(np.pi * t / 0.01), 1e-5)
    assert found == pytest.approx(0.4146 * 0.01 * 100.0**2.5, rel=1e-3)


def test_the_criterion_of_a_half_sine_by_search():
    """The best window of a half-sine lies in its middle: its half-width, as a share of the pulse, by a plain search."""
    half = np.linspace(0.01, 0.499, 100_000)
    mean = np.sin(np.pi * half) / (np.pi * half)
    assert (2 * half * mean**2.5).max() == pytest.approx(0.4146, abs=1e-4)


@pytest.mark.parametrize(
    ("recording", "settings", "message"),
    [
        (lambda: blow().slice(1010), {}, "begins within the impact"),
        (lambda: blow().slice(800), {}, "are needed to zero the channels"),
        (lambda: blow().slice(0, 900), {}, "no impact"),
        (lambda: blow(rate=3200.0), {}, "take class 180"),
    ],
)
def test_what_cannot_be_measured_is_refused(recording, settings, message):
    with pytest.raises(InputError, match=message):
        measure_impact(recording(), NAP, ImpactSettings(**settings))


@pytest.mark.parametrize("settings", [{"direction": "x"}, {"threshold_m_s2": 0.0}, {"threshold_m_s2": float("nan")}])
def test_settings_are_checked(settings):
    with pytest.raises(InputError):
        ImpactSettings(**settings)
