"""`gfimu live`: the filter on a pipe and on a socket gives what `gfimu estimate` gives."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import threading

import numpy as np
import pytest

from gfimu.array import AccelerometerArray
from gfimu.rate.filter import filter_rate
from gfimu.rate.sensing import SensorErrors

CUBE = AccelerometerArray.load("cube12")
RATE = 100.0
PROGRAM = "from gfimu.cli import main; main()"


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
    expected = filter_rate(CUBE, t, readings, SensorErrors.from_parts(CUBE, RATE))
    np.testing.assert_allclose([line["t_s"] for line in found], t)
    np.testing.assert_allclose([line["omega_rad_s"] for line in found], expected.omega, atol=1e-12)
    np.testing.assert_allclose([line["omega_std_rad_s"] for line in found], expected.std, atol=1e-12)
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
        ((), "t_s," + ",".join(f"{name}_lsb" for name in CUBE.channels) + "\n", "unit must be m_s2, g or mg"),
        (("--from", "nowhere"), "", "host:port"),
        (("--from", "127.0.0.1:1"), "", "start the server first"),
    ],
)
def test_bad_input(options, text, message):
    result = run_live(*options, text=text)
    assert result.returncode == 2
    assert message in result.stderr
    assert "Traceback" not in result.stderr
