"""Estimates against known motion, their stated uncertainty against scatter, and their file."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gfimu
from gfimu import (
    AccelerometerArray,
    Chip,
    Estimate,
    GeometryError,
    InputError,
    Recording,
    centripetal_agreement,
    estimate,
    integrate_attitude,
    specific_force,
    summarise,
)
from gfimu.array import omega_products, white_noise_std
from gfimu.base import STANDARD_GRAVITY
from gfimu.motion import to_rotation

CUBE = AccelerometerArray.load("cube12")


def tumble(t):
    """Rate that starts at rest and turns about all axes, and its derivative, (n, 3) each."""
    frequency = np.array([2.0, 3.1, 1.3])
    size = np.array([4.0, 3.0, 6.0])
    phase = t[:, None] * frequency
    return size * np.sin(phase) ** 2, size * frequency * np.sin(2 * phase)


def tumbling_run(array, *, n=1001, rate=100.0, **fields):
    """Recording of a body that tumbles about its origin, and its true p, alpha, omega and attitude."""
    t = np.arange(n) / rate
    omega, alpha = tumble(t)
    fine = np.linspace(t[0], t[-1], 20 * (n - 1) + 1)
    quaternion = integrate_attitude(fine, *tumble(fine))[::20]
    p = to_rotation(quaternion).inv().apply([0.0, 0.0, STANDARD_GRAVITY])
    recording = Recording.from_arrays(t, specific_force(array, p, alpha, omega), array, **fields)
    return recording, p, alpha, omega, quaternion


def spinning_run(mounting=(0.0, 0.0, 0.0), n=1000, speed=5.0, omega_metadata=None):
    """Recording of a cube that a table turns about the vertical: spun up, then at constant speed."""
    t = np.arange(n) / 100.0
    rate = speed * np.minimum(t / 2.0, 1.0) ** 2 * (3 - 2 * np.minimum(t / 2.0, 1.0))
    x = np.minimum(t / 2.0, 1.0)
    acceleration = np.where(t < 2.0, speed * 6 * x * (1 - x) / 2.0, 0.0)
    axis = Rotation.from_rotvec(mounting).inv().apply([0.0, 0.0, 1.0])
    readings = specific_force(CUBE, STANDARD_GRAVITY * axis, acceleration[:, None] * axis, rate[:, None] * axis)
    return Recording.from_arrays(
        t,
        readings,
        CUBE,
        reference={"tacho_rad_s": rate},
        metadata={"mounting_rotvec_rad": list(mounting)} | (omega_metadata or {}),
    )


@pytest.mark.parametrize("name", ["cube12", "cube12_as_built", "corners8", "p3_three_plus_one", "mimu4444"])
def test_tumble(name):
    array = AccelerometerArray.load(name)
    recording, p, alpha, omega, quaternion = tumbling_run(array)
    found = estimate(recording, array)
    np.testing.assert_allclose(found.p, p, atol=1e-8)
    np.testing.assert_allclose(found.alpha, alpha, atol=1e-7)
    np.testing.assert_allclose(found.omega_products, omega_products(omega), atol=1e-6)
    # Simpson at 10 ms: h⁴/180 times the fourth derivative of α, which is 18.6·6.2⁴ at most, over 10 s.
    np.testing.assert_allclose(found.omega, omega, atol=1e-8 / 180 * 18.6 * 6.2**4 * 10)
    error = to_rotation(found.quaternion).inv() * to_rotation(quaternion)
    assert error.magnitude().max() < 2e-4


@pytest.mark.parametrize("name", ["p1_face_diagonals", "p2_face_centres"])
def test_tumble_by_recursion(name):
    array = AccelerometerArray.load(name)
    recording, p, alpha, omega, _ = tumbling_run(array, n=201)
    found = estimate(recording, array)
    if name == "p2_face_centres":
        assert found.metadata["form"] == "recursive"
    # Third order at 10 ms over 2 s: h³/24 times the third derivative of α, 18.6·6.2³ at most, and the feedback on top.
    np.testing.assert_allclose(found.omega, omega, atol=2e-2)
    np.testing.assert_allclose(found.alpha, alpha, atol=0.3)
    np.testing.assert_allclose(found.p, p, atol=0.02)
    finer = estimate(tumbling_run(array, n=401, rate=200.0)[0], array)
    error = np.abs(found.omega - omega).max()
    error_finer = np.abs(finer.omega[::2] - omega).max()
    assert error / error_finer > 6.0


def test_unsound_channel_is_left_out():
    recording, p, _, omega, _ = tumbling_run(CUBE, n=201)
    readings = recording.readings.copy()
    readings[:, 4] = np.nan
    found = estimate(replace(recording, readings=readings), CUBE)
    np.testing.assert_allclose(found.omega, omega, atol=2e-2)
    np.testing.assert_allclose(found.p, p, atol=0.05)


def test_samples_without_enough_channels_stay_unknown_and_are_bridged():
    recording, _, _, omega, _ = tumbling_run(CUBE, n=201)
    readings = recording.readings.copy()
    readings[[0, 60, 61]] = np.nan
    hurt = replace(recording, readings=readings)
    found = estimate(hurt, CUBE)
    unknown = np.isnan(found.p).any(axis=1)
    assert np.flatnonzero(unknown).tolist() == [0, 60, 61]
    for values in (found.alpha, found.omega, found.omega_std, found.quaternion, found.angle[:, None]):
        np.testing.assert_array_equal(np.isnan(values).all(axis=1), unknown)
    # The straight line over 30 ms is off by h³/12·α'', with α'' up to 18.6·6.2².
    np.testing.assert_allclose(found.omega[~unknown], omega[~unknown], atol=2 * 0.03**3 / 12 * 18.6 * 6.2**2)
    assert summarise(found, hurt, CUBE).samples_without_estimate == 3
    with pytest.raises(InputError, match="no sample has enough channels"):
        estimate(replace(recording, readings=np.full_like(readings, np.nan)), CUBE)


@pytest.mark.parametrize("mounting", [(0.0, 0.0, 0.0), (np.pi / 2, 0.0, 0.0), (0.3, -0.8, 0.4)])
def test_cube_turned_on_the_table(mounting):
    recording = spinning_run(mounting)
    found = estimate(recording, CUBE)
    summary = summarise(found, recording, CUBE)
    assert summary.tacho_rmse_rad_s < 1e-6
    truth = np.sum((recording.reference["tacho_rad_s"][1:] + recording.reference["tacho_rad_s"][:-1]) / 2) / 100
    assert summary.angle_rad == pytest.approx(truth, abs=1e-4)
    up = to_rotation(found.quaternion).apply(found.p)
    np.testing.assert_allclose(up, np.tile([0, 0, STANDARD_GRAVITY], (len(up), 1)), atol=1e-6)


def test_without_mounting_the_first_second_levels():
    recording = spinning_run((0.2, -0.1, 0.0))
    unmounted = replace(recording, metadata={})
    found = estimate(unmounted, CUBE)
    np.testing.assert_allclose(to_rotation(found.quaternion[0]).apply(found.p[0]), [0, 0, STANDARD_GRAVITY], atol=1e-9)


def test_start_can_be_given():
    recording, _, _, omega, _ = tumbling_run(CUBE)
    late = recording.slice(300)
    start = [0.6, 0.0, 0.8, 0.0]
    found = estimate(late, CUBE, omega0=omega[300], quaternion0=start)
    np.testing.assert_allclose(found.omega, omega[300:], atol=1e-5)
    np.testing.assert_allclose(found.quaternion[0], start, atol=1e-12)
    with pytest.raises(InputError, match=r"omega0 is .* three finite numbers"):
        estimate(late, CUBE, omega0=[1.0, np.nan, 0.0])


def test_position_where_asked_for():
    recording = spinning_run()
    assert estimate(recording, CUBE).position is None
    still = estimate(recording, CUBE, position=True)
    np.testing.assert_allclose(still.position, 0.0, atol=1e-6)  # the cube turns about its own centre
    pushed = replace(recording, readings=recording.readings + CUBE.axes @ [0.0, 0.0, 0.5])
    moved = estimate(pushed, CUBE, position=True)
    np.testing.assert_allclose(moved.position[:, 2], 0.25 * recording.t_s**2, atol=1e-6)
    np.testing.assert_allclose(moved.velocity[:, 2], 0.5 * recording.t_s, atol=1e-6)


@pytest.mark.study
def test_standard_deviation_of_the_rate_is_its_scatter():
    n, runs, noise = 200, 400, 0.04
    rng = np.random.default_rng(6)
    t = (np.arange(n) + rng.uniform(-0.1, 0.1, n)) / 100
    finals = []
    for _ in range(runs):
        run = Recording.from_arrays(t, noise * rng.normal(size=(n, 12)) + CUBE.axes @ [0, 0, 9.8], CUBE)
        found = estimate(run, CUBE, noise_std=noise)
        finals.append(found.omega[-1])
    scatter = np.std(finals, axis=0)
    # Sampling error of 400 runs: 3.5 %; three of them.
    np.testing.assert_allclose(found.omega_std[-1], scatter, rtol=0.106)
    even = Recording.from_arrays(np.arange(n) / 100, np.zeros((n, 12)) + CUBE.axes @ [0, 0, 9.8], CUBE)
    sigma_alpha = noise / (np.sqrt(8) * 0.05)
    expected = sigma_alpha * 0.01 * np.sqrt(n - 1.5)
    np.testing.assert_allclose(estimate(even, CUBE, noise_std=noise).omega_std[-1], expected, rtol=1e-12)


def test_samples_bunched_in_time_do_not_amplify_noise():
    n, noise = 400, 0.04
    rng = np.random.default_rng(7)
    t = np.sort(rng.uniform(0.0, 4.0, n))  # neighbours as close as microseconds
    readings = noise * rng.normal(size=(n, 12)) + CUBE.axes @ [0, 0, 9.8]
    found = estimate(Recording.from_arrays(t, readings, CUBE), CUBE, noise_std=noise)
    assert np.abs(found.omega[1:] / found.omega_std[1:]).max() < 5.0


def test_noise_comes_from_the_data_sheet():
    # ADXL345, table 1: 0.75, 0.75, 1.1 LSB rms at 100 Hz; 3.9 mg per LSB.
    lsb = 0.0039 * STANDARD_GRAVITY
    np.testing.assert_allclose(white_noise_std(CUBE, 100.0)[:3], np.array([0.75, 0.75, 1.1]) * lsb, rtol=1e-6)
    np.testing.assert_allclose(white_noise_std(CUBE, 400.0), 2 * white_noise_std(CUBE, 100.0))


def test_geometry_that_does_not_see_everything():
    one_chip = AccelerometerArray("one", (Chip("a1", np.array([0.0, 0.0, 0.1]), np.eye(3)),))
    recording = Recording.from_arrays(np.arange(10) / 100, np.zeros((10, 3)), one_chip)
    with pytest.raises(GeometryError, match=r"rank 3 of 6.*can't see angular acceleration about z;") as caught:
        estimate(recording, one_chip)
    assert "\n" not in str(caught.value)


def test_unknown_names():
    recording = spinning_run(n=20)
    with pytest.raises(InputError, match=r"unknown method 'guess'; valid: .*integrate"):
        estimate(recording, CUBE, method="guess")
    with pytest.raises(InputError, match="unknown form 'guess'"):
        estimate(recording, CUBE, form="guess")


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
@pytest.mark.parametrize("position", [False, True])
def test_file_there_and_back(tmp_path, suffix, position):
    recording, *_ = tumbling_run(CUBE, n=50)
    found = estimate(recording, CUBE, position=position)
    found.write(tmp_path / f"estimate.{suffix}")
    back = Estimate.read(tmp_path / f"estimate.{suffix}")
    for name in Estimate.__dataclass_fields__:
        if name == "metadata":
            assert back.metadata == found.metadata
        elif getattr(found, name) is None:
            assert getattr(back, name) is None
        else:
            np.testing.assert_array_equal(getattr(back, name), getattr(found, name))


def test_file_has_the_columns_of_the_format():
    recording, *_ = tumbling_run(CUBE, n=50)
    columns = estimate(recording, CUBE, position=True).to_columns()
    for quantity, unit in {
        "p": "m_s2",
        "alpha": "rad_s2",
        "omega": "rad_s",
        "velocity": "m_s",
        "position": "m",
    }.items():
        assert {f"{quantity}_{axis}_{unit}" for axis in "xyz"} <= columns.keys()
    assert {"t_s", "q_w", "q_x", "q_y", "q_z", "omega_z_std_rad_s", "omega_xy_rad2_s2", "angle_rad"} <= columns.keys()


def test_file_that_is_no_estimate(tmp_path):
    file = tmp_path / "run.parquet"
    recording, *_ = tumbling_run(CUBE, n=5)
    recording.write(file)
    with pytest.raises(InputError, match="column angle_rad is missing; give a file that gfimu estimate wrote"):
        Estimate.read(file)
    found = estimate(recording, CUBE)
    replace(found, metadata={"format_version": 99}).write(file)
    with pytest.raises(InputError, match="Estimate format 99; this gfimu reads 1"):
        Estimate.read(file)


def test_centripetal_terms_agree_with_a_perfect_gyro():
    recording, _, _, omega, _ = tumbling_run(CUBE)
    assert centripetal_agreement(recording, CUBE) is None
    gyro = {f"gyro_{axis}_rad_s": omega[:, place] for place, axis in enumerate("xyz")}
    agreement = centripetal_agreement(replace(recording, reference=gyro), CUBE)
    assert agreement.slope == pytest.approx(1.0, abs=1e-9)
    assert agreement.correlation == pytest.approx(1.0, abs=1e-9)
    assert agreement.samples == np.sum(np.linalg.norm(omega, axis=1) > 2.0)
    weak = centripetal_agreement(replace(recording, reference={k: v / 2 for k, v in gyro.items()}), CUBE)
    assert weak.slope == pytest.approx(4.0, rel=1e-9)


@pytest.mark.parametrize("number", [1, 2])
def test_measured_centripetal_terms_agree_with_the_gyros(shared_data, number):
    from gfimu import read_mimu4444

    array = AccelerometerArray.load("mimu4444")
    run = read_mimu4444(shared_data / "mimu4444" / f"exp_{number}.bin.gz")
    agreement = centripetal_agreement(run, array)
    # What others found with nominal positions: correlation 0.986 to 0.988, slope 0.996 to 1.010.
    assert agreement.samples > 5000
    assert 0.98 < agreement.slope < 1.02
    assert agreement.correlation >= 0.98
    found = estimate(run, array)
    assert np.isfinite(found.p).all()
    assert np.isfinite(found.alpha).all()
    assert np.isfinite(found.omega_products).all()
    # α against the gyros' own derivative: no integration, no shared error.
    gyro = np.column_stack([run.reference[f"gyro_{axis}_rad_s"] for axis in "xyz"])
    derivative = np.gradient(gyro, run.t_s, axis=0)
    moving = np.isfinite(derivative).all(axis=1) & (np.linalg.norm(gyro, axis=1) > 2.0)
    for axis in range(3):
        assert np.corrcoef(derivative[moving, axis], found.alpha[moving, axis])[0, 1] > 0.6


def test_estimate_says_what_made_it():
    recording, *_ = tumbling_run(CUBE, n=5)
    metadata = estimate(recording, CUBE).metadata
    assert (metadata["array"], metadata["method"], metadata["form"]) == ("cube12", "integrate", "linear")
    assert metadata["software_version"] == gfimu.__version__
