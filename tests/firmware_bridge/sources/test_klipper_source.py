"""ADXL345 of a printer through Klipper's API server: one chip, two with paces of their own, trouble of every kind."""

from __future__ import annotations

import socket
import time

import numpy as np
import pytest

from firmware_bridge import record
from firmware_bridge.sources import klipper
from gfimu import InputError
from gfimu.recording import Recording
from tests.firmware_bridge.sources.fake_klippy import FakeKlippy, motion

pytestmark = pytest.mark.skipif(not hasattr(socket, "AF_UNIX"), reason="no unix domain sockets")

ONE = {"hotend": 3212.5}
TWO = {"hotend": 3212.5, "bed": 3177.0}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "klippy_uds"


def test_one_chip_in_si_units_with_its_own_times(path, tmp_path) -> None:
    out = tmp_path / "run.parquet"
    with FakeKlippy(path, ONE) as klippy:
        report = record(f"klipper://{path}", out, duration_s=1.5)
    recording = Recording.read(out)
    assert report.stream.corrupt == report.stream.skipped_bytes == report.breaks == 0
    assert klippy.requests[-1]["params"] == {"sensor": "hotend", "response_template": {"chip": "hotend"}}
    assert recording.sample_rate == pytest.approx(3212.5, rel=1e-3)
    assert not len(recording.gaps)
    assert np.allclose(
        recording.readings, motion(recording.t_s - 100.0), atol=2e-3
    )  # stamps of 1 µs, counts of 0.1 mm/s²
    assert recording.array is not None
    assert recording.array.name == "one_adxl345"
    assert recording.metadata["klipper_chips"] == ["hotend"]
    assert recording.metadata["klipper_overflows"]["hotend"] >= 1
    assert recording.metadata["klipper_errors"] == {"hotend": 0}


def test_two_chips_come_to_the_times_of_the_first_and_their_paces_are_stated(path, tmp_path) -> None:
    out = tmp_path / "run.parquet"
    with FakeKlippy(path, TWO):
        record(f"klipper://{path}?chip=hotend,bed", out, duration_s=1.5, array="toolhead_pair")
    recording = Recording.read(out)
    assert np.isfinite(recording.readings).all()
    assert recording.sample_rate == pytest.approx(3212.5, rel=1e-3)
    both = motion(recording.t_s - 100.0)
    assert np.allclose(recording.readings[:, :3], both, atol=2e-3)
    assert np.allclose(recording.readings[:, 3:], both, atol=2e-3)
    facts = recording.metadata
    assert facts["chip_times_of"] == "hotend"
    assert facts["chip_rates_hz"]["bed"] == pytest.approx(3177.0, rel=2e-5)
    assert facts["chip_rate_ratios"]["bed"] == pytest.approx(3177.0 / 3212.5, rel=2e-5)
    assert 0.8 < facts["interpolation_noise_factor"] < 0.95
    assert 0.1 < facts["interpolation_error_1_percent_hz"]["bed"] / 3177.0 < 0.5


@pytest.mark.parametrize(
    ("rates", "query", "array", "words"),
    [
        (TWO, "?chip=nozzle", "", r"no ADXL345 'nozzle'; it has hotend, bed"),
        (TWO, "", "", r"2 ADXL345 \(hotend, bed\); name them with \?chip="),
        ({}, "", "", r"0 ADXL345; put a section \[adxl345\]"),
        (ONE, "?chip=hotend,bed", "", "say with --array where the 2 chips are"),
        (ONE, "?chip=hotend", "toolhead_pair", "has 2 chips with 6 axes; this source has 1"),
        (ONE, "?chip=hotend,hotend", "toolhead_pair", "named twice"),
        (ONE, "?sensor=hotend", "", r"give klipper:///PATH/OF/SOCKET\?chip="),
    ],
)
def test_what_klipper_does_not_have_is_one_line_that_says_what_there_is(
    path, tmp_path, rates, query, array, words
) -> None:
    with FakeKlippy(path, rates), pytest.raises(InputError, match=words) as caught:
        record(f"klipper://{path}{query}", tmp_path / "run.csv", array=array)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "run.csv").exists()


def test_an_endpoint_that_klipper_does_not_know(path, tmp_path, monkeypatch) -> None:
    with FakeKlippy(path, ONE) as klippy:
        klippy.sections = []  # a printer whose configuration says nothing
        with pytest.raises(InputError, match="Klipper refuses adxl345/dump_adxl345 of chip 'x': The value 'x' is not"):
            record(f"klipper://{path}?chip=x", tmp_path / "run.csv")


def test_a_printer_that_is_not_ready(path, tmp_path) -> None:
    with FakeKlippy(path, ONE, state="startup"), pytest.raises(InputError, match=r"not ready: Printer is startup\)"):
        record(f"klipper://{path}", tmp_path / "run.csv")


def test_no_socket(tmp_path) -> None:
    with pytest.raises(InputError, match=r"can't be opened.*start Klipper with -a"):
        record(f"klipper://{tmp_path}/nothing", tmp_path / "run.csv")


def test_something_else_behind_the_socket(path, tmp_path) -> None:
    with FakeKlippy(path, ONE) as klippy:
        klippy._answer = lambda connection, *_: connection.sendall(b"220 mail server\r\n\x03")
        with pytest.raises(InputError, match="is not Klipper's API server"):
            record(f"klipper://{path}", tmp_path / "run.csv")
    assert not (tmp_path / "run.csv").exists()


@pytest.mark.parametrize(
    "garbage",
    [b"{nonsense\x03", b'{"chip": "hotend", "params": {"data": [[1, 2]]}}\x03',
     b'{"chip": "hotend", "params": {"data": [[NaN, 1, 1, 1]]}}\x03', b"[1]\x03"],
)  # fmt: skip
def test_garbage_in_the_middle_ends_the_recording_and_keeps_what_came(path, tmp_path, garbage) -> None:
    out = tmp_path / "run.csv"
    with FakeKlippy(path, ONE, batches=5) as klippy:
        klippy.garbage = garbage
        record(f"klipper://{path}", out)
    recording = Recording.read(out)
    assert len(recording) == pytest.approx(0.5 * 3212.5, abs=2)
    assert "Klipper" in recording.metadata["ended_by"] or "no list of time" in recording.metadata["ended_by"]


def test_a_lost_connection_comes_back_with_the_printers_clock_running_on(path, tmp_path) -> None:
    out = tmp_path / "run.parquet"
    with FakeKlippy(path, ONE, batches=5, starts=(100.0, 100.7), hold_open=False):
        report = record(f"klipper://{path}", out, duration_s=1.1)
    recording = Recording.read(out)
    assert (report.breaks, report.stream.restarts) == (1, 0)
    assert recording.gaps.tolist() == [pytest.approx(0.5 * 3212.5, abs=2)]
    assert np.diff(recording.t_s).max() == pytest.approx(0.2, abs=1e-3)


def test_a_printer_that_was_started_anew_is_a_new_segment(path, tmp_path) -> None:
    """Its print time is ahead by far more than the time that passed."""
    out = tmp_path / "run.parquet"
    with FakeKlippy(path, ONE, batches=5, starts=(100.0, 150.0), hold_open=False):
        report = record(f"klipper://{path}", out, duration_s=0.8)
    recording = Recording.read(out)
    assert (report.breaks, report.stream.restarts) == (1, 1)
    assert np.diff(recording.t_s).max() < 5.0


def test_a_chip_that_sends_nothing_is_named(path, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("firmware_bridge.host.recorder._SILENCE_S", 0.5)
    with FakeKlippy(path, TWO) as klippy:
        klippy.silent = {"bed"}
        with pytest.raises(InputError, match="nothing came; chip 'bed' sends nothing"):
            record(f"klipper://{path}?chip=hotend,bed", tmp_path / "run.csv", array="toolhead_pair")
    assert not (tmp_path / "run.csv").exists()


def test_a_chip_that_dies_is_missing_and_the_other_goes_on(path, tmp_path, monkeypatch) -> None:
    """It is subscribed to once more, and then no longer waited for."""
    monkeypatch.setattr(klipper, "_SILENT_S", 0.3)
    out = tmp_path / "run.parquet"
    klippy = FakeKlippy(path, TWO, batches=40, starts=(100.0, 102.6))
    whole = klippy._batch

    def batch(name, start, number):
        time.sleep(0.02)
        if start == 102.6 or number == 9:
            klippy.silent = {"bed"}
        return whole(name, start, number)

    klippy._batch = batch
    with klippy:
        report = record(f"klipper://{path}?chip=hotend,bed", out, duration_s=2.2, array="toolhead_pair")
    recording = Recording.read(out)
    assert report.breaks == 1
    assert np.isfinite(recording.readings[:, :3]).all()
    late = recording.t_s > 101.1
    assert np.isfinite(recording.readings[~late & (recording.t_s < 100.85)]).all()
    assert np.isnan(recording.readings[late, 3:]).all()
    assert recording.t_s[-1] > 102.1


def test_a_subscription_that_klipper_gave_up_is_made_again(path, tmp_path, monkeypatch) -> None:
    """Klipper says nothing when reading a chip fails: the batches just end."""
    monkeypatch.setattr(klipper, "_SILENT_S", 0.3)
    out = tmp_path / "run.csv"
    with FakeKlippy(path, ONE, batches=5, starts=(100.0, 101.0)):
        report = record(f"klipper://{path}", out, duration_s=1.3)
    assert report.breaks == 1
    assert "ended_by" not in Recording.read(out).metadata
