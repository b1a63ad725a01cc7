"""`gfimu convert`: a recording in another format."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gfimu.cli import completion
from gfimu.cli.output import print_json, print_paths, print_table, progress
from gfimu.cli.shared_options import JsonOption, MapOption, MapSetOption, shared

if TYPE_CHECKING:
    from gfimu.calibration.result import Calibration
    from gfimu.geometry.array import AccelerometerArray

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="convert")(_convert)


def _convert(
    source: Annotated[
        list[Path],
        typer.Argument(
            metavar="SOURCE...",
            help="Recording: .csv, .parquet, a MIMU4444 stream, or with --map a foreign file, one per chip; "
            "or a calibration (.json), or an array (a name or .toml).",
        ),
    ],
    target: Annotated[
        Path,
        typer.Argument(
            metavar="TARGET",
            help="File to write: .csv, .parquet, .mcap (ROS 2), .euroc (a folder); .yaml of a calibration; .xml of an "
            "array, for MuJoCo.",
        ),
    ],
    array: Annotated[
        str | None, shared("--array", more="; its channels must be there, else every channel found is taken")
    ] = None,
    column_map: MapOption = None,
    map_set: MapSetOption = None,
    drop: Annotated[
        str,
        typer.Option(
            "--drop",
            metavar="KIND,...",
            help="Rows to leave out, counted: corrupt, out_of_range, missing, duplicates, unordered.",
        ),
    ] = "",
    table: Annotated[str | None, shared("--table")] = None,
    to: Annotated[
        str | None,
        typer.Option(
            "--to",
            metavar="FORMAT",
            autocompletion=completion.words("kalibr", "ros", "turntable", "motor_turntable", "free_cube"),
            help="Of a calibration, the format: kalibr or ros. Of an array: turntable, motor_turntable or free_cube.",
        ),
    ] = None,
    lsb_m_s2: Annotated[
        float | None,
        typer.Option("--lsb-m-s2", help="Of a calibration for counts: m/s² per count, as the sensor's driver has it."),
    ] = None,
    chip: Annotated[str | None, typer.Option("--chip", help="Of a calibration: the one chip to export.")] = None,
    noise: Annotated[
        Path | None, typer.Option("--noise", help="Of a calibration: recording at rest, for noise and sample rate.")
    ] = None,
    json: JsonOption = False,
) -> None:
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
    from gfimu.commands.convert import convert
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.recording import Recording

    with progress("converting"):
        recording = convert(
            source,
            target,
            array=array,
            column_map=column_map,
            map_set=map_set or [],
            drop=drop,
            table=table,
            to=to,
            lsb_m_s2=lsb_m_s2,
            chip=chip,
            noise=noise,
        )
    if isinstance(recording, AccelerometerArray):
        _print_array(recording, target, json=json)
        return
    if not isinstance(recording, Recording):
        _print_calibration(recording, target, str(to), json=json)
        return
    figures = {
        "samples": len(recording),
        "channels": len(recording.channels),
        "duration_s": recording.duration,
        "sample_rate_hz": recording.sample_rate if len(recording) > 1 else None,
        "gaps": len(recording.gaps) if len(recording) > 1 else 0,
    } | {key: value for key, value in recording.metadata.items() if key.startswith(("packets", "bytes"))}
    figures |= {f"dropped_rows_{kind}": count for kind, count in recording.dropped.items()}
    if json:
        print_json(figures | {"files": {"recording": target}})
    else:
        print_table(", ".join(map(str, source)), ("quantity", "value"), _shown(figures))
        print_paths([("recording", target)])


def _print_array(found: AccelerometerArray, target: Path, *, json: bool) -> None:
    figures = {"array": found.name, "chips": len(found.chips), "channels": found.n_channels}
    if json:
        print_json(figures | {"files": {"model": target}})
    else:
        print_table(str(target), ("quantity", "value"), _shown(figures))
        print_paths([("model", target)])


def _print_calibration(found: Calibration, target: Path, to: str, *, json: bool) -> None:
    figures = {"format": to, "method": found.method, "unit": found.unit, "chips": len(found.chips)}
    if json:
        print_json(figures | {"files": {"calibration": target}})
    else:
        print_table(str(target), ("quantity", "value"), _shown(figures))
        print_paths([("calibration", target)])


def _shown(figures: Mapping[str, object]) -> list[tuple[str, str]]:
    return [(key, f"{value:.9g}" if isinstance(value, float) else str(value)) for key, value in figures.items()]
