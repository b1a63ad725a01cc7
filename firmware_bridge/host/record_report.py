"""What was recorded from a port: how the stream came in, clocks, and what the board says about itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from numpy.typing import NDArray

from firmware_bridge.frames.commands import Identity
from firmware_bridge.frames.decoder import StreamCounts
from firmware_bridge.host.chip_selftest import AxisSelfTest
from firmware_bridge.host.clock import ClockFit
from firmware_bridge.host.finder import Found
from gfimu.base.declared import Declared, figure
from gfimu.base.results import TableResult, one_row
from gfimu.rate.health.fault import FaultEntry

__all__ = ["BoardsFound", "RecordReport", "Recorded"]

_STATED = {"host": "given", "board": "stated by the board", "format": "the format's", "answer": "as answered"}


@dataclass(frozen=True)
class RecordReport(Declared, TableResult):
    """What was recorded from a board."""

    path: Annotated[Path, figure("The recording.", head="file")]
    duration_s: Annotated[
        float, figure("From the first to the last sample, board time.", "s", head="duration", form=".2f")
    ]
    stream: Annotated[StreamCounts, figure("How the stream came in.")]
    breaks: Annotated[int, figure("Times that the connection was lost.", head="connection breaks")]
    clock: Annotated[ClockFit | None, figure("Board clock against host clock; null where it was not found.")]
    identity: Annotated[Identity | None, figure("What the board stated about itself.")]
    status_counts: Annotated[dict[str, int], figure("Samples by status bit.")] = field(default_factory=dict)
    faults: Annotated[
        tuple[dict[str, Any], ...], figure("Faults of channels that a live view saw.", json=list[FaultEntry])
    ] = ()
    baud: Annotated[
        int | None,
        figure("Speed of the line at the end; null of a port without one.", "bit/s", head="speed of the line"),
    ] = None
    source: Annotated[
        dict[str, Any], figure("What a source without a serial port states about itself, as the recording does.")
    ] = field(default_factory=dict)
    array: Annotated[str, figure("Array that the recording carries; empty if none was stated.")] = ""
    array_stated_by: Annotated[str, figure("host, format, board or answer; empty if none was stated.")] = ""
    board_array: Annotated[str, figure("Array that the board states; empty if it states none.")] = ""
    temperature_degC: Annotated[
        tuple[float, float] | None, figure("Lowest and highest temperature of the board.", "°C")
    ] = None

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row: file, length, counts of the stream, array."""
        counts = {name: getattr(self.stream, name) for name in ("samples", "lost", "corrupt", "restarts")}
        return one_row(
            {"path": self.path, "duration_s": self.duration_s, **counts, "breaks": self.breaks, "array": self.array}
        )

    def facts(self) -> list[tuple[str, str]]:
        """Return what people read of it: a word, and a value with its unit."""
        rows = [*super().facts(), *self.stream.facts()]
        if self.clock is not None:
            error, std = 1e6 * self.clock.rate_error, 1e6 * self.clock.rate_error_std
            rows.append(("host clock against board", f"{error:+.1f} ± {std:.1f} ppm"))
        if self.identity is not None:
            chips = [str(chip) for chip, faulty in enumerate(self.identity.faulty, start=1) if faulty]
            rows += [("chips that do not hold their settings", ", ".join(chips))] if chips else []
            rows.append(("firmware", self.identity.settings))
        rows.append(("array", f"{self.array} ({_STATED[self.array_stated_by]})" if self.array else "not known"))
        if self.temperature_degC is not None:
            rows.append(("temperature", "{:.2f} to {:.2f} °C".format(*self.temperature_degC)))
        rows += [(f"status {name}", str(count)) for name, count in self.status_counts.items()]
        return rows + [(name.replace("_", " "), _in_words(value)) for name, value in self.source.items()]

    def _heading(self) -> str:
        return "Recording from a board"


@dataclass(frozen=True)
class BoardsFound(Declared):
    """Boards that were looked for, and their self-test, without a recording."""

    boards: Annotated[list[Found], figure("Boards that were found with --find.")] = field(default_factory=list)
    self_test: Annotated[list[AxisSelfTest], figure("Self-test of each axis; empty where none was asked for.")] = field(
        default_factory=list
    )


@dataclass(frozen=True)
class Recorded(Declared):
    """A recording from a board."""

    report: Annotated[RecordReport, figure("What was recorded.", flat=True)]
    before: Annotated[BoardsFound, figure("What was found before.", flat=True)]
    files: Annotated[dict[str, Path], figure("Files and folders that were written, by what they are.")]


def _in_words(value: Any) -> str:
    """Return a fact on a source as text: numbers to six digits, parts with their names."""
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_in_words(part)}" for name, part in value.items())
    if isinstance(value, list):
        return ", ".join(map(_in_words, value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)
