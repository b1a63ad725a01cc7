"""Speeds of the line: found, raised where the samples need it, given up where one end can't do them."""

from __future__ import annotations

import sys
import threading
from contextlib import contextmanager

import numpy as np
import pytest

from firmware_bridge import (
    Command,
    Link,
    as_received,
    change_speed,
    encode_command,
    find_boards,
    frame_format,
    open_port,
    record,
    serve,
    set_rate,
)
from gfimu import InputError
from gfimu.recording import Recording

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the speed of a pseudo-terminal is read on Linux")
needs_board = pytest.mark.skipif(
    not pytest.importorskip("importlib.util").find_spec("unicorn"), reason="the emulator is in the extra 'firmware'"
)


@contextmanager
def served(*commands: bytes, port_name: str = "pty"):
    """A board in real time behind a port; gives the board and the port."""
    from firmware_bridge import BoardProcess

    port = open_port(port_name)
    done = threading.Event()
    with BoardProcess() as board:
        board.run_for(0.05)
        for command in commands:
            board.receive(command)
            board.run_for(0.05)
        board.take_sent()
        thread = threading.Thread(target=serve, args=(board, port), kwargs={"stop": done.is_set})
        thread.start()
        try:
            yield board, port
        finally:
            done.set()
            thread.join()
            port.close()


@needs_board
def test_a_rate_that_the_first_speed_does_not_carry_raises_it(tmp_path) -> None:
    with served() as (_, port):
        report = record(port.name, tmp_path / "run.csv", duration_s=1.0, setup=(set_rate(800),))
        again = record(port.name, tmp_path / "again.csv", duration_s=0.5)  # the board is not at its first speed now
    assert report.baud == again.baud == 460_800
    assert report.stream.lost == report.stream.corrupt == 0
    assert Recording.read(tmp_path / "run.csv").sample_rate == pytest.approx(800)
    assert Recording.read(tmp_path / "again.csv").sample_rate == pytest.approx(800)


@needs_board
@pytest.mark.parametrize("baud", [115_200, 921_600])
def test_a_board_is_found_whatever_its_speed(baud: int) -> None:
    with served(encode_command(Command.SET_BAUD, baud), encode_command(Command.IDENTIFY)) as (_, port):
        (found,) = find_boards([port.name])
    assert (found.form, found.baud) == ("lpc1768", baud)
    assert found.identity is not None
    assert found.identity.present == (True,) * 4


@needs_board
def test_a_speed_that_the_adapter_cannot_do_is_given_up(monkeypatch) -> None:
    """Above 500,000 baud the host's adapter gives garbage; both ends go back."""

    def through_adapter(data: bytes, sent: float, read: float) -> tuple[bytes, int]:
        return (bytes(b ^ 0x55 for b in data), 1) if max(sent, read) > 500_000 else as_received(data, sent, read)

    monkeypatch.setattr("firmware_bridge.loop.virtual_port.as_received", through_adapter)
    with served() as (board, port), Link(port.name) as link:
        form = frame_format("lpc1768")
        assert change_speed(link, form, 115_200, 921_600) is None
        assert link.baud == 115_200
        assert board.baud() == pytest.approx(115_200, rel=0.01)
        changed = change_speed(link, form, 115_200, 460_800)
        assert changed is not None
        assert board.baud() == pytest.approx(460_800, rel=0.01)


@needs_board
def test_a_board_that_starts_anew_is_found_again(tmp_path) -> None:
    with served() as (board, port):
        threading.Timer(1.5, board.press_reset).start()
        report = record(port.name, tmp_path / "run.csv", duration_s=6.0, setup=(set_rate(400),))
    assert report.stream.restarts == 1
    assert report.baud == 230_400
    recording = Recording.read(tmp_path / "run.csv")
    assert recording.t_s[-1] > 5.9
    assert np.median(np.diff(recording.t_s[-400:])) == pytest.approx(1 / 400, rel=1e-3)


def test_nothing_that_sends_is_no_board() -> None:
    port = open_port("pty")
    try:
        assert find_boards([port.name]) == []
        with pytest.raises(InputError, match="can't be opened"):
            find_boards(["/dev/no_such_port"])
    finally:
        port.close()
