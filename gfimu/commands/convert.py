"""Under `gfimu convert`: a recording in another format, a calibration as YAML, an array as a MuJoCo model."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.errors import InputError
from gfimu.files.outputs import EXPORT, writes

if TYPE_CHECKING:
    from gfimu.calibration.result import Calibration
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.importing import ColumnMap
    from gfimu.recording import Recording
    from gfimu.recording.mapped import RecordingLike
    from gfimu.sensor_noise import RecordingNoise

__all__ = ["convert"]


@writes(reads=("source", "array", "column_map", "noise"), target=EXPORT)
def convert(
    source: RecordingLike | Calibration | AccelerometerArray | Sequence[str | Path],
    target: str | Path | None = None,
    *,
    array: AccelerometerArray | str | Path | None = None,
    column_map: ColumnMap | str | Path | None = None,
    map_set: Sequence[str] = (),
    drop: str | Sequence[str] = (),
    table: str | None = None,
    to: str | None = None,
    lsb_m_s2: float | None = None,
    chip: str | None = None,
    noise: RecordingNoise | Recording | str | Path | None = None,
) -> Recording | Calibration | AccelerometerArray:
    """Read a recording in any format that is known, in m/s², and write it as CSV, Parquet, MCAP or EuRoC.

    Or read a calibration and write it as Kalibr's or imu_calib's YAML; or an array and write it as a MuJoCo model.

    Parameters
    ----------
    source : Recording, Calibration, AccelerometerArray, path, table, or times (n,) with readings (n, c)
        A calibration, or its ``.json`` file; an array, or its ``.toml`` file; or a recording, or its file: CSV,
        Parquet, a MIMU4444 stream, or a foreign file with its column map; one file per chip on a common clock, with a
        map.
    target : str or Path, optional
        Recording to write: ``.csv`` or ``.parquet``; ``.mcap`` with a topic of ``sensor_msgs/Imu`` per tri-axial chip;
        ``.euroc``, a folder in the layout of EuRoC / ASL. Of a calibration: ``.yaml``. Of an array: ``.xml``.
    array : AccelerometerArray, str or Path, optional
        Array whose channels must be there; every channel found by default.
    column_map : ColumnMap, str or Path, optional
        What the columns of a foreign file are: a map, its name or TOML file (``--map``); see `gfimu.inspect`.
    map_set : sequence of str
        Keys of that map to set, such as ``"time.unit=ms"`` (``--map-set``); without a map they are all of it.
    drop : str or sequence of str
        Rows to leave out, counted and reported: ``corrupt``, ``out_of_range``, ``missing``, ``duplicates``,
        ``unordered`` (see `gfimu.recording.filtered`).
    table : str, optional
        With a map: the table, topic or member of a file that holds several.
    to : {"kalibr", "ros", "turntable", "motor_turntable", "free_cube"}, optional
        Of a calibration, the format: `gfimu.exporting.kalibr`, `gfimu.exporting.ros`. Of an array, what carries it in
        the MuJoCo model (`sim.rigs.mjcf_export`), by default the turntable.
    lsb_m_s2 : float, optional
        Of a calibration for raw counts: size of a count by which the sensor's driver makes m/s² of counts; by default
        that of the array's parts.
    chip : str, optional
        Of a calibration: the one chip to export; all by default.
    noise : RecordingNoise, Recording, str or Path, optional
        Of a calibration: a recording at rest for the noise, or what `gfimu.noise` found; by default the data sheets'.

    Returns
    -------
    Recording, Calibration or AccelerometerArray
        What was read.

    Raises
    ------
    InputError
        If the source can't be read, or the target can't be written where it is asked for.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.convert("log.csv", "run.parquet", column_map="phyphox")  # doctest: +SKIP
    """
    from gfimu.commands.export_array import export_array
    from gfimu.commands.export_calibration import export_calibration
    from gfimu.commands.opened import as_array, as_source, files_by_map, name_of
    from gfimu.recording import Recording
    from gfimu.recording.carried_array import carried_array
    from gfimu.recording.checks import examine
    from gfimu.recording.formats import open_recording
    from gfimu.recording.mapped import MappedFile

    drawn = _array(source, target)
    if drawn is not None:
        if (lsb_m_s2, chip, noise) != (None, None, None):
            raise InputError("--lsb-m-s2, --chip and --noise are for a calibration (.json, from gfimu calibrate)")
        return export_array(drawn, target, to)
    drawing = None if array is None else as_array(array)
    calibration = _calibration(source)
    if calibration is not None:
        export_calibration(
            calibration, target, to=to, array=drawing, lsb_m_s2=lsb_m_s2, chip=chip, noise=noise, map_set=map_set
        )
        return calibration
    if (to, lsb_m_s2, chip, noise) != (None, None, None, None):
        raise InputError("--to, --lsb-m-s2, --chip and --noise are for a calibration (.json, from gfimu calibrate)")
    given = _given(source)
    changes = [*map_set, *_dropping(drop)]
    if isinstance(given[0], Recording | MappedFile):
        given = [as_source(given[0], map_set=changes), *given[1:]]
    elif not isinstance(given[0], str | Path):
        given = [as_source(given[0], drawing, column_map, changes), *given[1:]]
    elif column_map is not None or changes:
        files = [one for one in given if isinstance(one, str | Path)]
        given = [files_by_map(files, column_map, table, changes)]
    if len(given) > 1:
        raise InputError(f"{given[1]}: several files need --map, which says what the columns of each chip's file are")
    recording = given[0] if isinstance(given[0], Recording) else open_recording(as_source(given[0]), array=drawing)
    if recording.unit == "m_s2":
        examine(recording, drawing, source=name_of(given[0]), force=True)  # a conversion is how a file is mended
    if drawing is not None:
        recording = recording.carrying(drawing)
    elif "array_toml" in recording.metadata:
        named = os.fspath(given[0]) if isinstance(given[0], str | os.PathLike) else "the recording"
        carried_array(recording.metadata, source=named)  # a damaged one is not passed on
    if target is not None:
        _write(recording, Path(target))
    return recording


def _dropping(drop: str | Sequence[str]) -> list[str]:
    """Return the change of a column map that leaves rows out."""
    kinds = drop if isinstance(drop, str) else ",".join(drop)
    return [f"drop={kinds}"] if kinds else []


def _write(recording: Recording, target: Path) -> None:
    """Write a recording in the format that the ending of a file says."""
    if target.suffix in {".yaml", ".yml"}:
        raise InputError(f"{target}: YAML is for calibrations; write a recording as .csv, .parquet, .mcap or .euroc")
    if target.suffix in {".mcap", ".euroc"}:
        from gfimu.exporting import write_euroc, write_mcap

        (write_mcap if target.suffix == ".mcap" else write_euroc)(target, recording)
    else:
        recording.write(target)


def _array(source: object, target: str | Path | None) -> AccelerometerArray | None:
    """Return the array that is to be converted: one itself, or what is named where the target is a MuJoCo model."""
    from gfimu.commands.opened import as_array
    from gfimu.geometry.array import AccelerometerArray

    if isinstance(source, list | tuple) and len(source) == 1:
        source = source[0]
    if isinstance(source, AccelerometerArray):
        return source
    if target is None or Path(target).suffix != ".xml":
        return None
    if not isinstance(source, str | Path) or Path(source).suffix not in {"", ".toml", ".xml"}:
        raise InputError(f"{target}: a MuJoCo model is made of an array; give its name or .toml file")
    return as_array(source)


def _calibration(source: object) -> Calibration | None:
    """Return the calibration that is to be converted; None for a recording."""
    from gfimu.calibration.result import Calibration, load_calibration

    if isinstance(source, list | tuple) and len(source) == 1:
        source = source[0]
    if isinstance(source, str | Path):
        return load_calibration(source) if Path(source).suffix == ".json" else None
    return source if isinstance(source, Calibration) else None


def _given(
    source: RecordingLike | Calibration | AccelerometerArray | Sequence[str | Path],
) -> list[RecordingLike]:
    """Return one source or several as a list."""
    from gfimu.commands.opened import is_arrays

    several = isinstance(source, list | tuple) and not is_arrays(source)
    return list(source) if several else [source]  # type: ignore[arg-type, list-item]
