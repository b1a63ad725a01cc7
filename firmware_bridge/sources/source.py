"""What a source is: something other than a serial port that gives bytes in a frame format to the link that reads it.

A source that delivers samples with times of their own (Klipper, phyphox) packs them into `sample_format`; from there on
they go the way of every other board's: decoder, record session, journal.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.frames.frame_format import FrameFormat
from firmware_bridge.frames.packets import PacketLayout
from gfimu.array.array import AccelerometerArray

__all__ = ["Source", "pack_samples", "sample_format"]

_CLOCK_HZ = 1e9
_FINE_M_S2 = 1e-4  # size of a stored count
_NO_READING = -(1 << 31)
_SYNC = 0xA55A


class Source(Protocol):
    """Gives bytes in a frame format to a `firmware_bridge.host.link.Link`, which opens it again when it is lost."""

    @property
    def hint(self) -> str:
        """What to check when it can't be opened or sends nothing."""
        ...

    def open(self) -> None:
        """Connect, and subscribe to what is to come.

        Raises
        ------
        OSError
            If it is not there, which may pass.
        InputError
            If it is there and refuses, or is something else.
        """
        ...

    def read(self, size: int, /) -> bytes:
        """Return whole samples that have come, or nothing after a short wait; raises `OSError` on a lost connection."""
        ...

    def write(self, data: bytes, /) -> None:
        """Send bytes to the board, if it takes any."""
        ...

    def close(self) -> None:
        """Close the connection."""
        ...

    def facts(self) -> dict[str, Any]:
        """Return what the recording's metadata say about the source."""
        ...


def sample_format(name: str, array: str) -> FrameFormat:
    """Return the format of samples that come with times of their own: time in ns, readings in counts of 0.1 mm/s².

    Parameters
    ----------
    name : str
        Name that the recording has as ``format``.
    array : str
        Array: a name or a file.
    """
    carried = AccelerometerArray.load(array)
    dtype = np.dtype([("sync", "<u2"), ("time", "<u8"), ("counts", "<i4", (carried.n_channels,))])
    signature = tuple(enumerate(_SYNC.to_bytes(2, "little")))
    return FrameFormat(
        name,
        PacketLayout(dtype, signature, None),
        clock_field="time",
        clock_hz=_CLOCK_HZ,
        array=array,
        channels=tuple(range(carried.n_channels)),
        sequence_field="",
        no_reading=_NO_READING,
        count_m_s2=_FINE_M_S2,
        slowest_hz=1.0,
    )


def pack_samples(form: FrameFormat, t_s: NDArray[np.float64], readings: NDArray[np.float64]) -> bytes:
    """Return samples as bytes of `sample_format`: times (n,), s, readings (n, c), m/s², NaN where missing."""
    packets = np.zeros(len(t_s), form.layout.dtype)
    packets["sync"] = _SYNC
    packets["time"] = np.round(t_s * _CLOCK_HZ)
    counts = np.where(np.isfinite(readings), np.round(readings / _FINE_M_S2), _NO_READING)
    packets["counts"] = np.clip(counts, _NO_READING, -_NO_READING - 1)
    return packets.tobytes()
