"""What the ADXL345 emits, against the figures of its data sheet (Analog Devices, ADXL345 Rev. E).

The figures are written out here again, in the data sheet's own units.
"""

from dataclasses import replace

import allantools
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gfimu import AccelerometerArray, InputError
from sim import DataSheet, Sensor, SensorErrors, SensorSettings, quantise
from sim.chips.adxl345 import conversion_offsets, draw_errors, flicker

MG = 9.80665e-3
LSB = 3.9 * MG
ONLY_NOISE = SensorSettings(errors=False)
QUIET = SensorSettings(errors=False, noise=False)


@pytest.fixture(scope="module")
def cube12():
    return AccelerometerArray.load("cube12")


@pytest.fixture(scope="module")
def sheet():
    return DataSheet.load("adxl345")


def emitted(array, settings, force, seed=1):
    """Readings at 25 °C for a constant or given specific force, m/s²."""
    rng = np.random.default_rng(seed)
    sensor = Sensor.build(array, settings, rng)
    return sensor.sense(force, np.full(len(force), 25.0), rng)


@pytest.mark.parametrize(
    ("rate", "x", "z"),
    [(12.5, 0.75, 1.1), (100.0, 0.75, 1.1), (200.0, 0.75 * 2**0.5, 1.1 * 2**0.5), (800.0, 0.75 * 8**0.5, 1.1 * 8**0.5)],
)
def test_noise_of_the_codes(cube12, rate, x, z):
    n = 20_000
    # Rests between codes of every phase, so that the quantisation error is uniform over channels and rows.
    force = np.random.default_rng(0).uniform(-5 * LSB, 5 * LSB, size=12) + np.linspace(0, LSB, n)[:, None]
    settings = replace(ONLY_NOISE, output_data_rate=rate)
    noise = (emitted(cube12, settings, force) - force).std(axis=0) / LSB
    # Standard error of a standard deviation over n: 1/√(2n) = 0.5 %; five of them.
    np.testing.assert_allclose(noise, np.tile([x, x, z], 4), rtol=5 / np.sqrt(2 * n))


@pytest.mark.parametrize("rate", [1600.0, 3200.0])
def test_noise_and_last_bit_at_the_highest_rates(cube12, rate):
    n = 20_000
    force = np.linspace(0, 2 * LSB, n)[:, None] + np.zeros(12)
    readings = emitted(cube12, replace(ONLY_NOISE, output_data_rate=rate), force)
    codes = np.round(readings / LSB).astype(int)
    assert not np.any(codes % 2)  # the last bit is always zero
    noise = (readings - force).std(axis=0) / LSB
    np.testing.assert_allclose(noise, np.tile([0.75, 0.75, 1.1], 4) * np.sqrt(rate / 100), rtol=5 / np.sqrt(2 * n))
    # Clearing the bit shifts the mean down by half a count.
    standard_error = 1.1 * np.sqrt(rate / 100) / np.sqrt(n)
    np.testing.assert_allclose((readings - force).mean(axis=0) / LSB, -0.5, atol=5 * standard_error)


@pytest.mark.parametrize(
    ("settings", "step_mg", "lowest", "highest"),
    [
        ({"range_g": 16}, 3.9, -4096, 4095),
        ({"range_g": 8}, 3.9, -2048, 2047),
        ({"range_g": 2}, 3.9, -512, 511),
        ({"range_g": 16, "full_resolution": False}, 31.2, -512, 511),
        ({"range_g": 4, "full_resolution": False}, 7.8, -512, 511),
    ],
)
def test_steps_and_range(cube12, settings, step_mg, lowest, highest):
    force = np.linspace(-25 * 1000 * MG, 25 * 1000 * MG, 100_001)[:, None] + np.zeros(12)
    readings = emitted(cube12, replace(QUIET, **settings), force)
    values = np.unique(readings[:, 0])
    np.testing.assert_allclose(np.diff(values), step_mg * MG, rtol=1e-6)
    np.testing.assert_allclose(values[[0, -1]], np.array([lowest, highest]) * step_mg * MG, rtol=1e-6)
    inside = (force > (lowest + 1) * step_mg * MG) & (force < (highest - 1) * step_mg * MG)
    assert np.abs(readings - force)[inside].max() <= 0.5 * step_mg * MG * (1 + 1e-6)


def test_the_last_bit_moves_in_reduced_resolution_above_2_g(cube12):
    force = np.linspace(-50, 50, 5001)[:, None] + np.zeros(12)
    fast = replace(QUIET, output_data_rate=3200.0, full_resolution=False)
    for range_g, odd in ((2, False), (16, True)):
        step = 3.9 * MG * range_g / 2
        codes = np.round(emitted(cube12, replace(fast, range_g=range_g), force)[:, 0] / step).astype(int)
        assert np.any((codes % 2 == 1) & (np.abs(codes) < 500)) == odd


def test_supply_of_3_3_volts(cube12, sheet):
    low, high = (
        draw_errors(cube12, {"adxl345": sheet}, supply=supply, rng=np.random.default_rng(3)) for supply in (2.5, 3.3)
    )
    np.testing.assert_allclose((high.bias - low.bias) / MG, np.tile([25, 25, -20], 4), rtol=1e-4)
    np.testing.assert_allclose((1 + high.scale) / (1 + low.scale), np.tile([265 / 256, 265 / 256, 1.0], 4))


def test_drawn_errors_have_the_spread_of_the_data_sheet(cube12, sheet):
    rng, draws = np.random.default_rng(7), 1500
    chips = [draw_errors(cube12, {"adxl345": sheet}, supply=2.5, rng=rng) for _ in range(draws)]
    by_axis = np.array([chip.bias for chip in chips]).reshape(-1, 3) / MG  # (6000, 3)
    tolerance = 5 / np.sqrt(2 * len(by_axis))
    np.testing.assert_allclose(by_axis.std(axis=0), [35, 35, 40], rtol=tolerance)
    np.testing.assert_allclose(by_axis.mean(axis=0), 0.0, atol=5 * 40 / np.sqrt(len(by_axis)))
    assert np.all(np.abs(by_axis).max(axis=0) < [150, 150, 250])

    def spread(name):
        values = np.array([getattr(chip, name) for chip in chips])
        return values[np.nonzero(values)].std()

    assert spread("scale") == pytest.approx(0.01, rel=tolerance)
    assert spread("cross_axis") == pytest.approx(0.01, rel=tolerance)
    assert spread("misalignment") == pytest.approx(np.radians(0.1), rel=tolerance)
    assert spread("quadratic") == pytest.approx(0.005 / (16 * 1000 * MG), rel=tolerance)  # 0.5 % of full scale there
    assert spread("scale_temperature") == pytest.approx(1e-4, rel=tolerance)
    drift = np.array([chip.bias_temperature for chip in chips]).reshape(-1, 3) / MG
    np.testing.assert_allclose(drift.std(axis=0), [0.4, 0.4, 1.2], rtol=tolerance)


def test_limits_cut_the_draws_off(cube12, sheet):
    tight = replace(sheet, offset_limit=np.full(3, 50 * MG))
    rng = np.random.default_rng(0)
    biases = np.array([draw_errors(cube12, {"adxl345": tight}, supply=2.5, rng=rng).bias for _ in range(200)])
    assert np.abs(biases).max() <= 50 * MG
    # A normal distribution of 35 mg cut at 50 mg (1.4286 σ) keeps a standard deviation of 25.0 mg.
    assert biases[:, [0, 1]].std() == pytest.approx(25.0 * MG, rel=0.1)


def test_errors_stay_inside_their_chip(cube12, sheet):
    errors = draw_errors(cube12, {"adxl345": sheet}, supply=2.5, rng=np.random.default_rng(0))
    same = cube12.chip_of_channel[:, None] == cube12.chip_of_channel
    for matrix in (errors.cross_axis, errors.misalignment):
        assert np.all(matrix[~same] == 0.0)
        assert np.all(np.diag(matrix) == 0.0)
        assert np.count_nonzero(matrix) == 24


def test_each_error_does_what_it_says():
    force = np.array([[10.0, -4.0], [0.0, 2.0]])
    warm = np.array([25.0, 35.0])

    def distorted(**errors):
        return replace(SensorErrors.none(2), **{key: np.array(value) for key, value in errors.items()}).distort(
            force, warm
        )

    np.testing.assert_array_equal(distorted(), force)
    np.testing.assert_allclose(distorted(bias=[0.5, -1.0]), force + np.array([0.5, -1.0]))
    np.testing.assert_allclose(distorted(scale=[0.01, 0.0]), force * [1.01, 1.0])
    np.testing.assert_allclose(distorted(cross_axis=[[0, 0.02], [0, 0]]), [[9.92, -4.0], [0.04, 2.0]])
    np.testing.assert_allclose(distorted(misalignment=[[0, 0], [0.1, 0]]), [[10.0, -3.0], [0.0, 2.0]])
    np.testing.assert_allclose(distorted(quadratic=[1e-3, 0.0]), [[10.1, -4.0], [0.0, 2.0]])
    np.testing.assert_allclose(distorted(bias_temperature=[0.1, 0.0]), [[10.0, -4.0], [1.0, 2.0]])
    np.testing.assert_allclose(distorted(scale_temperature=[0.0, 0.01]), [[10.0, -4.0], [0.0, 2.2]])


def test_a_seed_makes_the_same_chips_and_the_same_noise(cube12):
    force = np.zeros((50, 12))
    first, again, other = (emitted(cube12, SensorSettings(), force, seed) for seed in (5, 5, 6))
    np.testing.assert_array_equal(first, again)
    assert np.any(first != other)


def test_a_perfect_sensor_passes_the_specific_force_through(cube12):
    force = np.random.default_rng(0).normal(size=(100, 12)) * 300.0
    np.testing.assert_array_equal(emitted(cube12, SensorSettings(bias_instability=1.0).perfect(), force), force)


def test_noise_factor_multiplies_the_white_noise(cube12):
    rng = np.random.default_rng(2)
    sensor = Sensor.build(cube12, ONLY_NOISE, rng)
    analogue = sensor.analogue(np.zeros((20_000, 12)), np.full(20_000, 25.0), rng, noise_factor=3.0)
    np.testing.assert_allclose(analogue.std(axis=0), 3.0 * sensor.noise_std, rtol=5 / np.sqrt(40_000))


def test_bandwidth_is_half_the_output_data_rate(sheet):
    for rate in (100.0, 800.0):
        offsets = conversion_offsets(replace(QUIET, output_data_rate=rate), sheet)
        response = np.mean(np.exp(2j * np.pi * (rate / 2) * offsets))
        assert abs(response) == pytest.approx(np.sqrt(0.5))
        assert response.imag == pytest.approx(0.0, abs=1e-12)  # no delay
        assert abs(np.mean(np.exp(2j * np.pi * (rate / 100) * offsets))) > 0.999
    np.testing.assert_array_equal(conversion_offsets(replace(QUIET, bandwidth=False), sheet), [0.0])


def test_flicker_has_its_allan_floor():
    instability, rate = 0.002, 100.0
    noise = flicker((1 << 15, 24), instability, np.random.default_rng(4))
    for tau in (0.2, 1.0, 5.0):
        variances = [allantools.oadev(x, rate=rate, data_type="freq", taus=[tau])[1][0] ** 2 for x in noise.T]
        # IEEE Std 952-1997, C.1.3: flat at √(2 ln 2/π) B.
        assert np.sqrt(np.mean(variances)) == pytest.approx(np.sqrt(2 * np.log(2) / np.pi) * instability, rel=0.05)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"range_g": 3}, "range_g 3; valid: 2, 4, 8, 16"),
        ({"output_data_rate": 120.0}, "output data rate 120 Hz"),
        ({"output_data_rate": 6400.0}, "output data rate 6400 Hz"),
        ({"supply": 5.0}, "supply_V 5"),
    ],
)
def test_settings_the_chip_does_not_have(cube12, wrong, message):
    with pytest.raises(InputError, match=message):
        Sensor.build(cube12, replace(SensorSettings(), **wrong), np.random.default_rng(0))


def test_another_part_has_its_own_word(cube12):
    rng = np.random.default_rng(0)
    sensor = Sensor.build(cube12, replace(QUIET, range_g=8), rng, part="mpu9150")
    np.testing.assert_allclose(sensor.lsb, 9.80665 * 8 / 32768, rtol=1e-6)
    assert set(sensor.highest) == {32767}
    with pytest.raises(InputError, match="full resolution"):
        Sensor.build(cube12, replace(QUIET, full_resolution=False), rng, part="mpu9150")


@given(st.lists(st.floats(-600.0, 600.0), min_size=1, max_size=50))
def test_codes_are_nearest_and_in_order(values):
    value = np.sort(np.array(values))
    codes = quantise(value, -512, 511)
    inside = (value >= -512) & (value < 511)
    assert np.all(np.abs(codes - value)[inside] <= 0.5)
    assert np.all(np.diff(codes) >= 0)
    assert codes.min() >= -512
    assert codes.max() <= 511
    assert np.all(quantise(value, -512, 511, zero_lsb=True) % 2 == 0)
