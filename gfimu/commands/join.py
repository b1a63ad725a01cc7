"""Under `gfimu join`: channels and a reference of two clocks in one recording."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.files.outputs import RECORDING, writes

if TYPE_CHECKING:
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.importing import ColumnMap
    from gfimu.joining import Joined, ReferenceSeries
    from gfimu.recording.mapped import RecordingLike

__all__ = ["join"]


@writes(reads=("channels", "reference", "array", "column_map", "reference_map"), out=RECORDING)
def join(
    channels: RecordingLike,
    reference: ReferenceSeries | str | Path,
    *,
    out: str | Path | None = None,
    array: AccelerometerArray | str | Path | None = None,
    column_map: ColumnMap | str | Path | None = None,
    reference_map: ColumnMap | str | Path | None = None,
    map_set: Sequence[str] = (),
    reference_map_set: Sequence[str] = (),
    most_rate_error: float = 0.02,
    force: bool = False,
) -> Joined:
    """Find offset and rate error between two clocks, and write channels and reference into one recording.

    Parameters
    ----------
    channels : Recording, path, table, or times (n,) with readings (n, c)
        The recording of the accelerometers, or its file.
    reference : ReferenceSeries, str or Path
        Tachometer, encoder angle, command or gyro with times of its own, or the file.
    out : str or Path, optional
        Recording to write, ``.csv`` or ``.parquet``.
    array : AccelerometerArray, str or Path, optional
        The array of the channels; the recording's own by default.
    column_map, reference_map : ColumnMap, str or Path, optional
        What the columns of a foreign file are, of the channels (``--map``) and of the reference.
    map_set, reference_map_set : sequence of str
        Keys of these maps to set, such as ``"time.unit=ms"`` (``--map-set``); without a map they are all of it.
    most_rate_error : float
        Largest rate error between the clocks that is searched, a ratio.
    force : bool
        Go on, with a warning, where the checks of the channels would refuse them; join nevertheless where the two don't
        seem to belong together.

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
    from gfimu.commands.opened import as_array, as_source, name_of
    from gfimu.importing import load_map
    from gfimu.joining import ReferenceSeries, join_reference, open_reference
    from gfimu.recording import Recording
    from gfimu.recording.checks import examine
    from gfimu.recording.formats import open_recording

    drawing = None if array is None else as_array(array)
    source = as_source(channels, array, column_map, map_set)
    recording = source if isinstance(source, Recording) else open_recording(source, array=drawing)
    examine(recording, drawing, source=name_of(channels), force=force)
    if drawing is not None:
        recording = recording.carrying(drawing)
    if isinstance(reference, ReferenceSeries):
        series = reference
    else:
        given = reference_map is not None or reference_map_set
        series = open_reference(reference, load_map(reference_map, reference_map_set) if given else None)
    joined = join_reference(recording, series, most_rate_error=most_rate_error, force=force)
    if out is not None:
        joined.recording.write(out)
    return joined
