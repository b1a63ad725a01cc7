"""What the board's process does on request (`firmware_bridge.loop.board_process`)."""

from __future__ import annotations

import gc
from array import array
from collections.abc import Sequence
from pathlib import Path

from firmware_bridge.adxl345.device import Adxl345
from firmware_bridge.adxl345.registers import LineFault
from firmware_bridge.board.board import Board
from firmware_bridge.board.fast_board import FastBoard
from firmware_bridge.board.nvic import FIRST_IRQ
from firmware_bridge.board.trace import Event, EventList
from firmware_bridge.lpc1768.build import named_image
from firmware_bridge.lpc1768.elf import ElfImage

__all__ = ["Worker"]

_TIMER0 = FIRST_IRQ + 1
_TIMER_COUNTER = 0x08


class Worker:
    """One board and the requests it answers; each method is one request."""

    def __init__(
        self, path: Path, sensors: Sequence[Adxl345], *, fast: bool, trace: bool, lose_every: int, array: str = ""
    ) -> None:
        image = ElfImage.load(path)
        if array:
            image = named_image(image, array)
        self._events = EventList() if trace else None
        self._board: Board = FastBoard(image, sensors) if fast else Board(image, sensors, tracer=self._events)
        gc.freeze()
        gc.disable()  # nothing that a board does while it runs makes cycles
        if lose_every:
            self._board.lose_interrupts(_TIMER0, lose_every)

    def ready(self) -> None:
        """Answer once the board stands."""

    def run_until(self, ticks: int) -> int:
        """Run to a tick."""
        self._board.run_until(ticks)
        return self._board.now

    def now(self) -> int:
        """Virtual time, ticks."""
        return self._board.now

    def take_sent(self, uart: int) -> tuple[bytes, array[int]]:
        """Bytes that left a UART, and when."""
        return self._board.uarts[uart].take_sent()

    def receive(self, uart: int, data: bytes, errors: int) -> None:
        """Put bytes on a receiving line."""
        self._board.uarts[uart].receive(data, errors)

    def brown_out(self) -> None:
        """Drop the supply voltage."""
        self._board.brown_out()

    def press_reset(self) -> None:
        """Reset the processor, not the sensors."""
        self._board.press_reset()

    def read_chip(self, sensor: int, address: int) -> int:
        """Register of a sensor."""
        return self._board.read_chip(sensor, address)

    def write_chip(self, sensor: int, address: int, value: int) -> None:
        """Write a register of a sensor."""
        self._board.write_chip(sensor, address, value)

    def warnings(self) -> list[str]:
        """Return what the firmware should not have done."""
        return list(self._board.warnings)

    def set_line_fault(self, sensor: int, fault: LineFault) -> None:
        """Break or mend a sensor's line."""
        self._board.set_line_fault(sensor, fault)

    def baud(self, uart: int) -> float:
        """Bits per second."""
        return self._board.uarts[uart].baud

    def word(self, symbol: str) -> int:
        """Value of a variable of the firmware."""
        return self._board.word(symbol)

    def timer(self, number: int) -> int:
        """Counter of a timer."""
        return self._board.read_bus(self._board.timers[number].base + _TIMER_COUNTER)

    def counters(self) -> dict[str, int]:
        """Exceptions handled, register accesses, resets."""
        board = self._board
        return {"exceptions": board.exceptions, "accesses": board.accesses, "resets": board.resets}

    def take_trace(self) -> list[Event]:
        """Events noted since the last request."""
        return [] if self._events is None else self._events.take()
