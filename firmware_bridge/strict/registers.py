"""Names and places of the LPC1768's registers (UM10360, the register tables of each chapter)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

__all__ = ["is_register", "register_name"]


def _run(names: str, first: int, step: int = 4) -> dict[int, str]:
    return {first + step * k: name for k, name in enumerate(names.split())}


_UART = {0x00: "RBR/THR", 0x04: "IER", 0x08: "IIR/FCR", 0x0C: "LCR", 0x10: "MCR", 0x14: "LSR", 0x18: "MSR",
         0x1C: "SCR", 0x20: "ACR", 0x24: "ICR", 0x28: "FDR", 0x30: "TER", 0x4C: "RS485CTRL", 0x50: "ADRMATCH",
         0x54: "RS485DLY", 0x58: "FIFOLVL"}  # fmt: skip
_SSP = _run("CR0 CR1 DR SR CPSR IMSC RIS MIS ICR DMACR", 0x00)
_TIMER = {**_run("IR TCR TC PR PC MCR MR0 MR1 MR2 MR3 CCR CR0 CR1", 0x00), 0x3C: "EMR", 0x70: "CTCR"}
_I2C = _run("CONSET STAT DAT ADR0 SCLH SCLL CONCLR MMCTRL ADR1 ADR2 ADR3 DATA_BUFFER MASK0 MASK1 MASK2 MASK3", 0x00)
_SYSCON = {
    0x000: "FLASHCFG", **_run("PLL0CON PLL0CFG PLL0STAT PLL0FEED", 0x080),
    **_run("PLL1CON PLL1CFG PLL1STAT PLL1FEED", 0x0A0),
    **_run("PCON PCONP", 0x0C0), **_run("CCLKCFG USBCLKCFG CLKSRCSEL CANSLEEPCLR CANWAKEFLAGS", 0x104),
    0x140: "EXTINT", 0x148: "EXTMODE", 0x14C: "EXTPOLAR", 0x180: "RSID", 0x1A0: "SCS", 0x1A4: "IRCTRIM",
    **_run("PCLKSEL0 PCLKSEL1", 0x1A8), 0x1C0: "USBIntSt", 0x1C4: "DMAREQSEL", 0x1C8: "CLKOUTCFG",
}  # fmt: skip
_PINCON = {
    **{4 * k: f"PINSEL{k}" for k in range(11)},
    **{0x40 + 4 * k: f"PINMODE{k}" for k in range(10)},
    **{0x68 + 4 * k: f"PINMODE_OD{k}" for k in range(5)},
    0x7C: "I2CPADCFG",
}
_GPIO = {
    32 * port + place: f"FIO{port}{name}"
    for port in range(5)
    for place, name in ((0x00, "DIR"), (0x10, "MASK"), (0x14, "PIN"), (0x18, "SET"), (0x1C, "CLR"))
}
_GPIO_INTERRUPTS = {
    0x80: "IOIntStatus",
    **_run("IO0IntStatR IO0IntStatF IO0IntClr IO0IntEnR IO0IntEnF", 0x84),
    **_run("IO2IntStatR IO2IntStatF IO2IntClr IO2IntEnR IO2IntEnF", 0xA4),
}
_WATCHDOG = _run("WDMOD WDTC WDFEED WDTV WDCLKSEL", 0x00)


def _numbered(
    name: str, registers: Mapping[int, str], bases: Iterable[int]
) -> dict[int, tuple[str, Mapping[int, str]]]:
    return {base: (f"{name}{index}", registers) for index, base in enumerate(bases)}


_BLOCKS: dict[int, tuple[str, Mapping[int, str]]] = {
    0x400FC000: ("", _SYSCON),
    0x4002C000: ("", _PINCON),
    0x2009C000: ("", _GPIO),
    0x40028000: ("", _GPIO_INTERRUPTS),
    0x40000000: ("", _WATCHDOG),
    **_numbered("U", _UART, (0x4000C000, 0x40010000, 0x40098000, 0x4009C000)),
    **_numbered("SSP", _SSP, (0x40088000, 0x40030000)),
    **_numbered("T", _TIMER, (0x40004000, 0x40008000, 0x40090000, 0x40094000)),
    **_numbered("I2C", _I2C, (0x4001C000, 0x4005C000, 0x400A0000)),
}
"""Peripherals whose register tables are complete here, by base address."""


def is_register(base: int, offset: int) -> bool:
    """Whether the manual has a register there; True for peripherals without a table."""
    return base not in _BLOCKS or offset & ~3 in _BLOCKS[base][1]


def register_name(base: int, offset: int) -> str:
    """Name of a register as in the manual, or its address."""
    prefix, registers = _BLOCKS.get(base, ("", {}))
    name = registers.get(offset & ~3)
    return f"{base + offset:#010x}" if name is None else prefix + name
