"""Datagrams with frames or lines of text over loopback."""

from __future__ import annotations

import socket
import threading
import time

import numpy as np
import pytest

from firmware_bridge import UdpSource, encode_samples, find_boards, frame_format, record
from gfimu import InputError
from gfimu.recording import Recording


@pytest.fixture
def number() -> int:
    """A port that is free."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def frames(first: int, count: int) -> bytes:
    place = np.arange(first, first + count)
    return encode_samples(place, 1250 * place, (place[:, None] * 13 + np.arange(12)) % 4000)


class Sender:
    """Sends datagrams again and again until the test is over, first in order, then from the start again."""

    def __init__(self, number: int, datagrams, pause_s: float = 0.002) -> None:
        self.done = threading.Event()
        self.thread = threading.Thread(target=self._send, args=(number, datagrams, pause_s), daemon=True)

    def _send(self, number, datagrams, pause_s) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            for data in datagrams:
                if self.done.wait(pause_s):
                    return
                out.sendto(data, ("127.0.0.1", number))

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.done.set()
        self.thread.join()


def test_frames_in_datagrams(number, tmp_path) -> None:
    out = tmp_path / "run.csv"
    with Sender(number, (frames(10 * k, 10) for k in range(10_000))):
        report = record(f"udp://127.0.0.1:{number}", out, duration_s=1.0)
    recording = Recording.read(out, unit="lsb")
    assert report.stream.lost == report.stream.corrupt == report.stream.skipped_bytes == 0
    assert recording.sample_rate == pytest.approx(800)
    place = np.round(recording.t_s / 1.25e-3).astype(int)
    assert np.array_equal(recording.readings, (place[:, None] * 13 + np.arange(12)) % 4000)
    assert recording.metadata["datagrams_late"] == recording.metadata["datagrams_of_others"] == 0


@pytest.mark.parametrize("end", ["", "\n", "\r\n"])
def test_a_line_of_text_in_each_datagram(number, tmp_path, end) -> None:
    out = tmp_path / "run.csv"
    lines = (",".join(map(str, [10_000 * k, *range(12)])) + end for k in range(100_000))
    with Sender(number, (line.encode() for line in lines)):
        report = record(f"udp://:{number}", out, duration_s=0.5, form="arduino_csv")
    recording = Recording.read(out, unit="lsb")
    assert report.stream.skipped_bytes == 0
    assert recording.sample_rate == pytest.approx(100)
    assert np.array_equal(recording.readings[0], np.arange(12))


def test_datagrams_that_come_late_twice_or_from_others_are_left_out(number) -> None:
    form = frame_format("lpc1768")
    source = UdpSource(f"udp://0.0.0.0:{number}", form)
    source.open()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.bind(("127.0.0.1", 0))
        for data in (frames(0, 10), frames(20, 10), frames(10, 10), frames(20, 10), frames(30, 10)):
            out.sendto(data, ("127.0.0.1", number))
        got = b"".join(source.read(1) for _ in range(5))
        assert got == frames(0, 10) + frames(20, 10) + frames(30, 10)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            other.bind(("127.0.0.2", 0))
            other.sendto(frames(40, 10), ("127.0.0.1", number))
            assert source.read(1) == b""
        source.write(b"command")
        assert out.recv(100) == b"command"
        late, fresh = frames(5000, 1), frames(0, 3)  # a board that started anew
        out.sendto(late, ("127.0.0.1", number))
        out.sendto(fresh, ("127.0.0.1", number))
        assert source.read(1) + source.read(1) == late + fresh
    source.close()
    assert source.facts() == {"datagrams_late": 2, "datagrams_of_others": 1}


def test_nothing_comes(number, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("firmware_bridge.host.recorder._SILENCE_S", 0.3)
    with pytest.raises(InputError, match=rf"nothing came; .* give udp://0.0.0.0:{number}"):
        record(f"udp://:{number}", tmp_path / "run.csv", form="arduino_csv")
    assert not list(tmp_path.iterdir())


def test_datagrams_that_are_no_frames(number, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("firmware_bridge.host.recorder._SILENCE_S", 0.3)
    with (
        Sender(number, (b"hello" for _ in range(1000))),
        pytest.raises(InputError, match=r"no arduino_csv frame came.* bytes were no frames"),
    ):
        record(f"udp://127.0.0.1:{number}", tmp_path / "run.csv", form="arduino_csv")


def test_a_port_that_is_taken(number, tmp_path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", number))
        with pytest.raises(InputError, match="in use"):
            record(f"udp://127.0.0.1:{number}", tmp_path / "run.csv")


@pytest.mark.parametrize("port", ["udp://", "udp://1.2.3.4", "udp://x:99999", "udp://:5005/path", "udp://:5005?a=1"])
def test_a_url_of_another_form(port, tmp_path) -> None:
    with pytest.raises(InputError, match="give udp://ADDRESS:PORT"):
        record(port, tmp_path / "run.csv")


def test_a_board_behind_udp_is_found(number) -> None:
    began = time.monotonic()
    with Sender(number, (frames(10 * k, 10) for k in range(10_000))):
        (found,) = find_boards([f"udp://:{number}"])
    assert (found.form, found.identity) == ("lpc1768", None)
    assert time.monotonic() - began < 5.0
