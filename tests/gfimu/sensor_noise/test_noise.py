"""Noise: Allan deviation against published values and allantools, identification on synthetic noise, export."""

import math

import allantools
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gfimu import InputError, UnitError
from gfimu.recording import Recording
from gfimu.sensor_noise import (
    allan_deviation,
    flicker_noise,
    identify_noise,
    kalibr_yaml,
    model_variance,
    random_walk,
    recording_noise,
    synthesise_noise,
    white_noise,
)

RATE = 100.0


def nbs14_1000():
    values, x = [], 1234567890
    for _ in range(1000):
        values.append(x / (2**31 - 1))
        x = 16807 * x % (2**31 - 1)
    return np.array(values)


def test_nbs14():
    """NIST SP 1065, table 31: the 1000-point set at averaging factors 1, 10 and 100."""
    data = nbs14_1000()
    plain = allan_deviation(data, 1.0, factors=[1, 10, 100], overlapping=False).deviation
    overlapping = allan_deviation(data, 1.0, factors=[1, 10, 100]).deviation
    np.testing.assert_allclose(plain, [0.2922319, 0.09965736, 0.03897804], rtol=2e-7)
    np.testing.assert_allclose(overlapping, [0.2922319, 0.09159953, 0.03241343], rtol=2e-7)


@settings(max_examples=20, deadline=None)
@given(st.integers(10, 3000), st.floats(0.1, 1000.0), st.integers(0, 2**32 - 1), st.booleans())
def test_equals_allantools(n, rate, seed, drifting):
    rng = np.random.default_rng(seed)
    data = 5.0 + (np.cumsum(rng.normal(size=n)) if drifting else rng.normal(size=n))
    own = allan_deviation(data, rate)
    tau, deviation, _, _ = allantools.oadev(data, rate, data_type="freq", taus=own.factor / rate)
    np.testing.assert_allclose(own.tau, tau, rtol=1e-12)
    np.testing.assert_allclose(own.deviation, deviation, rtol=1e-12)


def test_default_grid_is_logarithmic():
    curve = allan_deviation(np.random.default_rng(0).normal(size=100_000), RATE)
    assert curve.factor[0] == 1
    assert curve.factor[-1] == 100_000 // 9
    assert 35 <= len(curve.factor) <= 45


@pytest.mark.parametrize(
    ("values", "options", "message"),
    [
        ([1.0, 2.0], {}, "three or more"),
        ([1.0, np.nan, 2.0, 3.0], {}, "without gaps"),
        ([1.0, 2.0, 3.0, 4.0], {"factors": [3]}, "1 to half the series"),
        ([1.0, 2.0, 3.0, 4.0], {"factors": [0]}, "1 to half the series"),
        ([1.0, 2.0, 3.0, 4.0], {"rate": -1.0}, "must be positive"),
    ],
)
def test_allan_refusals(values, options, message):
    with pytest.raises(InputError, match=message):
        allan_deviation(values, options.pop("rate", RATE), **options)


def test_spectra_of_synthetic_noise():
    """Periodograms against the two-sided densities N², B²/(2πf), K²/(2πf)²; 400 runs, each ordinate ±5 %."""
    rng = np.random.default_rng(1)
    n, runs = 4096, 400
    f = np.fft.rfftfreq(n, 1 / RATE)[1:]
    band = (f > 1.0) & (f < 10.0)
    window = np.hanning(n)
    for draw, coefficient, density in (
        (white_noise, 0.003, lambda f: 0.003**2 + 0 * f),
        (flicker_noise, 0.01, lambda f: 0.01**2 / (2 * np.pi * f)),
        (random_walk, 0.02, lambda f: 0.02**2 / (2 * np.pi * f) ** 2),
    ):
        power = np.zeros(len(f))
        for _ in range(runs):
            data = draw(n, RATE, coefficient, rng)
            power += np.abs(np.fft.rfft((data - data.mean()) * window)[1:]) ** 2 / (RATE * np.sum(window**2)) / runs
        assert np.mean(power[band] / density(f[band])) == pytest.approx(1.0, abs=0.03)


def test_model_forms_are_those_of_the_synthesis():
    """Mean Allan variance of many runs against the fitted forms, to the sampling error of 200 runs."""
    rng = np.random.default_rng(2)
    factors = np.array([1, 4, 16, 64])
    forms = model_variance(factors, RATE)
    for column, draw in ((1, white_noise), (2, flicker_noise), (3, random_walk)):
        runs = [allan_deviation(draw(2000, RATE, 1.0, rng), RATE, factors=factors).variance for _ in range(200)]
        error = np.std(runs, axis=0) / np.sqrt(200)
        np.testing.assert_array_less(np.abs(np.mean(runs, axis=0) - forms[:, column]), 4.5 * error + 1e-12)
    assert model_variance([4096], RATE)[0, 2] == pytest.approx(2 * math.log(2) / math.pi, rel=1e-3)


def test_quantisation_of_an_integrating_sensor():
    """Increments of a velocity rounded to a step q: Allan variance 3Q²/τ² with Q = q/√12, beside white noise."""
    rng = np.random.default_rng(3)
    n, step, N = 200_000, 0.01, 0.05  # a step's noise, 5 mm/s, spreads the rounding errors evenly
    velocity = np.cumsum(white_noise(n + 1, RATE, N, rng) + 0.3) / RATE
    rounded = np.round(velocity / step) * step
    model = identify_noise(np.diff(rounded) * RATE, RATE)
    assert model.found == ("Q", "N")
    assert model["Q"].value == pytest.approx(step / math.sqrt(12), rel=0.02)
    assert model["N"].value == pytest.approx(N, rel=0.05)


@pytest.mark.parametrize("seed", range(3))
def test_round_trip(seed):
    """Simulate, then identify: N within 2 %, K within 15 %."""
    rng = np.random.default_rng(10 + seed)
    model = identify_noise(synthesise_noise(1_000_000, RATE, N=0.003, K=0.0003, rng=rng), RATE)
    assert model.found == ("N", "K")
    assert model["N"].value == pytest.approx(0.003, rel=0.02)
    assert model["K"].value == pytest.approx(0.0003, rel=0.15)
    assert model["N"].low < model["N"].value < model["N"].high


def test_bias_instability_round_trip():
    rng = np.random.default_rng(20)
    model = identify_noise(synthesise_noise(1_000_000, RATE, N=0.003, B=0.001, rng=rng), RATE)
    assert model.found == ("N", "B")
    assert model["B"].value == pytest.approx(0.001, rel=0.1)
    assert model.allan.bias_instability == pytest.approx(0.001, rel=0.25)  # minimum / 0.664, one noisy point


@pytest.mark.study
def test_intervals_are_honest():
    """95 % intervals of N and K over 200 runs, and few terms that are not there."""
    rng = np.random.default_rng(30)
    N, K = 0.003, 0.003
    inside, wrong, normalised = [], 0, []
    for _ in range(200):
        model = identify_noise(synthesise_noise(20_000, RATE, N=N, K=K, rng=rng), RATE)
        if model.found != ("N", "K"):
            wrong += 1
            continue
        inside.append([model["N"].low < N < model["N"].high, model["K"].low < K < model["K"].high])
        normalised.append([(model["N"].value - N) / model["N"].std, (model["K"].value - K) / model["K"].std])
    assert wrong <= 6
    assert np.all(np.mean(inside, axis=0) > 0.92 - 0.02)  # binomial standard deviation of 200: 1.5 %
    np.testing.assert_allclose(np.var(normalised, axis=0), 1.0, atol=4 * np.sqrt(2 / 200))


def test_no_term_is_invented():
    """White noise alone, 200 runs: nothing but N in at least 99 %, and the others' upper limits are given."""
    rng = np.random.default_rng(40)
    found = [identify_noise(white_noise(10_000, RATE, 0.003, rng), RATE) for _ in range(200)]
    assert sum(model.found != ("N",) for model in found) <= 2
    limits = found[0]
    assert all(limits[symbol].high > 0 and not limits[symbol].found for symbol in "QBKR")


def test_ramp_is_found():
    rng = np.random.default_rng(50)
    series = white_noise(100_000, RATE, 0.003, rng) + 2e-5 * np.arange(100_000) / RATE
    model = identify_noise(series, RATE)
    assert "R" in model.found
    assert model["R"].value == pytest.approx(2e-5, rel=0.1)


def test_identification_refusals():
    with pytest.raises(InputError, match="too few to identify"):
        identify_noise(np.zeros(50), RATE)
    with pytest.raises(InputError, match="never change"):
        identify_noise(np.ones(1000), RATE)
    with pytest.raises(InputError, match="not negative"):
        white_noise(10, RATE, -1.0, np.random.default_rng(0))


@pytest.fixture
def recording():
    rng = np.random.default_rng(60)
    readings = np.column_stack([synthesise_noise(30_000, RATE, N=N, rng=rng) for N in (0.003, 0.003, 0.004)])
    readings[:2000] += np.sin(np.arange(2000) / 20)[:, None]  # moved at first
    gyro = {f"gyro_{axis}_rad_s": white_noise(30_000, RATE, 1e-4, rng) for axis in "xyz"}
    return Recording(np.arange(30_000) / RATE, readings, ("a11", "a12", "a13"), reference=gyro)


def test_recording_uses_its_longest_rest(recording):
    noise = recording_noise(recording)
    assert 20.0 < noise.start_s < 22.0
    values = [noise.models[name]["N"].value for name in ("a11", "a12", "a13", "gyro_x")]
    np.testing.assert_allclose(values, [0.003, 0.003, 0.004, 1e-4], rtol=0.03)
    assert set(noise.gyros) == {"gyro_x", "gyro_y", "gyro_z"}
    assert recording_noise(recording, stretch="all").models["a11"].found != ("N",)


def test_one_sample_scatters_by_the_density_and_the_rate(recording):
    """White noise of density N sampled at a rate f has the standard deviation N √f."""
    channels = ("a11", "a12", "a13")
    noise = recording_noise(recording)
    scatter = recording.readings[round(noise.start_s * RATE) :].std(axis=0)
    np.testing.assert_allclose(noise.sample_std(channels), scatter, rtol=0.03)


def test_recording_refusals(recording):
    recording.readings[15_000::10, 1] = np.nan
    with pytest.raises(InputError, match=r"channel a12: .* of its samples are missing"):
        recording_noise(recording)
    with pytest.raises(InputError, match="unknown stretch"):
        recording_noise(recording, stretch="some")
    with pytest.raises(InputError, match="no rest found"):
        recording_noise(recording, rest_threshold=1e-15)
    recording.readings[:, 1] = 1.0
    with pytest.raises(InputError, match="channel a12: the readings never change"):
        recording_noise(recording)


def test_kalibr_export(recording):
    text = kalibr_yaml(recording_noise(recording))
    values = dict(line.split("#")[0].split(":", 1) for line in text.splitlines() if not line.startswith("#"))
    assert list(values) == [
        "accelerometer_noise_density",
        "accelerometer_random_walk",
        "gyroscope_noise_density",
        "gyroscope_random_walk",
        "rostopic",
        "update_rate",
    ]
    expected = math.sqrt((0.003**2 + 0.003**2 + 0.004**2) / 3)
    assert float(values["accelerometer_noise_density"]) == pytest.approx(expected, rel=0.02)
    assert float(values["update_rate"]) == pytest.approx(RATE)
    assert "95 % upper limits" in text
    bare = recording_noise(Recording(recording.t_s, recording.readings, recording.channels))
    assert "add gyroscope_noise_density" in kalibr_yaml(bare)
    counts = recording_noise(Recording(recording.t_s, recording.readings, recording.channels, unit="lsb"))
    with pytest.raises(UnitError, match="Kalibr needs m/s²"):
        kalibr_yaml(counts)
