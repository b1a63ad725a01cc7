"""Ports that are taken or not there yet, disks that are full, files that can't be written."""

from __future__ import annotations

import errno
import os
import socket
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from firmware_bridge import ClockFit, Journal, JournalError, Link, PseudoTerminal, encode_samples, record
from firmware_bridge.host import journal
from gfimu import GfimuError, InputError
from gfimu.recording import Recording

posix = pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals and limits on Windows")
CHANNELS = tuple(f"a{chip}{axis}" for chip in range(1, 5) for axis in range(1, 4))


def frames(first: int, count: int) -> bytes:
    number = np.arange(first, first + count)
    return encode_samples(number, number * 1250, (number[:, None] * 13 + np.arange(12)) % 4000)


def is_whole(recording: Recording) -> bool:
    """Whether the rows are frames one after another, from whichever was the first."""
    number = np.arange(len(recording))
    expected = (recording.readings[0, 0] + number[:, None] * 13 + np.arange(12)) % 4000
    return np.array_equal(recording.readings, expected)


class Feed:
    """Frames behind a pseudo-terminal or a TCP port, as long as it is open."""

    def __init__(self, port) -> None:
        self.port = port
        self.done = threading.Event()
        self.thread = threading.Thread(target=self._play)
        self.thread.start()

    def _play(self) -> None:
        sent = 0
        while not self.done.is_set():
            self.port.read()
            self.port.write(frames(sent, 80), 1.0)
            sent += 80
            time.sleep(0.02)

    def close(self) -> None:
        self.done.set()
        self.thread.join()
        self.port.close()


@pytest.fixture
def feed():
    from firmware_bridge import TcpPort

    opened = Feed(TcpPort(0))
    yield opened
    opened.close()


@posix
def test_a_port_that_is_recorded_from_is_in_use(tmp_path) -> None:
    port = PseudoTerminal()
    try:
        with Link(port.name) as first:
            began = time.monotonic()
            for patience in (None, 5.0):  # waiting is for ports that are not there, not for taken ones
                with pytest.raises(InputError, match=r"in use by another program; end that one") as caught:
                    record(port.name, tmp_path / "second.csv", reconnect_s=patience)
                assert "\n" not in str(caught.value)
            assert time.monotonic() - began < 2.0
            port.write(b"for the first alone", 1.0)
            got = b""
            while len(got) < 19:
                chunk = first.read()
                assert chunk is not None
                got += chunk.data
        assert got == b"for the first alone"
        Link(port.name).close()  # free again
    finally:
        port.close()
    assert not list(tmp_path.iterdir())


@posix
def test_a_wait_for_a_device_that_is_plugged_in_later(tmp_path) -> None:
    device, out = tmp_path / "ttyUSB0", tmp_path / "run.csv"
    opened = Feed(PseudoTerminal())
    timer = threading.Timer(0.5, lambda: device.symlink_to(opened.port.name))
    timer.start()
    try:
        report = record(str(device), out, duration_s=0.5, reconnect_s=10.0)
    finally:
        timer.join()
        opened.close()
    assert report.stream.samples > 0
    assert report.breaks == 0


def test_a_wait_for_a_server_that_is_started_later() -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        number = probe.getsockname()[1]
    servers = []
    timer = threading.Timer(0.4, lambda: servers.append(socket.create_server(("127.0.0.1", number))))
    timer.start()
    with Link(f"socket://127.0.0.1:{number}", reconnect_s=10.0):
        pass
    timer.join()
    servers[0].close()


@pytest.mark.parametrize("patience", [None, 0.0, 0.4])
def test_the_wait_ends(patience, tmp_path) -> None:
    began = time.monotonic()
    with pytest.raises(InputError, match="can't be opened"):
        record(str(tmp_path / "nothing"), tmp_path / "run.csv", reconnect_s=patience)
    assert (patience or 0.0) <= time.monotonic() - began < 3.0


@pytest.mark.parametrize("place", ["folder.csv", "file/run.csv", "run.txt"])
def test_a_file_that_cannot_be_written_is_found_before_the_port_is_opened(place, tmp_path, monkeypatch) -> None:
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "file").touch()
    monkeypatch.setattr("firmware_bridge.host.recorder.Link", lambda *_, **__: pytest.fail("the port was opened"))
    with pytest.raises(InputError, match=r"is a folder|is a file|\.csv or \.parquet"):
        record("/dev/does-not-exist", tmp_path / place)


class FullDisk:
    """A disk that takes so many more bytes of one file, the last of them in a short write."""

    def __init__(self, file, room: int) -> None:
        self.file, self.room, self.write = file, room, os.write

    def __call__(self, number: int, data: bytes) -> int:
        if not (self.file.exists() and os.path.samestat(os.fstat(number), self.file.stat())):
            return self.write(number, data)
        if not self.room:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        taken = self.write(number, data[: self.room])
        self.room -= taken
        return taken


@pytest.mark.parametrize("name", ["run.csv", "run.parquet"])
def test_a_full_disk_ends_the_recording_and_keeps_what_was_written(feed, tmp_path, monkeypatch, name: str) -> None:
    out = tmp_path / name
    monkeypatch.setattr(journal.os, "write", FullDisk(out, 50_001))

    def no_room(*_) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Journal, "_finish_csv", no_room)
    monkeypatch.setattr(Journal, "_finish_parquet", no_room)
    with pytest.raises(
        JournalError, match=r"No space left on device; \d+ samples are in the file and can be read"
    ) as caught:
        record(feed.port.name, out)
    assert "\n" not in str(caught.value)
    recording = Recording.read(out, unit="lsb")
    assert len(recording) == int(str(caught.value).split("; ")[1].split()[0]) > 500
    assert is_whole(recording)
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_room_for_the_final_file_but_not_for_more_lines(feed, tmp_path, monkeypatch) -> None:
    out = tmp_path / "run.parquet"
    monkeypatch.setattr(journal.os, "write", FullDisk(out, 50_001))
    with pytest.raises(JournalError):
        record(feed.port.name, out)
    recording = Recording.read(out, unit="lsb")
    assert out.read_bytes()[:4] == b"PAR1"
    assert is_whole(recording)
    assert "No space left" in recording.metadata["ended_by"]


def test_no_room_for_the_header_leaves_nothing(tmp_path, monkeypatch) -> None:
    out = tmp_path / "run.csv"
    monkeypatch.setattr(journal.os, "write", FullDisk(out, 20))
    with pytest.raises(JournalError, match="no sample was written"):
        Journal(out, CHANNELS, {"array": "cube12"})
    assert not out.exists()


def test_a_line_longer_than_a_page_is_written(tmp_path) -> None:
    out = tmp_path / "run.csv"
    written = Journal(out, CHANNELS, {"remark": "x" * 10_000})
    written.append(np.array([0.0]), np.zeros((1, 12)), np.zeros(1, dtype=np.uint16))
    written.finish({})
    assert Recording.read(out).metadata["remark"] == "x" * 10_000


@posix
def test_the_command_ends_with_one_line_and_code_1(feed, tmp_path) -> None:
    out = tmp_path / "run.parquet"
    program = (
        "import resource, signal, sys\n"
        "from gfimu.commands.shell.program import main\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))\n"  # as a disk with so much room for a file
        f"sys.argv = ['gfimu', 'record', '--port', {feed.port.name!r}, '--out', {str(out)!r}]\n"
        "main()\n"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 1
    assert run.stderr.count("\n") == 1
    assert "can be read" in run.stderr
    recording = Recording.read(out, unit="lsb")
    assert len(recording) > 500
    assert is_whole(recording)


def test_a_recording_states_the_rate_of_its_time_stamps(feed, tmp_path) -> None:
    out = tmp_path / "run.csv"
    record(feed.port.name, out, duration_s=4.5)
    stated = Recording.read(out).metadata
    assert stated["time_stamp_clock"] == "board"
    assert stated["time_stamp_tick_hz"] == 1e6
    assert stated["time_stamp_rate_hz"] == pytest.approx(800.0, abs=1e-6)
    assert stated["time_stamp_rate_from"].startswith("board clock")
    assert stated["host_clock_rate_hz"] == pytest.approx(
        stated["time_stamp_rate_hz"] / (1 + stated["host_clock"]["rate_error"])
    )
    clock = ClockFit(**stated["host_clock"])  # as docs/reference/firmware.md says
    assert clock.to_host(clock.mean_board_s) == pytest.approx(clock.mean_board_s + clock.offset_s)


def test_write_errors_are_no_bad_input() -> None:
    assert issubclass(JournalError, GfimuError)
    assert not issubclass(JournalError, InputError)
