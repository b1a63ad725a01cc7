"""UARTs: divisors, speed, FIFOs (UM10360 chapters 14 and 15)."""

from __future__ import annotations

from firmware_bridge.board.uart import Uart
from firmware_bridge.strict.findings import Rule, Severity
from firmware_bridge.strict.watch import Access, Watch

__all__ = ["READ_EMPTY", "WRITE_FULL", "UartWatch"]

DIVISOR = Rule(
    "uart_divisor",
    "with the fractional divider in use DLL is 3 or more while DLM is 0, MULVAL 1…15, DIVADDVAL less than MULVAL",
    "UM10360 14.4.12",
)
BAUD = Rule("uart_speed", "work out DLL, DLM and FDR from PCLK = CCLK over PCLKSELx", "UM10360 14.4.12.1")
DLAB = Rule("uart_dlab", "clear DLAB in LCR after the divisors are written", "UM10360 14.4.2, 14.4.7")
WORD = Rule("uart_word_length", "write 0x03 to LCR for 8 bits, no parity, one stop bit", "UM10360 14.4.7")
PARITY = Rule(
    "uart_parity",
    "write 0x03 to LCR for 8N1, if the other end is not set to parity as well",
    "UM10360 14.4.7",
    Severity.WARNING,
)
NO_FIFO = Rule(
    "uart_fifo_off", "set bit 0 of FCR: a UART without its FIFOs must not be used", "UM10360 14.4.6", Severity.WARNING
)
READ_EMPTY = Rule(
    "read_empty_fifo", "read only what has arrived: look at RDR in UnLSR, RNE in SSPnSR", "UM10360 14.4.8, 18.6.4"
)
WRITE_FULL = Rule(
    "write_full_fifo", "write only while there is room: look at THRE in UnLSR, TNF in SSPnSR", "UM10360 14.4.8, 18.6.4"
)

_DEPTH = 16
_DIVISOR_ACCESS, _PARITY = 0x80, 8
_DIVISOR_WRITES = 4  # a divisor is written once, or twice; data are written on and on
_RESET_DIVISOR = 1


class UartWatch(Watch):
    """Looks at the speed when a UART sends, and at its FIFOs."""

    peripherals = frozenset({"uart0", "uart1", "uart2", "uart3"})

    def reset(self) -> None:
        """Nothing sent."""
        self._judged: dict[int, tuple[int, int, int]] = {}
        self._used: set[int] = set()
        self._divisor_writes: dict[int, int] = {}
        self._emptied: dict[int, int] = {}

    def before(self, access: Access) -> None:
        """Look at the UART before the access changes it."""
        number, uart = next((n, one) for n, one in enumerate(self.board.uarts) if one.base == access.base)
        if uart.line_control & _DIVISOR_ACCESS:
            self._with_divisor_access(number, access)
        elif access.offset == 0 and access.write:
            self._send(number, uart, access.value & 0xFF)
        elif access.offset == 0 and not uart.receiver:
            self._read_empty(number)

    def _read_empty(self, number: int) -> None:
        """Judge a read of nothing; programs may empty a FIFO that they have not used yet."""
        if number not in self._used:
            self._emptied[number] = self._emptied.get(number, 0) + 1
        if number in self._used or self._emptied[number] > _DEPTH:
            self.report(READ_EMPTY, f"U{number}RBR is read, but nothing has arrived")

    def _with_divisor_access(self, number: int, access: Access) -> None:
        if access.offset == 0x0C:
            self._divisor_writes[number] = 0
        elif access.offset == 0 and access.write:
            self._divisor_writes[number] = count = self._divisor_writes.get(number, 0) + 1
            if count >= _DIVISOR_WRITES:
                self.report(DLAB, f"U{number}THR written with DLAB set: this is the divisor")
        elif access.offset == 0x14 and not access.write:
            self.report(DLAB, f"U{number}LSR is asked with DLAB set: no character can be sent or read")

    def _send(self, number: int, uart: Uart, byte: int) -> None:
        self._used.add(number)
        fifo = uart.fifo_control & 1
        if not fifo:
            self.report(NO_FIFO, f"U{number} sends with its FIFOs off")
        if uart.sent_end > self.board.now + (_DEPTH if fifo else 1) * uart.character:
            self.report(WRITE_FULL, f"U{number}THR is written, but its FIFO is full: the byte is lost")
        bits = 5 + (uart.line_control & 3)
        if byte >> bits:
            self.report(WORD, f"U{number} sends {byte:#04x} in {bits} bits")
        if uart.line_control & _PARITY:
            self.report(PARITY, f"U{number} sends with parity")
        setting = (uart.divisor, uart.fraction, uart.character)
        if self._judged.get(number) != setting:
            self._judged[number] = setting
            self._judge(number, uart)

    def _judge(self, number: int, uart: Uart) -> None:
        add, multiplier = uart.fraction & 15, uart.fraction >> 4
        if not multiplier or add >= multiplier:
            self.report(DIVISOR, f"U{number}FDR: DIVADDVAL = {add}, MULVAL = {multiplier}")
        elif add and uart.divisor < 3:
            self.report(DIVISOR, f"U{number}: DLL = {uart.divisor} with DIVADDVAL = {add}")
        if not uart.divisor:
            self.report(DIVISOR, f"U{number}: divisor 0")
        wanted = self.policy.baud or min(self.policy.speeds, key=lambda speed: abs(uart.baud / speed - 1.0))
        error = uart.baud / wanted - 1.0
        if abs(error) > self.policy.baud_error:
            untouched = " (divisors as after reset)" if uart.divisor == _RESET_DIVISOR else ""
            name = "wanted" if self.policy.baud else "the nearest standard speed"
            self.report(BAUD, f"U{number} sends at {uart.baud:.0f} baud{untouched}, {error:+.1%} from {name}, {wanted}")
