"""Parameters that several functions take: the type in Python with the option on the shell.

A command whose help says more puts its own words over them: ``Annotated[given.Array, ARRAY.also(", as drawn")]``.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

from gfimu.commands.shell import options

if TYPE_CHECKING:
    from gfimu.array.array import AccelerometerArray
    from gfimu.base.files.memory import MemorySize
    from gfimu.calibration.result import Calibration
    from gfimu.model.world_model import WorldModel
    from gfimu.recording.importing import ColumnMap
    from gfimu.recording.mapped import RecordingLike

__all__ = ["Array", "CalibrationToApply", "Map", "Memory", "Picture", "Progress", "ReferenceMap", "Run", "Runs", "Twin"]

RUN = options.file_argument("Recording", "RUN")
"""A recording that a command reads; what it has to hold is said by `Option.also`."""


Array: TypeAlias = Annotated["AccelerometerArray | str | Path | None", options.ARRAY.also("; else the recording's own")]
CalibrationToApply: TypeAlias = Annotated["Calibration | str | Path | None", options.CALIBRATION]
Map: TypeAlias = Annotated["ColumnMap | str | Path | None", options.MAP]
Memory: TypeAlias = Annotated["MemorySize | None", options.MAX_MEMORY]
Picture: TypeAlias = Annotated["str | Path | None", options.PICTURE]
Progress: TypeAlias = Annotated["Callable[[float, str], None] | None", options.PROGRESS]
ReferenceMap: TypeAlias = Annotated["ColumnMap | str | Path | None", options.REFERENCE_MAP]
Run: TypeAlias = Annotated["RecordingLike", RUN]
Runs: TypeAlias = Annotated["RecordingLike | Sequence[RecordingLike]", options.RECORDINGS]
Twin: TypeAlias = Annotated["WorldModel | str | Path", options.TWIN]
