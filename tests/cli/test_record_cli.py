"""`gfimu record` and `gfimu firmware` as a user runs them."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from firmware_bridge import FORMATS
from gfimu.recording import Recording

pytestmark = pytest.mark.skipif(find_spec("unicorn") is None, reason="the emulator is in the extra")
GFIMU = Path(sys.executable).parent / "gfimu"


def test_run_to_a_file(gfimu_command, tmp_path) -> None:
    out = tmp_path / "run.parquet"
    result = gfimu_command(
        "firmware", "run", "--scenario", "rest", "--duration", "2", "--rate", "200", "--out", out, "--json"
    )
    assert result.code == 0
    found = json.loads(result.stdout)
    assert found["stream"]["lost"] == 0
    assert found["identity"]["rate_hz"] == 200
    recording = Recording.read(out)
    assert recording.sample_rate == pytest.approx(200, rel=0.02)  # the pace of the chips, whose clocks are 0.5 % off
    assert "tacho_rad_s" in recording.reference


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals on Windows")
def test_run_behind_a_port_and_record_from_it(tmp_path) -> None:
    board = subprocess.Popen(
        [GFIMU, "firmware", "run", "--scenario", "rest", "--port", "pty", "--duration", "60"],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert board.stdout is not None
        line = board.stdout.readline()
        device = line.split()[2].rstrip(";")
        assert device.startswith("/dev/")
        out = tmp_path / "run.csv"
        command = [GFIMU, "record", "--port", device, "--out", out, "--duration", "2", "--rate", "800", "--json"]
        command += ["--rrd", tmp_path / "live.rrd"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    finally:
        board.kill()
        board.wait()
    found = json.loads(done.stdout)
    assert found["stream"]["lost"] == found["stream"]["corrupt"] == 0
    assert found["identity"]["rate_hz"] == 800
    assert (found["array"], found["array_stated_by"]) == ("cube12", "board")
    assert len(Recording.read(out)) >= 1600 * 0.98  # the pace of the chips
    assert (tmp_path / "live.rrd").read_bytes()[:3] == b"RRF"


def test_build_and_trace(gfimu_command, tmp_path) -> None:
    result = gfimu_command("firmware", "build", "selfcheck", "--out", tmp_path / "image", "--json")
    assert result.code == 0
    assert Path(json.loads(result.stdout)["elf"]).is_file()
    result = gfimu_command("firmware", "trace", "--out", tmp_path / "t.vcd", "--duration", "0.02", "--json")
    assert json.loads(result.stdout)["exceptions"] > 0


BAD = [
    (("firmware", "run"), "--port"),
    (("firmware", "run", "--port", "com7"), "pty, tcp:PORT"),
    (("firmware", "run", "--scenario", "nowhere", "--port", "pty"), "paper_run"),
    (("firmware", "run", "--out", "run.txt"), ".csv or .parquet"),
    (("firmware", "run", "--out", "/dev/null/run.csv"), "choose a folder that can be written"),
    (("firmware", "run", "--out", "run.csv", "--rate", "9"), "10 to 3200 Hz"),
    (("firmware", "run", "--port", "tcp:0", "--rate", "3201"), "10 to 3200 Hz"),
    (("firmware", "trace", "--out", "t.vcd", "--rate", "0"), "10 to 3200 Hz"),
    (("record", "--port", "/dev/nothing", "--out", "run.csv", "--rate", "5000"), "10 to 3200 Hz"),
    (("record", "--port", "/dev/nothing", "--out", "/dev/null/run.csv"), "choose a folder that can be written"),
    (
        ("record", "--port", "/dev/nothing", "--out", "/dev/null/run.csv", "--rrd", "live.rrd"),
        "choose a folder that can be written",
    ),
    (("firmware", "build", "blink"), "selfcheck"),
    (("firmware", "build", "--define", "X Y"), "NAME=VALUE"),
    (("firmware", "trace", "--out", "t.txt"), ".vcd or .rrd"),
    (("record", "--port", "/dev/nothing", "--out", "run.csv"), "can't be opened"),
    (("record", "--port", "/dev/nothing", "--out", "run.txt"), ".csv or .parquet"),
    (("record", "--port", "/dev/nothing", "--out", "run.csv", "--range", "3"), "2, 4, 8 and 16"),
    (("record", "--port", "/dev/nothing", "--out", "run.csv", "--format", "nmea"), "mimu4444"),
]


@pytest.mark.parametrize(("arguments", "remedy"), BAD)
def test_bad_input_is_one_line_and_code_2(gfimu_command, tmp_path, monkeypatch, arguments, remedy) -> None:
    monkeypatch.chdir(tmp_path)
    result = gfimu_command(*arguments)
    assert result.code == 2
    assert remedy in result.stderr
    assert result.stderr.strip().count("\n") == 0
    assert not list(tmp_path.iterdir())


def test_a_full_disk_at_the_end_of_a_virtual_run(gfimu_command, tmp_path, monkeypatch) -> None:
    def no_room(*_) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("gfimu.recording.tables.column_file._write_csv", no_room)
    out = tmp_path / "run.csv"
    result = gfimu_command("firmware", "run", "--scenario", "rest", "--duration", "0.2", "--out", out)
    assert result.code == 1
    assert "not written: No space left on device" in result.stderr
    assert result.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_an_interrupted_recording_is_whole(tmp_path) -> None:
    from firmware_bridge import TcpPort

    port = TcpPort(0)
    out = tmp_path / "run.parquet"
    process = subprocess.Popen([GFIMU, "record", "--port", port.name, "--out", out, "--json"], stdout=subprocess.PIPE)
    try:
        from firmware_bridge import encode_samples

        end = time.monotonic() + 30
        number = 0
        while time.monotonic() < end and (not out.exists() or number < 3000):
            port.read()
            port.write(
                encode_samples(
                    range(number, number + 80), [k * 1250 for k in range(number, number + 80)], [[0] * 12] * 80
                ),
                1.0,
            )
            number += 80
            time.sleep(0.05)
        process.send_signal(2)
        assert process.wait(20) == 0
    finally:
        process.kill()
        port.close()
    assert out.read_bytes()[:4] == b"PAR1"
    assert len(Recording.read(out)) > 0


@pytest.mark.parametrize("name", ["run.csv", "run.parquet"])
def test_live_follows_what_record_is_writing(tmp_path, name) -> None:
    """Both processes at once: every sample comes through with its size, and live ends with the recording."""
    from firmware_bridge import TcpPort, encode_samples

    chance, port, out, shown = np.random.default_rng(0), TcpPort(0), tmp_path / name, tmp_path / "shown"
    command = [GFIMU, "record", "--port", port.name, "--array", "cube12", "--out", out, "--json"]
    record = subprocess.Popen(command, stdout=subprocess.PIPE)
    live, number, last = None, 0, None
    end = time.monotonic() + 120.0
    try:
        while last is None or number < last:  # a second more once live has shown something
            assert time.monotonic() < end
            port.read()
            counts = np.round(chance.normal(0.0, 1.0, (5, 12)) + np.tile([0, 0, 256], 4)).astype(int).tolist()
            numbers = range(number, number + 5)
            port.write(encode_samples(numbers, [10_000 * k for k in numbers], counts), 1.0)
            number += 5
            time.sleep(0.05)
            if live is None and out.exists() and out.read_bytes().count(b"\n") > 100:
                follow = [GFIMU, "live", "--from", out, "--follow", "--rate", "100"]
                live = subprocess.Popen(follow, stdout=shown.open("w"))
            if last is None and live is not None and shown.stat().st_size:
                last = number + 100
        assert record.poll() is None
        record.send_signal(2)
        assert record.wait(60) == 0
        assert live.wait(60) == 0
    finally:
        for process in (record, live):
            if process is not None:
                process.kill()
        port.close()
    recording = Recording.read(out)
    lines = [line for line in map(json.loads, shown.read_text().splitlines()) if "event" not in line]
    np.testing.assert_allclose([line["t_s"] for line in lines], recording.t_s)
    assert len(lines) >= 200


def test_without_a_display_a_live_picture_is_one_line_before_anything_is_written(
    gfimu_command, tmp_path, monkeypatch
) -> None:
    monkeypatch.setattr("gfimu.visual.viewer.has_display", lambda: False)
    monkeypatch.setattr("gfimu.visual.viewer.viewer_listens", lambda: False)
    result = gfimu_command("record", "--port", "/dev/nothing", "--out", tmp_path / "run.csv", "--live")
    assert result.code == 1
    assert "no display here" in result.stderr
    assert "--rrd" in result.stderr
    assert result.stderr.strip().count("\n") == 0
    assert not list(tmp_path.iterdir())


def test_the_help_lists_every_format(gfimu_command) -> None:
    shown = " ".join(gfimu_command("record", "--help").stdout.replace("│", " ").split())
    assert f"Frame format: {' or '.join(FORMATS)}." in shown
