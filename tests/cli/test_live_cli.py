"""`gfimu live`: the filter on a pipe and on a socket gives what `gfimu estimate` gives."""

from __future__ import annotations

import io
import json
import socket
import subprocess
import sys
import threading

import numpy as np
import pytest

from firmware_bridge import Journal
from gfimu import AccelerometerArray, LiveRateFilter, SensorErrors
from gfimu.rate import joined_estimates

CUBE = AccelerometerArray.load("cube12")
RATE = 100.0
PROGRAM = "from gfimu.commands.shell.program import main; main()"


@pytest.fixture(scope="module")
def stream():
    """CSV text of a ramp from rest, its times and readings."""
    rng = np.random.default_rng(0)
    t = np.arange(400) / RATE
    readings = rng.normal(0, 0.03, (len(t), 12)) + rng.normal(0, 0.3, 12)
    alpha = np.where(t > 2, 2.0, 0.0)
    omega = np.maximum(t - 2, 0) * 2.0
    readings += np.outer(alpha, CUBE.regression_matrix[:, 2]) + np.outer(omega**2, CUBE.centripetal_matrix[:, 2])
    lines = ["# a comment", "t_s," + ",".join(f"{name}_m_s2" for name in CUBE.channels)]
    lines += [",".join(repr(float(value)) for value in (time, *row)) for time, row in zip(t, readings, strict=True)]
    return "\n".join(lines) + "\n", t, readings


def run_live(*options, text=""):
    return subprocess.run(
        [sys.executable, "-c", PROGRAM, "live", "--array", "cube12", "--rate", "100", *options],
        input=text, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


def check(output, t, readings):
    found = [json.loads(line) for line in output.splitlines()]
    live = LiveRateFilter(CUBE, SensorErrors.from_parts(CUBE, RATE).with_part_gains(CUBE), 1 / RATE)
    expected = joined_estimates([live.push(t, readings), live.finish()])
    np.testing.assert_allclose([line["t_s"] for line in found], t)
    np.testing.assert_allclose([line["omega_rad_s"] for line in found], expected.omega, atol=1e-7)
    np.testing.assert_allclose([line["omega_std_rad_s"] for line in found], expected.std, atol=1e-7)
    assert found[-1]["sign"] == "known"


def test_standard_input(stream):
    text, t, readings = stream
    result = run_live(text=text)
    assert result.returncode == 0, result.stderr
    check(result.stdout, t, readings)


def test_socket(stream):
    text, t, readings = stream
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve():
            connection, _ = server.accept()
            with connection:
                connection.sendall(text.encode())

        thread = threading.Thread(target=serve)
        thread.start()
        result = run_live("--from", f"127.0.0.1:{server.getsockname()[1]}")
        thread.join(timeout=10)
    assert result.returncode == 0, result.stderr
    check(result.stdout, t, readings)


def test_faults_are_told_and_survived(stream):
    lines = stream[0].splitlines()
    lines[100] = "rubbish"
    lines[150] = lines[149]  # a repeated sample
    cells = lines[200].split(",")
    cells[4] = ""
    lines[200] = ",".join(cells)
    result = run_live(text="\n".join(lines) + "\n")
    assert result.returncode == 0, result.stderr
    found = [json.loads(line) for line in result.stdout.splitlines()]
    faults = [line["fault"] for line in found if "fault" in line]
    assert "columns" in str(faults[0])
    assert any("increase" in str(fault) for fault in faults)
    assert any(fault.get("missing") == {"a21": 1} for fault in faults if isinstance(fault, dict))
    assert sum("t_s" in line for line in found) == 398


@pytest.mark.parametrize(
    ("options", "text", "message"),
    [
        ((), "1,2,3\n", "lacks t_s"),
        ((), "t_s,a11_m_s2\n", "lacks channel a12"),
        ((), "t_s," + ",".join(f"{name}_V" for name in CUBE.channels) + "\n", "valid: m_s2, g, mg, lsb"),
        ((), "# lsb_m_s2: 0\nt_s," + ",".join(f"{name}_lsb" for name in CUBE.channels) + "\n", "size of one count"),
        (("--from", "nowhere"), "", "no such file"),
        (("--from", "nowhere.csv", "--follow"), "", "no such file"),
        (("--from", "127.0.0.1:1"), "", "start the server first"),
    ],
)
def test_bad_input(gfimu_command, monkeypatch, options, text, message):
    monkeypatch.setattr(sys, "stdin", io.StringIO(text))
    result = gfimu_command("live", "--array", "cube12", "--rate", "100", *options)
    assert result.code == 2
    assert message in result.stderr
    assert "Traceback" not in result.stderr


@pytest.fixture(scope="module")
def counts(stream):
    """Raw counts of the ramp and the readings they stand for."""
    size = 0.038245935
    number = np.round(stream[2] / size)
    return number, number * size


def journal(out, t, number, **metadata):
    described = {"array": "cube12", "part": "adxl345", "lsb_m_s2": 0.038245935, "sample_rate_hz": 100, **metadata}
    written = Journal(out, CUBE.channels, described)
    written.append(t[:200], number[:200], np.zeros(200, dtype=np.uint16))
    return written


@pytest.mark.parametrize("name", ["run.csv", "run.parquet"])
def test_what_record_has_finished(stream, counts, tmp_path, name, gfimu_command):
    _, t, _ = stream
    number, readings = counts
    written = journal(tmp_path / name, t, number)
    written.append(t[200:], number[200:], np.zeros(len(t) - 200, dtype=np.uint16))
    written.finish({"frames_lost": 0})
    result = gfimu_command("live", "--from", tmp_path / name)
    assert result.code == 0, result.stderr
    check(result.stdout, t, readings)


@pytest.mark.parametrize("name", ["run.csv", "run.parquet"])
def test_what_record_is_writing(stream, counts, tmp_path, name, gfimu_command):
    _, t, _ = stream
    number, readings = counts
    written = journal(tmp_path / name, t, number)
    assert len(gfimu_command("live", "--from", tmp_path / name).stdout.splitlines()) == 200
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, "live", "--from", str(tmp_path / name), "--follow"],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        first = process.stdout.readline()  # it has read what is there, and waits
        written.append(t[200:], number[200:], np.zeros(len(t) - 200, dtype=np.uint16))
        written.finish({})
        rest = process.stdout.read()  # communicate() would lose what readline() has read ahead
        code = process.wait(timeout=60)
    finally:
        process.kill()
    assert code == 0
    check(first + rest, t, readings)


def test_counts_on_a_pipe_are_of_the_arrays_part(stream, counts, gfimu_command, monkeypatch):
    _, t, _ = stream
    number, readings = counts
    lines = ["t_s,status," + ",".join(f"{name}_lsb" for name in CUBE.channels)]
    lines += [",".join(map(repr, (time, 0.0, *row))) for time, row in zip(t.tolist(), number.tolist(), strict=True)]
    monkeypatch.setattr(sys, "stdin", io.StringIO("\n".join(lines) + "\n"))
    result = gfimu_command("live", "--array", "cube12", "--rate", "100")
    assert result.code == 0, result.stderr
    check(result.stdout, t, readings)


@pytest.mark.parametrize(
    ("head", "message"), [("", "--array is missing"), ('# array: "cube12"\n', "--rate is missing")]
)
def test_a_stream_that_does_not_describe_itself(head, message, gfimu_command, monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.StringIO(head + "t_s,a11_lsb\n"))
    result = gfimu_command("live")
    assert result.code == 2
    assert message in result.stderr
    assert result.stderr.count("\n") == 1
