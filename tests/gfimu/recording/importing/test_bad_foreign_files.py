"""Damaged, foreign or wrongly mapped files end in one line that names file and remedy, and what is odd is reported."""

import contextlib
import struct
import time

import foreign_files as files
import numpy as np
import pytest

import gfimu
from gfimu import InputError, RecordingWarning, UnitError, load_map
from gfimu.recording import inspect_file, mapped_recording, sample_doubts

MAP = 'name = "m"\n[time]\ncolumn = "t"\n[channels]\na11 = { column = "x", unit = "g" }\n'

BAD_MAPS = {
    "unknown unit": (MAP.replace('"g"', '"furlong"'), ["a11", "furlong", "m/s2"]),
    "unknown key": ("colour = 1\n" + MAP, ["colour"]),
    "unknown reference": (MAP + '[reference]\nspeed = { column = "v", unit = "rpm" }\n', ["speed", "tacho_rad_s"]),
    "unit of another kind": (MAP + '[reference]\ntacho_rad_s = { column = "v", unit = "g" }\n', ["tacho_rad_s", "rpm"]),
    "no time": (MAP.replace('column = "t"\n', ""), ["rate_hz"]),
    "negative rate": (MAP.replace('column = "t"', "rate_hz = -5.0"), ["time.rate_hz"]),
    "no channels": ('name = "m"\n[time]\nrate_hz = 5.0\n[channels]\n', ["channels"]),
    "a number for a name": (MAP.replace('column = "x"', "column = 1.5"), ["channels"]),
    "no TOML": ("name =\n", ["TOML"]),
    "unknown array": ('array = "nowhere"\n' + MAP, ["nowhere", "cube12"]),
}


@pytest.mark.parametrize(("text", "words"), BAD_MAPS.values(), ids=BAD_MAPS)
def test_a_bad_map_is_one_line(tmp_path, text, words):
    file = tmp_path / "m.toml"
    file.write_text(text)
    with pytest.raises(InputError) as error:
        load_map(file)
    message = str(error.value)
    assert "\n" not in message
    assert all(word in message for word in words), message


BAD_FILES = {
    "empty": (b"", ["empty file"]),
    "binary": (bytes(range(256)) * 20, ["unknown format", "ulog"]),
    "damaged zip": (b"PK\x03\x04" + bytes(100), ["damaged archive"]),
    "damaged ULog": (b"ULog\x01\x12\x35\x01" + bytes(4), ["ULog"]),
    "damaged MCAP": (b"\x89MCAP0\r\n" + bytes(50), ["MCAP"]),
    "damaged MATLAB": (b"MATLAB 5.0 MAT-file" + bytes(30), ["MATLAB"]),
    "damaged HDF5": (b"\x89HDF\r\n\x1a\n" + bytes(50), ["HDF5"]),
    "damaged bag": (b"#ROSBAG V2.0\n" + bytes(50), ["ROS bag"]),
    "damaged gzip": (b"\x1f\x8b\x08" + bytes(50), ["gzip"]),
    "damaged Parquet": (b"PAR1" + bytes(50), ["damaged Parquet"]),
}


@pytest.mark.parametrize(("content", "words"), BAD_FILES.values(), ids=BAD_FILES)
def test_a_bad_file_is_one_line(tmp_path, content, words):
    file = tmp_path / "run.bag"
    file.write_bytes(content)
    with pytest.raises(InputError) as error:
        inspect_file(file)
    message = str(error.value)
    assert message.startswith(str(file))
    assert "\n" not in message
    assert all(word in message for word in words), message


def ulog_message(kind, body):
    return struct.pack("<HB", len(body), ord(kind)) + body


ULOG_HEAD = b"ULog\x01\x12\x35\x01" + bytes(8)
ENDLESS = {
    "a ULog that its parser goes back in": ULOG_HEAD + b"[" * 20_000,
    "ULog formats within formats": ULOG_HEAD
    + b"".join(
        ulog_message("F", b"f%d:f%d[60000] x;" % (number, number + 1) if number < 5 else b"f5:float x;")
        for number in range(6)
    )
    + ulog_message("A", struct.pack("<BH", 0, 7) + b"f0"),
    "a ULog format within itself": ULOG_HEAD + ulog_message("F", b"f:f[9] x;") + ulog_message("A", bytes(3) + b"f"),
    "a name of spaces": b"t,x" + b" " * 60_000 + b"x,y\n" + b"0.1,1,2\n" * 9,
    "an open bracket": b"t,x [" + b" " * 60_000 + b"x,y\n" + b"0.1,1,2\n" * 9,
    "lines that begin with spaces": (b" " * 9_000 + b"1 2 3\n") * 400,
    "a log with a number of many digits": (b"[INFO] imu: 1 " + b"1" * 9_000 + b"x\n") * 400,
    "a log of many marks": (b"a: " * 60 + b"1 " * 50 + b"x\n") * 400,
    "a word of many letters": (b"a" * 9_000 + b": 1 2 3x\n") * 400,
    "values to plot": (b">a:" + b"1" * 9_000 + b":x\n") * 400,
    "series of many words": (b"a," + b"1," * 9_000 + b"x\n") * 60,
    "a LabVIEW file of ends": b"LabVIEW Measurement\n" + b"***End_of_Header***\n" * 90_000,
    "dates above words": b"t,ax\n" + b"2024-05-17T23:59:50.000Z,1\n" * 60 + b"x,2\n" * 100,
}


@pytest.mark.parametrize("content", ENDLESS.values(), ids=ENDLESS)
def test_a_file_that_leads_a_parser_astray_ends_soon(tmp_path, content):
    file = tmp_path / "run"
    file.write_bytes(content)
    start = time.process_time()
    with contextlib.suppress(InputError):
        inspect_file(file)
    assert time.process_time() - start < 5.0


def test_another_map_than_the_file_needs_is_named(tmp_path):
    with pytest.raises(InputError, match=r"needs column 'accel_x'.*--map euroc"):
        mapped_recording(files.euroc(tmp_path / "data.csv"), "klipper")


def text_run(tmp_path, t, force=files.FORCE):
    names = ["time", "accel_x", "accel_y", "accel_z"]
    return files.rows(tmp_path / "run.csv", [",".join(names)], [t, *(1000.0 * force.T)], form="{:.12g}")


def test_repeated_times_are_left_out_and_said(tmp_path):
    t = files.T.copy()
    t[100] = t[99]
    with pytest.warns(RecordingWarning, match="1 rows whose time does not increase"):
        assert len(mapped_recording(text_run(tmp_path, t), "klipper")) == files.N - 1


def test_rounded_times_are_refused_with_the_remedy(tmp_path):
    with pytest.raises(InputError, match=r"do not increase.*rate_hz"):
        mapped_recording(text_run(tmp_path, np.round(files.T, 1)), "klipper")


def test_numbers_that_stand_for_missing_are_missing(tmp_path):
    force = files.FORCE.copy()
    force[40:50, 1] = -0.999
    text = 'name = "m"\nmissing = [-999.0]\n[time]\ncolumn = "time"\n[channels]\n' + "".join(
        f'a1{number} = {{ column = "accel_{axis}", unit = "mm/s^2" }}\n' for number, axis in enumerate("xyz", 1)
    )
    (tmp_path / "m.toml").write_text(text)
    recording = mapped_recording(text_run(tmp_path, files.T, force), tmp_path / "m.toml")
    assert np.flatnonzero(np.isnan(recording.readings[:, 1])).tolist() == list(range(40, 50))


def test_a_map_does_not_fit_an_array_of_other_size(tmp_path):
    from gfimu import AccelerometerArray

    with pytest.raises(InputError, match=r"3 channels.*'cube12' has 12.*--array"):
        mapped_recording(files.klipper(tmp_path / "a.csv"), "klipper", array=AccelerometerArray.load("cube12"))


def test_rails_corrupt_values_and_noise_are_reported():
    rng = np.random.default_rng(0)
    values = {
        name: np.round(6000.0 * np.sin(np.arange(8000) / 500.0) + 20.0 * rng.standard_normal(8000)) for name in "abcd"
    }
    values["a"] = np.clip(values["a"], -8000, 5600.0)
    over = values["a"] == 5600.0
    values["a"][over] += rng.choice([0.0, 1.0, 3.0, 10.0], over.sum(), p=[0.97, 0.01, 0.01, 0.01])  # it overshoots
    values["b"][17] = 1e19
    values["b"][20:23] = np.nan
    values["c"] += 300.0 * rng.standard_normal(8000)
    values["d"][:] = 7.0
    reported = [one.text for one in sample_doubts(values, [[name] for name in values])]
    assert any(line.startswith("a reads its rail") and "most 5600" in line for line in reported)
    assert not any("rail" in line and line[0] in "bcd" for line in reported)
    assert any(line.startswith("b: 1 values that can be no reading") for line in reported)
    assert any(line.startswith("b: 3 of 8000 cells are empty") for line in reported)
    assert any(line.startswith("c is noisy") for line in reported)
    assert any(line.startswith("d reads 7 throughout") for line in reported)


def test_units_are_read_as_people_write_them():
    from gfimu.recording import factor_of

    for text in ("m/s^2", "m/s²", "m s^-2", "m_s2", "M/S2"):
        assert factor_of(text, "acceleration") == 1.0
    for text in ("deg/s", "°/s", "dps", "deg s^-1"):
        assert factor_of(text, "rate") == pytest.approx(np.pi / 180.0)
    with pytest.raises(UnitError, match="rpm"):
        factor_of("knots", "rate")


def test_a_recording_of_gfimus_is_known_and_its_repeated_rows_are_said(tmp_path):

    rows = [f"{k / 100},{k % 5},{k % 3},{9.8 + 0.01 * (k % 4)},{k}" for k in range(300)]
    path = tmp_path / "run.csv"
    path.write_text("t_s,a11_m_s2,a12_m_s2,a13_m_s2,tacho_rpm\n" + "\n".join([*rows[:200], *rows[190:]]) + "\n")
    found = inspect_file(path)
    assert (found.is_own, found.chips, found.column_map) == (True, 1, None)
    assert any("left out 10 rows" in line for line in found.findings)
    assert any("--drop duplicates" in line for line in found.findings)
    assert [one.role for one in found.columns][-1] == "reference"
    with pytest.raises(InputError, match="needs no column map"):
        gfimu.inspect(path, out=tmp_path / "m.toml")


def test_times_that_go_back_are_no_counter_that_starts_anew(tmp_path):
    t = files.T.copy()
    t[150:] -= 0.105
    assert inspect_file(text_run(tmp_path, t)).column_map.time.wrap is None
    counts = (65000 + 10 * np.arange(files.N)) % 65536
    assert inspect_file(text_run(tmp_path, counts)).column_map.time.wrap == 65536.0
