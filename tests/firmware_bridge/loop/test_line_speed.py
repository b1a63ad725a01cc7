"""A line at the wrong speed: garbage as in life, and nothing changed at the right one."""

from __future__ import annotations

import os
import sys

import pytest
import serial

from firmware_bridge import as_received, terminal_baud


def test_the_right_speed_changes_nothing() -> None:
    data = bytes(range(256))
    assert as_received(data, 115_200, 115_200) == (data, 0)
    assert as_received(data, 115_200 * 1.02, 115_200) == (data, 0)


def test_characters_worked_out_by_hand() -> None:
    # 0x00 at half the receiver's speed: 18 low half-bits. The receiver reads 0x00 without a stop bit, and then nothing,
    # as the line has no falling edge before it is idle.
    assert as_received(b"\x00", 57_600, 115_200) == (b"\x00", 1)
    # 0x55 alternates: each bit lasts two of the receiver's. Start 0 0, then 1 1 0 0 1 1 0 and a low stop bit; the next
    # falling edge begins the bits 0 0 1 1 0 0 1 1 with idle line behind.
    assert as_received(b"\x55", 57_600, 115_200)[0][0] == 0b01100110
    # Twice too slow a receiver sees every other bit: of 0xFF only the start bit, which is over when it looks.
    assert as_received(b"\xff", 230_400, 100_000) == (b"", 0)


def test_a_speed_a_twentieth_off_still_reads_and_a_fifth_off_does_not() -> None:
    data = bytes(range(256))
    assert as_received(data, 1.04 * 115_200, 115_200)[0] == data  # half a bit in 9.5
    read, errors = as_received(data, 1.2 * 115_200, 115_200)
    assert read != data
    assert errors > 0


@pytest.mark.skipif(sys.platform != "linux", reason="the speed of a pseudo-terminal is read on Linux")
def test_the_speed_that_a_program_set_is_read_from_the_other_end() -> None:
    ours, theirs = os.openpty()
    try:
        for baud in (115_200, 1_562_500, 460_800):
            with serial.Serial(os.ttyname(theirs), baud):
                assert terminal_baud(ours) == baud
    finally:
        os.close(ours)
        os.close(theirs)
