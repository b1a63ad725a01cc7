"""The results of `gfimu firmware` and its commands."""

from __future__ import annotations

from typing import Annotated

from gfimu.commands.results.base import Files, Number, Numbers, Result
from gfimu.commands.results.shared import Identity, Stream
from gfimu.files.schema import about

__all__ = [
    "Built",
    "FaultOutcome",
    "Faulted",
    "Finding",
    "FirmwareRecorded",
    "FirmwareServed",
    "SelfTestCheck",
    "SelfTested",
    "StrictChecked",
    "Traced",
]


class FirmwareRecorded(Result, kw_only=True):
    """What the firmware on the emulated board sent, as a recording."""

    stream: Annotated[Stream, about("How the stream came in.")]
    identity: Annotated[Identity | None, about("What the board stated about itself.")]
    warnings: Annotated[list[str], about("What the firmware did that the processor's documents advise against.")]
    files: Files


class FirmwareServed(Result, kw_only=True):
    """What the emulated board did behind a port."""

    virtual_s: Annotated[Number, about("Virtual time.", "s")]
    wall_s: Annotated[Number, about("Real time.", "s")]
    sent: Annotated[int, about("Bytes sent.", "bytes")]
    refused: Annotated[int, about("Bytes that the host did not take.", "bytes")]
    received: Annotated[int, about("Bytes from the host.", "bytes")]
    warnings: Annotated[list[str], about("What the firmware did that the processor's documents advise against.")]
    port: Annotated[str, about("The port.")]


class Built(Result, kw_only=True):
    """A built image."""

    name: Annotated[str, about("Name of the image.")]
    elf: Annotated[str, about("ELF file, with symbols.")]
    binary: Annotated[str, about("Raw image for the flash.")]
    sha256: Annotated[str, about("Hash of the ELF file.")]
    source_sha256: Annotated[str, about("Hash of the sources, linker script, flags and definitions.")]
    compiler: Annotated[str, about("Compiler and version.")]
    text_bytes: Annotated[int, about("Code and constants.", "bytes")]
    data_bytes: Annotated[int, about("Initialised memory.", "bytes")]
    bss_bytes: Annotated[int, about("Zeroed memory.", "bytes")]
    defines: Annotated[dict[str, str], about("Preprocessor definitions beyond the defaults.")]
    files: Files


class SelfTestCheck(Result, kw_only=True):
    """One check of the self-test."""

    check: Annotated[str, about("What was checked.")]
    passed: Annotated[bool, about("Whether it passed.")]
    measured: Annotated[str, about("What was measured.")]


class SelfTested(Result, kw_only=True):
    """The self-test of the emulator and the firmware."""

    passed: Annotated[bool, about("Whether every check passed.")]
    checks: Annotated[list[SelfTestCheck], about("The checks.")]


class Traced(Result, kw_only=True):
    """A trace of the firmware."""

    events: Annotated[int, about("Register accesses and interrupts.")]
    exceptions: Annotated[int, about("Exceptions entered.")]
    files: Files


class FaultOutcome(Result, kw_only=True):
    """What the host makes of one fault."""

    fault: Annotated[str, about("Name of the fault.")]
    frames_whole: Annotated[int, about("Sample frames that reached the host undamaged.")]
    frames_decoded: Annotated[int, about("Sample frames that the host accepted.")]
    invented: Annotated[int, about("Accepted frames that the board never sent.")]
    counts: Annotated[Stream, about("What the host's decoder reports.")]
    reported: Annotated[list[str], about("Status bits that the board raised because of the fault.")]
    recovered: Annotated[bool, about("Whether good frames came again after the fault.")]
    detail: Annotated[str, about("What else happened.")]
    passed: Annotated[bool, about("Whether nothing was invented or lost, and good frames came again.")]


class Faulted(Result, kw_only=True):
    """What the host makes of faults of wire, supply and chips."""

    passed: Annotated[bool, about("Whether every fault passed.")]
    faults: Annotated[list[FaultOutcome], about("The faults.")]


class Finding(Result, kw_only=True):
    """A rule that was broken at one place of the program."""

    rule: Annotated[str, about("Name of the rule.")]
    severity: Annotated[str, about("fault or warning.")]
    what: Annotated[str, about("What happened, the first time.")]
    pc: Annotated[int, about("Address of the instruction.")]
    symbol: Annotated[str, about("Function and offset, where the image has symbols.")]
    exception: Annotated[int, about("Exception that was handled; 0 in the main program.")]
    time_s: Annotated[Number, about("Virtual time of the first time.", "s")]
    count: Annotated[int, about("How often at this place.")]
    remedy: Annotated[str, about("What to do.")]
    source: Annotated[str, about("Document that says so.")]


class StrictChecked(Result, kw_only=True):
    """An image on the strict board."""

    image: Annotated[str, about("The image.")]
    virtual_s: Annotated[Number, about("Virtual time.", "s")]
    ended: Annotated[str, about("Why the run ended before its time; empty if it did not.")]
    accesses: Annotated[int, about("Register accesses.")]
    exceptions: Annotated[int, about("Exceptions handled.")]
    resets: Annotated[int, about("Resets after the first start.")]
    sent: Annotated[list[int], about("Bytes that each UART sent.", "bytes")]
    baud: Annotated[Numbers, about("Speed of each UART at the end.", "bit/s")]
    character: Annotated[list[str], about("Bits, parity and stop bits of each UART, as in 8N1.")]
    stack_bytes: Annotated[int | None, about("Main stack that was used; null if not known.", "bytes")]
    stack_room: Annotated[int | None, about("Room of the main stack; null if not known.", "bytes")]
    started_at: Annotated[int, about("Address of the vector table.")]
    findings: Annotated[list[Finding], about("Rules broken, faults first.")]
    faults: Annotated[int, about("Findings that are faults.")]
