"""`gfimu noise`: Allan deviation and noise terms of a recording at rest."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gfimu.cli.mapped import MapOption, MapSetOption
from gfimu.cli.output import JsonOption, print_json, print_paths, print_table

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="noise")(_noise)


def _noise(
    run: Annotated[Path, typer.Argument(help="Recording at rest: .csv, .parquet, a MIMU4444 stream, or text rows.")],
    stretch: Annotated[
        str, typer.Option("--stretch", help="Samples to use: rest (the longest one) or all (up to the first gap).")
    ] = "rest",
    rest_threshold: Annotated[
        float | None,
        typer.Option("--rest-threshold", help="Threshold of rest, reading unit squared; else from the data."),
    ] = None,
    calibration: Annotated[Path | None, typer.Option("--calibration", help="Calibration to apply first.")] = None,
    kalibr: Annotated[Path | None, typer.Option("--kalibr", help="Kalibr imu.yaml to write.")] = None,
    picture: Annotated[Path | None, typer.Option("--picture", help="Picture to write (.png, .svg, .pdf).")] = None,
    column_map: MapOption = None,
    map_set: MapSetOption = None,
    json: JsonOption = False,
) -> None:
    """Identify velocity random walk N, bias instability B, acceleration random walk K, quantisation Q and ramp R.

    Example: gfimu noise rest.parquet --kalibr imu.yaml --picture allan.png
    """
    from gfimu.commands.noise import noise
    from gfimu.sensor_noise.identification import TERMS

    result = noise(
        run,
        column_map=column_map,
        map_set=map_set or [],
        stretch=stretch,
        rest_threshold=rest_threshold,
        calibration=calibration,
        kalibr=kalibr,
        picture=picture,
    )
    written = {} if kalibr is None else {"Kalibr": kalibr}
    written |= {} if picture is None else {"picture": picture}
    if json:
        print_json(result.to_dict() | {"files": written})
        return
    unit = {"m_s2": "m/s²"}.get(result.unit, result.unit)
    print_table(
        f"noise over {result.duration_s:.1f} s from {result.start_s:.1f} s, {result.rate:.4g} Hz, readings in {unit}",
        ("channel", *result.shown, "B by minimum"),
        result.rows(),
        note="; ".join(
            f"{symbol} {name}, {_times(unit, power)}"
            for symbol, (name, power) in TERMS.items()
            if symbol in result.shown
        )
        + "; <: not found, 95 % limit",
    )
    print_paths(written.items())


def _times(unit: str, power: str) -> str:
    """Return the unit of a term from that of the readings."""
    return {"m/s²·s": "m/s", "m/s²/s": "m/s³"}.get(unit + power, unit + power)
