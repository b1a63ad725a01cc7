"""Arrays: files, channel names, and the matrices J and Q against their definitions."""

import itertools

import numpy as np
import pytest

from gfimu import AccelerometerArray, InputError
from gfimu.array import ALTERNATE_CORNERS, OMEGA_PRODUCTS, omega_products
from gfimu.base import list_models

SHIPPED = list_models("arrays")


@pytest.mark.parametrize("name", SHIPPED)
def test_file_survives_a_round_trip(name, tmp_path):
    array = AccelerometerArray.load(name)
    path = tmp_path / "copy.toml"
    path.write_text(array.to_toml())
    copy = AccelerometerArray.load(path)
    assert copy.name == array.name == name
    assert copy.channels == array.channels
    assert copy.description == array.description
    np.testing.assert_array_equal(copy.positions, array.positions)
    np.testing.assert_array_equal(copy.axes, array.axes)
    assert copy.length_unit == array.length_unit


@pytest.mark.parametrize("name", SHIPPED)
def test_rows_of_j_and_q_follow_their_definition(name):
    array = AccelerometerArray.load(name)
    omega = np.array([1.3, -0.7, 2.1])
    turn = np.outer(omega, omega) - omega @ omega * np.eye(3)
    for row, centripetal, position, axis in zip(
        array.regression_matrix, array.centripetal_matrix, array.positions, array.axes, strict=True
    ):
        np.testing.assert_allclose(row, np.r_[np.cross(position, axis), axis], atol=1e-15)
        assert centripetal @ omega_products(omega) == pytest.approx(axis @ turn @ position, abs=1e-14)


@pytest.mark.parametrize("name", SHIPPED)
def test_triads_are_right_handed_and_orthogonal(name):
    for chip in AccelerometerArray.load(name).chips:
        np.testing.assert_allclose(chip.axes @ chip.axes.T, np.eye(len(chip.axes)), atol=1e-12)
        if len(chip.axes) == 3:
            assert np.linalg.det(chip.axes) == pytest.approx(1.0)


def test_omega_products_are_named_in_their_order():
    omega = dict(zip("xyz", (2.0, 3.0, 5.0), strict=True))
    expected = [omega[first] * omega[second] for first, second in OMEGA_PRODUCTS]
    np.testing.assert_array_equal(omega_products(list(omega.values())), expected)


@pytest.mark.parametrize("name", ["cube12", "cube12_as_built"])
def test_cube_has_its_chips_at_the_contract_s_corners(name):
    array = AccelerometerArray.load(name)
    np.testing.assert_array_equal(array.chip_positions, 0.05 * ALTERNATE_CORNERS)
    assert array.channels == tuple(f"a{chip}{axis}" for chip, axis in itertools.product((1, 2, 3, 4), (1, 2, 3)))


def test_mimu4444_turns_its_lower_chips_as_published():
    # Carlsson, Skog & Jaldén 2021: v_board = C v_chip for the chips of even number; chip axis i is column i of C.
    c = np.array([[0, -1, 0], [-1, 0, 0], [0, 0, -1]])
    x = [-0.00945] * 4 + [0.00945] * 4
    y = [0.00945, 0.00945, -0.00945, -0.00945] * 2
    z = [0.001, -0.001] * 4
    array = AccelerometerArray.load("mimu4444")
    np.testing.assert_array_equal(array.chip_positions, np.column_stack([x, y, z]))
    for number, chip in enumerate(array.chips, start=1):
        np.testing.assert_array_equal(chip.axes, np.eye(3) if number % 2 else c.T)


def test_origin_moves_with_relative_to():
    array = AccelerometerArray.load("cube12")
    moved = array.relative_to([0.01, 0.02, -0.03])
    np.testing.assert_allclose(moved.chip_positions, array.chip_positions - np.array([0.01, 0.02, -0.03]))
    np.testing.assert_array_equal(moved.axes, array.axes)


CHIP = {"position_m": [0.0, 0.0, 0.1], "axes": [[1, 0, 0]]}


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({}, "no \\[\\[chip\\]\\]"),
        ({"chip": [CHIP], "colour": "red"}, "unknown key 'colour'.*valid: chip"),
        ({"chip": [CHIP | {"axis": [1, 0, 0]}]}, r"\[\[chip\]\] 1: unknown key 'axis'.*did you mean 'axes'\?"),
        ({"chip": [{"axes": [[1, 0, 0]]}]}, "'position_m' is missing"),
        ({"chip": [CHIP | {"position_m": [0, 0]}]}, r"position_m = \[0, 0\] must be a list of 3 finite numbers"),
        ({"chip": [CHIP | {"position_m": "here"}]}, "position_m = 'here' must be a list of 3 finite numbers"),
        ({"chip": [CHIP | {"axes": [[1, 0], [0, 1]]}]}, "must be one to three rows of three numbers"),
        ({"chip": [CHIP | {"axes": [[1, 0, 0], [0, 1]]}]}, "must be one to three rows of three numbers"),
        ({"chip": [CHIP | {"axes": "x"}]}, "axes = 'x' must be lists of numbers: one to three rows of three"),
        ({"chip": [CHIP | {"supply_V": 0}]}, "supply_V = 0 must be greater than 0"),
        ({"chip": [CHIP | {"own_clock": 1}]}, "own_clock = 1 must be true or false"),
        ({"chip": CHIP}, r"must be an array of tables: \[\[chip\]\]"),
        ({"chip": []}, r"no \[\[chip\]\] table; add at least one"),
        ({"chip": [CHIP], "turning_axis": {"hub": "fixed"}}, r"\[turning_axis\]: key 'direction' is missing; add it"),
        ({"chip": [CHIP], "turning_axis": {"direction": "z", "hub": "fre"}}, "one of fixed, free; did you mean 'free'"),
        ({"chip": [CHIP | {"axes": [[1, 0, 0.1]]}]}, "unit vectors.*1.00499"),
        ({"chip": [CHIP | {"position_m": [0, 0, float("nan")]}]}, "finite"),
        ({"chip": [CHIP | {"name": "a"}, CHIP | {"name": "a"}]}, "share a name"),
    ],
)
def test_malformed_array_says_what_and_where(data, message):
    with pytest.raises(InputError, match=f"cube.toml: .*{message}" if data.get("chip") else message):
        AccelerometerArray.from_dict(data, source="cube.toml")


def test_a_chip_keeps_its_own_settings(tmp_path):
    chips = [CHIP | {"supply_V": 3.3, "output_data_rate_hz": 200, "own_clock": True}, CHIP | {"name": "b"}]
    array = AccelerometerArray.from_dict({"chip": chips}, source="arm.toml")
    path = tmp_path / "arm.toml"
    path.write_text(array.to_toml())
    for found in (array, AccelerometerArray.load(path)):
        own, usual = found.chips
        assert (own.name, own.supply, own.output_data_rate, own.own_clock) == ("a1", 3.3, 200.0, True)
        assert (usual.supply, usual.output_data_rate, usual.own_clock) == (None, None, False)
        assert repr(own).endswith("supply=3.3, output_data_rate=200, own_clock=True)")
    assert array.to_dict()["chip"][1].keys() == {"name", "part", "position_m", "axes"}


def test_the_axes_of_a_chip_with_one_axis_may_be_one_row():
    chip = AccelerometerArray.from_dict({"chip": [CHIP | {"axes": [0, 1, 0]}]}).chips[0]
    np.testing.assert_array_equal(chip.axes, [[0.0, 1.0, 0.0]])


def test_unknown_array_and_channel_list_the_names():
    with pytest.raises(InputError, match=r"unknown array 'cube13'; valid: .*cube12_as_built"):
        AccelerometerArray.load("cube13")
    with pytest.raises(InputError, match=r"no channel 'a51'.*a43"):
        AccelerometerArray.load("cube12").index("a51")
