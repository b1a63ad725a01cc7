"""The inside of one ADXL345: conversions, FIFO, interrupts, registers (data sheet Rev. E).

Time is an integer number of ticks of the board (`TICKS_PER_SECOND`). The analogue side is not here: a conversion
source returns what each conversion yields, before range, resolution and justification, which the chip applies when a
register is read. The same chip exists in C for the fast path (``board/native/board.c``); both do integer arithmetic
only and agree bit by bit.
"""

from __future__ import annotations

from firmware_bridge.adxl345.conversion import ConversionSource, Readings, format_count, output_period, wake_up_period
from firmware_bridge.adxl345.events import Events
from firmware_bridge.adxl345.registers import (
    ACT_TAP_STATUS,
    ASLEEP,
    AUTO_SLEEP,
    BW_RATE,
    BYPASS,
    DATA_FORMAT,
    DATA_READY,
    DATAX0,
    DATAZ1,
    DEVICE_ID,
    EVENTS,
    FIFO,
    FIFO_CTL,
    FIFO_STATUS,
    INT_ENABLE,
    INT_INVERT,
    INT_MAP,
    INT_SOURCE,
    LINK,
    MEASURE,
    OFSX,
    OVERRUN,
    POWER_CTL,
    RAW_PER_COUNT,
    SELF_TEST,
    SLEEP,
    THREE_WIRE,
    TICKS_PER_SECOND,
    TRIGGER,
    UNDECIMATED,
    WATERMARK,
    WRITABLE,
    Adxl345Options,
    LineFault,
)

__all__ = ["NO_AXIS", "ChipCore"]

_FIFO_DEPTH = 32  # and one more entry at the output filter
_RAW_PER_OFFSET_STEP = 4 * RAW_PER_COUNT  # OFSx: 15.6 mg = 4 counts of 3.9 mg, in every range
_POP_TICKS = 5 * TICKS_PER_SECOND // 1_000_000
_TURN_ON_TICKS = 11 * TICKS_PER_SECOND // 10_000  # τ + 1.1 ms from standby to the first sample
NO_AXIS = 99  # no value is being read
_NEVER = 1 << 62


class ChipCore:
    """One ADXL345 without its bus.

    Parameters
    ----------
    source : callable
        Where the conversions come from.
    options : Adxl345Options
        Clock, self-test, wiring.
    """

    def __init__(self, source: ConversionSource, options: Adxl345Options | None = None) -> None:
        self.line_fault = LineFault.NONE
        self.source = source
        self.options = options or Adxl345Options()
        shift = self.options.self_test_counts
        self.self_test_raw = tuple(round(counts * RAW_PER_COUNT) for counts in shift)
        self.power_on()

    def power_on(self) -> None:
        """Return to the state after power-on: standby, registers at their reset values."""
        self.registers = bytearray(64)
        self.registers[0] = DEVICE_ID
        self.registers[BW_RATE] = 0x0A
        self.events = 0
        self.fifo: list[tuple[int, int, int]] = []
        self.next_conversion: int | None = None
        self.next_undecimated = _NEVER
        self.asleep = False
        self.signalling = True
        self._stepwise = False
        self.triggered = False
        self._data_ready = False
        self._overrun = False
        self._out = (0, 0, 0)
        self._word_axis = NO_AXIS
        self._word = 0
        self._deaf_host = self.options.wires == 3
        self._shown = 0
        self._pop_done = 0
        self._output = Readings()
        self._undecimated = Readings()
        self._undecimated_period = output_period(UNDECIMATED, self.options.clock_error)
        self._sensing = Events(self.registers, round(TICKS_PER_SECOND / (1.0 + self.options.clock_error)))
        self._selected = False
        self._command: int | None = None
        self._address = 0
        self._reading = False
        self._period = self._sample_period()
        self._set_added()

    # Conversions

    def _sample_period(self) -> int:
        """Ticks between two conversions at the present rate, by the chip's own clock."""
        if self.asleep or self.registers[POWER_CTL] & SLEEP:
            return wake_up_period(self.registers[POWER_CTL], self.options.clock_error)
        return output_period(self.registers[BW_RATE], self.options.clock_error)

    def _restart(self, start: int) -> None:
        """Begin converting, or stop, after a change of rate or power mode."""
        self._period = self._sample_period()
        self._output.restart()
        measuring = self.registers[POWER_CTL] & MEASURE
        early = round(self._period * self.options.phase)
        self.next_conversion = start + self._period - early if measuring else None

    def _conversion(self, skip: int) -> tuple[int, int, int]:
        """Yield the conversion ``skip`` places ahead; ``next_conversion`` is still the first of them."""
        assert self.next_conversion is not None
        x, y, z = self._output.take(self.source, self.next_conversion, self._period, self.registers[BW_RATE], skip)
        added = self._added
        return x + added[0], y + added[1], z + added[2]

    def _set_added(self) -> None:
        """Work out what the offset registers and the self-test add to a raw conversion."""
        offsets = self.registers[OFSX : OFSX + 3]
        shift = self.self_test_raw if self.registers[DATA_FORMAT] & SELF_TEST else (0, 0, 0)
        self._added = [_signed(byte) * _RAW_PER_OFFSET_STEP + by for byte, by in zip(offsets, shift, strict=True)]

    def catch_up(self, now: int) -> None:
        """Do the conversions that are due by ``now``."""
        if self._stepwise:
            self._catch_up_stepwise(now)
            return
        if self.next_conversion is None or now < self.next_conversion:
            return
        due = (now - self.next_conversion) // self._period + 1
        mode = self.registers[FIFO_CTL] >> 6
        if mode == BYPASS:
            self._overrun |= self._data_ready or due > 1
            self._out = self._conversion(due - 1)
            self._data_ready = True
            self.next_conversion += due * self._period
            return
        if due == 1 and not self.fifo:  # the most frequent case
            self.fifo.append(self._conversion(0))
            self.next_conversion += self._period
            return
        filling = mode == FIFO or (mode == TRIGGER and self.triggered)
        # Conversions that leave no trace: those that find a full FIFO, or those that newer ones push out.
        stored = min(due, _FIFO_DEPTH + 1)
        skip = 0 if filling else due - stored
        for index in range(stored):
            ahead = skip if index == 0 else 0
            sample = self._conversion(ahead)
            self.next_conversion += (ahead + 1) * self._period
            self._store(sample, mode)
        if filling and due > stored:
            self._output.place += due - stored
            self.next_conversion += (due - stored) * self._period
            self._overrun = True

    def _catch_up_stepwise(self, now: int) -> None:
        """Do the conversions that are due one by one: sensing logic works, or the chip sleeps."""
        sensing = self._sensing
        while self.next_conversion is not None:
            at = min(self.next_conversion, self.next_undecimated)
            if at > now:
                return
            if self.next_undecimated == at:
                self.next_undecimated += self._undecimated_period
                code = self.registers[BW_RATE] | UNDECIMATED
                reading = self._undecimated.take(self.source, at, self._undecimated_period, code)
                self._raise(sensing.undecimated([value + by for value, by in zip(reading, self._added, strict=True)]))
                continue
            sample = self._conversion(0)
            self.next_conversion += self._period
            if self.asleep or self.registers[POWER_CTL] & SLEEP:
                self._out = sample  # without DATA_READY, and nothing into the FIFO
                found = sensing.activity(sample)
                self._raise(found)
                if found and self.asleep:
                    self._set_asleep(asleep=False, now=at)
            else:
                self._take(sample)
                found = sensing.inactivity(sample, at)
                self._raise(found)
                both = LINK | AUTO_SLEEP
                if found and self.registers[POWER_CTL] & both == both:
                    self._set_asleep(asleep=True, now=at)

    def _take(self, sample: tuple[int, int, int]) -> None:
        """Hand one conversion of the output data to the registers or to the FIFO."""
        mode = self.registers[FIFO_CTL] >> 6
        if mode == BYPASS:
            self._overrun |= self._data_ready
            self._out = sample
            self._data_ready = True
        else:
            self._store(sample, mode)

    def _set_asleep(self, *, asleep: bool, now: int) -> None:
        """Fall asleep, or wake up, by inactivity and activity."""
        self.asleep = asleep
        status = self.registers[ACT_TAP_STATUS] & ~ASLEEP
        self.registers[ACT_TAP_STATUS] = status | (ASLEEP if asleep else 0)
        self._restart(now)
        self._configure_sensing(now)

    def _configure_sensing(self, now: int) -> None:
        """Start and stop what the registers ask the sensing logic for."""
        sensing = self._sensing
        sensing.configure()
        sleeps = self.asleep or self.registers[POWER_CTL] & SLEEP
        undecimated = sensing.tap_on or sensing.free_fall_on or sensing.activity_on
        if self.next_conversion is None or sleeps or not undecimated:
            self.next_undecimated = _NEVER
        elif self.next_undecimated >= _NEVER:
            self._undecimated.restart()
            self.next_undecimated = max(now, self.next_conversion - self._period) + self._undecimated_period
        self._stepwise = bool(undecimated or sensing.inactivity_on or sleeps)

    def _store(self, sample: tuple[int, int, int], mode: int) -> None:
        """Put one sample into the FIFO."""
        holds = _FIFO_DEPTH + 1
        if mode == TRIGGER and not self.triggered:
            holds = max(1, self.registers[FIFO_CTL] & 31)  # keeps the last n samples until the trigger comes
        if len(self.fifo) >= holds:
            if mode == FIFO or (mode == TRIGGER and self.triggered):
                self._overrun = True
                return
            del self.fifo[0]
        self.fifo.append(sample)
        if len(self.fifo) >= _FIFO_DEPTH:
            self._overrun = True  # outside bypass mode: set when the FIFO is filled

    # Interrupts

    def _raise(self, events: int) -> None:
        events &= self.registers[INT_ENABLE] & EVENTS
        if not events:
            return
        self.events |= events
        pin = self.registers[FIFO_CTL] >> 5 & 1
        on_pin = events & (self.registers[INT_MAP] if pin else ~self.registers[INT_MAP])
        if self.registers[FIFO_CTL] >> 6 == TRIGGER and on_pin and not self.triggered:
            self.triggered = True
            keep = self.registers[FIFO_CTL] & 31
            self.fifo = self.fifo[-keep:] if keep else []

    def _int_source(self) -> int:
        source = self.events
        if self.fifo if self.registers[FIFO_CTL] >> 6 else self._data_ready:
            source |= DATA_READY
        if len(self.fifo) >= self.registers[FIFO_CTL] & 31:
            source |= WATERMARK
        return source | (OVERRUN if self._overrun else 0)

    def interrupt_pin(self, number: int, now: int) -> bool:
        """Level of pin INT1 or INT2 at ``now``."""
        self.catch_up(now)
        mapped = self.registers[INT_MAP] if number == 2 else ~self.registers[INT_MAP]
        active = bool(self._int_source() & self.registers[INT_ENABLE] & mapped)
        return active != bool(self.registers[DATA_FORMAT] & INT_INVERT)

    @property
    def signals(self) -> bool:
        """Whether any interrupt output is enabled."""
        return self.registers[INT_ENABLE] != 0

    @property
    def next_change(self) -> int:
        """Tick of the next conversion, which may change an interrupt pin."""
        return (
            self.next_undecimated if self.next_conversion is None else min(self.next_conversion, self.next_undecimated)
        )

    # Registers

    def _read(self, address: int, now: int) -> int:
        if DATAX0 <= address <= DATAZ1:
            self._reading = True
            stuck = self.options.stuck_range
            data_format = self.registers[DATA_FORMAT] if stuck is None else stuck
            axis = (address - DATAX0) >> 1
            if axis != self._word_axis:  # both bytes of a value are of one reading
                self._word_axis = axis
                self._word = format_count(self._out[axis], data_format, self.registers[BW_RATE])
            return self._word >> 8 if address & 1 else self._word & 0xFF
        if self._reading and address == DATAZ1 + 1:
            self._end_of_read(now)
        if address == INT_SOURCE:
            value = self._int_source()
            self.events = 0
            return value
        if address == FIFO_STATUS:
            entries = self._shown if now < self._pop_done else min(len(self.fifo), _FIFO_DEPTH)
            return entries | (0x80 if self.triggered else 0)
        return self.registers[address]

    def _show(self, now: int) -> None:
        """Move the oldest FIFO entry to the data registers, once the last pop is complete (5 µs)."""
        if self.registers[FIFO_CTL] >> 6 and self.fifo and now >= self._pop_done:
            self._out = self.fifo[0]

    def _end_of_read(self, now: int) -> None:
        """Pop the FIFO and clear the flags, at the step from 0x37 to 0x38 or when CS goes high."""
        self._reading = False
        self._overrun = False
        if self.registers[FIFO_CTL] >> 6 == BYPASS:
            self._data_ready = False
        elif self.fifo:
            self._shown = min(len(self.fifo), _FIFO_DEPTH)
            del self.fifo[0]
            self._pop_done = now + _POP_TICKS

    def _write(self, address: int, value: int, now: int) -> None:
        if address not in WRITABLE:
            return
        old = self.registers[address]
        self.registers[address] = value
        self._set_added()
        if address == BW_RATE:
            self._restart(now)
        elif address == POWER_CTL:
            self._write_power(old, value, now)
        elif address == DATA_FORMAT:
            # A chip in 3-wire mode on four wires, or the other way round, drives a line the host does not listen to.
            self._deaf_host = bool(value & THREE_WIRE) != (self.options.wires == 3)
        elif address == FIFO_CTL and value >> 6 != old >> 6:
            if value >> 6 == BYPASS:
                self.fifo.clear()
                self._data_ready = self._overrun = False
            self.triggered = False
        if value != old:
            self.signalling = True
            self._configure_sensing(now)

    def _write_power(self, old: int, value: int, now: int) -> None:
        waking = value & MEASURE and not old & MEASURE
        if waking or (old ^ value) & LINK:
            self._sensing.restart()
        both = LINK | AUTO_SLEEP | MEASURE
        was_asleep = self.asleep
        if was_asleep and value & both != both:
            self.asleep = False
            self.registers[ACT_TAP_STATUS] &= ~ASLEEP
        if (old ^ value) & (MEASURE | SLEEP | 3) or was_asleep != self.asleep:
            self._restart(now + _TURN_ON_TICKS if waking else now)

    def write_register(self, address: int, value: int, now: int) -> None:
        """Write a register at ``now`` without a bus."""
        self.catch_up(now)
        self._write(address, value, now)


def _signed(byte: int) -> int:
    return byte - 256 if byte > 127 else byte
