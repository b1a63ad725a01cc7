"""ADC, RTC, repetitive timer, external interrupts and PWM1 of the emulated board (UM10360)."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("unicorn", reason="the emulator is in the extra 'firmware'")

from firmware_bridge import RepetitiveTimer

IMAGE = Path(__file__).parents[1] / "images" / "board_parts.c"
KINDS = ("python", "fast")


@pytest.fixture(scope="module")
def image(compile_image):
    return compile_image(IMAGE)


def found(board, names: str) -> tuple[int, ...]:
    return tuple(board.word(name) for name in names.split())


@pytest.fixture(params=KINDS)
def board(request, make_board, image):
    board = make_board(request.param, image)
    board.adc.values[1], board.adc.values[3] = 77, 1234
    board.gpio.drive(2, 13, False)
    return board


def test_converter_clock_timers_and_calendar(board) -> None:
    board.run_for(2.5)
    assert board.word("done") == 1
    assert found(board, "adc_polled adc_channel adc_again") == (1234, 3, 0)
    assert board.word("adc_microseconds") == pytest.approx(65, abs=15)  # 65 clocks of 1 MHz, and the code around
    assert found(board, "adc_interrupts adc_burst") == (4, 1 << 1 | 1 << 3)
    assert board.word("pwm_second") == pytest.approx(3000, abs=30)  # 1 ms, as begun, then 2 ms
    assert board.word("rit_count") == 10
    assert board.word("rit_counter") < 100
    assert found(board, "rtc_seconds rtc_alarms rtc_day rtc_month rtc_year") == (2, 1, 29, 2, 2028)


def test_external_interrupts_by_edge_and_by_level(board) -> None:
    board.run_for(2.5)
    for level in (True, False, True, False):
        board.gpio.drive(2, 10, level)
        board.run_for(0.001)
    assert board.word("eint0_count") == 2
    assert board.word("eint3_count") > 10  # a low level that lasts interrupts again and again
    assert board.word("eint_flags") & 8
    board.gpio.drive(2, 13, True)
    board.run_for(0.001)
    quiet = board.word("eint3_count")
    board.run_for(0.01)
    assert board.word("eint3_count") <= quiet + 1


def test_both_kinds_agree(make_board, image) -> None:
    ends = []
    for kind in KINDS:
        board = make_board(kind, image)
        board.adc.values[3] = 9
        board.run_for(2.4)
        board.gpio.drive(2, 10, False)
        board.run_for(0.001)
        ends.append((board.now, board.accesses, board.exceptions, *found(board, "pwm_first rit_counter eint0_count")))
    assert ends[0] == ends[1]


def test_the_calendar_turns_a_year_and_counts_on_over_a_reset(make_board) -> None:
    board = make_board("python")
    rtc = board.rtc
    for offset, value in (
        (0x20, 59),
        (0x24, 59),
        (0x28, 23),
        (0x2C, 31),
        (0x30, 6),
        (0x34, 365),
        (0x38, 12),
        (0x3C, 2026),
    ):
        rtc.write(offset, value, 4)
    rtc.write(0x08, 1, 4)
    board.run_for(1.5)
    assert rtc.time == [0, 0, 0, 1, 0, 1, 1, 2027]
    assert rtc.read(0x18, 4) == 1 | 1 << 8 | 2027 << 16
    board.press_reset()
    board.run_for(2.0)
    assert rtc.time[0] == 2


@pytest.mark.parametrize(
    ("compare", "mask", "count", "expected"),
    [
        (100, 0, 5, 100),
        (100, 0, 101, 100 + (1 << 32)),
        (0x50, 0x0F, 0x12, 0x50),
        (0x50, 0x0F, 0x53, 0x53),
        (0x50, 0xF00, 0x151, 0x250),
        (0x50, 0xFFFFFF00, 0x1FE, 0x250),
    ],
)
def test_the_repetitive_timer_leaves_masked_bits_out(make_board, compare, mask, count, expected) -> None:
    board = make_board("python")
    timer = next(p for p in board._peripherals if isinstance(p, RepetitiveTimer))
    timer.compare, timer.mask = compare, mask
    assert timer._next_match(count) == expected


def test_memory_below_a_kilobyte_is_flash_for_other_bus_masters_too(make_board) -> None:
    board = make_board("python")
    assert board.read_bus(0) == int.from_bytes(board.cpu.peek(0, 4), "little") != 0
