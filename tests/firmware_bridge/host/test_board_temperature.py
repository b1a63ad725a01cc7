"""From a board that sends its temperature to what a check, a calibration and an inspection say of it."""

from __future__ import annotations

import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from firmware_bridge import TcpPort
from gfimu import BoardSettings, calibrate, check, inspect, record
from gfimu.commands import print_blocks
from gfimu.recording import Recording
from sim.scenarios import Scenario
from sim.simulation import simulate

LSB = 0.038245935
SECONDS = 32.0


@pytest.fixture(scope="module")
def warming():
    """The paper's run while the board warms up from 25 towards 35 °C."""
    run = simulate(replace(Scenario.load("paper_run"), temperature=(25.0, 35.0, 20.0)), seed=12)
    return run.between(0.0, SECONDS)


@pytest.fixture(scope="module")
def recorded(warming, tmp_path_factory):
    """The run as a sketch prints it and `gfimu record` reads it."""
    port, out = TcpPort(0), tmp_path_factory.mktemp("warm") / "run.csv"
    counts = np.round(warming.readings / LSB).astype(int)
    lines = "".join(
        f"{round(1e6 * t)},{','.join(map(str, row))},{warm:.2f}\r\n"
        for t, row, warm in zip(warming.t_s, counts, warming.reference["temperature_degC"], strict=True)
    )
    done = threading.Event()

    def send() -> None:
        while not done.is_set() and port._host is None:
            port.read()
            time.sleep(0.01)
        time.sleep(0.3)  # pyserial empties its input when it opens a port
        port.write(lines.encode(), 10.0)
        done.wait(20.0)

    thread = threading.Thread(target=send)
    thread.start()
    report = record(port.name, out, board=BoardSettings(form="arduino_csv"), duration=warming.duration - 0.5)
    done.set()
    thread.join()
    port.close()
    return out, report


def test_the_recording_has_the_temperature(warming, recorded) -> None:
    out, report = recorded
    run = Recording.read(out)
    truth = np.interp(run.t_s, warming.t_s, warming.reference["temperature_degC"])
    np.testing.assert_allclose(run.reference["temperature_degC"], truth, atol=0.0051)  # two decimals were sent
    assert report.temperature_degC == pytest.approx((truth.min(), truth.max()), abs=0.01)


def test_a_check_and_an_inspection_show_it(warming, recorded, capsys) -> None:
    out, report = recorded
    run = Recording.read(out)
    tacho = np.interp(run.t_s, warming.t_s, warming.reference["tacho_rad_s"])
    found = check(replace(run, reference={**run.reference, "tacho_rad_s": tacho}), "cube12_turntable")
    lowest, highest = report.temperature_degC
    assert (found.runs[0].lowest_degC, found.runs[0].highest_degC) == pytest.approx((lowest, highest))
    print_blocks(found.shown())
    assert f"Temperature of run 1: {lowest:.4g} to {highest:.4g} °C." in capsys.readouterr().out
    (column,) = (one for one in inspect(out).columns if one.name == "temperature_degC")
    assert (column.least, column.most) == pytest.approx((lowest, highest))


def test_a_calibration_states_mean_and_span() -> None:
    scenario = replace(Scenario.load("calibration_poses"), temperature=(20.0, 24.0, 60.0))
    run = simulate(scenario, seed=3)
    warm = run.reference["temperature_degC"]
    statistics = calibrate("twelve-position", run).statistics
    assert statistics["temperature_mean_degC"] == pytest.approx(warm.mean())
    assert statistics["temperature_span_K"] == pytest.approx(np.ptp(warm))
    without = calibrate("twelve-position", replace(run, reference={}))
    assert not [name for name in without.statistics if name.startswith("temperature")]
