r"""Convert a recording between CSV and Parquet, or import MIMU4444 streams and foreign files. Readings become m/s².

Examples
--------
gfimu convert exp_1.bin.gz run.parquet
# A Klipper recording
gfimu convert adxl345-x.csv run.parquet --map klipper
# One file per chip on a common clock
gfimu convert chip1.csv chip2.csv run.parquet --map klipper --array mine.toml
# A plain csv, no map written
gfimu convert log.csv run.csv --map-set time.column=ms --map-set time.unit=ms --map-set unit=g \
    --map-set channels.a11=ax --map-set channels.a12=ay --map-set channels.a13=az
# A damaged recording
gfimu convert run.csv clean.csv --drop corrupt,duplicates
# For ROS 2
gfimu convert run.parquet run.mcap
# A calibration for Kalibr
gfimu convert cal.json imu.yaml --to kalibr --array mine.toml --noise rest.parquet
# An array as a MuJoCo model
gfimu convert mine.toml mine.xml --to motor_turntable
"""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from gfimu.base.errors import InputError
from gfimu.commands.shell.completion import words
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import ARRAY, MAP_OF_TABLE, MAX_MEMORY
from gfimu.commands.shell.output_files import EXPORT

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Any

    from gfimu.array.array import AccelerometerArray
    from gfimu.base.files.memory import MemorySize
    from gfimu.calibration.result import Calibration
    from gfimu.commands.converted import Converted, ConvertedArray, ConvertedCalibration
    from gfimu.commands.opened import Source
    from gfimu.recording import Recording
    from gfimu.recording.importing import ColumnMap
    from gfimu.recording.mapped import RecordingLike
    from gfimu.sensor_noise import RecordingNoise

__all__ = ["convert"]


def _results() -> tuple[type, ...]:
    from gfimu.commands.converted import Converted, ConvertedArray, ConvertedCalibration

    return Converted, ConvertedArray, ConvertedCalibration


def _report(
    found: "Recording | Calibration | AccelerometerArray", given: "Mapping[str, Any]"
) -> "Converted | ConvertedArray | ConvertedCalibration":
    from gfimu.commands.converted import converted

    return converted(found, given)


def _kind_of(target: "str | Path") -> str:
    """Return what a file of that name holds."""
    return {".xml": "model", ".yaml": "calibration", ".yml": "calibration"}.get(Path(target).suffix, "recording")


@command(results=_results, report=_report, doing="converting")
def convert(
    source: Annotated[
        "RecordingLike | Calibration | AccelerometerArray | Sequence[str | Path]",
        Option(
            "Recording: .csv, .parquet, a MIMU4444 stream, or with --map a foreign file, one per chip; "
            "or a calibration (.json), or an array (a name or .toml).",
            "SOURCE...", kind=list[Path], argument=True, reads=True,
        ),
    ],
    target: Annotated[
        "str | Path | None",
        Option(
            "File to write: .csv, .parquet, .mcap (ROS 2), .euroc (a folder); .yaml of a calibration; .xml of an "
            "array, for MuJoCo.",
            "TARGET", kind=Path, argument=True, needed=True, writes=EXPORT, what=_kind_of,
        ),
    ] = None,
    *,
    array: Annotated[
        "AccelerometerArray | str | Path | None",
        ARRAY.also("; its channels must be there, else every channel found is taken"),
    ] = None,
    column_map: Annotated["ColumnMap | str | Path | None", MAP_OF_TABLE] = None,
    max_memory: Annotated["MemorySize | None", MAX_MEMORY] = None,
    drop: Annotated[
        "str | Sequence[str]",
        Option(
            "Rows to leave out, counted: corrupt, out_of_range, missing, duplicates, unordered.", "KIND,...", kind=str
        ),
    ] = "",
    to: Annotated[
        str | None,
        Option(
            "Of a calibration, the format: kalibr or ros. Of an array: turntable, motor_turntable or free_cube.",
            "FORMAT",
            offers=words("kalibr", "ros", "turntable", "motor_turntable", "free_cube"),
        ),
    ] = None,
    lsb_m_s2: Annotated[
        float | None, Option("Of a calibration for counts: m/s² per count, as the sensor's driver has it.")
    ] = None,
    chip: Annotated[str | None, Option("Of a calibration: the one chip to export.")] = None,
    noise: Annotated[
        "RecordingNoise | Recording | str | Path | None",
        Option("Of a calibration: recording at rest, for noise and sample rate.", "FILE", kind=Path, reads=True),
    ] = None,
) -> "Recording | Calibration | AccelerometerArray":  # fmt: skip
    """Read a recording in any format that is known, in m/s², and write it as CSV, Parquet, MCAP or EuRoC.

    Or read a calibration and write it as Kalibr's or imu_calib's YAML; or an array and write it as a MuJoCo model.
    MCAP has a topic of ``sensor_msgs/Imu`` per tri-axial chip, ``.euroc`` is a folder in the layout of EuRoC / ASL. By
    default a count has the size that the array's parts state, all chips of a calibration are exported, with the noise
    of the data sheets, and a turntable carries an array.

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
    from gfimu.commands.opened import as_array

    drawn = _array(source, target)
    if drawn is not None:
        if (lsb_m_s2, chip, noise) != (None, None, None):
            raise InputError("--lsb-m-s2, --chip and --noise are for a calibration (.json, from gfimu calibrate)")
        return export_array(drawn, target, to)
    drawing = None if array is None else as_array(array)
    calibration = _calibration(source)
    if calibration is not None:
        export_calibration(
            calibration,
            target,
            to=to,
            array=drawing,
            lsb_m_s2=lsb_m_s2,
            chip=chip,
            noise=noise,
            column_map=column_map,
            max_memory=max_memory,
        )
        return calibration
    if (to, lsb_m_s2, chip, noise) != (None, None, None, None):
        raise InputError("--to, --lsb-m-s2, --chip and --noise are for a calibration (.json, from gfimu calibrate)")
    recording = _read(_given(source), drawing, column_map, drop, max_memory)
    if target is not None:
        _write(recording, Path(target))
    return recording


def _read(
    given: "list[RecordingLike]",
    drawing: "AccelerometerArray | None",
    column_map: "ColumnMap | str | Path | None",
    drop: "str | Sequence[str]",
    max_memory: "MemorySize | None",
) -> "Recording":
    """Return the recording that one source, or a file per chip, holds."""
    from gfimu.commands.opened import as_source, files_by_map, name_of
    from gfimu.recording import Recording
    from gfimu.recording.carried_array import carried_array
    from gfimu.recording.checks import examine
    from gfimu.recording.formats import open_recording
    from gfimu.recording.mapped import MappedFile

    first, *others = given
    if column_map is None and isinstance(first, MappedFile):
        column_map = first.column_map
    chosen = _dropping(column_map, drop)
    source: Source
    if chosen is not None and isinstance(first, str | Path):
        source = files_by_map([one for one in given if isinstance(one, str | Path)], chosen)
    elif others:
        raise InputError(f"{others[0]}: several files need --map, which says what the columns of each chip's file are")
    else:
        source = as_source(first, drawing, chosen)
    recording = (
        source if isinstance(source, Recording) else open_recording(source, array=drawing, max_memory=max_memory)
    )
    if recording.unit == "m_s2":
        examine(recording, drawing, source=name_of(source), force=True)  # a conversion is how a file is mended
    if drawing is not None:
        return recording.carrying(drawing)
    if "array_toml" in recording.metadata:
        named = os.fspath(source) if isinstance(source, str | os.PathLike) else "the recording"
        carried_array(recording.metadata, source=named)  # a damaged one is not passed on
    return recording


def _dropping(
    column_map: "ColumnMap | str | Path | None", drop: "str | Sequence[str]"
) -> "ColumnMap | str | Path | None":
    """Return a column map that leaves out rows of some kinds, too."""
    from gfimu.recording.importing import load_map

    kinds = drop if isinstance(drop, str) else ",".join(drop)
    return load_map(column_map, [f"drop={kinds}"]) if kinds else column_map


def _write(recording: "Recording", target: Path) -> None:
    """Write a recording in the format that the ending of a file says."""
    if target.suffix in {".yaml", ".yml"}:
        raise InputError(f"{target}: YAML is for calibrations; write a recording as .csv, .parquet, .mcap or .euroc")
    if target.suffix in {".mcap", ".euroc"}:
        from gfimu.calibration.exporting import write_euroc, write_mcap

        (write_mcap if target.suffix == ".mcap" else write_euroc)(target, recording)
    else:
        recording.write(target)


def _array(source: object, target: "str | Path | None") -> "AccelerometerArray | None":
    """Return the array that is to be converted: one itself, or what is named where the target is a MuJoCo model."""
    from gfimu.array.array import AccelerometerArray
    from gfimu.commands.opened import as_array

    if isinstance(source, list | tuple) and len(source) == 1:
        source = source[0]
    if isinstance(source, AccelerometerArray):
        return source
    if target is None or Path(target).suffix != ".xml":
        return None
    if not isinstance(source, str | Path) or Path(source).suffix not in {"", ".toml", ".xml"}:
        raise InputError(f"{target}: a MuJoCo model is made of an array; give its name or .toml file")
    return as_array(source)


def _calibration(source: object) -> "Calibration | None":
    """Return the calibration that is to be converted; None for a recording."""
    from gfimu.calibration.result import Calibration, load_calibration

    if isinstance(source, list | tuple) and len(source) == 1:
        source = source[0]
    if isinstance(source, str | Path):
        return load_calibration(source) if Path(source).suffix == ".json" else None
    return source if isinstance(source, Calibration) else None


def _given(
    source: "RecordingLike | Calibration | AccelerometerArray | Sequence[str | Path]",
) -> "list[RecordingLike]":
    """Return one source or several as a list."""
    from gfimu.commands.opened import is_arrays

    several = isinstance(source, list | tuple) and not is_arrays(source)
    return list(source) if several else [source]  # type: ignore[arg-type, list-item]
