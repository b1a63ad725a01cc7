"""A frame format is one object: recorded here without the package having a word of it."""

from __future__ import annotations

import socket
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from firmware_bridge import FORMATS, Identity, Reply, Result, SampleDecoder, frame_format, record, set_rate
from firmware_bridge.frames.commands import Dialogue
from firmware_bridge.frames.decoder import FrameFormat
from firmware_bridge.frames.packets import PacketLayout
from gfimu import InputError
from gfimu.recording import Recording

MISSING = -(1 << 31)
PACKET = np.dtype(
    [("mark", "u1"), ("kind", "u1"), ("number", "u1"), ("when", ">u8"), ("raw", ">i4", 13), ("parity", "u1")]
)


def parity(rows):
    return np.bitwise_xor.reduce(rows, axis=1)


def answer(packet):
    """Read an answer: the first words are the code of the command, its result, and the rate."""
    code, result, rate = packet["raw"][:3].tolist()
    if packet["kind"] == 7:
        return Reply(code, Result(result))
    return Identity("9.9.9", 0, rate, 0, 8 + 3, 115_200, (True,) * 4, "power-on", streaming=False, spi_khz=0, dropped=0)


MUTE = FrameFormat(
    "own",
    PacketLayout(PACKET, ((0, 0x5C),), parity),
    clock_field="when",
    clock_hz=10_000.0,
    array="cube12",
    channels=tuple(range(1, 13)),
    sequence_field="number",
    counts_field="raw",
    sample_type=("kind", 3),
    no_reading=MISSING,
)
TALKING = replace(MUTE, dialogue=Dialogue(identify=b"who?", identify_code=42, start=b"go!", parse=answer))


def packets(numbers, counts, *, kind=3, when=None):
    """Encode packets; one every 20 ticks (2 ms) from a clock beyond 32 bits."""
    frames = np.zeros(len(numbers), PACKET)
    frames["mark"], frames["kind"] = 0x5C, kind
    frames["number"] = np.asarray(numbers) & 0xFF
    frames["when"] = (1 << 33) + 20 * np.asarray(numbers) if when is None else when
    frames["raw"] = counts
    rows = frames.view(np.uint8).reshape(len(frames), PACKET.itemsize)
    frames["parity"] = parity(rows[:, :-1])
    return frames.tobytes()


def counts_of(numbers):
    return 13 * np.asarray(numbers)[:, None] % 4000 + np.arange(13)


class Board:
    """A TCP port with a board behind it, and what the board was sent."""

    def __init__(self, behaviour) -> None:
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.name = f"socket://127.0.0.1:{self.listener.getsockname()[1]}"
        self.received = b""
        self.thread = threading.Thread(target=self._run, args=(behaviour,))
        self.thread.start()

    def _run(self, behaviour) -> None:
        line, _ = self.listener.accept()
        time.sleep(0.2)  # pyserial empties its input when it opens a port
        behaviour(self, line)
        line.settimeout(0.5)
        try:
            while part := line.recv(100):
                self.received += part
        except OSError:
            pass
        line.close()

    def close(self) -> None:
        self.thread.join()
        self.listener.close()


def test_a_format_made_here_is_recorded(tmp_path, monkeypatch):
    """Another checksum, byte order, clock, width of the sequence number and of the counts; no commands."""
    monkeypatch.setattr("firmware_bridge.host.record_session._IDENTIFY_EVERY_S", 0.05)
    numbers = np.delete(np.arange(800), np.arange(300, 310))  # ten are lost, across no wrap
    counts = counts_of(numbers)
    counts[5, 4] = MISSING
    stream = b"noise" + packets(numbers, counts)

    def send(board, line):
        for start in range(0, len(stream), 5000):
            line.sendall(stream[start : start + 5000])
            time.sleep(0.03)

    board = Board(send)
    report = record(board.name, tmp_path / "run.csv", form=MUTE, duration_s=1.597)
    board.close()
    assert (report.stream.samples, report.stream.lost, report.stream.skipped_bytes) == (790, 10, 5)
    recording = Recording.read(tmp_path / "run.csv", unit="lsb")
    assert recording.metadata["format"] == "own"
    np.testing.assert_allclose(np.diff(recording.t_s)[:100], 0.002, rtol=1e-6)
    expected = counts[:, 1:].astype(float)
    expected[5, 3] = np.nan
    np.testing.assert_array_equal(recording.readings, expected)
    assert board.received == b""


def test_a_board_without_commands_is_sent_none(tmp_path, monkeypatch):
    """The shipped format that only sends was asked for its identity every second."""
    monkeypatch.setattr("firmware_bridge.host.record_session._IDENTIFY_EVERY_S", 0.05)
    monkeypatch.setattr("firmware_bridge.host.recorder._SILENCE_S", 0.5)
    board = Board(lambda board, line: time.sleep(0.1))
    with pytest.raises(InputError, match="no mimu4444 frame came"):
        record(board.name, tmp_path / "run.csv", form="mimu4444")
    board.close()
    assert board.received == b""
    with pytest.raises(InputError, match="format mimu4444 has no commands: rate and range can't be set"):
        record(board.name, tmp_path / "run.csv", form="mimu4444", setup=(set_rate(100),))


def test_a_dialogue_made_here_is_held(tmp_path):
    """The recorder asks, hears the answer, starts the stream, and takes scale and rate from the identity."""
    numbers = np.arange(400)

    def talk(board, line):
        board.received += line.recv(4)
        line.sendall(packets([0], [[42, 0] + 11 * [0]], kind=7))
        line.sendall(packets([0], [[0, 0, 500] + 10 * [0]], kind=8))
        while not board.received.endswith(b"go!"):
            board.received += line.recv(10)
        line.sendall(packets(numbers, counts_of(numbers)))

    board = Board(talk)
    report = record(board.name, tmp_path / "run.csv", form=TALKING, duration_s=0.7)
    board.close()
    assert board.received.startswith(b"who?go!")
    assert report.identity is not None
    assert report.identity.firmware == "9.9.9"
    metadata = Recording.read(tmp_path / "run.csv").metadata
    assert (metadata["sample_rate_hz"], metadata["range_g"]) == (500, 16)


def test_a_gap_longer_than_the_sequence_number_counts():
    """With one byte, 300 lost samples look like 44; the clock shows the rest."""
    decoder = SampleDecoder(MUTE)
    numbers = np.concatenate([np.arange(100), np.arange(400, 500)])
    samples = decoder.feed(packets(numbers, 100_000 + counts_of(numbers)))
    assert samples.lost_before[100] == 300
    np.testing.assert_array_equal(samples.counts, 100_000 + counts_of(numbers)[:, 1:])  # wider than 16 bits
    assert decoder.counts.lost == 300


def test_a_format_is_looked_up_by_name_or_passed_through():
    assert frame_format(MUTE) is MUTE
    assert all(frame_format(name) is known for name, known in FORMATS.items())
    assert all(name == known.name for name, known in FORMATS.items())
