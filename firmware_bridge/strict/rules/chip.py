"""What an ADXL345 on SSP1 asks of its host (data sheet Rev. E); nothing is judged while no chip is selected."""

from __future__ import annotations

from firmware_bridge.adxl345.device import Adxl345
from firmware_bridge.adxl345.registers import TICKS_PER_SECOND
from firmware_bridge.board.ssp import Ssp
from firmware_bridge.strict.findings import Rule, Severity
from firmware_bridge.strict.rules.ssp import words_received
from firmware_bridge.strict.watch import Access, Watch

__all__ = ["ChipWatch"]

_SHEET = "ADXL345 data sheet Rev. E"
FAST = Rule("spi_too_fast", "keep the SPI clock at 5 MHz or less: PCLK / (CPSDVSR · (SCR + 1))", f"{_SHEET}, table 9")
MODE = Rule(
    "spi_mode", "set CPOL and CPHA (mode 3), SPI frame format, master, no loop-back", f"{_SHEET}, Serial communications"
)
SIZE = Rule("spi_frame_size", "exchange whole bytes: 8 or 16 bits per word", f"{_SHEET}, figures 36 to 39")
TWO = Rule("two_chips_selected", "set every other CS high before one goes low", f"{_SHEET}, Serial communications")
CUT = Rule("deselected_while_busy", "wait until BSY in SSPnSR is clear before CS goes high", "UM10360 18.6.4")
STALE = Rule(
    "stale_receive_fifo", "read a word for every word that was written before the next exchange", "UM10360 18.6.3"
)
NOBODY = Rule(
    "no_chip_selected",
    "set one CS low before the first word, if the words are for a chip",
    f"{_SHEET}, Serial communications",
    Severity.WARNING,
)
REST = Rule("chip_select_rest", "keep CS high for 150 ns between two accesses", f"{_SHEET}, table 10 (tCS,DIS)")
MULTIPLE = Rule("chip_multiple_bit", "set bit 6 of the command to access several registers", f"{_SHEET}, figure 37")
STANDBY = Rule("chip_standby", "set the measure bit of POWER_CTL before data are read", f"{_SHEET}, register 0x2D")
TORN = Rule(
    "torn_sample",
    "read the six data bytes in one burst: the next sample may come between two",
    f"{_SHEET}, registers 0x32 to 0x37",
    Severity.WARNING,
)
SLOW = Rule(
    "spi_too_slow",
    "3200 and 1600 Hz want 2 MHz or more, 800 Hz 400 kHz, lower rates in proportion",
    f"{_SHEET}, Serial communications",
    Severity.WARNING,
)
POP = Rule(
    "chip_fifo_rest", "leave 5 µs between the end of a read from the FIFO and the data of the next", f"{_SHEET}, FIFO"
)
REGISTER = Rule("chip_register", "write the registers 0x1D…0x2A, 0x2C…0x2F, 0x31 and 0x38 only", f"{_SHEET}, table 19")

_CS_PORT = 2
_SPI_MAX_HZ, _TOLERANCE = 5e6, 1e-3
_MODE_3, _FRAME_FORMAT, _SLAVE, _LOOP_BACK = 0xC0, 0x30, 4, 1
_REST_TICKS = 150 * TICKS_PER_SECOND // 1_000_000_000
_POP_TICKS = 5 * TICKS_PER_SECOND // 1_000_000
_READ, _MULTIPLE, _ADDRESS = 0x80, 0x40, 0x3F
_BW_RATE, _POWER_CTL, _FIFO_CTL, _MEASURE = 0x2C, 0x2D, 0x38, 0x08
_DATA = range(0x32, 0x38)
_WRITABLE = frozenset([*range(0x1D, 0x2B), *range(0x2C, 0x30), 0x31, _FIFO_CTL])
_SPI_HZ_AT_800 = 400e3
_CODE_800_HZ, _CODE_1600_HZ = 13, 14
_FAST_RATES_SPI_HZ = 2e6


class ChipWatch(Watch):
    """Follows the chip-selects and the words between them."""

    peripherals = frozenset({"gpio", "ssp1"})

    def reset(self) -> None:
        """No chip selected."""
        self._low = 0
        self._sent = bytearray()
        self._selected_at: dict[int, int] = {}
        self._deselected: dict[int, int] = {}
        self._popped: dict[int, int] = {}

    @property
    def _ssp(self) -> Ssp:
        return self.board.ssps[1]

    def before(self, access: Access) -> None:
        """Look at a word for the selected chip."""
        if access.base != self._ssp.base or access.offset != 0x08 or not access.write:
            return
        if self._low:
            self._word(access.value & 0xFFFF)
        elif self.board.gpio.direction[_CS_PORT] & ((1 << len(self.board.sensors)) - 1):
            self.report(NOBODY, "words are sent on SSP1, but no CS is low")

    def _word(self, value: int) -> None:
        ssp = self._ssp
        if self._low & (self._low - 1):
            chips = [str(index + 1) for index in range(len(self.board.sensors)) if self._low >> index & 1]
            self.report(TWO, f"chips {' and '.join(chips)} are selected at once")
        hz = TICKS_PER_SECOND / ssp.bit
        if hz > _SPI_MAX_HZ * (1.0 + _TOLERANCE):
            self.report(FAST, f"SPI clock {hz / 1e6:g} MHz")
        mode = (ssp.control0 >> 6 & 1) * 2 + (ssp.control0 >> 7 & 1)
        if ssp.control0 & _FRAME_FORMAT:
            self.report(MODE, "SSP1CR0 selects another frame format than SPI")
        elif mode != 3:
            self.report(MODE, f"SPI mode {mode}")
        if ssp.control1 & _SLAVE:
            self.report(MODE, "SSP1 is a slave")
        if ssp.control1 & _LOOP_BACK:
            self.report(MODE, "SSP1 reads what it sends itself (loop-back)")
        if ssp.bits == 16:
            self._sent += bytes((value >> 8, value & 0xFF))
        elif ssp.bits == 8:
            self._sent.append(value & 0xFF)
        else:
            self.report(SIZE, f"words of {ssp.bits} bits")

    def after(self, access: Access) -> None:
        """Look at the chip-selects that a write has moved."""
        if access.base != self.board.gpio.base or not access.write or access.offset >> 5 != _CS_PORT:
            return
        low = ~self.board.gpio.levels[_CS_PORT] & ((1 << len(self.board.sensors)) - 1)
        for index, sensor in enumerate(self.board.sensors):
            bit = 1 << index
            if low & bit and not self._low & bit:
                self._selected(index)
            elif self._low & bit and not low & bit:
                self._ended(index, sensor)
        self._low = low

    def _selected(self, number: int) -> None:
        rest = self.board.now - self._deselected.get(number, -_REST_TICKS)
        if rest < _REST_TICKS:
            self.report(REST, f"chip {number + 1}: CS high for {rest * 1e9 / TICKS_PER_SECOND:.0f} ns")
        if count := words_received(self._ssp):
            self.report(STALE, f"chip {number + 1} is selected with {count} words of before in the receive FIFO")
        self._selected_at[number] = self.board.now
        self._sent.clear()

    def _ended(self, number: int, sensor: Adxl345) -> None:
        now = self.board.now
        self._deselected[number] = now
        if self._ssp.done > now:
            self.report(CUT, f"CS of chip {number + 1} goes high while a word is shifted")
        sent = bytes(self._sent)
        self._sent.clear()
        if len(sent) == 1:
            self.report(SIZE, f"chip {number + 1}: CS goes high after 8 clocks; an access takes 16 or more")
        if len(sent) < 2:
            return
        command, count = sent[0], len(sent) - 1
        first = command & _ADDRESS
        if count > 1 and not command & _MULTIPLE:
            self.report(MULTIPLE, f"chip {number + 1}: {count} bytes at register {first:#04x}, all for one register")
            count = 1
        touched = range(first, first + count)
        if not command & _READ:
            for address in touched:
                if address not in _WRITABLE:
                    self.report(REGISTER, f"chip {number + 1}: write to register {address:#04x}")
        elif any(address in _DATA for address in touched):
            self._data_read(number, sensor, touched)

    def _data_read(self, number: int, sensor: Adxl345, touched: range) -> None:
        chip, now = f"chip {number + 1}", self.board.now
        if not sensor.registers[_POWER_CTL] & _MEASURE:
            self.report(STANDBY, f"{chip}: data are read in standby")
        if not all(address in touched for address in _DATA):
            self.report(TORN, f"{chip}: data registers {touched.start:#04x}…{touched.stop - 1:#04x} of 0x32…0x37 read")
        code = sensor.registers[_BW_RATE] & 15
        least = _FAST_RATES_SPI_HZ if code >= _CODE_1600_HZ else _SPI_HZ_AT_800 * 2.0 ** (code - _CODE_800_HZ)
        hz = TICKS_PER_SECOND / self._ssp.bit
        if hz < least * (1.0 - _TOLERANCE):
            self.report(SLOW, f"{chip}: SPI clock {hz / 1e3:g} kHz at rate code {code}")
        begun = self._selected_at.get(number, 0) + 8 * self._ssp.bit  # the command takes its time, too
        if sensor.registers[_FIFO_CTL] >> 6 and begun - self._popped.get(number, -_POP_TICKS) < _POP_TICKS:
            self.report(POP, f"{chip}: the FIFO is read again within 5 µs")
        self._popped[number] = now
