"""Calibrations written for Kalibr and for ROS: applied as those programs do, counts give what gfimu makes of them."""

import re
from dataclasses import replace

import numpy as np
import pytest

import gfimu
from gfimu import AccelerometerArray, Calibration, InputError
from gfimu.calibration.exporting.calibrated_chip import calibrated_chips, number
from gfimu.calibration.exporting.kalibr import lower_form
from gfimu.calibration.exporting.ros import inverse_form
from gfimu.calibration.parameter_names import parameter_names
from gfimu.recording import Recording

ruamel = pytest.importorskip("ruamel.yaml", reason="comes with rosbags, of the extra 'test'")
ARRAY = AccelerometerArray.load("cube12_as_built")
LSB = 0.0039 * 9.80665


def calibration(unit="lsb", gauge="array", chips=("a1", "a2", "a3", "a4"), *, positions=True):
    """Made-up calibration with a full covariance of all parameters."""
    rng = np.random.default_rng(4)
    names = [name for chip in chips for name in parameter_names(chip, gauge)]
    scale = 1.0 / LSB if unit == "lsb" else 1.0
    values = []
    for name in names:
        nominal = float("M" in name and name[-1] == name[-2])
        values.append(scale * ((nominal + 0.03 * rng.standard_normal()) if "_M_" in name else rng.standard_normal()))
    values = list(values)
    if positions:
        names += [f"{chip}_r_{axis}" for chip in chips for axis in "xyz"]
        values += (ARRAY.chip_positions + 1e-3 * rng.standard_normal((4, 3))).ravel().tolist()
    root = 1e-3 * rng.standard_normal((len(names), len(names)))
    channels = tuple(f"{chip}{axis}" for chip in chips for axis in (1, 2, 3))
    return Calibration("array", unit, channels, gauge, 9.81, tuple(names), np.array(values), root @ root.T)


def counts(unit="lsb", channels=ARRAY.channels, n=50):
    readings = np.random.default_rng(5).uniform(-4000, 4000, (n, len(channels))) * (1.0 if unit == "lsb" else LSB)
    return Recording(np.arange(n) / 100.0, readings, channels, unit=unit)


def parsed(path):
    text = path.read_text()
    # YAML 1.1 (PyYAML, yaml-cpp) takes 1e-05 for text.
    assert not re.search(r"(?<![\d.])-?\d+e[-+]?\d", text)
    return ruamel.YAML(typ="safe").load(text)


UNITS = ("lsb", "m_s2")


@pytest.mark.parametrize("unit", UNITS)
def test_kalibr_applied_to_counts_gives_what_gfimu_makes_of_them(tmp_path, unit):
    """f_b = C_ibᵀ M⁻¹ (z − b), with M lower triangular and z in m/s²."""
    made, raw = calibration(unit), counts(unit)
    gfimu.convert(made, tmp_path / "imu.yaml", to="kalibr", array=ARRAY)
    content = parsed(tmp_path / "imu.yaml")
    assert list(content) == ["imu0", "imu1", "imu2", "imu3"]
    ours = made.apply(raw).readings
    for place, chip in enumerate(ARRAY.chips):
        imu = content[f"imu{place}"]
        assert (imu["model"], imu["rostopic"]) == ("scale-misalignment", f"/imu{place}")
        matrix, own = np.array(imu["accelerometers"]["M"]), imu["gfimu"]
        assert np.array_equal(matrix, np.tril(matrix))
        assert np.diag(matrix) == pytest.approx(np.ones(3), abs=0.15)  # a ratio, not counts
        assert own["lsb_m_s2"] == pytest.approx(LSB if unit == "lsb" else 1.0)
        turn = np.array(own["T_i_array"])[:3, :3]
        assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-12)
        assert np.linalg.det(turn) == pytest.approx(1.0)
        z = own["lsb_m_s2"] * raw.readings[:, 3 * place : 3 * place + 3]
        body = (np.linalg.inv(matrix) @ (z - own["bias_m_s2"]).T).T @ turn
        assert body @ chip.axes.T == pytest.approx(ours[:, 3 * place : 3 * place + 3], abs=1e-9)


def test_kalibrs_own_prediction_of_a_motion_is_gfimus(tmp_path):
    """Kalibr's frame b is that of imu0, and its lever arm is the place of the chip there."""
    made = calibration("m_s2")
    array = made.calibrated_array(ARRAY)
    gfimu.convert(made, tmp_path / "imu.yaml", to="kalibr", array=ARRAY)
    content = parsed(tmp_path / "imu.yaml")
    rng = np.random.default_rng(6)
    p, alpha, omega = rng.standard_normal((3, 3)) * [[5.0], [20.0], [10.0]]

    def force(place):
        return p + np.cross(alpha, place) + np.cross(omega, np.cross(omega, place))

    truth = np.concatenate([chip.axes @ force(chip.position) for chip in array.chips])
    ours = made.invert(Recording(np.zeros(1), truth[None, :], array.channels)).readings[0]
    assert np.array(content["imu0"]["T_i_b"]) == pytest.approx(np.eye(4), abs=0.0)
    first = np.array(content["imu0"]["gfimu"]["T_i_array"])[:3, :3]
    at_imu0, turning, rate = first @ force(array.chips[0].position), first @ alpha, first @ omega
    for place in range(4):
        imu = content[f"imu{place}"]
        pose = np.array(imu["T_i_b"])
        turn, lever = pose[:3, :3], -pose[:3, :3].T @ pose[:3, 3]
        a = at_imu0 + np.cross(turning, lever) + np.cross(rate, np.cross(rate, lever))
        z = np.array(imu["accelerometers"]["M"]) @ turn @ a + imu["gfimu"]["bias_m_s2"]
        assert z == pytest.approx(ours[3 * place : 3 * place + 3], abs=1e-9)


@pytest.mark.parametrize("unit", UNITS)
def test_imu_calib_applied_to_counts_gives_what_gfimu_makes_of_them(tmp_path, unit):
    """corrected = SM · raw − bias: the inverse, and the bias taken off after it."""
    made, raw = calibration(unit), counts(unit)
    gfimu.convert(made, tmp_path / "all.yaml", to="ros", array=ARRAY)
    ours, together = made.apply(raw).readings, parsed(tmp_path / "all.yaml")
    for place, chip in enumerate(ARRAY.chips):
        gfimu.convert(made, tmp_path / "one.yaml", to="ros", array=ARRAY, chip=chip.name)
        one = parsed(tmp_path / "one.yaml")
        assert one == together[chip.name]
        matrix = np.zeros((3, 3))
        for element in range(9):  # as imu_calib reads it
            matrix[element // 3, element % 3] = one["SM"][element]
        assert np.diag(matrix) == pytest.approx(np.ones(3), abs=0.15)
        z = one["lsb_m_s2"] * raw.readings[:, 3 * place : 3 * place + 3]
        corrected = np.array([matrix @ row - one["bias"] for row in z])
        assert corrected == pytest.approx(ours[:, 3 * place : 3 * place + 3], abs=1e-9)
        x, y, z, w = one["transform"]["rotation_xyzw"]
        turn = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                         [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                         [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])  # fmt: skip
        assert turn == pytest.approx(chip.axes.T)  # takes a vector of the chip's frame to the body's
        assert one["transform"]["translation_m"] == pytest.approx(made.positions[chip.name])


def changed(made, step):
    return replace(made, values=made.values + step)


@pytest.mark.parametrize("gauge", ["array", "x_axis", "z_axis"])
def test_covariances_are_those_of_the_numbers_written(gauge):
    """Against central differences of the written numbers by gfimu's parameters."""
    made = calibration("lsb", gauge, positions=False)

    def written(values):
        chip = calibrated_chips(replace(made, values=values), ARRAY)[1]
        lower, turn, _ = lower_form(chip)
        inverse, bias, _ = inverse_form(chip)
        rows, columns = np.tril_indices(3)
        return np.concatenate([lower[rows, columns], chip.bias]), turn, np.concatenate([inverse.ravel(), bias])

    chip = calibrated_chips(made, ARRAY)[1]
    _, turn, kalibr = lower_form(chip)
    ros = inverse_form(chip)[2]
    kalibr_slopes, ros_slopes = [], []
    for place in range(len(made.values)):
        step = np.zeros(len(made.values))
        step[place] = 1e-5
        (above, turn_above, ros_above), (below, turn_below, ros_below) = (
            written(made.values + sign * step) for sign in (1.0, -1.0)
        )
        skew = (turn_above - turn_below) @ turn.T / 2e-5
        phi = [skew[2, 1], skew[0, 2], skew[1, 0]]
        kalibr_slopes.append(np.concatenate([(above - below) / 2e-5, phi]))
        ros_slopes.append((ros_above - ros_below) / 2e-5)
    for found, rows in ((kalibr, kalibr_slopes), (ros, ros_slopes)):
        slopes = np.array(rows).T
        expected = slopes @ made.covariance @ slopes.T
        assert found == pytest.approx(expected, rel=1e-5, abs=1e-6 * np.abs(expected).max())


def test_a_triangular_triad_is_kalibrs_as_it_stands():
    made = calibration("m_s2", "x_axis", ("a1",), positions=False)
    chip = calibrated_chips(made)[0]
    lower, turn, _ = lower_form(chip)
    assert lower == pytest.approx(made.models["a1"].sensitivity)
    assert turn == pytest.approx(np.eye(3))


def test_noise_is_in_the_units_of_the_format(tmp_path):
    """Kalibr's density times the root of the rate, and the diagonal of ROS's covariance, are a sample's variance."""
    rng = np.random.default_rng(7)
    still = 0.02 * rng.standard_normal((20000, 12)) + ARRAY.axes @ [0.0, 0.0, 9.81]
    rest = Recording.from_arrays(np.arange(20000) / 200.0, still, ARRAY)
    exact = calibration("m_s2", positions=False)
    exact = replace(exact, values=np.array([float(n[-1] == n[-2] and "_M_" in n) for n in exact.names]))
    gfimu.convert(exact, tmp_path / "k.yaml", to="kalibr", array=ARRAY, noise=rest)
    gfimu.convert(exact, tmp_path / "r.yaml", to="ros", array=ARRAY, noise=rest)
    imu = parsed(tmp_path / "k.yaml")["imu2"]
    assert imu["update_rate"] == pytest.approx(200.0)
    assert imu["accelerometer_noise_density"] * 200.0**0.5 == pytest.approx(0.02, rel=0.03)
    assert imu["accelerometer_random_walk"] > 0.0
    covariance = parsed(tmp_path / "r.yaml")["a3"]["linear_acceleration_covariance"]
    assert np.reshape(covariance, (3, 3)) == pytest.approx(0.02**2 * np.eye(3), rel=0.06, abs=1e-12)
    gfimu.convert(exact, tmp_path / "sheet.yaml", to="kalibr", array=ARRAY)
    sheet = parsed(tmp_path / "sheet.yaml")["imu0"]
    assert sheet["accelerometer_noise_density"] * sheet["update_rate"] ** 0.5 == pytest.approx(LSB, rel=0.5)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, "--to"),
        ({"to": "matlab"}, "kalibr, ros"),
        ({"to": "kalibr"}, "--array"),
        ({"to": "kalibr", "chip": "a1"}, "--lsb-m-s2"),
        ({"to": "kalibr", "chip": "b1"}, "a1, a2"),
        ({"to": "ros", "array": "mimu4444"}, "no chip"),
    ],
)
def test_what_is_missing_is_one_line(tmp_path, options, words):
    with pytest.raises(InputError) as error:
        gfimu.convert(calibration(), tmp_path / "x.yaml", **options)
    assert words in str(error.value)
    assert "\n" not in str(error.value)
    assert not list(tmp_path.iterdir())


def test_recordings_and_calibrations_are_not_mixed_up(tmp_path):
    made = calibration()
    with pytest.raises(InputError, match=r"ends in \.yaml"):
        gfimu.convert(made, tmp_path / "x.csv", to="kalibr", array=ARRAY)
    with pytest.raises(InputError, match="YAML is for calibrations"):
        gfimu.convert(counts("m_s2"), tmp_path / "x.yaml")
    with pytest.raises(InputError, match="are for a calibration"):
        gfimu.convert(counts("m_s2"), tmp_path / "x.csv", to="ros")


def test_a_calibration_of_the_command_line_goes_through_its_file(tmp_path):
    made = calibration("lsb", "poses", ("a1",), positions=False)
    made.save(tmp_path / "cal.json")
    again = gfimu.convert(tmp_path / "cal.json", tmp_path / "imu.yaml", to="ros", lsb_m_s2=0.04)
    assert isinstance(again, Calibration)
    one = parsed(tmp_path / "imu.yaml")
    raw = counts(channels=("a11", "a12", "a13"))
    corrected = (np.reshape(one["SM"], (3, 3)) @ (0.04 * raw.readings).T).T - one["bias"]
    assert corrected == pytest.approx(made.apply(raw).readings, abs=1e-9)


def test_numbers_are_numbers_to_every_parser():
    assert (number(1e-05), number(-2.5e-7), number(3.0), number(1e22)) == ("1.0e-05", "-2.5e-07", "3.0", "1.0e+22")
