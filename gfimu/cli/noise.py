"""`gfimu noise`: Allan deviation and noise terms of a recording at rest."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from gfimu.cli import completion
from gfimu.cli.axis_options import AxisOption, AxisPointOption, HubOption
from gfimu.cli.output import print_json, print_paths, print_table, progress
from gfimu.cli.shared_options import ForceOption, JsonOption, MapOption, MapSetOption, PictureOption, shared

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="noise")(_noise)


def _noise(
    run: Annotated[
        Path, typer.Argument(metavar="RUN", help="Recording at rest: .csv, .parquet, a MIMU4444 stream, or text rows.")
    ],
    stretch: Annotated[
        str,
        typer.Option(
            "--stretch",
            metavar="KIND",
            autocompletion=completion.words("rest", "all"),
            help="Samples to use: rest (the longest one) or all (up to the first gap).",
        ),
    ] = "rest",
    rest_threshold: Annotated[float | None, shared("--rest-threshold")] = None,
    calibration: Annotated[Path | None, shared("--calibration")] = None,
    kalibr: Annotated[Path | None, typer.Option("--kalibr", help="Kalibr file to write (.yaml).")] = None,
    picture: PictureOption = None,
    force: ForceOption = False,
    column_map: MapOption = None,
    map_set: MapSetOption = None,
    axis: AxisOption = None,
    axis_point: AxisPointOption = (0.0, 0.0, 0.0),
    hub: HubOption = "fixed",
    speed: Annotated[float, shared("--speed-rad-s", when="With --axis: ", more=", at which that holds")] = math.tau,
    array: Annotated[str | None, shared("--array", when="With --axis: ", more="; else the recording's own")] = None,
    json: JsonOption = False,
) -> None:
    """Identify velocity random walk N, bias instability B, acceleration random walk K, quantisation Q and ramp R.

    Examples
    --------
    gfimu noise rest.parquet --picture allan.png
    # For Kalibr
    gfimu noise rest.parquet --kalibr imu.yaml
    # One chip on a table
    gfimu noise rest.parquet --axis z --axis-point -0.1 0 0
    """
    from gfimu.commands.noise import noise
    from gfimu.sensor_noise.identification import TERMS

    with progress("identifying the noise"):
        result = noise(
            run,
            column_map=column_map,
            map_set=map_set or [],
            stretch=stretch,
            rest_threshold=rest_threshold,
            calibration=calibration,
            kalibr=kalibr,
            picture=picture,
            array=array,
            axis=axis,
            axis_point=axis_point,
            hub=hub,
            speed_rad_s=speed,
            force=force,
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
    about = result.about_axis
    if about is not None:
        bounds = about.bounds
        print_table(
            f"Rotation about the known axis at {bounds.rate_rad_s:.4g} rad/s, {bounds.axis.hub} hub",
            ("quantity", "1 σ", "unit"),
            [
                ("angular acceleration, per sample", _figure(bounds.acceleration_std), "rad/s²"),
                ("rate, per sample", _figure(bounds.sample_std), "rad/s"),
                ("rate, of a filter that has settled", _figure(bounds.filter_std), "rad/s"),
                ("rate, by bias instability", _figure(about.instability_rate_std), "rad/s"),
            ],
            note="—: one sample can't show it. How angle and rate run off with time: gfimu drift --axis.",
        )
    print_paths(written.items())


def _figure(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "—"


def _times(unit: str, power: str) -> str:
    """Return the unit of a term from that of the readings."""
    return {"m/s²·s": "m/s", "m/s²/s": "m/s³"}.get(unit + power, unit + power)
