"""Commands to the firmware, its replies and its identity (docs/reference/frames.md)."""

from __future__ import annotations

import enum
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from firmware_bridge.frames.checksum import crc16
from gfimu.base.declared import Declared, figure
from gfimu.base.errors import InputError

__all__ = [
    "FAST_BAUD",
    "LPC1768_DIALOGUE",
    "RATES_HZ",
    "RATE_CODE_AUTO",
    "TEMPERATURE_LSB_K",
    "ArrayName",
    "Command",
    "Dialogue",
    "FrameType",
    "Identity",
    "Reply",
    "Result",
    "asked_rate",
    "encode_command",
    "parse_message",
    "sample_at",
    "set_range",
    "set_rate",
]

COMMAND_SYNC = bytes((0xC3, 0x3C))
RATE_CODE_AUTO = 0xFF
"""Let the firmware choose the chips' output data rate."""

RATES_HZ = (10, 3200)
"""Lowest and highest sample rate of the firmware (core.h)."""

NO_TEMPERATURE = -(1 << 15)
"""Value of the temperature field while no sensor fills it."""

TEMPERATURE_LSB_K = 0.01
"""Size of a count of that field."""

_LARGEST_RATE_CODE = 15
_FASTEST_OUTPUT_HZ = 3200.0  # of the chips, at that code
_SEVERAL_BITS = (4, 5, 6, 7)  # status bits of the sensors that converted more than once since the sample before
_BITS_OF_A_READ = 5 * 16  # of SPI, per sensor
_PACED_SINCE = (1, 2, 0)  # firmware that keeps pace with its chips
FAST_BAUD = 1_562_500
"""Carries every sample rate; 100 MHz / 16 / 4 exactly, bits per second."""

_BOOT_LINE_HZ = 280  # samples per second that the firmware's first speed, 115,200 baud, carries with room for answers
_SENSORS = 4  # that the bits of the identity have room for
_LONGEST_REPLY = 10  # command, result, and at most 8 bytes of the command's payload
_PAYLOADS = {3: "<HB", 4: "<BB", 5: "<B", 7: "<I"}


class FrameType(enum.IntEnum):
    """Content of an `lpc1768` frame."""

    SAMPLE = 1
    IDENTITY = 2
    REPLY = 3
    ARRAY = 4


class Command(enum.IntEnum):
    """Commands of the host."""

    START = 1
    STOP = 2
    SET_RATE = 3
    SET_RANGE = 4
    SELF_TEST = 5
    IDENTIFY = 6
    SET_BAUD = 7


class Result(enum.IntEnum):
    """What became of a command."""

    DONE = 0
    UNKNOWN_COMMAND = 1
    BAD_LENGTH = 2
    BAD_VALUE = 3
    LINE_TOO_SLOW = 4


@dataclass(frozen=True)
class Reply:
    """Answer to a command."""

    command: int
    result: Result


@dataclass(frozen=True)
class ArrayName:
    """The array that a board states to be on it; sent before each identity by boards that state one."""

    name: str


@dataclass(frozen=True)
class Identity(Declared):
    """What a board states about itself."""

    firmware: Annotated[str, figure("Version of the firmware.")]
    build_id: Annotated[int, figure("First 32 bits of the hash of its sources.")]
    rate_hz: Annotated[int, figure("Sample rate.", "Hz")]
    rate_code: Annotated[int, figure("BW_RATE code of the chips.")]
    data_format: Annotated[int, figure("DATA_FORMAT of the chips.")]
    baud: Annotated[int, figure("Speed of the line.", "bit/s")]
    present: Annotated[tuple[bool, ...], figure("Which chips answer and hold their configuration.")]
    reset_cause: Annotated[
        str,
        figure("Why the board started last; no crystal: it runs on its internal oscillator, whose 1 % is the clock's."),
    ]
    streaming: Annotated[bool, figure("Whether it sends samples.")]
    spi_khz: Annotated[int, figure("Clock of the bus to the chips.", "kHz")]
    dropped: Annotated[int, figure("Frames that the line could not take.")]
    faulty: Annotated[
        tuple[bool, ...],
        figure("Which chips identify themselves but have a register that does not read back as written."),
    ] = ()

    @property
    def range_g(self) -> int:
        """Range of the chips, in units of g."""
        return 2 << (self.data_format & 3)

    @property
    def settings(self) -> str:
        """Firmware, sample rate and range in words."""
        return f"{self.firmware}, {self.rate_hz} Hz, ±{self.range_g} g"

    @property
    def full_resolution(self) -> bool:
        """Whether a count is 3.9 mg in every range."""
        return bool(self.data_format & 8)

    @property
    def conversions(self) -> dict[str, Any]:
        """What a recording states of when its chips convert (`gfimu.recording.timing.conversion_times`).

        Nothing where the board does not say how fast it reads them.
        """
        if not self.spi_khz:
            return {}
        output_rate_hz = _FASTEST_OUTPUT_HZ / 2.0 ** (_LARGEST_RATE_CODE - self.rate_code)
        paced = output_rate_hz >= self.rate_hz and output_rate_hz * 10 <= self.rate_hz * 11  # set_pace in core.c
        since = tuple(int(part) for part in self.firmware.split(".")) >= _PACED_SINCE
        bits = {"paced_status_bits": list(_SEVERAL_BITS[: len(self.present)])} if paced and since else {}
        return {"output_data_rate_hz": output_rate_hz, "read_spacing_s": _BITS_OF_A_READ / (1e3 * self.spi_khz), **bits}

    @property
    def count_size(self) -> int:
        """Size of a count as sent, in full-resolution counts."""
        return 1 if self.full_resolution else self.range_g // 2


@dataclass(frozen=True)
class Dialogue:
    """Commands that a board understands, and how its answers are read.

    Parameters
    ----------
    identify : bytes
        Command that asks for the identity.
    identify_code : int
        Number of that command in its reply.
    start : bytes
        Command that starts the stream of samples.
    parse : callable
        Packet that is no sample to `Reply`, `ArrayName` or `Identity`, or None.
    """

    identify: bytes
    identify_code: int
    start: bytes
    parse: Callable[[Any], Reply | ArrayName | Identity | None]


def encode_command(command: int, *values: int) -> bytes:
    """Encode a command with its values (docs/reference/frames.md)."""
    try:
        payload = struct.pack(_PAYLOADS.get(command, "<"), *values)
    except struct.error:
        raise InputError(f"command {command} with {values}: a value is missing or out of range") from None
    body = COMMAND_SYNC + bytes((command, len(payload))) + payload
    return body + struct.pack("<H", crc16(body))


def set_rate(rate_hz: int, code: int = RATE_CODE_AUTO) -> bytes:
    """Encode the command for a sample rate, 10…3200 Hz, and the chips' BW_RATE code (by default the one that fits).

    Raises
    ------
    InputError
        If the rate or the code is out of its range.
    """
    if not RATES_HZ[0] <= rate_hz <= RATES_HZ[1]:
        raise InputError(f"rate {rate_hz} Hz: the firmware samples at {RATES_HZ[0]} to {RATES_HZ[1]} Hz")
    if code != RATE_CODE_AUTO and not 0 <= code <= _LARGEST_RATE_CODE:
        raise InputError(f"BW_RATE code {code}: the ADXL345 has 0 to {_LARGEST_RATE_CODE}")
    return encode_command(Command.SET_RATE, rate_hz, code)


def sample_at(rate_hz: int, code: int = RATE_CODE_AUTO) -> bytes:
    """Encode what makes a board that has just started sample at a rate: a line that carries it, then the rate.

    For an emulated board, whose host end has no speed of its own; on a port, `firmware_bridge.host.line_up`
    agrees on it.
    """
    speed = encode_command(Command.SET_BAUD, FAST_BAUD) if rate_hz > _BOOT_LINE_HZ else b""
    return speed + set_rate(rate_hz, code)


def asked_rate(commands: Sequence[bytes]) -> int:
    """Return the sample rate that some of these commands ask for, Hz; 0 if none does."""
    rates = [struct.unpack_from("<H", command, 4)[0] for command in commands if command[2] == Command.SET_RATE]
    return int(rates[-1]) if rates else 0


def set_range(range_g: int, *, full_resolution: bool = True) -> bytes:
    """Encode the command for a range of ±2, 4, 8 or 16 g."""
    if range_g not in {2, 4, 8, 16}:
        raise InputError(f"range {range_g} g: the ADXL345 has 2, 4, 8 and 16")
    return encode_command(Command.SET_RANGE, range_g.bit_length() - 2, int(full_resolution))


def parse_message(packet: Any) -> Reply | ArrayName | Identity | None:
    """Read a frame that is no sample; None for other types, and for what the firmware does not send.

    Status and temperature of all are empty, a reply and a name end in zeros: junk that passes the checksum has other
    bytes.
    """
    payload = np.asarray(packet["counts"], dtype="<i2").tobytes()
    if packet["status"] != 0 or packet["temperature"] != NO_TEMPERATURE:
        return None
    if packet["type"] == FrameType.REPLY:
        if any(payload[_LONGEST_REPLY:]):
            return None
        result = payload[1] if payload[1] <= max(Result) else Result.UNKNOWN_COMMAND
        return Reply(payload[0], Result(result))
    if packet["type"] == FrameType.ARRAY:
        name = payload.rstrip(b"\0")
        return ArrayName(name.decode("ascii")) if name and all(0x20 < byte < 0x7F for byte in name) else None
    if packet["type"] != FrameType.IDENTITY:
        return None
    fields: tuple[Any, ...] = struct.unpack("<4BHBBIBBBBIHH", payload)
    _, major, minor, patch, rate, code, data_format, baud, present, cause, streaming, sensors, build, khz, drop = fields
    if not (
        RATES_HZ[0] <= rate <= RATES_HZ[1] and code <= _LARGEST_RATE_CODE and streaming <= 1 and sensors <= _SENSORS
    ):
        return None
    causes = {1: "power-on", 2: "external", 4: "watchdog", 8: "brown-out", 16: "no crystal"}
    names = [name for bit, name in causes.items() if cause & bit]
    return Identity(
        f"{major}.{minor}.{patch}",
        build,
        rate,
        code,
        data_format,
        baud,
        tuple(bool(present >> k & 1) for k in range(sensors)),
        ", ".join(names) or "software",
        bool(streaming),
        khz,
        drop,
        tuple(bool(present >> (sensors + k) & 1) for k in range(sensors)),
    )


LPC1768_DIALOGUE = Dialogue(
    encode_command(Command.IDENTIFY), Command.IDENTIFY, encode_command(Command.START), parse_message
)
"""The dialogue of the project's firmware."""
