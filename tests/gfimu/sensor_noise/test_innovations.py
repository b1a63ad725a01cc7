"""White noise and bias instability as one filter: its spectrum is that of the sum, from the first sample on."""

import numpy as np
import pytest

from gfimu import InputError
from gfimu.sensor_noise import add_noise, flicker_shape
from sim.trials import bias_instability

N = 2000
WHITE, FLICKER = np.array([0.03, 0.2, 1.0]), np.array([0.1, 0.2, 0.01])


def spectrum_of_one_over_f(n):
    """Frequencies, cycles per sample, and power of 1/f noise of unit variance over four records, per sample."""
    k = np.arange(1, 2 * n + 1)
    return k / (4 * n), 2 * n / k / np.sum(1.0 / k)


def test_the_processes_together_have_the_spectrum_one_over_f():
    frequency, wanted = spectrum_of_one_over_f(N)
    shape = flicker_shape(N)
    z = np.exp(-2j * np.pi * frequency)[:, None]
    power = np.sum(shape.variance * (1 - shape.decay**2) / np.abs(1 - shape.decay * z) ** 2, axis=1)
    resolved = (frequency >= 1.0 / N) & (frequency <= 0.25)  # above, samples of such noise alias anyway
    assert power[resolved] / wanted[resolved] == pytest.approx(1.0, abs=0.07)


def test_one_number_per_sample_gives_the_spectrum_of_the_sum():
    frequency = np.geomspace(1e-4, 0.5, 50)
    shape = flicker_shape(N)
    gain, innovation, _ = shape.filters(WHITE, FLICKER)
    z = np.exp(-2j * np.pi * frequency)[:, None]
    own = np.sum(shape.variance * (1 - shape.decay**2) / np.abs(1 - shape.decay * z) ** 2, axis=1)
    for channel in range(3):
        passed = 1.0 + np.sum(gain[channel] * z / (1 - shape.decay * z), axis=1)
        wanted = WHITE[channel] ** 2 + FLICKER[channel] ** 2 * own
        # The level is rounded to 2 %, its square to 2 % either way.
        assert innovation[channel] ** 2 * np.abs(passed) ** 2 == pytest.approx(wanted, rel=0.021)


def test_the_first_sample_is_as_likely_as_the_last():
    runs, rng = 3000, np.random.default_rng(1)
    drawn = np.zeros((40, runs))
    add_noise(drawn, np.full(runs, 0.1), np.full(runs, 1.0), rng)
    shape = flicker_shape(40)
    wanted = 0.1**2 + shape.variance.sum()
    error = wanted * np.sqrt(2.0 / runs)
    assert np.mean(drawn[0] ** 2) == pytest.approx(wanted, abs=4 * error)
    assert np.mean(drawn[-1] ** 2) == pytest.approx(wanted, abs=4 * error)
    expected = np.sum(shape.variance * shape.decay**39)
    assert np.mean(drawn[0] * drawn[-1]) == pytest.approx(expected, abs=4 * wanted / np.sqrt(runs))


@pytest.mark.parametrize("average", [1, 10, 100, 500])
def test_the_allan_deviation_is_that_of_a_shaped_spectrum(average):
    channels, rng = 300, np.random.default_rng(2)
    mine = np.zeros((N, channels))
    add_noise(mine, np.full(channels, 0.2), np.ones(channels), rng)
    other = 0.2 * rng.standard_normal((N, channels)) + bias_instability(rng, N, channels, 1.0)

    def allan(readings):
        means = readings.reshape(N // average, average, channels).mean(axis=1)
        return np.sqrt(0.5 * np.mean(np.diff(means, axis=0) ** 2, axis=0))  # (channels,)

    a, b = allan(mine), allan(other)
    error = np.hypot(a.std() / a.mean(), b.std() / b.mean()) / np.sqrt(channels)
    # A spectrum whose sum is scaled to one has 3 % more power at high frequencies (Jensen), and poles ripple by 5 %.
    assert a.mean() / b.mean() == pytest.approx(1.0, abs=0.04 + 3 * error)


def test_noise_is_added_and_drawn_from_the_generator_that_is_given():
    once, twice = np.full((50, 3), 5.0), np.full((50, 3), 5.0)
    add_noise(once, WHITE, FLICKER, np.random.default_rng(3))
    add_noise(twice, WHITE, FLICKER, np.random.default_rng(3))
    assert np.array_equal(once, twice)
    assert 0.0 < np.abs(once - 5.0).max() < 10.0


def test_levels_of_zero_and_too_short_records_are_refused():
    with pytest.raises(InputError, match="above zero"):
        add_noise(np.zeros((50, 3)), np.zeros(3), FLICKER, np.random.default_rng(3))
    with pytest.raises(InputError, match="at least 2 samples"):
        add_noise(np.zeros((1, 3)), WHITE, FLICKER, np.random.default_rng(3))
