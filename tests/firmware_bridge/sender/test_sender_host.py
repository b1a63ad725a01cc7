"""The sender as a program behind a pseudo-terminal, and `gfimu record` at the other end."""

from __future__ import annotations

import re
import subprocess
import sys
from contextlib import contextmanager

import numpy as np
import pytest

import gfimu
from gfimu import InputError
from tests.firmware_bridge.sender.conftest import CORE, STRICT

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals on Windows")

COUNT_M_S2 = 0.038245935  # 3.9 mg


@pytest.fixture(scope="module")
def program(compile_sender):
    return compile_sender(*STRICT, "ports/host.c", *CORE)


@contextmanager
def running(program, *words: str):
    """Run the sender; yield the port that it prints."""
    with subprocess.Popen([str(program), *words], stdout=subprocess.PIPE, text=True) as sender:
        try:
            yield sender.stdout.readline().strip()
        finally:
            sender.kill()


def at_rest(chips: int) -> np.ndarray:
    """Mean readings of the simulated chips, counts: every channel has another bias."""
    return np.tile([0.0, 0.0, 256.0], chips) + 2.0 * np.arange(3 * chips) + 1.5


def test_a_recording_is_made_with_rate_range_speed_and_self_test(program, tmp_path) -> None:
    axes = []
    with running(program) as port:
        report = gfimu.record(
            port,
            tmp_path / "run.csv",
            self_test=True,
            duration=1.0,
            board=gfimu.BoardSettings(rate=400, range_g=8),
            callbacks=gfimu.RecordCallbacks(on_self_test=axes.extend),
        )
    assert [axis.verdict for axis in axes] == ["passed"] * 12
    assert report.identity is not None
    assert (report.identity.rate_hz, report.identity.range_g, report.identity.present) == (400, 8, (True,) * 4)
    assert report.baud >= 400 * 40 * 10
    assert report.stream.corrupt == 0
    recording = gfimu.Recording.read(tmp_path / "run.csv")
    assert recording.readings.mean(axis=0) / COUNT_M_S2 == pytest.approx(at_rest(4), abs=0.6)


def test_one_chip(compile_sender, tmp_path) -> None:
    one = compile_sender(*STRICT, "-DGFIMU_CHIPS=1", "ports/host.c", *CORE)
    with running(one) as port:
        report = gfimu.record(port, tmp_path / "run.csv", duration=0.5, board=gfimu.BoardSettings(array="one_adxl345"))
    recording = gfimu.Recording.read(tmp_path / "run.csv")
    assert recording.channels == ("a11", "a12", "a13")
    assert recording.readings.mean(axis=0) / COUNT_M_S2 == pytest.approx(at_rest(1), abs=0.6)
    assert not [name for name in report.status_counts if name.endswith("missing")]
    assert report.identity is not None
    assert (report.identity.present, report.identity.faulty) == ((True, False, False, False), (False,) * 4)


def test_a_sender_states_its_array_and_its_temperature(compile_sender, tmp_path) -> None:
    named = compile_sender(*STRICT, '-DGFIMU_ARRAY="cube12_as_built"', "-DGFIMU_TEMPERATURE", "ports/host.c", *CORE)
    with running(named) as port:
        report = gfimu.record(port, tmp_path / "run.parquet", duration=1.0)
    assert (report.array, report.array_stated_by) == ("cube12_as_built", "board")
    recording = gfimu.Recording.read(tmp_path / "run.parquet")
    assert recording.array is not None
    assert recording.array.name == "cube12_as_built"
    warm = recording.reference["temperature_degC"]
    assert 25.0 <= warm[0] <= 26.0
    assert warm[-1] - warm[0] == pytest.approx(0.1, abs=0.021)  # 0.01 °C per 100 ms


def test_two_of_four_chips_that_answer(program, tmp_path) -> None:
    with running(program, "--chips", "2") as port:
        report = gfimu.record(port, tmp_path / "all.csv", duration=0.5)
        gfimu.record(port, tmp_path / "two.csv", duration=0.5, board=gfimu.BoardSettings(array="toolhead_pair"))
        with pytest.raises(InputError, match="array 'one_adxl345' has 1 chip, but 2 answer"):
            gfimu.record(port, tmp_path / "one.csv", duration=0.5, board=gfimu.BoardSettings(array="one_adxl345"))
        for other in ("corners8", "nap_3_2_2_2"):  # the second has three times three channels, on four chips
            with pytest.raises(InputError, match=f"'{other}' has .* channels, lpc1768 12, or 3 for each chip"):
                gfimu.record(port, tmp_path / "other.csv", duration=0.5, board=gfimu.BoardSettings(array=other))
    assert report.status_counts["sensor_3_missing"] == report.stream.samples
    assert np.isnan(gfimu.Recording.read(tmp_path / "all.csv").readings[:, 6:]).all()
    two = gfimu.Recording.read(tmp_path / "two.csv")
    assert two.readings.mean(axis=0) / COUNT_M_S2 == pytest.approx(at_rest(2), abs=0.6)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["all.csv", "two.csv"]


def test_it_measures_itself(program) -> None:
    text = subprocess.run([str(program), "--measure", "5000"], capture_output=True, text=True, check=True).stdout
    sent, rate = re.fullmatch(r"(\d+) bytes in [\d.]+ s: (\d+) samples per second\n", text).groups()
    assert int(sent) == 40 * 5001  # an identity, too
    assert int(rate) > 3200
