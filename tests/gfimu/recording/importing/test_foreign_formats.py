"""Files of other programs become the recording that they hold, by the maps that come with gfimu."""

import foreign_files as files
import numpy as np
import pytest

from gfimu import ColumnMap, InputError, MappedFile, RecordingWarning, load_map
from gfimu.recording import ColumnSpec, Recording, inspect_file, mapped_recording, open_run
from gfimu.recording.importing import list_maps
from gfimu.recording.importing.column_map import REFERENCE_KINDS, TimeSpec
from gfimu.recording.quantities import REFERENCE_UNITS

GYRO = ["gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s"]

CASES = {
    "klipper": (files.klipper, "a.csv", 1e-5, None),
    "euroc": (files.euroc, "data.csv", 1e-8, 1e-8),
    "xsens_dot": (files.xsens_dot, "dot.csv", 1e-8, 1e-8),
    "xsens_mt": (files.xsens_mt, "mt.txt", 1e-7, 1e-8),
    "gcdc_x16": (files.gcdc, "DATA-001.CSV", 0.5 * 9.81 / 2048, None),
    "phyphox": (files.phyphox, "experiment.zip", 1e-7, 2e-5),
    "sisfall": (files.sisfall, "D06.txt", 0.5 * 9.81 / 256, 6e-4),
    "ulog": (files.ulog, "log.ulg", 1e-6, 1e-6),
    "ros_imu": (files.mcap, "run.mcap", 1e-12, 1e-12),
    "ros_imu (ROS 1 bag)": (files.bag_of_ros1, "run.bag", 1e-12, 1e-12),
    "ros_imu (ROS 2 bag)": (files.bag_of_ros2, "bag", 1e-12, 1e-12),
}


@pytest.fixture(params=CASES)
def case(request, tmp_path):
    write, name, force, gyro = CASES[request.param]
    return request.param.partition(" ")[0], write(tmp_path / name), force, gyro


def test_a_file_becomes_the_recording_that_it_holds(case):
    name, path, force, gyro = case
    recording, array = open_run(MappedFile(path, load_map(name)))
    assert recording.for_array(array)[:, :3] == pytest.approx(files.FORCE, abs=force)
    rate = 200.0 if name == "sisfall" else files.RATE
    assert recording.t_s - recording.t_s[0] == pytest.approx(np.arange(files.N) / rate, abs=1e-5)
    if gyro is None:
        assert not recording.reference
    else:
        found = np.column_stack([recording.reference[axis] for axis in GYRO])
        known = np.isfinite(found).all(axis=1)
        assert known.mean() > 0.98
        assert found[known] == pytest.approx(files.GYRO[known], abs=gyro)


def test_the_map_of_a_file_is_recognised(case):
    name, path, *_ = case
    found = inspect_file(path)
    assert found.fitting == (name,)
    assert found.chips == (2 if name == "sisfall" else 1)
    with pytest.raises(InputError, match=f"--map {name}"):
        open_run(path)


def test_a_suggested_map_reads_the_file(case, tmp_path):
    name, path, force, gyro = case
    file = tmp_path / "suggested.toml"
    file.write_text(inspect_file(path).map_toml)
    recording = mapped_recording(path, load_map(file))
    assert recording.readings[:, :3] == pytest.approx(files.FORCE, abs=2 * force)
    if gyro is not None and name not in {"sisfall", "phyphox"}:  # counts whose scale no data show; another table
        assert np.column_stack([recording.reference[axis] for axis in GYRO]) == pytest.approx(files.GYRO, abs=gyro)


@pytest.mark.parametrize("warm", [True, False])
def test_the_temperature_of_a_chip_is_kept_where_a_log_has_it(tmp_path, warm):
    recording = mapped_recording(files.ulog_accel(tmp_path / "log.ulg", warm=warm), "ulog_accel")
    assert recording.readings == pytest.approx(files.FORCE, abs=1e-6)
    if warm:
        assert recording.reference["temperature_degC"] == pytest.approx(files.WARM, abs=1e-4)
    else:
        assert "temperature_degC" not in recording.reference


def test_the_temperature_of_a_sketch_is_recognised(tmp_path):
    path = files.mpu6050(tmp_path / "mpu.csv")
    file = tmp_path / "suggested.toml"
    file.write_text(inspect_file(path).map_toml)
    recording = mapped_recording(path, load_map(file))
    assert recording.reference["temperature_degC"] == pytest.approx(files.WARM)
    assert recording.readings == pytest.approx(files.FORCE, abs=1e-6)


def test_a_written_recording_reads_back_with_what_else_the_file_held(tmp_path):
    recording = mapped_recording(files.xsens_dot(tmp_path / "dot.csv"), "xsens_dot")
    recording.write(tmp_path / "run.csv")
    again = Recording.read(tmp_path / "run.csv")
    assert again.readings == pytest.approx(recording.readings)
    assert again.extra["raw_Euler_X"] == pytest.approx(10.0 * files.T)
    assert again.metadata["column_map"] == "xsens_dot"
    assert again.metadata["source_files"] == ["dot.csv"]
    assert again.array.name == "one_chip"


def test_times_since_an_epoch_keep_their_digits(tmp_path):
    recording = mapped_recording(files.euroc(tmp_path / "data.csv"), "euroc")
    assert recording.t_s == pytest.approx(files.T, abs=1e-9)
    assert recording.metadata["time_origin_s"] == pytest.approx(files.START_NS * 1e-9)


def test_files_of_chips_on_one_clock_become_one_recording(tmp_path):
    """The second chip samples 3 ms later and starts before the first."""
    times = files.T - 0.103
    force = np.column_stack(
        [9.7 + 0.5 * np.sin(3 * times), 0.8 * np.cos(2 * times) + 0.3, 1.2 * np.sin(5 * times + 1.0)]
    )
    first = files.klipper(tmp_path / "chip1.csv")
    second = files.klipper(tmp_path / "chip2.csv", start=1234.5 - 0.103, force=force)
    with pytest.warns(RecordingWarning, match="interpolated"):
        recording = mapped_recording([first, second], "klipper")
    assert recording.channels == ("a11", "a12", "a13", "a21", "a22", "a23")
    assert len(recording) == pytest.approx(files.N - 11, abs=1)
    assert recording.readings[:, 3:] == pytest.approx(recording.readings[:, :3], abs=1e-4)
    assert recording.array is None


def test_files_without_a_common_time_are_refused(tmp_path):
    first = files.klipper(tmp_path / "chip1.csv")
    second = files.klipper(tmp_path / "chip2.csv", start=9999.0)
    with pytest.raises(InputError, match="its clock is not that of"):
        mapped_recording([first, second], "klipper")


@pytest.mark.parametrize("library", ["pandas", "polars", "pyarrow"])
def test_tables_of_python_are_read_by_a_map(library):
    columns = {"ms": 1000.0 * files.T, "ax": files.FORCE[:, 0], "ay": files.FORCE[:, 1], "az": -files.FORCE[:, 2]}
    module = pytest.importorskip(library)
    table = module.table(columns) if library == "pyarrow" else module.DataFrame(columns)
    channels = {
        "a11": ColumnSpec("ax", "m/s^2"),
        "a12": ColumnSpec("ay", "m/s^2"),
        "a13": ColumnSpec("az", "m/s²", -1.0),
    }
    recording = mapped_recording(table, ColumnMap("mine", channels, time=TimeSpec("ms", "ms")))
    assert recording.readings == pytest.approx(files.FORCE)
    assert recording.t_s == pytest.approx(files.T)


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_variables_of_matlab_are_columns(tmp_path, version):
    path = tmp_path / "run.mat"
    if version == "5":
        from scipy.io import savemat

        savemat(path, {"t": files.T, "imu": {"acc": files.FORCE}, "note": "bench"})
    else:
        import h5py

        with h5py.File(path, "w", userblock_size=512) as file:
            file["t"] = files.T[None, :]
            file["imu/acc"] = files.FORCE.T
        with path.open("r+b") as file:  # as MATLAB itself begins such a file
            file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    found = inspect_file(path)
    assert found.chips == 1
    assert found.sample_rate_hz == pytest.approx(100.0)
    assert mapped_recording(path, found.column_map).readings == pytest.approx(files.FORCE)


def test_every_map_that_comes_with_gfimu_is_sound():
    assert {name.partition(" ")[0] for name in CASES} <= set(list_maps())
    for name in list_maps():
        column_map = load_map(name)
        assert column_map.name == name
        assert column_map.summary
    assert set(REFERENCE_KINDS) == {
        f"{name}_{next(iter(units))}" for name, units in REFERENCE_UNITS.items() if name != "t"
    }
