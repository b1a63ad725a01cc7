"""Find the offset and the rate error between two clocks, and put channels and reference into one recording.

Exit code 2 if the two files don't seem to belong together; --force writes them all the same.

Examples
--------
gfimu join logger.csv tacho.csv --map klipper --array mine.toml --out run.parquet
# A file of references of another layout
gfimu join run.csv encoder.csv --reference-map encoder_map.toml --out joined.parquet
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import ARRAY, FORCE, MAP, MAX_MEMORY, RECORDING_OUT, REFERENCE_MAP

if TYPE_CHECKING:
    from gfimu.array.array import AccelerometerArray
    from gfimu.base.files.memory import MemorySize
    from gfimu.recording.importing import ColumnMap
    from gfimu.recording.joining import Joined, ReferenceSeries
    from gfimu.recording.mapped import RecordingLike

__all__ = ["join"]


def _results() -> tuple[type, ...]:
    from gfimu.recording.joining import Joined

    return (Joined,)


@command(results=_results, doing="searching the offset between the clocks")
def join(
    channels: Annotated[
        "RecordingLike",
        Option("Recording of the accelerometers.", "CHANNELS", kind=Path, argument=True, reads=True),
    ],
    reference: Annotated[
        "ReferenceSeries | str | Path",
        Option("File of the tachometer, encoder, command or gyro.", "REFERENCE", kind=Path, argument=True, reads=True),
    ],
    *,
    out: Annotated["str | Path | None", RECORDING_OUT.also(needed=True)] = None,
    array: Annotated["AccelerometerArray | str | Path | None", ARRAY.also("; else the recording's own")] = None,
    column_map: Annotated["ColumnMap | str | Path | None", MAP] = None,
    reference_map: Annotated["ColumnMap | str | Path | None", REFERENCE_MAP] = None,
    max_memory: Annotated["MemorySize | None", MAX_MEMORY] = None,
    most_rate_error: Annotated[
        float, Option("Largest rate error between the clocks that is searched, a ratio.")
    ] = 0.02,
    force: Annotated[bool, FORCE.also(", or the two don't seem to belong together")] = False,
) -> "Joined":
    """Find offset and rate error between two clocks, and write channels and reference into one recording.

    Raises
    ------
    InputError
        If a file can't be read, the channels' checks refuse them, the reference does not change, or the two don't seem
        to belong together.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.join("accelerometers.csv", "tacho.csv", out="run.parquet")  # doctest: +SKIP
    """
    from gfimu.base.files.memory import with_memory
    from gfimu.commands.opened import as_array, as_source, name_of
    from gfimu.recording import Recording
    from gfimu.recording.checks import examine
    from gfimu.recording.formats import open_recording
    from gfimu.recording.importing import load_map
    from gfimu.recording.joining import ReferenceSeries, join_reference, open_reference

    drawing = None if array is None else as_array(array)
    source = as_source(channels, array, column_map, max_memory=max_memory)
    recording = source if isinstance(source, Recording) else open_recording(source, array=drawing)
    examine(recording, drawing, source=name_of(channels), force=force)
    if drawing is not None:
        recording = recording.carrying(drawing)
    if isinstance(reference, ReferenceSeries):
        series = reference
    else:
        mapped = None if reference_map is None else load_map(reference_map)
        series = open_reference(with_memory(reference, max_memory), mapped)
    joined = join_reference(recording, series, most_rate_error=most_rate_error, force=force)
    if out is not None:
        joined.recording.write(out)
    return joined
