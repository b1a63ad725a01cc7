"""What a frame is: status bits, packet layouts, their fields and the built-in formats (docs/reference/frames.md)."""

from __future__ import annotations

import enum
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firmware_bridge.frames.checksum import crc16_rows, sum16_rows
from firmware_bridge.frames.commands import (
    LPC1768_DIALOGUE,
    NO_TEMPERATURE,
    RATES_HZ,
    TEMPERATURE_LSB_K,
    Dialogue,
    FrameType,
)
from firmware_bridge.frames.packets import PacketLayout, StreamLayout
from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.part import Part
from gfimu.base.errors import InputError

__all__ = ["FORMATS", "LPC1768_DTYPE", "FrameFormat", "Status", "TemperatureField", "encode_samples"]

FRAME_VERSION = 1

SYNC = (0xA5, 0x5A)

_AXES, _SENSORS = 3, 4  # of a chip, and chips, in `lpc1768`


class Status(enum.IntFlag):
    """Bits of the status field of a sample frame."""

    SENSOR_1_MISSING = 1 << 0
    SENSOR_2_MISSING = 1 << 1
    SENSOR_3_MISSING = 1 << 2
    SENSOR_4_MISSING = 1 << 3
    SENSOR_1_OVERRUN = 1 << 4
    SENSOR_2_OVERRUN = 1 << 5
    SENSOR_3_OVERRUN = 1 << 6
    SENSOR_4_OVERRUN = 1 << 7
    LATE = 1 << 8
    FRAMES_DROPPED = 1 << 9
    SELF_TEST = 1 << 10
    RECEIVE_ERROR = 1 << 11
    FIRST = 1 << 12
    WATCHDOG_RESET = 1 << 13
    STALE = 1 << 14
    CHIP_FAULT = 1 << 15

    @property
    def missing_sensors(self) -> tuple[int, ...]:
        """Numbers 1…4 of the sensors that did not answer."""
        return tuple(index + 1 for index in range(4) if self & (1 << index))


LPC1768_DTYPE = np.dtype(
    [
        ("sync", "u1", 2),
        ("version", "u1"),
        ("type", "u1"),
        ("sequence", "<u2"),
        ("time_us", "<u4"),
        ("counts", "<i2", 12),
        ("status", "<u2"),
        ("temperature", "<i2"),
        ("crc", "<u2"),
    ]
)

MIMU4444_DTYPE = np.dtype(
    [
        ("start", "u1"),
        ("sequence", ">u2"),
        ("payload_bytes", "u1"),
        ("ticks", ">u4"),
        ("counts", ">i2", 48),
        ("sum", ">u2"),
    ]
)


@dataclass(frozen=True)
class TemperatureField:
    """Where a sample has a temperature, and what its number means.

    Parameters
    ----------
    name : str
        The field.
    lsb_K : float
        Size of a count, K; negative where the count falls as it gets warmer.
    zero_degC : float
        Temperature of the count zero, °C.
    no_reading : int, optional
        Count that stands for no temperature.
    """

    name: str
    lsb_K: float
    zero_degC: float = 0.0
    no_reading: int | None = None

    def of(self, packets: NDArray[Any]) -> NDArray[np.float64]:
        """Temperatures of the packets, shape (n,), °C; NaN where there is none."""
        counts = packets[self.name]
        temperature = self.zero_degC + self.lsb_K * counts.astype(float)
        return temperature if self.no_reading is None else np.where(counts == self.no_reading, np.nan, temperature)


@dataclass(frozen=True)
class FrameFormat:
    """One frame format: all that decoding and recording need to know of a board's stream.

    Parameters
    ----------
    name : str
        Name for ``--format``.
    layout : StreamLayout
        The sample on the wire.
    clock_field : str
        Field that holds the board's time stamp, an unsigned integer.
    clock_hz : float
        Ticks of the time stamp per second.
    array : str
        Array file whose channels the counts belong to.
    channels : tuple of int
        Columns of the counts that are the array's channels, in order.
    sequence_field : str
        Field that holds the sequence number, an unsigned integer; empty if there is none: then the time stamps alone
        say what is missing.
    counts_field : str
        Field that holds the raw counts, signed integers.
    status_field : str, optional
        Field with status bits as in `Status`; None if there is none.
    status_mask : int
        Status bits that count.
    sample_type : tuple of (str, int), optional
        Field and its value that mark a packet as a sample; None if every packet is one.
    no_reading : int, optional
        Count that stands for a missing reading.
    count_m_s2 : float, optional
        Size of a count, m/s²; by default that of the array's part.
    slowest_hz : float
        Lowest sample rate of the board, Hz: two samples can't be farther apart.
    dialogue : Dialogue, optional
        Commands and answers of the board; None if it only sends.
    temperature : TemperatureField, optional
        Temperature of the board; None if a sample has none.
    array_is_assumed : bool
        Whether the format says nothing of how the chips are mounted: then ``array`` gives names and number of the
        channels, and which array it is has to be stated by the board or at the host.
    """

    name: str
    layout: StreamLayout
    clock_field: str
    clock_hz: float
    array: str
    channels: tuple[int, ...]
    sequence_field: str = "sequence"
    counts_field: str = "counts"
    status_field: str | None = None
    status_mask: int = 0xFFFF
    sample_type: tuple[str, int] | None = None
    no_reading: int | None = None
    count_m_s2: float | None = None
    slowest_hz: float = 1.0
    dialogue: Dialogue | None = None
    temperature: TemperatureField | None = None
    array_is_assumed: bool = False

    def count_size(self, array: AccelerometerArray) -> float:
        """Return the size of a count, m/s²: its own, or that of the part of the array's first chip."""
        return self.count_m_s2 or Part.load(array.chips[0].part, array.part_files).lsb

    def for_array(self, array: AccelerometerArray) -> FrameFormat:
        """Return this format for an array of its own number of channels, or of fewer chips where one may be missing.

        Then the array's chips, of three axes each, are the first ones, and the others are not looked at.

        Raises
        ------
        InputError
            If the array has more channels, or the format has no reading for a chip that is missing.
        """
        chips, channels, own = len(array.chips), array.n_channels, len(self.channels)
        if channels == own:
            return self
        if self.no_reading is None or channels != _AXES * chips or channels > own:
            fewer = "" if self.no_reading is None else f", or {_AXES} for each chip"
            raise InputError(
                f"array {array.name!r} has {channels} channels, {self.name} {own}{fewer}; give another --array"
            )
        others = sum((Status.SENSOR_1_MISSING | Status.SENSOR_1_OVERRUN) << chip for chip in range(chips, _SENSORS))
        return replace(self, channels=self.channels[:channels], status_mask=self.status_mask & ~others)

    def is_sample(self, packets: NDArray[Any]) -> NDArray[np.bool_]:
        """Return which packets, shape (n,), carry a sample."""
        if self.sample_type is None:
            return np.ones(len(packets), dtype=bool)
        field, value = self.sample_type
        return np.asarray(packets[field] == value)

    def status(self, packets: NDArray[Any]) -> NDArray[np.uint16]:
        """Status bits of the packets, shape (n,); zero in formats without them."""
        if self.status_field is None:
            return np.zeros(len(packets), dtype=np.uint16)
        return packets[self.status_field].astype(np.uint16) & np.uint16(self.status_mask)

    def counts(self, packets: NDArray[Any]) -> NDArray[Any]:
        """Raw counts of the array's channels, shape (n, c), in the byte order of this machine."""
        counts = packets[self.counts_field][:, list(self.channels)]
        return np.asarray(counts, dtype=counts.dtype.newbyteorder("="))

    def temperatures(self, packets: NDArray[Any]) -> NDArray[np.float64]:
        """Temperatures of the packets, shape (n,), °C; NaN where there is none."""
        return np.full(len(packets), np.nan) if self.temperature is None else self.temperature.of(packets)

    def mask_of(self, field: str) -> int:
        """Largest value of an unsigned field, at which it wraps; of 8 bytes, only 63 bits are used."""
        return 0 if not field else (1 << min(8 * self.layout.dtype[field].itemsize, 63)) - 1


FORMATS: dict[str, FrameFormat] = {
    known.name: known
    for known in (
        FrameFormat(
            "lpc1768",
            PacketLayout(LPC1768_DTYPE, ((0, SYNC[0]), (1, SYNC[1]), (2, FRAME_VERSION)), crc16_rows),
            clock_field="time_us",
            clock_hz=1e6,
            array="cube12",
            channels=tuple(range(12)),
            status_field="status",
            sample_type=("type", FrameType.SAMPLE),
            no_reading=-(1 << 15),
            slowest_hz=RATES_HZ[0],
            dialogue=LPC1768_DIALOGUE,
            temperature=TemperatureField("temperature", TEMPERATURE_LSB_K, no_reading=NO_TEMPERATURE),
            array_is_assumed=True,
        ),
        FrameFormat(
            "mimu4444",
            PacketLayout(MIMU4444_DTYPE, ((0, 0xAA), (3, 0x64)), sum16_rows),
            clock_field="ticks",
            clock_hz=64e6,
            array="mimu4444",
            channels=tuple(6 * chip + axis for chip in range(8) for axis in range(3)),
        ),
    )
}
"""Every frame format by name."""


def encode_samples(
    sequence: ArrayLike,
    time_us: ArrayLike,
    counts: ArrayLike,
    status: ArrayLike = 0,
    temperature: ArrayLike = NO_TEMPERATURE,
) -> bytes:
    """Encode sample frames of the format `lpc1768` as the firmware does.

    Parameters
    ----------
    sequence, time_us, status, temperature : array_like, shape (n,)
        Sequence numbers and time stamps (both taken modulo their width), status bits, temperature field.
    counts : array_like, shape (n, 12)
        Raw counts.
    """
    readings = np.asarray(counts)
    frames = np.zeros(len(readings), LPC1768_DTYPE)
    frames["sync"] = SYNC
    frames["version"] = FRAME_VERSION
    frames["type"] = FrameType.SAMPLE
    frames["sequence"] = np.asarray(sequence, dtype=np.int64) & 0xFFFF
    frames["time_us"] = np.asarray(time_us, dtype=np.int64) & 0xFFFFFFFF
    frames["counts"] = readings
    frames["status"] = status
    frames["temperature"] = temperature
    rows = frames.view(np.uint8).reshape(len(frames), LPC1768_DTYPE.itemsize)
    frames["crc"] = crc16_rows(rows[:, :-2])
    return frames.tobytes()
