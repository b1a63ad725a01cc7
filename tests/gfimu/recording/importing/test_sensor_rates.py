"""Logs with a rate per sensor: slower ones keep their times, others are interpolated with a note."""

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

import gfimu
from gfimu import InputError, RecordingWarning, load_map
from gfimu.recording import nearest_rows, reference_on_rows, reference_series

ACCEL = np.arange(0.0, 10.0, 0.01)
GYRO = np.arange(0.003, 10.0, 0.02)
TACHO = np.arange(0.007, 10.0, 0.25)

CHANNELS = ["channels.a11=x", "channels.a12=y", "channels.a13=z", "unit=m/s^2"]


def rate(t):
    return np.sin(2.0 * t)


def accelerations(t):
    return np.column_stack([np.cos(t), np.sin(t), 9.81 + 0.0 * t])


def map_of(*keys):
    return ["time.column=time", *CHANNELS, *keys]


GYRO_KEYS = [f'reference.gyro_{one}_rad_s={{column="{one}", unit="deg/s", table="sensor=gyro"}}' for one in "xyz"]
TACHO_KEY = 'reference.tacho_rad_s={column="x", unit="rad/s", table="sensor=tacho"}'


@pytest.fixture
def long_log(tmp_path):
    """Rows ``time, sensor, x, y, z`` as three sensors gave them: 100 Hz, 50 Hz in °/s and 4 Hz of one number."""
    rows = [(t, "accel", *a) for t, a in zip(ACCEL, accelerations(ACCEL), strict=True)]
    rows += [(t, "gyro", 0.0, 0.0, np.degrees(rate(t))) for t in GYRO]
    rows += [(t, "tacho", rate(t)) for t in TACHO]
    rows.sort(key=lambda row: row[0])
    lines = [",".join([f"{row[0]:.6f}", row[1], *(f"{one:.9f}" for one in row[2:])]) for row in rows]
    lines = [line + "," * (4 - line.count(",")) for line in lines]
    file = tmp_path / "long.csv"
    file.write_text("\n".join(["time,sensor,x,y,z", *lines]) + "\n")
    return file


def assert_own_times(recording):
    """The channels at their rate, and each value of the slower sensors beside the time at which it was read."""
    assert_allclose(recording.t_s, ACCEL, atol=1e-9)
    assert_allclose(recording.readings, accelerations(ACCEL), atol=1e-8)
    for name, times in (("gyro_z_rad_s", GYRO), ("tacho_rad_s", TACHO)):
        t, values = reference_series(recording, name)
        assert_allclose(t, times, atol=1e-8)
        assert_allclose(values, rate(times), atol=1e-8)
    assert np.isfinite(recording.reference["tacho_t_s"]).sum() == len(TACHO)
    assert np.isnan(recording.reference["tacho_rad_s"]).sum() == len(ACCEL) - len(TACHO)


def test_a_log_in_long_format_keeps_the_times_of_each_sensor(long_log, tmp_path):
    """The tachometer has fewer rows than a mistake may have; the map names it."""
    keys = map_of("split_by=sensor", "table=sensor=accel", *GYRO_KEYS, TACHO_KEY)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = gfimu.convert(long_log, tmp_path / "run.parquet", column_map=gfimu.load_map(None, keys))
    assert_own_times(made)
    assert_own_times(gfimu.Recording.read(tmp_path / "run.parquet"))
    on_rows = reference_on_rows(made).reference["gyro_z_rad_s"]
    known = np.isfinite(on_rows)
    assert known.mean() > 0.99
    assert_allclose(on_rows[known], rate(ACCEL[known]), atol=2e-4)


def test_files_of_sensors_are_the_tables_that_the_map_names(tmp_path):
    gyro = np.column_stack([GYRO, 0 * GYRO, 0 * GYRO, np.degrees(rate(GYRO))])
    tables = {
        "accel": (np.column_stack([ACCEL, accelerations(ACCEL)]), "time,x,y,z"),
        "gyro": (gyro, "time,x,y,z"),
        "tacho": (np.column_stack([TACHO, rate(TACHO)]), "time,x"),
    }
    for name, (values, head) in tables.items():
        np.savetxt(tmp_path / f"{name}.csv", values, delimiter=",", header=head, comments="", fmt="%.9f")
    keys = map_of("table=accel.csv", *(one.replace("sensor=gyro", "gyro.csv") for one in GYRO_KEYS))
    keys.append(TACHO_KEY.replace("sensor=tacho", "tacho.csv"))
    files = [tmp_path / f"{name}.csv" for name in tables]
    made = gfimu.convert(files, tmp_path / "run.csv", column_map=gfimu.load_map(None, keys))
    assert_own_times(made)
    assert made.metadata["source_files"] == ["accel.csv", "gyro.csv", "tacho.csv"]


def wide(path, columns):
    """A table whose columns end at different rows, the rest blank."""
    longest = max(map(len, columns.values()))
    rows = [",".join(f"{one[row]:.9f}" if row < len(one) else "" for one in columns.values()) for row in range(longest)]
    path.write_text("\n".join([",".join(columns), *rows]) + "\n")
    return path


def channel_columns():
    return dict(zip("xyz", accelerations(ACCEL).T, strict=True))


def test_columns_of_times_beside_each_sensor(tmp_path):
    columns = {"time": ACCEL, **channel_columns(), "t_gyro": GYRO, "wz": rate(GYRO), "t_tacho": TACHO, "w": rate(TACHO)}
    keys = map_of(
        'reference.gyro_z_rad_s={column="wz", unit="rad/s", time="t_gyro"}',
        'reference.tacho_rad_s={column="w", unit="rad/s", time="t_tacho"}',
    )
    made = gfimu.convert(
        wide(tmp_path / "wide.csv", columns), tmp_path / "run.csv", column_map=gfimu.load_map(None, keys)
    )
    assert_own_times(made)
    assert not [name for name in made.extra if name.startswith("raw_t_")]


def test_rates_of_sensors_without_times(tmp_path):
    """As a database of sensors states them: one rate each, all from the first row on."""
    gyro, tacho = np.arange(500) / 50.0, np.arange(40) / 4.0
    file = wide(tmp_path / "wide.csv", {**channel_columns(), "wz": rate(gyro), "w": rate(tacho)})
    keys = [
        "time.rate_hz=100",
        *CHANNELS,
        'reference.gyro_z_rad_s={column="wz", unit="rad/s", rate_hz=50}',
        'reference.tacho_rad_s={column="w", unit="rad/s", rate_hz=4}',
    ]
    made = gfimu.convert(file, tmp_path / "run.csv", column_map=gfimu.load_map(None, keys))
    assert len(made) == len(ACCEL)
    for name, times in (("gyro_z_rad_s", gyro), ("tacho_rad_s", tacho)):
        t, values = reference_series(made, name)
        assert_allclose(t, times, atol=1e-9)
        assert_allclose(values, rate(times), atol=1e-8)


def test_channels_that_end_before_a_faster_sensor(tmp_path):
    gyro = np.arange(4000) / 400.0
    file = wide(tmp_path / "wide.csv", {**channel_columns(), "wz": rate(gyro)})
    keys = ["time.rate_hz=100", *CHANNELS, 'reference.gyro_z_rad_s={column="wz", unit="rad/s", rate_hz=400}']
    with pytest.warns(RecordingWarning, match="gyro_z_rad_s interpolated to the sample times"):
        made = gfimu.convert(file, tmp_path / "run.csv", column_map=gfimu.load_map(None, keys))
    assert len(made) == len(ACCEL)
    assert_allclose(made.reference["gyro_z_rad_s"], rate(ACCEL), atol=1e-6)


def test_a_sensor_as_fast_as_the_channels_is_interpolated_and_that_is_said(long_log, tmp_path):
    text = long_log.read_text().replace("accel", "first").replace("gyro", "accel").replace("first", "gyro")
    long_log.write_text(text)  # now the gyro has 100 Hz, the accelerometer 50 Hz
    keys = map_of("split_by=sensor", "table=sensor=accel", *GYRO_KEYS)
    with pytest.warns(RecordingWarning, match="gyro_z_rad_s of table 'sensor=gyro' interpolated"):
        made = gfimu.convert(long_log, tmp_path / "run.csv", column_map=gfimu.load_map(None, keys))
    assert "gyro_t_s" not in made.reference


def test_a_sensor_that_is_not_there_is_said(long_log, tmp_path):
    keys = map_of(
        "split_by=sensor", "table=sensor=accel", TACHO_KEY.replace("tacho}", "wheel}").replace("=tacho", "=wh")
    )
    with pytest.warns(RecordingWarning, match="no table 'sensor=wh', so no tacho_rad_s"):
        gfimu.convert(long_log, tmp_path / "run.csv", column_map=gfimu.load_map(None, keys))


def test_a_row_has_the_mean_of_what_was_read_in_it():
    values, read = nearest_rows(
        np.array([0.0, 1.0, 2.0]), np.array([0.8, 1.3, 1.9, 4.0]), np.array([1.0, 3.0, np.nan, 9.0])
    )
    assert_allclose(values, [np.nan, 2.0, np.nan])
    assert_allclose(read, [np.nan, 1.05, np.nan])


def test_a_column_has_a_time_or_a_rate():
    both = 'reference.tacho_rad_s={column="w", unit="rad/s", time="t", rate_hz=4}'
    with pytest.raises(InputError, match="tacho_rad_s has both a time and rate_hz"):
        load_map(None, map_of(both))


def test_a_column_of_times_that_is_missing_is_named(tmp_path):
    file = wide(tmp_path / "wide.csv", {"time": ACCEL, **channel_columns(), "w": rate(TACHO)})
    keys = map_of('reference.tacho_rad_s={column="w", unit="rad/s", time="t_tacho"}')
    with pytest.raises(InputError, match="column 't_tacho' of the time is missing"):
        gfimu.convert(file, tmp_path / "run.csv", column_map=gfimu.load_map(None, keys))


def test_noise_of_a_slower_gyro_is_that_at_its_own_rate():
    rng = np.random.default_rng(9)
    t = np.arange(20000) / 100.0
    gyro = np.full(len(t), np.nan)
    gyro[::2] = 0.01 * rng.standard_normal(10000)
    reference = {"gyro_x_rad_s": gyro, "gyro_t_s": np.where(np.isfinite(gyro), t + 0.003, np.nan)}
    recording = gfimu.Recording(t, rng.standard_normal((len(t), 3)), ("a11", "a12", "a13"), reference)
    found = gfimu.noise(recording, stretch="all").models["gyro_x"]
    assert found.allan.rate == pytest.approx(50.0)
    assert found["N"].value == pytest.approx(0.01 / np.sqrt(50.0), rel=0.05)
