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
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from gfimu.base.declared import Declared, Key, Table, figure, figures
from gfimu.base.errors import InputError, unknown_name
from gfimu.base.files.atomic_file import write_text
from gfimu.base.files.outputs import OutputFile
from gfimu.commands import given
from gfimu.commands.opened import as_array, as_calibration, as_runs, as_source, files_by_map, name_of
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import ARRAY, MAP_OF_TABLE, file_argument

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gfimu.array.array import AccelerometerArray
    from gfimu.base.files.memory import MemorySize
    from gfimu.calibration.result import Calibration
    from gfimu.recording import Recording
    from gfimu.recording.importing import ColumnMap
    from gfimu.recording.mapped import RecordingLike, RecordingSource
    from gfimu.sensor_noise import RecordingNoise

__all__ = ["convert"]


_COUNTED = ("packets", "bytes", "dropped_rows")


@dataclass(frozen=True)
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
    dropped_rows_wrong_read: Annotated[int | None, _left_out("as misread")] = None
    dropped_rows_missing: Annotated[int | None, _left_out("for a missing value")] = None


@dataclass(frozen=True)
class ConvertedArray(_Shown):
    """An array as a MuJoCo model."""

    array: Annotated[str, figure("Name of the array.", head="array")]
    chips: Annotated[int, figure("Chips.", head="chips")]
    channels: Annotated[int, figure("Channels.", head="channels")]


@dataclass(frozen=True)
class ConvertedCalibration(_Shown):
    """A calibration in another format."""

    format: Annotated[str, figure("kalibr or ros.", head="format")]
    method: Annotated[str, figure("Method that made the calibration.", head="method")]
    unit: Annotated[str, figure("Unit of the readings that it applies to.", head="unit")]
    chips: Annotated[int, figure("Chips.", head="chips")]


def _report(
    found: "Recording | Calibration | AccelerometerArray", values: Mapping[str, Any]
) -> Converted | ConvertedArray | ConvertedCalibration:
    """Return the figures of what was converted, of the arguments of the command."""
    from gfimu.array.array import AccelerometerArray
    from gfimu.calibration.result import Calibration

    target = str(values["target"])
    if isinstance(found, AccelerometerArray):
        return ConvertedArray(target, found.name, len(found.chips), found.n_channels)
    if isinstance(found, Calibration):
        return ConvertedCalibration(target, values["to"], found.method, found.unit, len(found.chips))
    several = len(found) > 1
    counted = {**found.metadata, **{f"dropped_rows_{kind}": count for kind, count in found.dropped.items()}}
    return Converted(
        ", ".join(map(str, values["source"])),
        len(found),
        len(found.channels),
        found.duration,
        found.sample_rate if several else None,
        len(found.gaps) if several else 0,
        **{key: counted[key] for key in Converted.keys() & counted.keys() if key.startswith(_COUNTED)},
    )


def _kind_of(target: "str | Path") -> str:
    """Return what a file of that name holds."""
    return {".xml": "model", ".yaml": "calibration", ".yml": "calibration"}.get(Path(target).suffix, "recording")


_SOURCE = file_argument(
    "Recording: .csv, .parquet, a MIMU4444 stream, or with --map a foreign file, one per chip; or a calibration "
    "(.json), or an array (a name or .toml).",
    "SOURCE...",
    list[Path],
)
_EXPORT = OutputFile(
    "what is converted",
    (".csv", ".parquet", ".mcap", ".euroc", ".yaml", ".yml", ".xml"),
    {".mcap": ("mcap", "rosbags"), ".xml": ("mujoco",)},
)
_TARGET = Option(
    "File to write: .csv, .parquet, .mcap (ROS 2), .euroc (a folder); .yaml of a calibration; .xml of an array, for "
    "MuJoCo.",
    "TARGET",
    argument=True,
    needed=True,
    writes=_EXPORT,
    what=_kind_of,
)
_DROP = Option(
    "Rows to leave out, counted: corrupt, out_of_range, missing, wrong_read, duplicates, unordered.",
    "KIND,...",
    kind=str,
)
_TO = Option(
    "Of a calibration, the format: kalibr or ros. Of an array: turntable, motor_turntable or free_cube.",
    "FORMAT",
    offers=("kalibr", "ros", "turntable", "motor_turntable", "free_cube"),
)
_COUNT = Option("Of a calibration for counts: m/s² per count, as the sensor's driver has it.")
_NOISE = Option("Of a calibration: recording at rest, for noise and sample rate.", "FILE", reads=True)


@command(report=_report, doing="converting")
def convert(
    source: Annotated["RecordingLike | Calibration | AccelerometerArray | Sequence[str | Path]", _SOURCE],
    target: Annotated["str | Path | None", _TARGET] = None,
    *,
    array: Annotated[given.Array, ARRAY.also("; its channels must be there, else every channel found is taken")] = None,
    column_map: Annotated[given.Map, MAP_OF_TABLE] = None,
    max_memory: given.Memory = None,
    drop: Annotated["str | Sequence[str]", _DROP] = "",
    to: Annotated[str | None, _TO] = None,
    lsb_m_s2: Annotated[float | None, _COUNT] = None,
    chip: Annotated[str | None, Option("Of a calibration: the one chip to export.")] = None,
    noise: Annotated["RecordingNoise | Recording | str | Path | None", _NOISE] = None,
) -> "Recording | Calibration | AccelerometerArray":
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
    from gfimu.calibration.result import Calibration

    sources = as_runs(source)  # type: ignore[arg-type]
    alone = sources[0] if len(sources) == 1 else None
    drawn = _array(alone, target)
    if drawn is not None:
        if (lsb_m_s2, chip, noise) != (None, None, None):
            raise InputError("--lsb-m-s2, --chip and --noise are for a calibration (.json, from gfimu calibrate)")
        if target is not None and Path(target).suffix != ".xml":
            raise InputError(f"{target}: an array is written as a MuJoCo model; name it .xml")
        from sim.rigs.mjcf_export import array_as_mjcf

        text = array_as_mjcf(drawn, to or "turntable")
        if target is not None:
            write_text(target, text)
        return drawn
    drawing = None if array is None else as_array(array)
    if isinstance(alone, Calibration) or (
        isinstance(alone, str | Path) and Path(alone).suffix == ".json" and not column_map
    ):
        from gfimu.calibration.exporting import TARGETS, calibrated_chips, notes_of
        from gfimu.commands.noise import noise as recorded_noise
        from gfimu.sensor_noise import RecordingNoise

        calibration = as_calibration(alone)
        if to is None:
            raise InputError(f"a calibration is written for one of {', '.join(TARGETS)}; name it with --to")
        if to not in TARGETS:
            raise unknown_name("format of a calibration", to, TARGETS)
        if target is not None and Path(target).suffix not in {".yaml", ".yml"}:
            raise InputError(f"{target}: a calibration for {to} ends in .yaml or .yml; name it so")
        if noise is not None and not isinstance(noise, RecordingNoise):
            noise = recorded_noise(noise, calibration=calibration, column_map=column_map, max_memory=max_memory)
        chips = calibrated_chips(calibration, drawing, lsb_m_s2=lsb_m_s2, noise=noise, chip=chip)
        text = TARGETS[to](chips, notes=notes_of(calibration))
        if target is not None:
            write_text(target, text)
        return calibration
    if (to, lsb_m_s2, chip, noise) != (None, None, None, None):
        raise InputError("--to, --lsb-m-s2, --chip and --noise are for a calibration (.json, from gfimu calibrate)")
    recording = _read(sources, drawing, _dropping(sources[0], column_map, drop), max_memory)
    if target is not None:
        _write(recording, Path(target))
    return recording


def _read(
    sources: "list[RecordingLike]",
    drawing: "AccelerometerArray | None",
    column_map: "ColumnMap | str | Path | None",
    max_memory: "MemorySize | None",
) -> "Recording":
    """Return the recording that one source, or a file per chip, holds."""
    from gfimu.recording.carried_array import carried_array
    from gfimu.recording.doubts.judge import examine
    from gfimu.recording.formats import open_recording

    first, *others = sources
    if column_map is not None and isinstance(first, str | Path):
        source: RecordingSource = files_by_map([one for one in sources if isinstance(one, str | Path)], column_map)
    elif others:
        raise InputError(f"{others[0]}: several files need --map, which says what the columns of each chip's file are")
    else:
        source = as_source(first, drawing, column_map)
    recording = open_recording(source, array=drawing, max_memory=max_memory)
    if recording.unit == "m_s2":
        examine(recording, drawing, source=name_of(source), force=True)  # a conversion is how a file is mended
    if drawing is not None:
        return recording.carrying(drawing)
    if "array_toml" in recording.metadata:
        named = os.fspath(source) if isinstance(source, str | os.PathLike) else "the recording"
        carried_array(recording.metadata, source=named)  # a damaged one is not passed on
    return recording


def _dropping(
    source: "RecordingLike", column_map: "ColumnMap | str | Path | None", drop: "str | Sequence[str]"
) -> "ColumnMap | str | Path | None":
    """Return the column map, by default the source's own, with the kinds of rows that are to be left out, too."""
    from gfimu.recording.importing import load_map
    from gfimu.recording.mapped import MappedFile

    if column_map is None and isinstance(source, MappedFile):
        column_map = source.column_map
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

    if isinstance(source, AccelerometerArray):
        return source
    if target is None or Path(target).suffix != ".xml":
        return None
    if not isinstance(source, str | Path) or Path(source).suffix not in {"", ".toml", ".xml"}:
        raise InputError(f"{target}: a MuJoCo model is made of an array; give its name or .toml file")
    return as_array(source)
