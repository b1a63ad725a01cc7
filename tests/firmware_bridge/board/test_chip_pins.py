"""The chips' interrupt pins at the processor, with either kind of peripherals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("unicorn", reason="the emulator is in the extra 'firmware'")

from firmware_bridge import TICKS_PER_SECOND, Adxl345, Adxl345Options, Board, FastBoard

KINDS = {"python": Board, "fast": FastBoard}
IMAGE = Path(__file__).parents[1] / "images" / "chip_events.c"
FIO0PIN = 0x2009C014
PUSHES = ((0.3, 0.304, 0.6, 0.0, 6.0), (0.36, 0.364, 0.6, 0.0, 6.0), (1.2, 1.5, 5.0, 0.0, 0.8), (1.6, 1.7, 0, 0, 0))
COUNTED = ("wakes", "singles", "doubles", "activities", "inactivities", "falls", "ready", "status", "falling_edges")


def pushed(first, period, count, bw_rate):
    """Yield a specific force at rest, with two taps, a push and a fall."""
    t = (first + period * np.arange(count)) / TICKS_PER_SECOND
    g = np.tile((0.6, 0.0, 0.8), (count, 1))
    for begin, end, *force in PUSHES:
        g[(t >= begin) & (t < end)] = force
    return np.round(g * 65536).astype(np.int32)


@pytest.fixture(scope="module")
def ran(compile_image):
    """Both kinds of board after the same two and a half seconds, with the pins seen every 3 ms."""
    image = compile_image(IMAGE)
    result = {}
    for kind, board_class in KINDS.items():
        chips = [Adxl345(pushed, Adxl345Options(clock_error=0.003 * k, phase=0.2 * k)) for k in range(4)]
        board = board_class(image, chips)
        pins = []
        for _ in range(800):
            board.run_for(0.003)
            pins.append(board.read_bus(FIO0PIN))
        kept = [board.read_chip(sensor, 0x2B) for sensor in range(4)]
        result[kind] = {name: board.word(name) for name in COUNTED}, pins, kept, (board.now, board.accesses)
    return result


@pytest.mark.parametrize("kind", KINDS)
def test_events_wake_the_processor(ran, kind: str) -> None:
    counted, _, kept, _ = ran[kind]
    assert (counted["singles"], counted["doubles"], counted["falls"]) == (1, 1, 1)
    assert (counted["activities"], counted["inactivities"]) == (1, 1)  # asleep from 1 s on, woken at 1.2 s
    assert counted["ready"] == pytest.approx(240, abs=5)  # 100 Hz on INT2
    assert counted["wakes"] >= counted["ready"] + 4
    assert counted["falling_edges"] == 2  # of INT1 of sensor 1, which reading INT_SOURCE lets go
    assert kept[1] & 0x70 == 0x40


def test_both_kinds_of_board_agree(ran) -> None:
    assert ran["python"] == ran["fast"]
    assert len(set(ran["python"][1])) > 1


@pytest.mark.parametrize("kind", KINDS)
def test_pins_are_low_unless_inverted(make_board, kind: str) -> None:
    board = make_board(kind)
    board.run_for(0.02)
    assert board.read_bus(FIO0PIN) & 0x07878000 == 0
    board.write_chip(2, 0x31, 0x2B)
    assert board.read_bus(FIO0PIN) & 0x07878000 == 1 << 17 | 1 << 25
