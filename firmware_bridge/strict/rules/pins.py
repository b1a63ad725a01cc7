"""Power, pin functions and GPIO (UM10360 chapters 4, 8 and 9)."""

from __future__ import annotations

from firmware_bridge.strict.findings import Rule, Severity
from firmware_bridge.strict.registers import register_name
from firmware_bridge.strict.watch import Access, Watch

__all__ = ["GpioWatch", "PinWatch", "PowerWatch", "pin_function"]

UNPOWERED = Rule(
    "peripheral_unpowered",
    "set the peripheral's bit in PCONP before its registers are used; without it accesses hang or are lost",
    "UM10360 4.8.9",
)
PIN = Rule("pin_not_selected", "select the peripheral's function for the pin in PINSELx", "UM10360 8.5")
PIN_INPUT = Rule(
    "input_pin_not_selected",
    "select the peripheral's function for the pin in PINSELx, or do not use the input",
    "UM10360 8.5",
    Severity.WARNING,
)
NOT_OUTPUT = Rule(
    "gpio_not_output", "set the pin's bit in FIOxDIR: writes to an input's latch move nothing", "UM10360 9.5.1"
)
OTHER_FUNCTION = Rule(
    "gpio_other_function", "select function 0 (GPIO) for the pin in PINSELx", "UM10360 8.5", Severity.WARNING
)

_POWER_BITS = {
    0x40004000: 1, 0x40008000: 2, 0x4000C000: 3, 0x40010000: 4, 0x40018000: 6, 0x4001C000: 7, 0x40020000: 8,
    0x40024000: 9, 0x40030000: 10, 0x40034000: 12, 0x2009C000: 15, 0x40028000: 15, 0x400B0000: 16, 0x400B8000: 17,
    0x400BC000: 18, 0x4005C000: 19, 0x40088000: 21, 0x40090000: 22, 0x40094000: 23, 0x40098000: 24, 0x4009C000: 25,
    0x400A0000: 26, 0x400A8000: 27, 0x50000000: 30,
    0x50004000: 29, 0x5000C000: 31, 0x40044000: 13, 0x40048000: 14,
}  # fmt: skip
"""Bits of PCONP, by base address (UM10360 table 46)."""
_SLOT = 0x3FFF  # each peripheral has 16 KiB of addresses

Pin = tuple[int, int, int]
"""Port, pin, function."""

_OUTPUTS: dict[str, tuple[str, tuple[Pin, ...]]] = {
    "uart0": ("TXD0", ((0, 2, 1),)),
    "uart1": ("TXD1", ((0, 15, 1), (2, 0, 2))),
    "uart2": ("TXD2", ((0, 10, 1), (2, 8, 2))),
    "uart3": ("TXD3", ((0, 0, 2), (0, 25, 3), (4, 28, 3))),
}
_INPUTS: dict[str, tuple[str, tuple[Pin, ...]]] = {
    "uart0": ("RXD0", ((0, 3, 1),)),
    "uart1": ("RXD1", ((0, 16, 1), (2, 1, 2))),
    "uart2": ("RXD2", ((0, 11, 1), (2, 9, 2))),
    "uart3": ("RXD3", ((0, 1, 2), (0, 26, 3), (4, 29, 3))),
}
_SERIAL: dict[str, tuple[tuple[str, tuple[Pin, ...]], ...]] = {
    "ssp0": (("SCK0", ((0, 15, 2), (1, 20, 3))), ("MOSI0", ((0, 18, 2), (1, 24, 3)))),
    "ssp1": (("SCK1", ((0, 7, 2), (1, 31, 2))), ("MOSI1", ((0, 9, 2),))),
}
_SERIAL_INPUTS = {"ssp0": ("MISO0", ((0, 17, 2), (1, 23, 3))), "ssp1": ("MISO1", ((0, 8, 2),))}
_BUSES = {
    "i2c0": (("SDA0", ((0, 27, 1),)), ("SCL0", ((0, 28, 1),))),
    "i2c1": (("SDA1", ((0, 0, 3), (0, 19, 3))), ("SCL1", ((0, 1, 3), (0, 20, 3)))),
    "i2c2": (("SDA2", ((0, 10, 2),)), ("SCL2", ((0, 11, 2),))),
}
_NAMES = {
    0x4000C000: "uart0", 0x40010000: "uart1", 0x40098000: "uart2", 0x4009C000: "uart3", 0x40088000: "ssp0",
    0x40030000: "ssp1", 0x4001C000: "i2c0", 0x4005C000: "i2c1", 0x400A0000: "i2c2",
}  # fmt: skip
_I2C_START, _LOOP_BACK, _DIVISOR_ACCESS, _RECEIVE_INTERRUPT = 0x20, 1, 0x80, 1
_TOGGLES = 3  # a latch may be set before the direction, and again at a second start; that often means it should move


def pin_function(pincon: dict[int, int], port: int, pin: int) -> int:
    """Return the function of a pin, 0…3, from the registers of the pin connect block by offset."""
    return pincon.get(4 * (2 * port + pin // 16), 0) >> 2 * (pin % 16) & 3


class PowerWatch(Watch):
    """Looks for accesses to peripherals without power."""

    def before(self, access: Access) -> None:
        """Look at the peripheral's bit."""
        bit = _POWER_BITS.get(access.address & ~_SLOT)
        if bit is not None and not self.board.system_control.registers.get(0x0C4, 0) >> bit & 1:
            self.report(UNPOWERED, f"{register_name(access.base, access.offset)} with PCONP bit {bit} clear")


class PinWatch(Watch):
    """Looks, when a peripheral sends or receives, whether its pins are its own."""

    peripherals = frozenset({"pincon", *_NAMES.values()})

    def reset(self) -> None:
        """All pins are GPIO."""
        self.pincon: dict[int, int] = {}
        self._good: set[str] = set()

    def after(self, access: Access) -> None:
        """Keep what is written to the pin connect block."""
        if access.write and access.base == 0x4002C000:
            self.pincon[access.offset] = access.value
            self._good.clear()

    def before(self, access: Access) -> None:
        """Look at the pins of a peripheral that is put to use."""
        name = _NAMES.get(access.base)
        if name is None:
            return
        number, first = int(name[-1]), access.offset == 0
        if name.startswith("uart"):
            divisor = self.board.uarts[number].line_control & _DIVISOR_ACCESS
            if access.write and first and not divisor:
                self._need(PIN, *_OUTPUTS[name])
            elif access.write and access.offset == 4 and not divisor and access.value & _RECEIVE_INTERRUPT:
                self._need(PIN_INPUT, *_INPUTS[name])
        elif name.startswith("ssp"):
            ssp = self.board.ssps[number]
            if access.write and access.offset == 8 and not ssp.control1 & _LOOP_BACK:
                for signal, pins in _SERIAL[name]:
                    self._need(PIN, signal, pins)
                # A chip that answers is a chip that is meant to be read.
                self._need(PIN if ssp.selected is not None else PIN_INPUT, *_SERIAL_INPUTS[name])
        elif access.write and first and access.value & _I2C_START:
            for signal, pins in _BUSES[name]:
                self._need(PIN, signal, pins)

    def _need(self, rule: Rule, signal: str, pins: tuple[Pin, ...]) -> None:
        if signal in self._good:
            return
        if any(pin_function(self.pincon, port, pin) == function for port, pin, function in pins):
            self._good.add(signal)
            return
        choices = " or ".join(f"P{port}.{pin} function {function}" for port, pin, function in pins)
        self.report(rule, f"{signal} is used, but {choices} is not selected")


class GpioWatch(Watch):
    """Looks for pins that are moved but can't move."""

    peripherals = frozenset({"gpio", "pincon"})

    def reset(self) -> None:
        """No latch was written."""
        self._pincon: dict[int, int] = {}
        self._latch = [0] * 5
        self._toggles: dict[tuple[int, int], int] = {}

    def after(self, access: Access) -> None:
        """Look at the pins that a write sets or clears."""
        if not access.write:
            return
        if access.base == 0x4002C000:
            self._pincon[access.offset] = access.value
            return
        port = access.offset >> 5
        if port >= len(self._latch):
            return
        latch = self.board.gpio.latch[port]
        changed, self._latch[port] = latch ^ self._latch[port], latch
        if access.offset & 0x1C in {0x18, 0x1C}:  # FIOxSET, FIOxCLR: single pins are meant
            for pin in range(32):
                if changed >> pin & 1:
                    self._moved(port, pin)

    def _moved(self, port: int, pin: int) -> None:
        if not self.board.gpio.direction[port] >> pin & 1:
            count = self._toggles[port, pin] = self._toggles.get((port, pin), 0) + 1
            if count >= _TOGGLES:
                self.report(NOT_OUTPUT, f"P{port}.{pin} is set and cleared, but it is an input")
        elif function := pin_function(self._pincon, port, pin):
            self.report(OTHER_FUNCTION, f"P{port}.{pin} is moved as GPIO, but function {function} is selected")
