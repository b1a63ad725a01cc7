"""What the boot ROM and the processor ask of an image before its first instruction (UM10360 chapter 32)."""

from __future__ import annotations

import struct

from firmware_bridge.board.cpu import AHB_RAM_BASE, AHB_RAM_SIZE, RAM_BASE, RAM_SIZE
from firmware_bridge.lpc1768.elf import ElfImage
from firmware_bridge.strict.findings import Ledger, Place, Rule, Severity

__all__ = ["judge_image"]

CHECKSUM = Rule(
    "boot_checksum",
    "let word 7 of the vector table make the first eight sum to zero, or leave it to the flash tool: the boot ROM does "
    "not start the image without",
    "UM10360 32.3.1.1",
    Severity.WARNING,
)
VECTORS = Rule(
    "vector_table",
    "put the initial stack pointer (in RAM, a multiple of 8) and the reset handler (odd: Thumb) at address 0",
    "ARMv7-M ARM B1.5.3",
)
PROTECTION = Rule("code_protection", "reserve flash word 0x2FC in the linker script as 0xFFFFFFFF", "UM10360 32.6")

_PROTECTION_AT = 0x2FC
_PROTECTION_CODES = {0x12345678: "CRP1", 0x87654321: "CRP2", 0x43218765: "CRP3", 0x4E697370: "NO_ISP"}
_SUMMED = 8


def judge_image(image: ElfImage, ledger: Ledger, table: int) -> None:
    """Look at the vector table, which is at ``table``, and the code-protection word; a boot loader has its own."""
    words = struct.unpack(f"<{_SUMMED}I", image.read(table, 4 * _SUMMED))
    stack, reset = words[:2]
    here = Place(0, 0, 0.0)
    in_ram = RAM_BASE < stack <= RAM_BASE + RAM_SIZE or AHB_RAM_BASE < stack <= AHB_RAM_BASE + AHB_RAM_SIZE
    if not in_ram or stack & 7:
        ledger.add(VECTORS, f"the initial stack pointer is {stack:#010x}", here)
    elif not reset & 1 or not image.in_memory(reset & ~1):
        ledger.add(VECTORS, f"the reset vector is {reset:#010x}", here)
    elif table:
        return
    elif sum(words) & 0xFFFFFFFF:
        ledger.add(CHECKSUM, f"the first eight words sum to {sum(words) & 0xFFFFFFFF:#010x}", here)
    (code,) = struct.unpack("<I", image.read(_PROTECTION_AT, 4))
    if code in _PROTECTION_CODES:
        ledger.add(PROTECTION, f"{_PROTECTION_CODES[code]} is set: the flash may be locked for ever", here)
