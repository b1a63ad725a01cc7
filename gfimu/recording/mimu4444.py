"""Import the serial stream of a MIMU4444 board: eight MPU-9150 chips, each an accelerometer and a gyro.

The stream is a four-byte acknowledge and then packets of 106 bytes: ``AA``, packet number (2 bytes), payload length
``64`` hexadecimal, time in ticks of 64 MHz (4), eight times ax ay az gx gy gz (2 each, signed), and the sum of all
bytes before it (2); big-endian throughout (Carlsson, Skog, Jaldén, "Self-Calibration of Inertial Sensor Arrays", IEEE
Sensors Journal 21(6):8451, 2021).
"""

from __future__ import annotations

import gzip
import math
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.part import Part
from gfimu.base.errors import InputError
from gfimu.base.files.input_file import as_path, is_ordinary
from gfimu.recording.carried_array import array_metadata
from gfimu.recording.reading import read_bytes
from gfimu.recording.recording import Recording

__all__ = ["is_mimu4444", "read_mimu4444"]

_ACKNOWLEDGE = bytes.fromhex("A02800C8")
_GZIP_MAGIC = b"\x1f\x8b"
_START, _PAYLOAD = 0xAA, 0x64
_PACKET_BYTES = 106
_CHIPS = 8
_GROWS = 8.5  # numerical: memory for a byte of the stream, measured
_TICK = 1.0 / 64e6
_GYRO_LSB = math.radians(1.0 / 16.4)
_GYRO_AXES = ("x", "y", "z")
_FULL_SCALE = (np.iinfo(np.int16).min, np.iinfo(np.int16).max)


@dataclass(frozen=True)
class _Packets:
    """The valid packets of a stream, decoded, and what lay between them."""

    number: NDArray[np.int64]  # (n,)
    ticks: NDArray[np.int64]  # (n,)
    counts: NDArray[np.int16]  # (n, chips, 6)
    skipped_bytes: int
    corrupt: int


def is_mimu4444(path: str | Path) -> bool:
    """Whether a file starts as a MIMU4444 stream does, gzipped or plain."""
    if not is_ordinary(path):
        return False
    try:
        with Path(path).open("rb") as stream:
            head = stream.read(4)
        if head.startswith(_GZIP_MAGIC):
            with gzip.open(path) as stream:
                head = stream.read(4)
    except (OSError, EOFError, zlib.error):
        return False
    return head == _ACKNOWLEDGE or (len(head) == 4 and head[0] == _START and head[3] == _PAYLOAD)


def read_mimu4444(path: str | Path) -> Recording:
    """Read a MIMU4444 stream, gzipped or plain, into a recording of the array ``mimu4444``.

    Damaged stretches are skipped up to the next packet with a right checksum and show as gaps in time. The mean of the
    eight gyros, in board axes, becomes the reference ``gyro_x_rad_s``, ``gyro_y_rad_s``, ``gyro_z_rad_s``; it is NaN
    where any of them is at full scale. Each chip's own gyro, also in board axes, is kept in ``extra`` as
    ``m1_gyro_x_rad_s`` and so on.

    Parameters
    ----------
    path : str or Path
        The stream.

    Returns
    -------
    Recording
        Readings in m/s²; time from the first packet, s; the metadata counts ``packets``, ``packets_missing`` (gaps in
        the packet numbers), ``packets_corrupt`` and ``bytes_skipped``.

    Raises
    ------
    InputError
        If the file can't be read or holds no valid packet.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.read_mimu4444("stream.bin")  # doctest: +SKIP
    """
    file = as_path(path)
    packets = _decode(np.frombuffer(read_bytes(file, grows=_GROWS), dtype=np.uint8))
    if packets is None:
        raise InputError(f"{file}: no valid MIMU4444 packet; give the raw serial stream (.bin or .bin.gz)")
    elapsed = _unwrapped(packets.ticks, 32)
    first = np.diff(elapsed, prepend=-1) > 0  # a packet sent twice has the time of the one before
    missing = int(np.sum(np.diff(_unwrapped(packets.number, 16)[first]) - 1))

    array = AccelerometerArray.load("mimu4444")
    part = Part.load(array.chips[0].part, array.part_files)
    counts = packets.counts[first]  # (n, 8, 6)
    readings = counts[:, :, :3].reshape(len(counts), -1) * np.float64(part.lsb)  # (n, 24)
    gyros = _gyros_in_board_axes(counts[:, :, 3:], array)  # (n, 8, 3)
    mean = gyros.mean(axis=1)  # (n, 3), NaN where one is
    return Recording(
        elapsed[first] * np.float64(_TICK),
        readings,
        array.channels,
        {f"gyro_{axis}_rad_s": mean[:, index] for index, axis in enumerate(_GYRO_AXES)},
        {
            **array_metadata(array),
            "part": part.name,
            "source": file.name,
            "packets": len(packets.ticks),
            "packets_missing": missing,
            "packets_corrupt": packets.corrupt,
            "bytes_skipped": packets.skipped_bytes,
        },
        {
            f"{chip.name}_gyro_{axis}_rad_s": gyros[:, number, place]
            for number, chip in enumerate(array.chips)
            for place, axis in enumerate(_GYRO_AXES)
        },
    )


def _decode(stream: NDArray[np.uint8]) -> _Packets | None:
    """Find the packets with a right checksum and decode their fields; None if there is none."""
    body_start = len(_ACKNOWLEDGE) if stream[:4].tobytes() == _ACKNOWLEDGE else 0
    last = len(stream) - _PACKET_BYTES
    if last < body_start:
        return None
    is_start = (stream[: last + 1] == _START) & (stream[3 : last + 4] == _PAYLOAD)
    starts = np.flatnonzero(is_start[body_start:]) + body_start
    sums = np.zeros(len(stream) + 1, dtype=np.uint16)  # which wraps as the checksum does
    np.cumsum(stream, dtype=np.uint16, out=sums[1:])
    end = starts + _PACKET_BYTES - 2
    checksum = stream[end].astype(np.int64) * 256 + stream[end + 1]
    starts = _without_overlaps(starts[sums[end] - sums[starts] == checksum])
    if not len(starts):
        return None

    between = np.diff(starts, prepend=body_start - _PACKET_BYTES, append=len(stream)) - _PACKET_BYTES
    packets = np.lib.stride_tricks.sliding_window_view(stream, _PACKET_BYTES)[starts]  # (n, 106)
    fields = np.ascontiguousarray(packets[:, 1:]).view(
        np.dtype(
            [("number", ">u2"), ("length", "u1"), ("ticks", ">u4"), ("counts", ">i2", (_CHIPS, 6)), ("sum", ">u2")]
        )
    )[:, 0]
    return _Packets(
        fields["number"].astype(np.int64),
        fields["ticks"].astype(np.int64),
        fields["counts"].astype(np.int16),
        int(between.sum()),
        int(np.ceil(between / _PACKET_BYTES).sum()),
    )


def _without_overlaps(starts: NDArray[np.intp]) -> NDArray[np.intp]:
    """Drop packets that begin inside the one before: data that looks like a packet by chance."""
    while (inside := np.flatnonzero(np.diff(starts) < _PACKET_BYTES)).size:
        starts = np.delete(starts, inside[0] + 1)
    return starts


def _unwrapped(counter: NDArray[np.int64], bits: int) -> NDArray[np.int64]:
    """Count from the first value of a counter that wraps at 2**bits; steps are less than one wrap."""
    return np.concatenate([[0], np.cumsum(np.diff(counter) % (1 << bits))])


def _gyros_in_board_axes(counts: NDArray[np.int16], array: AccelerometerArray) -> NDArray[np.float64]:
    """Turn gyro counts (n, 8, 3) in chip axes into rates in board axes, rad/s; NaN where an axis is at full scale."""
    rates = np.where(np.isin(counts, _FULL_SCALE), np.nan, counts * _GYRO_LSB)
    turned = np.empty(rates.shape)
    for index, chip in enumerate(array.chips):
        # Chip axes are board axes but for order and sign: pick and flip, so that one NaN stays one NaN.
        source = np.argmax(np.abs(chip.axes), axis=0)
        turned[:, index] = rates[:, index, source] * chip.axes[source, np.arange(3)]
    return turned
