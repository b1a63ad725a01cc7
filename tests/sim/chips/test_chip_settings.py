"""A chip's own supply and output data rate, from its array file to the simulated readings."""

from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray, InputError
from gfimu.array import white_noise_std
from sim import Sensor, SensorSettings, conversion_groups
from sim.ride import Ride
from sim.scenarios import Scenario
from sim.simulation import simulate
from sim.twin import Twin

CUBE = AccelerometerArray.load("cube12")
MG = 9.80665e-3


def with_chip(number, **settings):
    chips = list(CUBE.chips)
    chips[number] = replace(chips[number], **settings)
    return replace(CUBE, chips=tuple(chips))


def built(array, settings=SensorSettings()):
    return Sensor.build(array, settings, np.random.default_rng(5))


def test_the_supply_of_one_chip_shifts_that_chip_alone():
    usual, high = built(CUBE), built(with_chip(1, supply=3.3))
    shift = (high.errors.bias - usual.errors.bias) / MG
    np.testing.assert_allclose(shift, [0, 0, 0, 25, 25, -20, 0, 0, 0, 0, 0, 0], atol=1e-4)
    gain = (1 + high.errors.scale) / (1 + usual.errors.scale)
    np.testing.assert_allclose(gain, [1, 1, 1, 265 / 256, 265 / 256, 1, 1, 1, 1, 1, 1, 1])


def test_the_output_data_rate_of_one_chip_sets_its_noise_and_its_last_bit():
    usual, fast = built(CUBE), built(with_chip(2, output_data_rate=1600.0))
    ratio = fast.noise_std / usual.noise_std
    assert (ratio[6:9] > 3.9).all()
    np.testing.assert_array_equal(np.delete(ratio, range(6, 9)), 1.0)
    assert fast.zero_lsb.tolist() == [False] * 6 + [True] * 3 + [False] * 3
    expected = np.repeat([1.0, 1.0, 4.0, 1.0], 3)
    at_100_hz = with_chip(2, output_data_rate=1600.0)
    np.testing.assert_allclose(white_noise_std(at_100_hz, 100.0) / white_noise_std(CUBE, 100.0), expected)
    twin = Twin.load("cube12_turntable")
    found = twin.with_array(at_100_hz).expected_noise(100.0).white / twin.expected_noise(100.0).white
    assert (found[6:9] > 3.9).all()
    np.testing.assert_array_equal(np.delete(found, range(6, 9)), 1.0)


def test_chips_of_another_rate_average_over_another_time():
    ((offsets, columns),) = conversion_groups(CUBE, SensorSettings())
    np.testing.assert_array_equal(columns, np.arange(12))
    groups = conversion_groups(with_chip(0, output_data_rate=400.0), SensorSettings())
    assert [list(one) for _, one in groups] == [[0, 1, 2], [3, 4, 5, 6, 7, 8, 9, 10, 11]]
    np.testing.assert_allclose(groups[0][0], offsets / 4)
    np.testing.assert_array_equal(groups[1][0], offsets)


def test_a_scenario_simulates_the_chips_as_its_array_file_has_them(tmp_path):
    (tmp_path / "mine.toml").write_text(with_chip(0, output_data_rate=400.0).to_toml())
    text = (
        'array = "{}"\nduration_s = 0.5\n[motion]\nstart_rate_rad_s = 60.0\n'
        'segment = [{{ kind = "hold", duration_s = 0.5 }}]'
        "\n[sensor]\nerrors = false\nnoise = false\nquantisation = false\n"
        '[[effect]]\nname = "table_tilt"\nparameters = {{ x_rad = 0.1 }}\n'
    )
    (tmp_path / "own.toml").write_text(text.format("mine.toml"))
    (tmp_path / "usual.toml").write_text(text.format("cube12"))
    own, usual = simulate(tmp_path / "own.toml"), simulate(tmp_path / "usual.toml")
    assert own.array.chips[0].output_data_rate == 400.0
    np.testing.assert_array_equal(own.readings[:, 3:], usual.readings[:, 3:])
    swing = own.readings[:, 0].std() / usual.readings[:, 0].std()
    assert swing == pytest.approx(np.cos(60 / 4 / 400) / np.cos(60 / 4 / 100), rel=1e-3)


def test_a_rate_that_the_part_does_not_have_is_refused():
    with pytest.raises(InputError, match="adxl345: output data rate 150 Hz does not exist"):
        built(with_chip(3, output_data_rate=150.0))
    with pytest.raises(InputError, match=r"adxl345: supply_V 5: figures exist for 2.5 and 3.3 V"):
        built(with_chip(3, supply=5.0))
    other = replace(CUBE.with_part("mpu6050"), chips=(replace(CUBE.chips[0], part="mpu6050", supply=3.0),))
    assert built(other, SensorSettings(output_data_rate=125.0)).errors.bias.shape == (3,)


def test_the_firmware_sets_the_rate_of_every_chip():
    scenario = replace(Scenario.load("rest"), array=with_chip(2, output_data_rate=1600.0), duration=0.1)
    np.testing.assert_array_equal(
        Ride(scenario).sensor(100.0).noise_std, Ride(replace(scenario, array=CUBE)).sensor(100.0).noise_std
    )
