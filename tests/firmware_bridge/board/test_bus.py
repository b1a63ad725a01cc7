"""Peripherals work on any object that satisfies the bus protocol; no board is needed."""

from __future__ import annotations

from firmware_bridge import TICKS_PER_SECOND
from firmware_bridge.board.gpdma import Gpdma
from firmware_bridge.board.peripheral import NEVER
from firmware_bridge.board.timer import Timer

CYCLE = TICKS_PER_SECOND // 96_000_000


class Lines:
    """Interrupt lines that keep their last level."""

    def __init__(self):
        self.level = {}

    def set_line(self, irq, level):
        self.level[irq] = bool(level)

    def pend(self, exception):
        raise AssertionError("not used by these peripherals")


class Dividers:
    def peripheral_divider(self, place):
        return {2: 4}[place]


class BareBus:
    """Time, events and memory; nothing of a board around them."""

    def __init__(self):
        self.now, self.cycle, self.alarm = 0, CYCLE, -1
        self.nvic, self.system_control = Lines(), Dividers()
        self.memory = {}
        self.devices, self.due = [], []

    def add(self, peripheral):
        self.devices.append(peripheral)
        self.due.append(NEVER)
        return len(self.devices) - 1

    def schedule(self, slot, when):
        self.due[slot] = when

    def read_bus(self, address, size=4):
        return self.memory.get(address, 0)

    def write_bus(self, address, value, size=4):
        self.memory[address] = value

    def run_until(self, ticks):
        while min(self.due) <= ticks:
            slot = self.due.index(min(self.due))
            self.now, self.due[slot] = self.due[slot], NEVER
            self.devices[slot].event()
        self.now = ticks


def test_a_timer_counts_and_interrupts_on_a_bare_bus():
    bus = BareBus()
    timer = Timer(bus, "timer0", 0x40004000, 1, 2)
    timer.reset()
    timer.clock_changed()
    timer.write(0x14, 3, 4)  # interrupt and reset on match 0
    timer.write(0x18, 99, 4)
    timer.write(0x04, 1, 4)
    match = 99 * 4 * CYCLE  # the count is 99 after as many ticks of the divided clock
    bus.run_until(match - 1)
    assert not bus.nvic.level.get(1)
    bus.run_until(match)
    assert bus.nvic.level[1]
    timer.write(0x00, 1, 4)
    assert not bus.nvic.level[1]


def test_a_dma_channel_copies_memory_on_a_bare_bus():
    bus = BareBus()
    dma = Gpdma(bus)
    dma.reset()
    bus.memory.update({0x1000 + 4 * k: 7 * k for k in range(5)})
    dma.write(0x30, 1, 4)
    for offset, value in ((0x100, 0x1000), (0x104, 0x2000), (0x10C, 5 | 2 << 18 | 3 << 26 | 1 << 31)):
        dma.write(offset, value, 4)
    dma.write(0x110, 1 | 1 << 15, 4)
    bus.run_until(1000 * CYCLE)
    assert [bus.memory[0x2000 + 4 * k] for k in range(5)] == [0, 7, 14, 21, 28]
    assert bus.nvic.level[26]
