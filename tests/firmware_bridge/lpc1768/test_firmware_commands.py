"""Every command of the host on the emulated board, ten virtual seconds each, with either kind of peripherals."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

pytest.importorskip("unicorn", reason="the emulator is in the extra 'firmware'")

from firmware_bridge import (
    FAST_BAUD,
    RATES_HZ,
    Command,
    Identity,
    Reply,
    Result,
    SampleDecoder,
    Samples,
    Status,
    crc16,
    encode_command,
    parse_message,
    set_range,
    set_rate,
)
from gfimu import InputError

KINDS = ("python", "fast")
SETTLE_S, RUN_S = 0.3, 10.0
START, STOP = encode_command(Command.START), encode_command(Command.STOP)
IDENTIFY = encode_command(Command.IDENTIFY)
RATE_ERROR = 0.01
CHIPS_CLOCKS = (
    Status.STALE | 0xF0
)  # the chips run on clocks of their own: now and then a conversion is stale or replaced


@dataclass
class Session:
    """A board and what the host decodes from it."""

    board: object
    decoder: SampleDecoder = field(default_factory=SampleDecoder)
    replies: list[Reply] = field(default_factory=list)
    identity: Identity | None = None

    def run(self, seconds: float, command: bytes = b"") -> Samples:
        """Send a command, run, and check that nothing was lost or damaged and nothing reset the board."""
        self.board.uarts[0].receive(command)
        self.board.run_for(seconds)
        samples = self.decoder.feed(self.board.uarts[0].take_sent()[0])
        for packet in self.decoder.messages:
            message = parse_message(packet)
            if isinstance(message, Reply):
                self.replies.append(message)
            else:
                self.identity = message
        self.decoder.messages.clear()
        counts = self.decoder.counts
        assert (counts.lost, counts.corrupt, counts.skipped_bytes, counts.restarts) == (0, 0, 0, 0)
        assert self.board.resets == 0
        assert not (samples.status & Status.WATCHDOG_RESET).any()
        assert not (samples.status & Status.FRAMES_DROPPED).any()
        return samples

    def stream(self, command: bytes, rate: int, *replies: Reply, restarts: bool = False) -> Samples:
        """Send a command and check its reply and ten seconds of samples."""
        self.replies.clear()
        settling = self.run(SETTLE_S, command)
        assert self.replies == list(replies)
        assert int(np.count_nonzero(settling.status & Status.FIRST)) == restarts
        samples = self.run(RUN_S)
        assert len(samples) == pytest.approx(rate * RUN_S, rel=RATE_ERROR)
        assert (len(samples) - 1) / np.ptp(samples.ticks) * 1e6 == pytest.approx(rate, rel=RATE_ERROR)
        assert set((np.diff(samples.sequence.astype(int)) & 0xFFFF).tolist()) == {1}
        return samples

    def identify(self) -> Identity:
        """Ask the board what it is set to."""
        self.run(0.2, IDENTIFY)
        assert self.identity is not None
        return self.identity


@pytest.fixture(params=KINDS)
def session(request, make_board) -> Session:
    opened = Session(make_board(request.param))
    opened.run(0.1)
    return opened


def done(command: Command) -> Reply:
    return Reply(command, Result.DONE)


def test_start(session: Session) -> None:
    session.stream(START, 100, done(Command.START), restarts=True)


def test_identify(session: Session) -> None:
    samples = session.stream(IDENTIFY, 100, done(Command.IDENTIFY))
    assert not (samples.status & ~CHIPS_CLOCKS).any()
    identity = session.identity
    assert (identity.rate_hz, identity.range_g, identity.baud, identity.streaming) == (100, 16, 115_200, True)
    assert identity.present == (True,) * 4
    assert identity.faulty == (False,) * 4
    assert identity.dropped == 0


def test_stop_outlives_the_watchdog_and_start_goes_on_with_the_settings(session: Session) -> None:
    session.run(SETTLE_S, set_range(4, full_resolution=False) + set_rate(200, 12))
    session.replies.clear()
    session.run(0.1, STOP)
    assert session.replies == [done(Command.STOP)]
    assert len(session.run(RUN_S)) == 0  # the watchdog's time is 2 s
    identity = session.identify()
    assert not identity.streaming
    samples = session.stream(START, 200, done(Command.START), restarts=True)
    identity = session.identify()
    assert (identity.rate_hz, identity.rate_code) == (200, 12)
    assert (identity.range_g, identity.full_resolution, identity.streaming) == (4, False, True)
    assert identity.reset_cause == "power-on"
    assert np.abs(samples.counts[:, 2::3] - 128).max() <= 64 + 1  # 1 ± 0.5 g at 128 counts per g


def test_settings_made_while_stopped_hold_from_the_start_on(session: Session) -> None:
    session.run(0.1, STOP)
    session.run(4.5, set_rate(50))
    session.stream(START, 50, done(Command.START), restarts=True)


@pytest.mark.parametrize("rate", [10, 33, 100, 200, 800, 1601, 3200])
def test_set_rate(session: Session, rate: int, request) -> None:
    if rate > 200 and "python" in request.node.name:
        pytest.skip("slow with peripherals in Python; test_board.py compares both kinds at 800 and 3200 Hz")
    session.run(SETTLE_S, encode_command(Command.SET_BAUD, FAST_BAUD))
    samples = session.stream(set_rate(rate), rate, done(Command.SET_RATE), restarts=True)
    assert session.identify().rate_hz == rate
    assert not (samples.status & Status.LATE).any()


@pytest.mark.parametrize("full", [True, False])
@pytest.mark.parametrize("range_g", [2, 4, 8, 16])
def test_set_range(session: Session, range_g: int, full: bool) -> None:
    samples = session.stream(set_range(range_g, full_resolution=full), 100, done(Command.SET_RANGE), restarts=True)
    per_g = 256 if full else 512 // range_g
    assert np.all(samples.counts[:, 10] == round(0.3 * per_g))
    assert np.abs(samples.counts[:, 2] / per_g - 1.0).max() <= 0.5 + 1 / per_g
    identity = session.identify()
    assert (identity.range_g, identity.full_resolution) == (range_g, full)


def test_self_test_on_and_off(session: Session) -> None:
    on = session.stream(encode_command(Command.SELF_TEST, 1), 100, done(Command.SELF_TEST), restarts=True)
    assert np.all(on.status & Status.SELF_TEST)
    off = session.stream(encode_command(Command.SELF_TEST, 0), 100, done(Command.SELF_TEST), restarts=True)
    assert not (off.status & ~CHIPS_CLOCKS).any()
    assert np.all(on.counts[:, 1] - off.counts[0, 1] == -294)  # the chip's shift of the second axis, counts


@pytest.mark.parametrize("baud", [115_200, 460_800, 921_600, 6_250_000])
def test_set_baud(session: Session, baud: int) -> None:
    # Sampling rests while the queue empties, so the numbers begin anew.
    session.stream(encode_command(Command.SET_BAUD, baud), 100, done(Command.SET_BAUD), restarts=True)
    assert session.board.uarts[0].baud == pytest.approx(baud, rel=0.01)
    assert session.identify().baud == baud


def bad_length() -> bytes:
    body = b"\xc3\x3c" + bytes((Command.SELF_TEST, 2, 1, 1))
    return body + crc16(body).to_bytes(2, "little")


REFUSED = {
    "rate 0": (encode_command(Command.SET_RATE, 0, 0xFF), Result.BAD_VALUE),
    "rate 9": (encode_command(Command.SET_RATE, RATES_HZ[0] - 1, 0xFF), Result.BAD_VALUE),
    "rate 3201": (encode_command(Command.SET_RATE, RATES_HZ[1] + 1, 0xFF), Result.BAD_VALUE),
    "rate 65535": (encode_command(Command.SET_RATE, 65535, 0xFF), Result.BAD_VALUE),
    "rate code 16": (encode_command(Command.SET_RATE, 100, 16), Result.BAD_VALUE),
    "range 4": (encode_command(Command.SET_RANGE, 4, 1), Result.BAD_VALUE),
    "resolution 2": (encode_command(Command.SET_RANGE, 3, 2), Result.BAD_VALUE),
    "self-test 2": (encode_command(Command.SELF_TEST, 2), Result.BAD_VALUE),
    "100 baud": (encode_command(Command.SET_BAUD, 100), Result.BAD_VALUE),
    "20 Mbaud": (encode_command(Command.SET_BAUD, 20_000_000), Result.BAD_VALUE),
    "line too slow": (encode_command(Command.SET_BAUD, 9600), Result.LINE_TOO_SLOW),
    "wrong length": (bad_length(), Result.BAD_LENGTH),
    "unknown": (encode_command(99), Result.UNKNOWN_COMMAND),
}


def test_what_is_out_of_range_is_refused_and_changes_nothing(session: Session) -> None:
    before = session.identify()
    for name, (command, result) in REFUSED.items():
        session.replies.clear()
        session.run(0.05, command)
        assert session.replies == [Reply(command[2], result)], name
    command, result = REFUSED["rate 9"]
    samples = session.stream(command, 100, Reply(command[2], result))
    assert not (samples.status & ~CHIPS_CLOCKS).any()
    assert session.identify() == before


def test_a_rate_the_line_cannot_carry_is_refused(session: Session) -> None:
    session.stream(set_rate(800), 100, Reply(Command.SET_RATE, Result.LINE_TOO_SLOW))


@pytest.mark.parametrize(("rate", "code"), [(0, 255), (9, 255), (3201, 255), (-1, 255), (100, 16), (100, -1)])
def test_the_host_does_not_send_what_the_firmware_refuses(rate: int, code: int) -> None:
    with pytest.raises(InputError, match=r"10 to 3200 Hz|0 to 15"):
        set_rate(rate, code)
