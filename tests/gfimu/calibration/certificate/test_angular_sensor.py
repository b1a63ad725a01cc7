"""The sheet of an array as an angular sensor, against closed forms and forward models that know nothing of it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gfimu import AccelerometerArray, Calibration, GeometryError, InputError, certificate, specific_force
from gfimu.calibration.certificate.angular import angular_sensor_sheet
from gfimu.calibration.certificate.angular.response import response
from gfimu.calibration.certificate.certificate import Term
from gfimu.calibration.parameter_names import parameter_names
from gfimu.recording import Recording, array_metadata
from gfimu.sensor_noise import flicker_noise
from sim import SpinState
from sim.forward import rigid_readings
from sim.world import World

CUBE = AccelerometerArray.load("cube12")
GRAVITY = 9.80665
FULL = 156.9064


def calibration(array=CUBE, *, gain=1e-4, bias=2e-3, values=None, unit="m_s2", scale=1.0, gauge="array"):
    names = [name for chip in array.chips for name in parameter_names(chip.name, "array")]
    nominal = np.tile(np.concatenate([scale * np.eye(3).ravel(), np.zeros(3)]), len(array.chips))
    std = scale * np.tile(np.concatenate([np.full(9, gain), np.full(3, bias)]), len(array.chips))
    return Calibration(
        "array",
        unit,
        array.channels,
        gauge,
        GRAVITY,
        tuple(names),
        nominal if values is None else values,
        np.diag(std**2),
    )


def terms(sheet) -> dict[str, Term]:
    return {term.name: term for term in sheet.terms}


@pytest.fixture(scope="module")
def sheet():
    return angular_sensor_sheet(calibration(), CUBE)


def test_noise_is_the_closed_form():
    """α of a cube with equal noise σ on all channels has σ/(√8 h) about each axis (GF-IMU paper, closed form)."""
    array = CUBE.with_part("generic")
    found = terms(angular_sensor_sheet(calibration(array), array))
    density = 2.9 * 0.00478840332 / np.sqrt(100.0)
    for axis in "xyz":
        assert found[f"noise_density_{axis}"].value == pytest.approx(density / (np.sqrt(8) * 0.05), rel=1e-9)
        assert found[f"rate_walk_{axis}"].value == found[f"noise_density_{axis}"].value
        assert "data sheets" in found[f"noise_density_{axis}"].note
        assert found[f"instability_{axis}"].value is None


def at_rest(sigma, seconds=200.0, bias=0.0):
    rng = np.random.default_rng(1)
    n = round(seconds * 100)
    readings = GRAVITY * CUBE.axes[:, 2] + bias + sigma * rng.normal(size=(n, 12))
    return Recording(np.arange(n) / 100.0, readings, CUBE.channels, metadata=array_metadata(CUBE))


def test_noise_and_bias_of_a_recording_at_rest():
    sigma, offset = 0.03, np.zeros(12)
    offset[0] = 0.01
    found = terms(angular_sensor_sheet(calibration(), CUBE, rest=at_rest(sigma, bias=offset)))
    for axis, bias in zip("xyz", np.linalg.pinv(CUBE.regression_matrix)[:3] @ offset, strict=True):
        density = found[f"noise_density_{axis}"]
        assert density.value == pytest.approx(sigma / np.sqrt(100.0) / (np.sqrt(8) * 0.05), rel=0.03)
        assert abs(density.value - sigma / 10 / (np.sqrt(8) * 0.05)) < 4 * density.std
        term = found[f"bias_{axis}"]
        assert abs(term.value - bias) < 4 * term.std
        assert "at rest" in term.note
    assert "upper limit" in found["instability_x"].note  # white noise alone: the curve falls to its end


def test_bias_instability_of_flicker_is_found():
    rng = np.random.default_rng(2)
    run = at_rest(1e-3, seconds=400.0)
    level = 5e-3
    flicker = np.column_stack([flicker_noise(len(run), 100.0, level, rng) for _ in range(12)])
    found = terms(angular_sensor_sheet(calibration(), CUBE, rest=replace(run, readings=run.readings + flicker)))
    expected = level / (np.sqrt(8) * 0.05)
    for axis in "xyz":
        assert found[f"instability_{axis}"].value == pytest.approx(expected, rel=0.25)


def test_the_instability_of_a_longer_rest_is_more_certain():
    """The minimum of the curve averages more stretches: four times the time halves its standard deviation about."""
    stds = []
    for seconds in (200.0, 800.0):
        rng = np.random.default_rng(2)
        run = at_rest(1e-3, seconds=seconds)
        flicker = np.column_stack([flicker_noise(len(run), 100.0, 5e-3, rng) for _ in range(12)])
        found = terms(angular_sensor_sheet(calibration(), CUBE, rest=replace(run, readings=run.readings + flicker)))
        stds.append(np.mean([found[f"instability_{axis}"].std / found[f"instability_{axis}"].value for axis in "xyz"]))
    assert 0.01 < stds[1] < stds[0] < 0.5


def spin_readings(mount, rate, acceleration, attitude):
    """Largest reading over a turn of the cube about the vertical or a horizontal axis, by the forward model."""
    angle = np.linspace(0.0, 2 * np.pi, 721)
    spin = SpinState(angle, np.full_like(angle, rate), np.full_like(angle, acceleration))
    world = World(
        CUBE, gravity=GRAVITY, cube_offset=np.zeros(3), mount_rotvec=mount, axis_rotvec=np.array([attitude, 0.0, 0.0])
    )
    return np.abs(rigid_readings(world, spin)).max()


MOUNTS = {"x": [0.0, -np.pi / 2, 0.0], "y": [np.pi / 2, 0.0, 0.0], "z": [0.0, 0.0, 0.0]}
"""Rotations of the cube that bring a body axis upright."""


@pytest.mark.parametrize("axis", "xyz")
def test_the_range_ends_where_a_channel_saturates(sheet, axis):
    found, mount = terms(sheet), np.array(MOUNTS[axis])
    np.testing.assert_allclose(Rotation.from_rotvec(mount).apply(np.eye(3)["xyz".index(axis)]), [0, 0, 1], atol=1e-12)
    rate, alpha = found[f"range_omega_{axis}"].value, found[f"range_alpha_{axis}"].value
    for factor, within in ((0.999, True), (1.001, False)):
        for speed, acceleration in ((factor * rate, 0.0), (0.0, factor * alpha)):
            worst = max(spin_readings(mount, speed, acceleration, attitude) for attitude in (0.0, np.pi / 2))
            assert (worst < FULL) == within


def test_a_bias_and_a_gain_narrow_the_range():
    values = calibration().values.copy()
    values[[9, 0]] = 20.0, 1.1  # a11
    found = terms(angular_sensor_sheet(calibration(values=values), CUBE))
    assert found["range_omega_z"].value == pytest.approx(np.sqrt(((FULL - 20.0) / 1.1 - GRAVITY) / 0.05), rel=1e-9)


def test_counts_have_the_same_range(sheet):
    counts = angular_sensor_sheet(calibration(unit="lsb", scale=1 / 0.038245935), CUBE)
    assert terms(counts)["range_alpha_y"].value == pytest.approx(terms(sheet)["range_alpha_y"].value, rel=1e-9)
    assert terms(counts)["g_sensitivity_y"].std == pytest.approx(terms(sheet)["g_sensitivity_y"].std, rel=1e-9)


def test_what_is_corrected_scatters_as_stated():
    """Chips and places drawn from the covariance, read by a forward model, corrected by the calibration as it is."""
    rng = np.random.default_rng(3)
    gain, bias, tolerance = 5e-3, 0.02, 2e-4
    stated = calibration(gain=gain, bias=bias)
    found = terms(angular_sensor_sheet(stated, CUBE, position_std_m=tolerance))
    a = np.linalg.pinv(CUBE.regression_matrix)[:3]
    runs, by_alpha, by_force, at_zero = 400, [], [], []
    for _ in range(runs):
        true = replace(stated, values=rng.normal(stated.values, stated.std))
        moved = CUBE.with_geometry(
            CUBE.chip_positions + tolerance * rng.normal(size=(4, 3)), [c.axes for c in CUBE.chips]
        )

        def alpha(force, acceleration, moved=moved, true=true):
            ideal = specific_force(moved, force, acceleration, np.zeros_like(acceleration))
            return true.invert(Recording(np.arange(len(ideal)) * 1.0, ideal, CUBE.channels)).readings @ a.T

        zero = alpha(np.zeros((1, 3)), np.zeros((1, 3)))
        at_zero.append(zero[0])
        by_force.append((alpha(np.eye(3), np.zeros((3, 3))) - zero).T)
        by_alpha.append((alpha(np.zeros((3, 3)), np.eye(3)) - zero).T)
    near = pytest.approx
    tol = 4.0 / np.sqrt(2 * runs)
    for place, axis in enumerate("xyz"):
        scale = np.array(by_alpha)[:, place]
        others = [k for k in range(3) if k != place]
        assert np.mean(scale[:, place]) == near(1.0, abs=4 * scale[:, place].std() / np.sqrt(runs))
        assert found[f"scale_factor_{axis}"].std == near(scale[:, place].std(), rel=tol)
        assert found[f"misalignment_{axis}"].std == near(
            np.sqrt(np.mean(np.sum(scale[:, others] ** 2, axis=1))), rel=tol
        )
        assert found[f"g_sensitivity_{axis}"].std == near(
            np.sqrt(np.mean(np.sum(np.array(by_force)[:, place] ** 2, axis=1))), rel=tol
        )
        assert found[f"bias_{axis}"].std == near(np.array(at_zero)[:, place].std(), rel=tol)


@pytest.mark.parametrize("name", ["cube12", "p2_face_centres_of_triads"])
def test_the_rate_leaks_as_the_geometry_says(name):
    rng = np.random.default_rng(4)
    places = CUBE.chip_positions if name == "cube12" else rng.uniform(-0.05, 0.05, (4, 3))
    array = CUBE.with_geometry(places, [chip.axes for chip in CUBE.chips])
    found = terms(angular_sensor_sheet(calibration(array), array))
    directions = rng.normal(size=(20000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    readings = specific_force(array, np.zeros((20000, 3)), np.zeros((20000, 3)), directions)
    largest = np.abs(readings @ np.linalg.pinv(array.regression_matrix)[:3].T).max(axis=0)
    for axis, value in zip("xyz", largest, strict=True):
        assert found[f"rate_squared_{axis}"].value == pytest.approx(value, rel=5e-3, abs=1e-12)


def test_fitted_positions_have_their_own_uncertainty():
    plain = calibration()
    names = tuple(f"{chip.name}_r_{axis}" for chip in CUBE.chips for axis in "xyz")
    covariance = np.zeros((60, 60))
    covariance[:48, :48] = plain.covariance
    covariance[range(48, 60), range(48, 60)] = 2e-5**2
    fitted = replace(
        plain,
        names=(*plain.names, *names),
        values=np.concatenate([plain.values, (CUBE.chip_positions + 1e-4).ravel()]),
        covariance=covariance,
        null_space=np.empty((60, 0)),
    )
    np.testing.assert_allclose(response(fitted, CUBE, 1.0).position_std, 2e-5)
    np.testing.assert_allclose(
        response(fitted, CUBE, 1.0).response_std, response(plain, CUBE, 2e-5).response_std, rtol=1e-6
    )


def test_bandwidth_is_that_of_the_slowest_part(sheet):
    assert terms(sheet)["bandwidth"].value == 50.0
    faster = replace(CUBE, chips=tuple(replace(chip, output_data_rate=800.0) for chip in CUBE.chips))
    assert terms(angular_sensor_sheet(calibration(), faster))["bandwidth"].value == 400.0


def test_every_figure_says_where_it_is_from(sheet):
    assert all(term.note for term in sheet.terms)
    assert sheet.conditions["positions"] == "positions as drawn, to 0.5 mm (taken for granted)"


def test_what_is_no_angular_sensor_is_refused():
    with pytest.raises(InputError, match="does not align the chips"):
        angular_sensor_sheet(replace(calibration(), gauge="poses"), CUBE)
    with pytest.raises(InputError, match="not of array 'corners8'"):
        angular_sensor_sheet(calibration(), AccelerometerArray.load("corners8"))
    line = CUBE.with_geometry([[0, 0, z] for z in (0.0, 0.02, 0.04, 0.06)], [chip.axes for chip in CUBE.chips])
    with pytest.raises(GeometryError, match="can't see every angular acceleration"):
        angular_sensor_sheet(calibration(), line)
    values = calibration().values.copy()
    values[9] = 150.0
    with pytest.raises(InputError, match="saturates by gravity alone"):
        angular_sensor_sheet(calibration(values=values), CUBE)


def test_the_command_adds_the_sheet(tmp_path):
    calibration().save(tmp_path / "cal.json")
    at_rest(0.03, seconds=30.0).write(tmp_path / "rest.parquet")
    by_sheet = certificate(tmp_path / "cal.json", array="cube12").angular_sensor
    recorded = certificate(tmp_path / "cal.json", rest=tmp_path / "rest.parquet", out=tmp_path / "made").angular_sensor
    assert by_sheet.conditions["noise"] == "data sheets of the parts"
    assert recorded.conditions["noise"].startswith("Allan deviation of α over")
    page = (tmp_path / "made" / "certificate.html").read_text(encoding="utf-8")
    assert '"angular_sensor"' in (tmp_path / "made" / "certificate.json").read_text(encoding="utf-8")
    assert "angular sensor" in page
