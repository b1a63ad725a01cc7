"""`gfimu calibrate`: sensitivity, bias and alignment of the chips from a recording at rest."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gfimu.calibration.registry import METHODS
from gfimu.cli import completion
from gfimu.cli.output import print_json, print_paths, print_table, progress
from gfimu.cli.shared_options import ForceOption, JsonOption, MapOption, MapSetOption, PictureOption, shared

if TYPE_CHECKING:
    from gfimu.calibration.result import Calibration

__all__ = ["register"]

_PAIRS = ("xy", "xz", "yz")
_NOTABLE = 0.9


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="calibrate")(_calibrate)


def _calibrate(
    method: Annotated[
        str,
        typer.Argument(
            metavar="METHOD", autocompletion=completion.words(*METHODS), help=f"Method: {', '.join(METHODS)}."
        ),
    ],
    run: Annotated[
        Path,
        typer.Argument(
            metavar="RUN", help="Recording of static poses: .csv, .parquet, a MIMU4444 stream, or text rows time x y z."
        ),
    ],
    out: Annotated[Path, typer.Option("--out", help="Calibration to write (.json).")],
    array: Annotated[str | None, shared("--array", more="; else the recording's own")] = None,
    gravity: Annotated[float | None, shared("--gravity")] = None,
    latitude: Annotated[float | None, shared("--latitude", more=": gravity from it")] = None,
    height: Annotated[float, typer.Option("--height", help="Height above the ellipsoid, m.")] = 0.0,
    parameters: Annotated[
        int | None, typer.Option("--parameters", help="Per chip: 12 (full matrix) or 9 (triangular).")
    ] = None,
    input_kind: Annotated[
        str,
        typer.Option(
            "--input",
            metavar="KIND",
            autocompletion=completion.words("averaged", "raw", "wavelet"),
            help="Rows that the fit uses: averaged, raw or wavelet.",
        ),
    ] = "averaged",
    wavelet_level: Annotated[
        int | None, typer.Option("--wavelet-level", help="With --input wavelet: level of the transform; 4 by default.")
    ] = None,
    wavelet_threshold: Annotated[
        str | None,
        typer.Option(
            "--wavelet-threshold",
            help="With --input wavelet: leave out all details (none, the default), or those below the universal "
            "threshold (soft or hard).",
        ),
    ] = None,
    rest_threshold: Annotated[float | None, shared("--rest-threshold")] = None,
    min_rest: Annotated[
        float | None, typer.Option("--min-rest", help="Shortest pose, s; 1 by default, 2 for array.")
    ] = None,
    levelling_std: Annotated[
        float | None, typer.Option("--levelling-std", help="Standard deviation of a pose's tilt per axis, rad.")
    ] = None,
    motion: Annotated[
        Path | None,
        typer.Option("--motion", help="array: recording of the motion, or of shakes (may be RUN)."),
    ] = None,
    update: Annotated[
        Path | None,
        typer.Option("--update", help="array: calibration of an earlier run to carry over; the biases may have moved."),
    ] = None,
    turn_on_std: Annotated[
        float | None,
        typer.Option(
            "--turn-on-std",
            help="With --update, --calibration: turn-on repeatability of a bias, m/s²; 0.03 by default.",
        ),
    ] = None,
    bias_walk: Annotated[
        float | None,
        typer.Option("--bias-walk", help="With --update: random walk of a bias between poses, m/s²/√s; 0 by default."),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option("--calibration", help="spin: static calibration to start from, or that of another spin."),
    ] = None,
    radius_std: Annotated[
        float | None,
        typer.Option("--radius-std", help="spin: standard deviation of a chip's place, m; 5e-4 by default."),
    ] = None,
    stretch_std: Annotated[
        float | None,
        typer.Option("--stretch-std", help="spin: standard deviation of the arm stretch, s²/rad²; 1e-7 by default."),
    ] = None,
    check: Annotated[
        Path | None, typer.Option("--check", help="Other poses at rest, which the fit does not see: |a| − g on them.")
    ] = None,
    rate_table: Annotated[
        bool, typer.Option("--rate-table", help="gyro: RUN is of a rate table, whose tachometer is the reference.")
    ] = False,
    also: Annotated[
        list[Path] | None,
        typer.Option("--also", help="With --rate-table: a recording of the gyro mounted otherwise; repeat it."),
    ] = None,
    table_axes: Annotated[
        str,
        typer.Option(
            "--table-axes", help="Gyro's axis along the table's, of RUN and each --also: x,y,-z; else by file."
        ),
    ] = "",
    picture: PictureOption = None,
    force: ForceOption = False,
    column_map: MapOption = None,
    map_set: MapSetOption = None,
    json: JsonOption = False,
) -> None:
    """Calibrate the accelerometers or the gyro of a recording, each parameter with its standard deviation.

    Examples
    --------
    gfimu calibrate multi-position poses.csv --latitude 52.3 --height 80 --out calibration.json
    # Checked on other poses
    gfimu calibrate multi-position poses.csv --out calibration.json --check others.csv
    # Non-linearity on a turntable
    gfimu calibrate spin run.parquet --calibration static.json --out spin.json
    # A gyro on a rate table
    gfimu calibrate gyro x.csv --rate-table --also y.csv --also z.csv --table-axes x,y,z --out gyro.json
    """
    from gfimu.commands.calibrate import calibrate

    with progress("calibrating", total=1.0) as done:
        result = calibrate(
            method,
            run,
            progress=lambda share: done(share, "fitting positions to the shakes"),
            out=out,
            array=array,
            gravity=gravity,
            latitude=latitude,
            height=height,
            parameters=parameters,
            input_kind=input_kind,
            wavelet_level=wavelet_level,
            wavelet_threshold=wavelet_threshold,
            rest_threshold=rest_threshold,
            min_rest=min_rest,
            levelling_std=levelling_std,
            motion=motion,
            column_map=column_map,
            map_set=map_set or [],
            update=update,
            turn_on_std=turn_on_std,
            bias_walk=bias_walk,
            calibration=calibration,
            radius_std=radius_std,
            stretch_std=stretch_std,
            check=check,
            rate_table=rate_table,
            also=also or [],
            table_axes=table_axes,
            picture=picture,
            force=force,
        )
    written = {"calibration": out} | ({} if picture is None else {"picture": picture})
    if json:
        print_json(result.to_dict() | {"files": written})
    else:
        _print(result)
        print_paths(written.items())


def _print(result: Calibration) -> None:
    print_table(
        f"{result.method} calibration, unit {result.unit}", ("parameter", "value", "std", "unit"), result.rows()
    )
    # Correlation is news where magnitudes alone leave a rotation open, and only there.
    pairs = [
        (f"{chip} {pair.upper()} / {pair[::-1].upper()}", f"{result.correlation_of(first, second):+.4f}")
        for chip in result.chips
        for pair in _PAIRS
        if (first := f"{chip}_M_{pair}") in result.names
        and (second := f"{chip}_M_{pair[::-1]}") in result.names
        and abs(result.correlation_of(first, second)) > _NOTABLE
    ]
    if pairs:
        print_table("correlation of the misalignments", ("pair", "correlation"), pairs)
    print_table(
        "fit",
        ("quantity", "value"),
        [(key, value if isinstance(value, str) else f"{value:.6g}") for key, value in result.statistics.items()],
    )
    for text in result.statements:
        typer.echo(f"note: {text}")
    for text in result.warnings:
        typer.echo(f"warning: {text}")
