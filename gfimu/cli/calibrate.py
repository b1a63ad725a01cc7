"""`gfimu calibrate`: sensitivity, bias and alignment of the chips from a recording at rest."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gfimu.calibration.registry import METHODS
from gfimu.cli.mapped import ForceOption, MapOption, MapSetOption
from gfimu.cli.output import JsonOption, print_json, print_paths, print_table, progress

if TYPE_CHECKING:
    from gfimu.calibration.result import Calibration

__all__ = ["register"]

_PAIRS = ("xy", "xz", "yz")
_NOTABLE = 0.9


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="calibrate")(_calibrate)


def _calibrate(
    method: Annotated[str, typer.Argument(help=f"Method: {', '.join(METHODS)}.")],
    run: Annotated[
        Path,
        typer.Argument(help="Recording of static poses: .csv, .parquet, a MIMU4444 stream, or text rows time x y z."),
    ],
    out: Annotated[Path, typer.Option("--out", help="Calibration file to write (JSON).")],
    array: Annotated[
        str | None, typer.Option("--array", help="Array: a name or .toml file; else the recording's own.")
    ] = None,
    gravity: Annotated[float | None, typer.Option("--gravity", help="Local gravity, m/s².")] = None,
    latitude: Annotated[float | None, typer.Option("--latitude", help="Latitude, degrees: gravity from it.")] = None,
    height: Annotated[float, typer.Option("--height", help="Height above the ellipsoid, m.")] = 0.0,
    parameters: Annotated[
        int | None, typer.Option("--parameters", help="Per chip: 12 (full matrix) or 9 (triangular).")
    ] = None,
    input_kind: Annotated[
        str, typer.Option("--input", help="Rows that the fit uses: averaged, raw or wavelet.")
    ] = "averaged",
    rest_threshold: Annotated[
        float | None,
        typer.Option("--rest-threshold", help="Threshold of rest, reading unit squared; else from the data."),
    ] = None,
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
        typer.Option("--turn-on-std", help="With --update: turn-on repeatability of a bias, m/s²; 0.03 by default."),
    ] = None,
    bias_walk: Annotated[
        float | None,
        typer.Option("--bias-walk", help="With --update: random walk of a bias between poses, m/s²/√s; 0 by default."),
    ] = None,
    check: Annotated[
        Path | None, typer.Option("--check", help="Other poses at rest, which the fit does not see: |a| − g on them.")
    ] = None,
    picture: Annotated[Path | None, typer.Option("--picture", help="Picture to write (.png, .svg, .pdf).")] = None,
    force: ForceOption = False,
    column_map: MapOption = None,
    map_set: MapSetOption = None,
    json: JsonOption = False,
) -> None:
    """Calibrate the accelerometers of a recording, each parameter with its standard deviation.

    Example: gfimu calibrate multi-position poses.csv --latitude 52.3 --height 80 --out calibration.json

    Checked on other poses: gfimu calibrate multi-position poses.csv --out calibration.json --check others.csv
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
            rest_threshold=rest_threshold,
            min_rest=min_rest,
            levelling_std=levelling_std,
            motion=motion,
            column_map=column_map,
            map_set=map_set or [],
            update=update,
            turn_on_std=turn_on_std,
            bias_walk=bias_walk,
            check=check,
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
