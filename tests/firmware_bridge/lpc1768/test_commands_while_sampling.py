"""Commands at any moment of the sampling: no sample lacks a chip or mixes two, whatever the host asks and when."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("unicorn", reason="the emulator is in the extra 'firmware'")

from unicorn.arm_const import UC_ARM_REG_PRIMASK

from firmware_bridge import (
    FAST_BAUD,
    FIRST_IRQ,
    RAW_PER_COUNT,
    Adxl345,
    Adxl345Options,
    Board,
    Command,
    ElfImage,
    FastBoard,
    Reply,
    Result,
    SampleDecoder,
    Status,
    StrictBoard,
    encode_command,
    image_path,
    parse_message,
    set_range,
    set_rate,
)

TIMES = 300
PERIODS = 5  # of sampling after a command; chips that are slower than the sampling may take 16 to be ready together
SLOW_PERIODS = 20
SET_UP_S = 0.002  # the chips are written and read back
IN_PACE, NEWEST = {100: 10, 3200: 15}, {100: 12, 3200: 14}  # BW_RATE codes of the two ways to read the chips
START, STOP, IDENTIFY = (encode_command(one) for one in (Command.START, Command.STOP, Command.IDENTIFY))
TIMER0, TCR, T0IR, DIVISOR_ACCESS = 1, 0x04, 0x40004000, 0x80
SHIFTED = np.array([294, -294, 474])  # of a chip under self-test, counts


def telling_source(chip: int):
    """Conversions whose axes belong together and to their chip: y = −x, z = 20 · chip; x in steps of 16 counts."""

    def source(first, period, count, bw_rate):
        x = (first // period + np.arange(count)) % 17 * 16 - 128
        return (np.stack([x, -x, np.full(count, 20 * chip)], axis=1) * RAW_PER_COUNT).astype(np.int32)

    return source


def sampling_board(kind: type[Board], rate: int, codes: dict[int, int], **options) -> Board:
    chips = [Adxl345(telling_source(k), Adxl345Options(clock_error=0.004 * k, phase=0.2 * k)) for k in range(4)]
    board = kind(ElfImage.load(image_path("gfimu")), chips, **options)
    board.run_for(0.03)
    board.uarts[0].receive(encode_command(Command.SET_BAUD, FAST_BAUD))
    board.run_for(0.02)
    board.uarts[0].receive(set_rate(rate, codes[rate]))
    board.run_for(10 / rate + 0.02)
    return board


def others(rate: int, codes: dict[int, int]) -> list[bytes]:
    """Every command but START, and START after STOP; some arrive while another is carried out."""
    return [
        set_rate(rate, codes[rate]),
        IDENTIFY,
        set_range(4),
        encode_command(Command.SELF_TEST, 1),
        encode_command(Command.SELF_TEST, 0),
        STOP + START,
        encode_command(Command.SET_BAUD, FAST_BAUD),
        set_range(16) + START + IDENTIFY,
    ]


def ask(board: Board, rate: int, commands: list[bytes], wait: int = PERIODS) -> None:
    """Send commands, each at a moment of its own within a sampling period, and check all samples and replies."""
    decoder, replies, parts = SampleDecoder(), [], []
    decoder.feed(board.uarts[0].take_sent()[0])
    moments = np.random.default_rng(1).permutation(len(commands)) / len(commands)
    for command, moment in zip(commands, moments, strict=True):
        board.uarts[0].receive(command)
        board.run_for((wait + moment) / rate + SET_UP_S * (command != START))
        parts.append(decoder.feed(board.uarts[0].take_sent()[0]))
        replies += [one for one in map(parse_message, decoder.messages) if isinstance(one, Reply)]
        decoder.messages.clear()
    assert {reply.result for reply in replies} == {Result.DONE}
    counts = decoder.counts
    assert (counts.lost, counts.corrupt, counts.skipped_bytes, counts.restarts) == (0, 0, 0, 0)
    samples = type(parts[0]).join(parts)

    readings = samples.counts.reshape(-1, 4, 3).astype(int)
    assert not np.any(samples.status & (0xF | Status.CHIP_FAULT))
    assert not np.any(readings == -32768)
    readings -= np.where((samples.status & Status.SELF_TEST)[:, None, None] != 0, SHIFTED, 0)
    assert np.abs(readings[:, :, 0] + readings[:, :, 1]).max() <= 2
    assert np.abs(readings[:, :, 2] - 20 * np.arange(4)).max() <= 1
    assert np.abs(readings[:, :, 0]).max() <= 128

    first = (samples.status & Status.FIRST) != 0
    assert first.sum() == sum(command != IDENTIFY for command in commands)
    assert np.all(samples.sequence[first] == samples.sequence[first].min())
    steps, periods = np.diff(samples.sequence.astype(int)), np.diff(samples.ticks) * 1e-6 * rate
    assert np.all(steps[~first[1:]] == 1)
    assert 0.95 < periods[~first[1:]].min() <= periods[~first[1:]].max() < 1.15  # it waits for chips up to an eighth
    assert periods.min() > 0.3
    assert not np.any(samples.status & (Status.LATE | Status.WATCHDOG_RESET))
    assert board.resets == 0


@pytest.mark.parametrize("codes", [IN_PACE, NEWEST], ids=["in_pace", "newest"])
@pytest.mark.parametrize("rate", [100, 3200])
@pytest.mark.parametrize("kind", [Board, FastBoard])
def test_commands_at_every_moment_of_a_period(kind: type[Board], rate: int, codes: dict[int, int]) -> None:
    board = sampling_board(kind, rate, codes)
    wait = SLOW_PERIODS if codes is NEWEST and rate == 3200 else PERIODS
    ask(board, rate, [START] * TIMES + (others(rate, codes) * TIMES)[:TIMES], wait)


class Onlooker:
    """Calls a function before every write to a register, and one at every exception; none while the board boots."""

    def look(self, peripheral: str, offset: int, value: int) -> None:
        """Look at a write."""

    def enter(self, number: int) -> None:
        """Look at an exception."""

    def access(self, ticks, peripheral, offset, value, *, write) -> None:
        if write:
            self.look(peripheral, offset, value)

    def exception(self, ticks, number, *, entered) -> None:
        if entered:
            self.enter(number)


def test_an_interrupt_that_was_due_when_sampling_stops_is_withdrawn() -> None:
    onlooker, due, matched = Onlooker(), [], []
    board = sampling_board(Board, 100, IN_PACE, tracer=onlooker)

    def match_meanwhile(peripheral: str, offset: int, value: int) -> None:
        if (peripheral, offset, value) == ("timer0", TCR, 0):
            board.nvic.pend(FIRST_IRQ + TIMER0)
            due.append(board.now)

    def enter(number: int) -> None:
        if number == FIRST_IRQ + TIMER0:
            matched.append(board.read_bus(T0IR) & 1)

    onlooker.look, onlooker.enter = match_meanwhile, enter
    ask(board, 100, [START] * 10)
    assert len(due) == 10
    assert len(matched) > 10 * (PERIODS - 1)
    assert set(matched) == {1}


def test_no_interrupt_comes_while_the_divisor_lies_in_the_place_of_the_receiver() -> None:
    onlooker, masked = Onlooker(), []
    board = sampling_board(Board, 100, IN_PACE, tracer=onlooker)

    def look(peripheral: str, offset: int, value: int) -> None:
        if peripheral == "uart0" and board.uarts[0].line_control & DIVISOR_ACCESS:
            masked.append(board.cpu.uc.reg_read(UC_ARM_REG_PRIMASK))

    onlooker.look = look
    ask(board, 100, [encode_command(Command.SET_BAUD, FAST_BAUD)] * 3)
    assert len(masked) >= 3 * 3
    assert set(masked) == {1}


def test_the_firmware_breaks_no_rule_whatever_the_host_asks_and_when() -> None:
    for rate in (100, 3200):
        board = sampling_board(StrictBoard, rate, IN_PACE)
        ask(board, rate, [START] * 40 + others(rate, IN_PACE))
        assert board.findings() == ()
