"""The options of a known axis: --axis and how it and the chips about it are mounted."""

from __future__ import annotations

from typing import Annotated

import typer

__all__ = [
    "AxisOption",
    "AxisPointOption",
    "BiasStdOption",
    "DirectionStdOption",
    "HubOption",
    "InclinationOption",
    "LeverStdOption",
    "PointStdOption",
    "RotationStdOption",
]

AxisOption = Annotated[
    str | None,
    typer.Option("--axis", help="Axis about which alone the array turns: x, y, z or 0,0,1. Few chips then suffice."),
]
AxisPointOption = Annotated[
    tuple[float, float, float], typer.Option("--axis-point", help="A point of that axis, body frame, m.")
]
HubOption = Annotated[
    str, typer.Option("--hub", help="With --axis: fixed (a table) or free (a wheel on a moving body).")
]
InclinationOption = Annotated[
    float | None,
    typer.Option(
        "--inclination-rad",
        help="Angle between --axis and the vertical; else from the data, or 0 (a free hub: π/2) where there are none.",
    ),
]
PointStdOption = Annotated[
    float, typer.Option("--point-std-m", help="With --axis: how exactly --axis-point is known, m.")
]
DirectionStdOption = Annotated[
    float, typer.Option("--direction-std-rad", help="With --axis: how exactly its direction is known, rad.")
]
LeverStdOption = Annotated[
    float, typer.Option("--lever-std-m", help="With --axis: how exactly each chip's place is known, m.")
]
RotationStdOption = Annotated[
    float, typer.Option("--rotation-std-rad", help="With --axis: how exactly each chip's orientation is known, rad.")
]
BiasStdOption = Annotated[
    float, typer.Option("--bias-std-m-s2", help="With --axis: standard deviation of each channel's bias, m/s².")
]
