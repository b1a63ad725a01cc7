"""What `gfimu convert` prints: figures of the recording, of the array, or of the calibration that it wrote."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from gfimu.array.array import AccelerometerArray
from gfimu.base.declared import Declared, Key, Table, figure, figures
from gfimu.calibration.result import Calibration
from gfimu.recording import Recording

__all__ = ["Converted", "ConvertedArray", "ConvertedCalibration", "converted"]


_COUNTED = ("packets", "bytes", "dropped_rows")


class _Shown(Declared):
    """Figures that are printed below the name of a file."""

    title: str

    def shown(self) -> Iterator[Table]:
        """Yield the table that people read."""
        yield figures(self.title, self)


def _of_stream(what: str, unit: str = "") -> Key:
    return figure(f"Of a MIMU4444 stream: {what}.", unit, head=what, absent=True)


def _left_out(why: str) -> Key:
    return figure(f"Rows left out {why}.", head=f"rows left out {why}", absent=True)


@dataclass(frozen=True)
class Converted(_Shown):
    """A recording in another format."""

    title: str
    samples: Annotated[int, figure("Samples.", head="samples")]
    channels: Annotated[int, figure("Channels.", head="channels")]
    duration_s: Annotated[float, figure("Length.", "s", head="duration", form=".9g")]
    sample_rate_hz: Annotated[
        float | None, figure("Sample rate; null of a single sample.", "Hz", head="sample rate", form=".9g")
    ]
    gaps: Annotated[int, figure("Places where samples are lost.", head="gaps")]
    packets: Annotated[int | None, _of_stream("packets")] = None
    packets_missing: Annotated[int | None, _of_stream("packets that are lost")] = None
    packets_corrupt: Annotated[int | None, _of_stream("packets with a wrong checksum")] = None
    bytes_skipped: Annotated[int | None, _of_stream("bytes between packets", "bytes")] = None
    dropped_rows_duplicates: Annotated[int | None, _left_out("as duplicates")] = None
    dropped_rows_unordered: Annotated[int | None, _left_out("as not in order of time")] = None
    dropped_rows_untimed: Annotated[int | None, _left_out("for a missing time")] = None
    dropped_rows_corrupt: Annotated[int | None, _left_out("as corrupt")] = None
    dropped_rows_out_of_range: Annotated[int | None, _left_out("as out of range")] = None
    dropped_rows_missing: Annotated[int | None, _left_out("for a missing value")] = None


@dataclass(frozen=True)
class ConvertedArray(_Shown):
    """An array as a MuJoCo model."""

    title: str
    array: Annotated[str, figure("Name of the array.", head="array")]
    chips: Annotated[int, figure("Chips.", head="chips")]
    channels: Annotated[int, figure("Channels.", head="channels")]


@dataclass(frozen=True)
class ConvertedCalibration(_Shown):
    """A calibration in another format."""

    title: str
    format: Annotated[str, figure("kalibr or ros.", head="format")]
    method: Annotated[str, figure("Method that made the calibration.", head="method")]
    unit: Annotated[str, figure("Unit of the readings that it applies to.", head="unit")]
    chips: Annotated[int, figure("Chips.", head="chips")]


def converted(
    found: Recording | Calibration | AccelerometerArray, given: Mapping[str, Any]
) -> Converted | ConvertedArray | ConvertedCalibration:
    """Return the figures of what was converted, of the arguments of the command."""
    target = str(given["target"])
    if isinstance(found, AccelerometerArray):
        return ConvertedArray(target, found.name, len(found.chips), found.n_channels)
    if isinstance(found, Calibration):
        return ConvertedCalibration(target, given["to"], found.method, found.unit, len(found.chips))
    several = len(found) > 1
    counted = {**found.metadata, **{f"dropped_rows_{kind}": count for kind, count in found.dropped.items()}}
    return Converted(
        ", ".join(map(str, given["source"])),
        len(found),
        len(found.channels),
        found.duration,
        found.sample_rate if several else None,
        len(found.gaps) if several else 0,
        **{key: counted[key] for key in Converted.keys() & counted.keys() if key.startswith(_COUNTED)},
    )
