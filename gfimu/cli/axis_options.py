"""The options of a known axis: --axis and how it and the chips about it are mounted."""

from __future__ import annotations

from typing import Annotated

from gfimu.cli.shared_options import shared

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

AxisOption = Annotated[str | None, shared("--axis")]
AxisPointOption = Annotated[tuple[float, float, float], shared("--axis-point")]
HubOption = Annotated[str, shared("--hub")]
InclinationOption = Annotated[float | None, shared("--inclination-rad")]
PointStdOption = Annotated[float, shared("--point-std-m")]
DirectionStdOption = Annotated[float, shared("--direction-std-rad")]
LeverStdOption = Annotated[float, shared("--lever-std-m")]
RotationStdOption = Annotated[float, shared("--rotation-std-rad")]
BiasStdOption = Annotated[float, shared("--bias-std-m-s2", when="With --axis: ")]
