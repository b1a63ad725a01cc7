"""Reading what is needed of an ELF file: the segments to load and the symbols to name addresses by."""

from __future__ import annotations

import bisect
import struct
from dataclasses import dataclass, replace
from pathlib import Path

from gfimu.base.errors import InputError

__all__ = ["ElfImage", "Segment"]

_LOAD, _SYMBOLS, _NO_BITS = 1, 2, 8
_WRITABLE, _ALLOCATED = 1, 2
_ARM = 40


@dataclass(frozen=True)
class Segment:
    """Bytes to put at a physical address.

    Parameters
    ----------
    address : int
        Where they go.
    data : bytes
        The bytes.
    file_offset : int
        Where they are in the file.
    """

    address: int
    data: bytes
    file_offset: int


@dataclass(frozen=True)
class ElfImage:
    """A 32-bit little-endian ARM image.

    Parameters
    ----------
    name : str
        Name for messages.
    segments : tuple of Segment
        What to load.
    symbols : dict of str to int
        Addresses of functions and objects; the Thumb bit is cleared.
    sizes : tuple of int
        Bytes of code, initialised data, zero data.
    occupied : tuple of (int, int)
        First address and length of every section that occupies memory and can be written; none in a raw image.
    """

    name: str
    segments: tuple[Segment, ...]
    symbols: dict[str, int]
    sizes: tuple[int, int, int]
    occupied: tuple[tuple[int, int], ...] = ()

    @classmethod
    def load(cls, path: str | Path) -> ElfImage:
        """Read an ELF file, or a raw flash image (``.bin``).

        Raises
        ------
        InputError
            If the file is missing or no 32-bit ARM image.
        """
        file = Path(path)
        try:
            content = file.read_bytes()
        except OSError as error:
            raise InputError(f"{file}: {error.strerror or error}; give an ELF file or a raw .bin image") from None
        if file.suffix == ".bin" and len(content) >= 8:
            return cls(str(file), (Segment(0, content, 0),), {}, (len(content), 0, 0))
        return cls.parse(content, str(file))

    @classmethod
    def parse(cls, content: bytes, name: str) -> ElfImage:
        """Parse the bytes of an ELF file."""
        try:
            return _parse(content, name)
        except (struct.error, IndexError, UnicodeDecodeError):
            raise InputError(f"{name}: damaged ELF file; build it again") from None

    def section_sizes(self) -> tuple[int, int, int]:
        """Bytes of code and constants, of initialised data, of zero data."""
        return self.sizes

    def flash_bytes(self) -> bytes:
        """Raw image from address 0, as it is written to the flash."""
        end = max(segment.address + len(segment.data) for segment in self.segments)
        flash = bytearray(b"\xff" * end)
        for segment in self.segments:
            flash[segment.address : segment.address + len(segment.data)] = segment.data
        return bytes(flash)

    def file_offset(self, address: int) -> int:
        """Place of an address in the file."""
        for segment in self.segments:
            if segment.address <= address < segment.address + len(segment.data):
                return segment.file_offset + address - segment.address
        raise InputError(f"{self.name}: nothing is loaded at {address:#x}; link the vector table there")

    def read(self, address: int, count: int) -> bytes:
        """Bytes that are loaded at an address; 0xFF, as erased flash, where nothing is."""
        content = bytearray(b"\xff" * count)
        for segment in self.segments:
            begin, end = max(address, segment.address), min(address + count, segment.address + len(segment.data))
            if begin < end:
                content[begin - address : end - address] = segment.data[begin - segment.address : end - segment.address]
        return bytes(content)

    def with_bytes(self, address: int, data: bytes) -> ElfImage:
        """Return the image with other bytes at an address that is loaded."""
        segments = []
        for segment in self.segments:
            at = address - segment.address
            if 0 <= at <= len(segment.data) - len(data):
                segments.append(replace(segment, data=segment.data[:at] + data + segment.data[at + len(data) :]))
            else:
                segments.append(segment)
        return replace(self, segments=tuple(segments))

    def in_memory(self, address: int) -> bool:
        """Whether a loaded segment or a writable section holds an address."""
        ranges = [(segment.address, len(segment.data)) for segment in self.segments]
        return any(start <= address < start + length for start, length in (*ranges, *self.occupied))

    def stack_limit(self, top: int, ram_base: int, ram_size: int) -> int | None:
        """End of the data below a stack that begins at ``top`` in a RAM.

        None if the image does not say: a raw image, or a stack inside a section that holds data, too.
        """
        inside = [(start, start + length) for start, length in self.occupied if length]
        inside = [(start, end) for start, end in inside if ram_base <= start < top <= ram_base + ram_size]
        ends = [end for _, end in inside]
        return max(ends) if ends and max(ends) < top else None

    def symbol_at(self, address: int) -> str:
        """Name an address as ``symbol+0x12``; empty when the image has no symbols there."""
        ordered = sorted((value, name) for name, value in self.symbols.items())
        place = bisect.bisect_right(ordered, (address, "\uffff")) - 1
        if place < 0:
            return ""
        start, name = ordered[place]
        return f"{name}+{address - start:#x}" if address != start else name


def _parse(content: bytes, name: str) -> ElfImage:
    if content[:6] != b"\x7fELF\x01\x01":
        raise InputError(f"{name}: not a 32-bit little-endian ELF file; build for thumb-freestanding-eabi")
    machine, _, _, programs, sections = struct.unpack_from("<HIIII", content, 18)
    if machine != _ARM:
        raise InputError(f"{name}: not an ARM image; build for cortex_m3")
    program_size, program_count, section_size, section_count = struct.unpack_from("<4H", content, 42)
    segments = []
    for index in range(program_count):
        kind, offset, _, address, length = struct.unpack_from("<5I", content, programs + index * program_size)
        if kind == _LOAD and length:
            segments.append(Segment(address, content[offset : offset + length], offset))
    headers = [struct.unpack_from("<10I", content, sections + n * section_size) for n in range(section_count)]
    text = data = zero = 0
    occupied = []
    symbols: dict[str, int] = {}
    for _, kind, flags, start, offset, length, link, _, _, entry in headers:
        if flags & _ALLOCATED and flags & _WRITABLE and length:
            occupied.append((start, length))
        if flags & _ALLOCATED:
            zero += length if kind == _NO_BITS else 0
            data += length if kind != _NO_BITS and flags & _WRITABLE else 0
            text += length if kind != _NO_BITS and not flags & _WRITABLE else 0
        if kind == _SYMBOLS:
            strings = headers[link][4]
            for at in range(offset, offset + length, entry):
                name_offset, value, _, info, _, section = struct.unpack_from("<IIIBBH", content, at)
                if section and info & 15 in {1, 2}:  # objects and functions that are defined here
                    end = content.index(b"\0", strings + name_offset)
                    symbols[content[strings + name_offset : end].decode()] = value & ~1 if info & 15 == 2 else value
    if not segments:
        raise InputError(f"{name}: the image loads nothing; link it with the linker script")
    return ElfImage(name, tuple(segments), symbols, (text, data, zero), tuple(occupied))
