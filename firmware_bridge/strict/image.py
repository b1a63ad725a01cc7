"""An image for the strict board: whether it fits the LPC1768, and where it starts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from firmware_bridge.board.cpu import AHB_RAM_BASE, AHB_RAM_SIZE, FLASH_SIZE, RAM_BASE, RAM_SIZE
from firmware_bridge.lpc1768.build import IMAGES, image_path
from firmware_bridge.lpc1768.elf import ElfImage, Segment
from gfimu.base.errors import InputError

__all__ = ["load_image", "started_by_loader"]

_MEMORIES = ((0, FLASH_SIZE), (RAM_BASE, RAM_SIZE), (AHB_RAM_BASE, AHB_RAM_SIZE))
_START_BYTES = 8  # initial stack pointer and reset vector


def load_image(name: str | Path) -> ElfImage:
    """Load an image by name, or an ELF or .bin file.

    Raises
    ------
    InputError
        If there is no such image, it is damaged, not for an ARM processor, or does not fit the LPC1768's memories.
    """
    image = ElfImage.load(image_path(str(name)) if str(name) in IMAGES else Path(name))
    for segment in image.segments:
        end = segment.address + len(segment.data)
        if not any(base <= segment.address and end <= base + size for base, size in _MEMORIES):
            raise InputError(
                f"{name}: bytes for {segment.address:#x}…{end:#x}, where an LPC1768 has no memory; "
                "link for flash at 0 (512 KiB) and RAM at 0x10000000 (32 KiB)"
            )
    if not any(segment.address < FLASH_SIZE and len(segment.data) >= _START_BYTES for segment in image.segments):
        raise InputError(f"{name}: nothing for the flash; link the vector table at address 0")
    return image


def started_by_loader(image: ElfImage) -> tuple[ElfImage, int]:
    """Return the image with a start at address 0, and the address of its vector table.

    An image that leaves the beginning of the flash to a boot loader is started as the loader would.
    """
    table = min(segment.address for segment in image.segments if segment.address < FLASH_SIZE)
    if not table:
        return image, 0
    start = Segment(0, image.read(table, _START_BYTES), 0)
    return replace(image, segments=(start, *image.segments)), table
