"""Which array a recording carries: stated by the board, at the host, answered, or open; and whether the samples fit."""

from __future__ import annotations

import threading
import time
import warnings
from dataclasses import replace
from typing import Self

import numpy as np
import pytest

from firmware_bridge import (
    FORMATS,
    ArrayName,
    Command,
    FrameType,
    SampleDecoder,
    TcpPort,
    encode_samples,
    parse_message,
)
from firmware_bridge import record as record_port
from firmware_bridge.host.mounting.on_board import candidate_arrays, mounting_words
from gfimu import AccelerometerArray, BoardSettings, InputError, RecordCallbacks, RecordingWarning, record
from gfimu.recording import Recording
from sim.scenarios import Scenario
from sim.simulation import simulate
from tests.firmware_bridge.made_frames import encode_message

IDENTITY = bytes.fromhex("01 010300 6400 0a 0b 00c20100 0f 01 01 04 efbeadde 8813 0000")
SECONDS = 20.0  # of the paper's run: a rest and two speeds


class SmallBoard:
    """Sends what a simulated array reads, and answers the question for its identity."""

    def __init__(self, real: str, states: str = "") -> None:
        run = simulate(replace(Scenario.load("paper_run"), array=AccelerometerArray.load(real)), seed=71)
        lsb = 0.038245935
        rows = run.t_s < SECONDS
        counts = np.round(run.readings[rows] / lsb).astype(int)
        self.frames = encode_samples(np.arange(len(counts)), np.round(run.t_s[rows] * 1e6), counts)
        self.answer = encode_message(FrameType.REPLY, 0, 5, bytes([Command.IDENTIFY, 0]))
        if states:
            self.answer += encode_message(FrameType.ARRAY, 1, 5, states.encode())
        self.answer += encode_message(FrameType.IDENTITY, 2, 5, IDENTITY)
        self.port = TcpPort(0)
        self.name = self.port.name
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def _run(self) -> None:
        asked = 0
        while not self._done.is_set():
            if self.port.read():
                asked += 1
                self.port.write(self.answer, 1.0)
                if asked == 2 or not self.frames:
                    self.port.write(self.frames, 5.0)
                    self.frames = b""
            time.sleep(0.01)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._done.set()
        self._thread.join()
        self.port.close()


def recorded(sender: SmallBoard, out, **options):
    """The report, the recording, and the warnings."""
    with sender, warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        report = record(sender.name, out, duration=SECONDS - 0.5, **options)
    texts = [str(one.message) for one in caught if issubclass(one.category, RecordingWarning)]
    return report, Recording.read(out), texts


def test_a_board_that_states_its_array_needs_no_word_from_the_host(tmp_path) -> None:
    report, run, texts = recorded(SmallBoard("cube12_as_built", "cube12_as_built"), tmp_path / "run.csv")
    assert (report.array, report.array_stated_by, report.board_array) == ("cube12_as_built", "board", "cube12_as_built")
    assert run.array is not None
    assert run.array.name == "cube12_as_built"
    assert texts == []


def test_an_open_array_is_one_warning_that_names_both_and_what_the_samples_show(tmp_path) -> None:
    report, run, texts = recorded(SmallBoard("cube12_as_built"), tmp_path / "run.csv")
    assert (report.array, report.array_stated_by) == ("", "")
    assert run.array is None
    assert len(texts) == 1
    assert "cube12 (axes 1, 2, 3 along +x, +y, +z) or cube12_as_built (axes 1, 2, 3 along +y, +x, -z)?" in texts[0]
    assert "the samples fit cube12_as_built alone" in texts[0]
    assert "--array NAME" in texts[0]


@pytest.mark.parametrize(("real", "wrong"), [("cube12_as_built", "cube12"), ("cube12", "cube12_as_built")])
def test_a_wrong_array_is_flagged_when_the_recording_ends(tmp_path, real: str, wrong: str) -> None:
    report, _, texts = recorded(SmallBoard(real, real), tmp_path / "run.csv", board=BoardSettings(array=wrong))
    assert (report.array, report.board_array) == (wrong, real)
    assert len(texts) == 2
    assert f"the board states array {real!r}, and {wrong!r} was given" in texts[0]
    assert f"give it with --array {real}" in texts[1]


def test_the_answer_of_a_person_is_taken(tmp_path) -> None:
    asked = []

    def choose(candidates) -> str:
        asked.extend(array.name for array in candidates)
        return "cube12_as_built"

    report, run, texts = recorded(
        SmallBoard("cube12_as_built"), tmp_path / "run.csv", callbacks=RecordCallbacks(choose_array=choose)
    )
    assert asked == ["cube12", "cube12_as_built"]
    assert report.array_stated_by == "answer"
    assert run.array is not None
    assert run.array.name == "cube12_as_built"
    assert texts == []


def test_an_array_that_this_computer_does_not_have_is_refused_before_anything_is_written(tmp_path) -> None:
    with SmallBoard("cube12", "lab7") as board, pytest.raises(InputError, match=r"states array 'lab7'.*--array"):
        record_port(board.name, tmp_path / "run.csv", duration_s=1.0)
    assert not list(tmp_path.iterdir())


def test_a_picture_needs_the_array(tmp_path) -> None:
    with SmallBoard("cube12") as board, pytest.raises(InputError, match="--rrd draw the array"):
        record(board.name, tmp_path / "run.csv", rrd=tmp_path / "live.rrd")
    assert not list(tmp_path.iterdir())


def test_the_temperature_of_a_board_is_in_the_recording(tmp_path) -> None:
    board = SmallBoard("cube12", "cube12")
    count = len(board.frames) // 40
    warm = np.round(2500 + 300 * np.arange(count) / count).astype(int)
    warm[5] = -(1 << 15)
    samples = SampleDecoder().feed(board.frames)
    board.frames = encode_samples(samples.sequence, samples.ticks, samples.counts, temperature=warm)
    for name in ("run.csv", "run.parquet"):
        fresh = SmallBoard("cube12", "cube12")
        fresh.frames = board.frames
        report, run, _ = recorded(fresh, tmp_path / name)
        assert report.temperature_degC == pytest.approx((25.0, 28.0), abs=0.1)
        np.testing.assert_allclose(run.reference["temperature_degC"][6:], warm[6 : len(run)] / 100, atol=1e-9)
        assert np.isnan(run.reference["temperature_degC"][5])


def test_names_that_are_no_names_are_no_messages() -> None:
    def parsed(payload: bytes):
        decoder = SampleDecoder()
        decoder.feed(encode_message(FrameType.ARRAY, 0, 0, payload))
        return parse_message(decoder.messages[0])

    assert parsed(b"cube12_as_built") == ArrayName("cube12_as_built")
    assert parsed(b"x" * 24) == ArrayName("x" * 24)
    assert parsed(b"") is None
    assert parsed(b"a\0b") is None
    assert parsed(b"\xff\xfe") is None


def test_the_candidates_are_the_mountings_of_the_same_chips() -> None:
    found = candidate_arrays(FORMATS["lpc1768"])
    assert [array.name for array in found] == ["cube12", "cube12_as_built"]
    assert mounting_words(AccelerometerArray.load("corners8")).startswith("axes 1, 2, 3 along")
    assert (
        mounting_words(AccelerometerArray.load("p1_face_diagonals"))
        == AccelerometerArray.load("p1_face_diagonals").description
    )
