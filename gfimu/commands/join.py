"""Find the offset and the rate error between two clocks, and put channels and reference into one recording.

The reference may be another logger on the same body; the recording then holds the channels of both.

Exit code 2 if the two files don't seem to belong together; --force writes them all the same.

Examples
--------
gfimu join logger.csv tacho.csv --map klipper --array mine.toml --out run.parquet
# Two loggers on one body, each with a part of the array
gfimu join left.csv right.csv --map logger.toml --array pair.toml --out run.parquet
# A file of references of another layout
gfimu join run.csv encoder.csv --reference-map encoder_map.toml --out joined.parquet
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from gfimu.commands import given
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import FORCE, RECORDING_OUT, file_argument

if TYPE_CHECKING:
    from gfimu.recording.joining import Joined, ReferenceSeries

__all__ = ["join"]

_REFERENCE = file_argument("File of the tachometer, encoder, command or gyro, or of another logger.", "REFERENCE")
_RATE_ERROR = Option("Largest rate error between the clocks that is searched, a ratio.")


@command(doing="searching the offset between the clocks")
def join(
    channels: Annotated[given.Run, given.RUN.also(" of the accelerometers.", metavar="CHANNELS")],
    reference: Annotated["ReferenceSeries | str | Path", _REFERENCE],
    *,
    out: Annotated["str | Path | None", RECORDING_OUT.also(needed=True)] = None,
    array: given.Array = None,
    column_map: given.Map = None,
    reference_map: given.ReferenceMap = None,
    max_memory: given.Memory = None,
    most_rate_error: Annotated[float, _RATE_ERROR] = 0.02,
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
    from gfimu.recording.doubts.judge import examine
    from gfimu.recording.formats import open_recording
    from gfimu.recording.importing import load_map
    from gfimu.recording.joining import ReferenceSeries, join_reference, open_reference

    drawing = None if array is None else as_array(array)
    if not isinstance(reference, ReferenceSeries):
        maps = [None if one is None else load_map(one) for one in (reference_map, column_map)]
        reference = open_reference(with_memory(reference, max_memory), *maps)
    whole = drawing if not reference.channels else None  # of two loggers each has a part of the array
    source = as_source(channels, whole, column_map, max_memory=max_memory)
    recording = open_recording(source, array=whole)
    examine(recording, whole, source=name_of(channels), force=force)
    if whole is not None:
        recording = recording.carrying(whole)
    joined = join_reference(recording, reference, most_rate_error=most_rate_error, force=force)
    if drawing is not None and whole is None:
        joined = joined.carrying(drawing)
    if out is not None:
        joined.recording.write(out)
    return joined
