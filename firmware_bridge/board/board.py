"""The LPC1768 board: processor, peripherals, four ADXL345 on SSP1, virtual time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from firmware_bridge.adxl345.device import Adxl345
from firmware_bridge.adxl345.registers import TICKS_PER_SECOND, LineFault
from firmware_bridge.board.adc import Adc
from firmware_bridge.board.bus import Tracer
from firmware_bridge.board.chip_pins import ChipPins
from firmware_bridge.board.cpu import Cpu
from firmware_bridge.board.dwt import CycleCounter
from firmware_bridge.board.external_interrupts import ExternalInterrupts, PinConnect
from firmware_bridge.board.gpdma import Gpdma
from firmware_bridge.board.gpio import Gpio, GpioInterrupts
from firmware_bridge.board.i2c import I2c
from firmware_bridge.board.nvic import Nvic
from firmware_bridge.board.peripheral import NEVER, Peripheral, StoredRegisters
from firmware_bridge.board.pwm import Pwm
from firmware_bridge.board.rit import RepetitiveTimer
from firmware_bridge.board.rtc import Rtc
from firmware_bridge.board.ssp import Ssp
from firmware_bridge.board.system_control import BROWN_OUT, EXTERNAL, POWER_ON, SystemControl
from firmware_bridge.board.systick import SysTick
from firmware_bridge.board.timer import Timer
from firmware_bridge.board.uart import Uart
from firmware_bridge.board.watchdog import Watchdog
from firmware_bridge.lpc1768.elf import ElfImage

__all__ = ["Board"]

_ACCESS_CYCLES = 4
_SPI_SELECT_PORT = 2  # P2.0…P2.3 select sensors 1…4

_STORED = (
    ("spi", 0x40020000, 0x1000),
    ("can", 0x40038000, 0x14000),
    ("dac", 0x4008C000, 0x1000),
    ("i2s", 0x400A8000, 0x1000),
    ("mcpwm", 0x400B8000, 0x1000),
    ("qei", 0x400BC000, 0x1000),
    ("ethernet", 0x50000000, 0x4000),
    ("usb", 0x5000C000, 0x4000),
)


class Board:
    """A board with one firmware image; the `firmware_bridge.board.bus.Bus` of its peripherals and its processor.

    Parameters
    ----------
    image : ElfImage
        The firmware.
    sensors : sequence of Adxl345
        Chips on SSP1, selected by P2.0, P2.1 and so on; the same chips hang on I2C0 for images that use it.
    tracer : Tracer, optional
        Receives every register access and every exception (slow).

    Attributes
    ----------
    now : int
        Virtual time, ticks (`TICKS_PER_SECOND`).
    cycle : int
        Ticks per core clock cycle.
    warnings : list of str
        What the firmware did that the processor's documents advise against, once each.
    """

    _cpu_class = Cpu

    def __init__(self, image: ElfImage, sensors: Sequence[Adxl345] = (), *, tracer: Tracer | None = None) -> None:
        self.sensors = list(sensors)
        self.tracer = tracer
        self.now = 0
        self.cycle = TICKS_PER_SECOND // 4_000_000
        self.access_ticks = _ACCESS_CYCLES * self.cycle
        self.until = NEVER
        self.alarm = -1
        self.reset_cause: int | None = None
        self.stopped = False
        self.sleeping = False
        self.resets = 0
        self.warnings: list[str] = []
        self.exceptions = 0
        self._events: list[int] = []
        self._peripherals: list[Peripheral] = []
        self.accesses = 0
        self._polled = (-1, -1)
        self._ready = False
        self._build()
        self.cpu = self._cpu_class(self, image)
        self._map()
        self._ready = True
        self._reset_all()

    def _build(self) -> None:
        self.system_control = SystemControl(self)
        self.nvic = Nvic(self)
        self.systick = SysTick(self, "systick", 0)
        self.timers = [
            Timer(self, "timer0", 0x40004000, 1, 2),
            Timer(self, "timer1", 0x40008000, 2, 4),
            Timer(self, "timer2", 0x40090000, 3, 32 + 12),
            Timer(self, "timer3", 0x40094000, 4, 32 + 14),
        ]
        self.uarts = [
            Uart(self, "uart0", 0x4000C000, 5, 6),
            Uart(self, "uart1", 0x40010000, 6, 8),
            Uart(self, "uart2", 0x40098000, 7, 32 + 16),
            Uart(self, "uart3", 0x4009C000, 8, 32 + 18),
        ]
        self.i2cs = [
            I2c(self, "i2c0", 0x4001C000, 10, 14),
            I2c(self, "i2c1", 0x4005C000, 11, 32 + 6),
            I2c(self, "i2c2", 0x400A0000, 12, 32 + 20),
        ]
        self.ssps = [Ssp(self, "ssp0", 0x40088000, 14, 32 + 10), Ssp(self, "ssp1", 0x40030000, 15, 20)]
        self.external_interrupts = ExternalInterrupts(self)
        self.gpio_interrupts = GpioInterrupts(self)
        self.gpio = Gpio(self)
        self.gpio.on_change = self._pins_changed
        self.chip_pins = ChipPins(self, self.sensors, self.gpio.drive)
        self.watchdog = Watchdog(self, "watchdog", 0x40000000, irq=0)
        CycleCounter(self, "dwt", 0xE0001000)
        PinConnect(self, "pincon", 0x4002C000)
        self.adc = Adc(self)
        self.rtc = Rtc(self)
        RepetitiveTimer(self)
        Pwm(self)
        for name, base, size in _STORED:
            StoredRegisters(self, name, base, size)
        Gpdma(self)
        self.i2cs[0].devices = list(self.sensors)

    def _map(self) -> None:
        for peripheral in self._peripherals:
            if peripheral is self.systick or not peripheral.size:
                continue
            read, write = peripheral.read, peripheral.write
            if self.tracer is not None:
                read, write = self._traced(peripheral, self.tracer)
            self.cpu.map_registers(peripheral.base, peripheral.size, read, write)
        self.cpu.map_registers(0x42000000, 0x02000000, *self._bit_band(0x40000000))
        self.cpu.map_registers(0x22000000, 0x02000000, *self._bit_band(0x20000000))

    def _traced(self, peripheral: Peripheral, tracer: Tracer) -> tuple[Any, Any]:
        def read(offset: int, size: int) -> int:
            value = peripheral.read(offset, size)
            tracer.access(self.now, peripheral.name, offset, value, write=False)
            return value

        def write(offset: int, value: int, size: int) -> None:
            tracer.access(self.now, peripheral.name, offset, value, write=True)
            peripheral.write(offset, value, size)

        return read, write

    def _bit_band(self, region: int) -> tuple[Any, Any]:
        """Reader and writer of a bit-band alias: one word per bit of the region."""

        def place(offset: int) -> tuple[int, int]:
            return region + (offset >> 5 & ~3), offset >> 2 & 31

        def read(offset: int, size: int) -> int:
            address, bit = place(offset)
            return self.read_bus(address) >> bit & 1

        def write(offset: int, value: int, size: int) -> None:
            address, bit = place(offset)
            old = self.read_bus(address)
            self.write_bus(address, old & ~(1 << bit) | (value & 1) << bit)

        return read, write

    def _peripheral_at(self, address: int) -> Peripheral | None:
        for peripheral in self._peripherals:
            if peripheral is not self.systick and 0 <= address - peripheral.base < peripheral.size:
                return peripheral
        return None

    def read_bus(self, address: int, size: int = 4) -> int:
        """Read memory or a register as another bus master does: without the processor and its time."""
        peripheral = self._peripheral_at(address)
        if peripheral is not None:
            return peripheral.read(address - peripheral.base, size)
        return int.from_bytes(self.cpu.peek(address, size), "little")

    def write_bus(self, address: int, value: int, size: int = 4) -> None:
        """Write memory or a register as another bus master does."""
        peripheral = self._peripheral_at(address)
        if peripheral is not None:
            peripheral.write(address - peripheral.base, value, size)
        else:
            self.cpu.poke(address, (value & ((1 << 8 * size) - 1)).to_bytes(size, "little"))

    @property
    def image(self) -> ElfImage:
        """The firmware."""
        return self.cpu.image

    @property
    def peripherals(self) -> Sequence[Peripheral]:
        """Peripherals, in the order of their events."""
        return self._peripherals

    # Time

    @property
    def seconds(self) -> float:
        """Virtual time, s."""
        return self.now / TICKS_PER_SECOND

    def add(self, peripheral: Peripheral) -> int:
        """Take in a peripheral; return the number of its event."""
        self._peripherals.append(peripheral)
        self._events.append(NEVER)
        return len(self._events) - 1

    def schedule(self, slot: int, when: int) -> None:
        """Wake a peripheral at ``when`` (instead of what it asked for before)."""
        events = self._events
        before = events[slot]
        events[slot] = when
        if when < self.until:
            self.until = when
            self.alarm = min(self.alarm, when)
        elif before == self.until:
            self.until = min(events)

    def service(self) -> None:
        """Do the events that are due, in the order of their times and then of the peripherals."""
        while self.until <= self.now:
            slot = self._events.index(self.until)
            self._events[slot] = NEVER
            self._peripherals[slot].event()
            self.until = min(self._events)
        self.alarm = -1

    def spinning(self, slot: int) -> bool:
        """Whether the last register access was the same: the program waits in a loop."""
        last_slot, last_access = self._polled
        self._polled = (slot, self.accesses)
        return slot == last_slot and self.accesses == last_access + 1

    def wait_until(self, when: int) -> None:
        """Let a polling program skip to ``when``, or to the next event if that is earlier."""
        self.now = max(self.now, min(when, self.until))
        if self.now >= self.until:
            self.service()

    def change_clock(self, cycle: int) -> None:
        """Change the core clock or a peripheral divider; every counter goes on from its present count."""
        for peripheral in self._peripherals if self._ready else ():
            peripheral.clock_will_change()
        self.cycle = cycle
        self.access_ticks = _ACCESS_CYCLES * cycle
        for peripheral in self._peripherals if self._ready else ():
            peripheral.clock_changed()

    def run_until(self, ticks: int) -> None:
        """Run to a point of virtual time.

        Raises
        ------
        BoardFault
            When the firmware does what the processor can't do.
        """
        if self.sleeping:
            self.sleeping = False
            if not self.cpu.resume_sleep(ticks):
                return
        self.cpu.run(ticks)

    def run_for(self, seconds: float) -> None:
        """Run for a span of virtual time, s."""
        self.run_until(self.now + round(seconds * TICKS_PER_SECOND))

    # Resets

    def request_reset(self, cause: int) -> None:
        """Reset at the next instruction boundary."""
        self.reset_cause = cause
        self.alarm = -1

    def do_reset(self) -> None:
        """Carry out a requested reset."""
        if self.reset_cause is not None:
            self.system_control.power_cause(self.reset_cause)
        self.reset_cause = None
        self.resets += 1
        self._reset_all()

    def warn(self, text: str) -> None:
        """Record what the firmware should not do."""
        if text not in self.warnings:
            self.warnings.append(text)

    def press_reset(self) -> None:
        """Reset the processor by its pin; the sensors have no reset pin and keep their registers."""
        self.request_reset(EXTERNAL)

    def brown_out(self) -> None:
        """Supply voltage drops: processor, peripherals and sensors start again; unsent bytes are lost."""
        self.request_reset(BROWN_OUT)
        self.sleeping = False
        self._power_on_sensors()
        self.do_reset()

    def _power_on_sensors(self) -> None:
        for sensor in self.sensors:
            sensor.power_on()

    def read_chip(self, sensor: int, address: int) -> int:
        """Register of a sensor (from 0) as it stands, without the bus and without side effects."""
        return self.sensors[sensor].registers[address]

    def write_chip(self, sensor: int, address: int, value: int) -> None:
        """Write a register of a sensor (from 0) as a program that ran before would have done."""
        self.sensors[sensor].write_register(address, value, self.now)
        self.chip_pins.update()

    def set_line_fault(self, sensor: int, fault: LineFault) -> None:
        """Break or mend the line between a sensor (from 0) and the processor."""
        self.sensors[sensor].line_fault = fault

    def _reset_all(self) -> None:
        self._reset_peripherals()
        self.cpu.reset()
        if not self.resets:
            self.system_control.cause = POWER_ON

    def _reset_peripherals(self) -> None:
        for slot in range(len(self._events)):
            self._events[slot] = NEVER
        self.until = NEVER
        for peripheral in self._peripherals:
            peripheral.reset()
        for ssp in self.ssps:
            ssp.selected = None

    # Wiring

    def _pins_changed(self, port: int, changed: int, levels: int) -> None:
        """Chip-selects go to the sensors; the highest selected one answers."""
        if port != _SPI_SELECT_PORT:
            return
        sensors = self.sensors
        wired = (1 << len(sensors)) - 1
        changed &= wired
        while changed:
            bit = changed & -changed
            changed ^= bit
            sensor = sensors[bit.bit_length() - 1]
            if levels & bit:
                sensor.deselect(self.now)
                if sensor.signalling:
                    self.chip_pins.update()
            else:
                sensor.select(self.now)
        low = ~levels & wired
        self.ssps[1].selected = sensors[low.bit_length() - 1] if low else None

    def lose_interrupts(self, exception: int, every: int) -> None:
        """Fault: let one in so many requests of an interrupt get lost, as a glitch on its way would."""
        pend = self.nvic.pend
        count = 0

        def lossy(number: int) -> None:
            nonlocal count
            if number == exception:
                count += 1
                if count % every == 0:
                    self.nvic.lines &= ~(1 << number)
                    return
            pend(number)

        self.nvic.pend = lossy  # type: ignore[method-assign,assignment]

    def word(self, symbol: str) -> int:
        """Value of a 32-bit variable of the firmware."""
        return int.from_bytes(self.cpu.peek(self.image.symbols[symbol], 4), "little")
