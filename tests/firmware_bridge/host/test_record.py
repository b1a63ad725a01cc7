"""From a port to a file: pseudo-terminal and TCP, unplugging, restarts, killing, what the file says."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress

import numpy as np
import pytest

from firmware_bridge import (
    Command,
    Link,
    SampleClock,
    encode_command,
    encode_samples,
    open_port,
    record,
    serve,
    set_range,
    set_rate,
)
from gfimu import AccelerometerArray, GfimuError, InputError
from gfimu.recording import Recording

needs_board = pytest.mark.skipif(
    not pytest.importorskip("importlib.util").find_spec("unicorn"), reason="the emulator is in the extra 'firmware'"
)


@contextmanager
def served_board(port_name: str, **options):
    from firmware_bridge import BoardProcess

    port = open_port(port_name)
    done = threading.Event()
    with BoardProcess() as board:
        board.run_for(0.02)
        thread = threading.Thread(target=serve, args=(board, port), kwargs={"stop": done.is_set, **options})
        thread.start()
        try:
            yield port.name
        finally:
            done.set()
            thread.join()
            port.close()


def frames(first: int, count: int, *, period_us: int = 1250, start_us: int = 0) -> bytes:
    number = np.arange(first, first + count)
    counts = (number[:, None] * 13 + np.arange(12)) % 4000
    return encode_samples(number, start_us + number * period_us, counts)


class Server:
    """A TCP port that sends what it is told to."""

    def __init__(self) -> None:
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.number = self.listener.getsockname()[1]
        self.name = f"socket://127.0.0.1:{self.number}"
        self.host: socket.socket | None = None

    def accept(self) -> None:
        self.host, _ = self.listener.accept()
        time.sleep(0.2)  # pyserial empties its input when it opens a port

    def send(self, data: bytes) -> None:
        assert self.host is not None
        self.host.sendall(data)

    def hang_up(self) -> None:
        if self.host is not None:
            with suppress(OSError):
                self.host.shutdown(socket.SHUT_RDWR)
            self.host.close()

    def close(self) -> None:
        self.hang_up()
        self.listener.close()


@pytest.fixture
def server():
    opened = Server()
    yield opened
    opened.close()


@needs_board
@pytest.mark.parametrize(("port", "name"), [("pty", "run.parquet"), ("tcp:0", "run.csv")])
def test_virtual_board_to_file(tmp_path, port: str, name: str) -> None:
    if port == "pty" and sys.platform == "win32":
        pytest.skip("no pseudo-terminals on Windows")
    out = tmp_path / name
    with served_board(port, realtime=False) as device:
        report = record(device, out, duration_s=2.0, array="cube12", setup=(set_range(8), set_rate(800)))
    recording = Recording.read(out)
    assert report.stream.lost == report.stream.corrupt == 0
    assert report.identity is not None
    assert (report.identity.rate_hz, report.identity.range_g) == (800, 8)
    assert len(recording) >= 1600
    assert not len(recording.gaps)
    assert recording.sample_rate == pytest.approx(800)
    assert recording.metadata["sample_rate_hz"] == 800
    assert recording.metadata["array_toml"] == AccelerometerArray.load("cube12").to_toml()
    assert np.allclose(recording.readings[:, 2::3], 256 * recording.metadata["lsb_m_s2"])
    assert not recording.readings[:, 0].any()


@needs_board
def test_a_board_that_was_stopped_is_started(tmp_path) -> None:
    with served_board("tcp:0", realtime=False) as device:
        with Link(device) as link:
            link.write(set_range(4) + encode_command(Command.STOP))
            end = time.monotonic() + 10.0
            while link.read(0.5) is not None and time.monotonic() < end:
                pass
        report = record(device, tmp_path / "run.csv", duration_s=1.0)
    assert report.identity is not None
    assert report.identity.range_g == 4
    assert report.stream.samples >= 100


def test_unplugging_marks_the_gap_and_recording_goes_on(server: Server, tmp_path) -> None:
    out = tmp_path / "run.parquet"

    def play() -> None:
        server.accept()
        server.send(frames(0, 400) + frames(400, 1)[:17])
        time.sleep(0.3)
        server.hang_up()
        server.accept()
        server.send(frames(1000, 1)[22:] + frames(1001, 400))

    thread = threading.Thread(target=play)
    thread.start()
    report = record(server.name, out, duration_s=1401 * 1.25e-3 - 1e-3 - 1.25e-3)
    thread.join()
    recording = Recording.read(out)
    assert report.breaks == 1
    assert len(recording) == 800
    assert report.stream.lost == 601
    assert recording.gaps.tolist() == [399]
    assert recording.t_s[400] - recording.t_s[399] == pytest.approx(602 * 1.25e-3)
    assert recording.metadata["connection_breaks"] == 1


def test_a_link_that_stays_away_ends_the_recording_and_keeps_what_came(server: Server, tmp_path) -> None:
    out = tmp_path / "run.csv"

    def play() -> None:
        server.accept()
        server.send(frames(0, 100))
        time.sleep(0.2)
        server.close()

    thread = threading.Thread(target=play)
    thread.start()
    report = record(server.name, out, reconnect_s=0.5)
    thread.join()
    assert report.stream.samples == 100
    recording = Recording.read(out)
    assert len(recording) == 100
    assert "did not come back" in recording.metadata["ended_by"]


def test_restart_of_the_board_is_one_gap_in_a_time_that_never_goes_back() -> None:
    from firmware_bridge import SampleDecoder

    decoder, clock = SampleDecoder(), SampleClock(1e6)
    before = clock.place(decoder.feed(frames(40_000, 800)), 100.0)
    after = clock.place(decoder.feed(frames(0, 800)), 103.5)  # 3.5 s later the last of 800 new samples is there
    assert after[0] > before[-1]
    assert after[-1] - before[-1] == pytest.approx(3.5, abs=0.01)


def test_a_file_being_written_can_be_read_and_survives_kill(server: Server, tmp_path) -> None:
    out = tmp_path / "run.parquet"
    program = f"from firmware_bridge.host.recorder import record; record({server.name!r}, {str(out)!r})"
    process = subprocess.Popen([sys.executable, "-c", program])
    try:
        server.accept()
        sent = 0
        began = time.monotonic()
        while time.monotonic() - began < 3.0:
            server.send(frames(sent, 80))
            sent += 80
            time.sleep(0.1)
        recording = Recording.read(out)
        assert len(recording) > 0
        process.send_signal(signal.SIGKILL if hasattr(signal, "SIGKILL") else signal.SIGTERM)
        process.wait()
    finally:
        process.kill()
    recording = Recording.read(out)
    assert sent - len(recording) <= 800  # one second at 800 Hz
    number = np.arange(len(recording))
    assert np.array_equal(Recording.read(out, unit="lsb").readings, (number[:, None] * 13 + np.arange(12)) % 4000)


def test_bytes_that_are_no_frames_end_with_a_line_that_says_so(server: Server, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("firmware_bridge.host.recorder._SILENCE_S", 0.6)

    def play() -> None:
        server.accept()
        server.send(bytes(5000))

    thread = threading.Thread(target=play)
    thread.start()
    with pytest.raises(InputError, match="5000 bytes were no frames"):
        record(server.name, tmp_path / "run.csv")
    thread.join()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("port", ["/dev/does-not-exist", "socket://127.0.0.1:1", "nonsense://x"])
def test_a_port_that_cannot_be_opened(port: str, tmp_path) -> None:
    with pytest.raises(InputError, match="can't be opened"):
        record(port, tmp_path / "run.csv")
    assert not list(tmp_path.iterdir())


def test_bad_arguments(tmp_path) -> None:
    with pytest.raises(InputError, match=r"\.csv or \.parquet"):
        record("socket://127.0.0.1:1", tmp_path / "run.txt")
    with pytest.raises(InputError, match="lpc1768, mimu4444"):
        record("socket://127.0.0.1:1", tmp_path / "run.csv", form="mavlink")
    with pytest.raises(InputError, match="24 channels, lpc1768 12"):
        record("socket://127.0.0.1:1", tmp_path / "run.csv", array="mimu4444")
    with pytest.raises(InputError, match="pty, tcp:PORT"):
        open_port("com5")


def test_a_slow_caller_loses_nothing(server: Server) -> None:
    data = os.urandom(3_000_000)

    def play() -> None:
        server.accept()
        server.send(data)

    thread = threading.Thread(target=play)
    thread.start()
    got = bytearray()
    with Link(server.name) as link:
        time.sleep(0.5)
        while len(got) < len(data):
            chunk = link.read()
            assert chunk is not None
            got += chunk.data
            time.sleep(0.002)
    thread.join()
    assert got == data


def test_lost_link_raises_after_its_patience(server: Server) -> None:
    with Link(server.name, reconnect_s=0.3) as link:
        server.accept()
        server.close()
        reads = iter(link.read, b"never")
        with pytest.raises(GfimuError, match="did not come back"):
            list(reads)


@needs_board
@pytest.mark.study
def test_ten_minutes_at_3200_hz(tmp_path) -> None:
    import resource

    out = tmp_path / "soak.parquet"
    memory = []

    def watch(batch, counts) -> None:
        if counts.samples % 64_000 < len(batch.t_s):
            memory.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)

    with served_board("pty", realtime=True) as device:
        report = record(device, out, duration_s=600.0, setup=(set_rate(3200),), on_batch=watch)
    assert report.stream.lost == report.stream.corrupt == 0
    assert report.stream.samples >= 600 * 3200
    assert memory[-1] - memory[len(memory) // 4] < 20_000  # kB
