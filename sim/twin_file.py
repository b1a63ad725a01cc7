"""The twin file: assumptions of a simulation about a rig."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import msgspec

from gfimu.array.array_file import MountingTable
from gfimu.base.files.schema import Positive, Table, Triple, about
from gfimu.base.units import STANDARD_GRAVITY
from sim.effect_table import EffectTable

__all__ = ["Inclination", "TwinDriveTable", "TwinFile", "TwinSensorTable"]

Inclination = Annotated[float, msgspec.Meta(ge=0.0, le=math.pi)]
"""Angle between an axis and the vertical, rad."""


class TwinDriveTable(Table, frozen=True):
    """Reference that drives the simulated rig."""

    source: Annotated[
        Literal["tacho", "angle", "command", "gyro", "carriage", "carriage_speed", "carriage_acceleration"],
        about(
            "Reference that drives the table: its tachometer, its encoder, the command; gyro: a free body, whose "
            "specific force is unknown at every sample; carriage, carriage_speed, carriage_acceleration: a linear axis "
            "and its commanded place, speed or acceleration."
        ),
    ] = "tacho"


class TwinSensorTable(Table, frozen=True):
    """How the chips are set up."""

    part: Annotated[
        str | None,
        about(
            "Name of a part (gfimu list parts), or the path of a part file beside this file.",
            default="that of the array's first chip",
        ),
    ] = None
    range_g: Annotated[Positive, about("Range that is set, in units of standard gravity.")] = 16.0
    full_resolution: Annotated[bool, about("Whether a count keeps its size in every range.")] = True


class TwinFile(Table, frozen=True):
    """A simulation's assumptions about a rig; effects extend it."""

    array: Annotated[
        str,
        about("Name of an array (gfimu list arrays), or the path of an array file beside this file.", example="cube12"),
    ]
    name: Annotated[str, about("Name of the twin.")] = ""
    description: Annotated[str, about("Description, one line.")] = ""
    gravity_m_s2: Annotated[Positive, about("Local gravity.", "m/s²")] = STANDARD_GRAVITY
    cube_offset_m: Annotated[
        Triple, about("Body origin from the point of the axis at table height, table frame.", "m")
    ] = (0.0, 0.0, 0.06)
    axis_inclination_rad: Annotated[
        Inclination, about("Angle between the table's axis and the vertical; π/2 of a pendulum or a wheel.", "rad")
    ] = 0.0
    carriage_axis: Annotated[
        Triple, about("Direction of positive places of a linear axis, in the twin's world frame.")
    ] = (1.0, 0.0, 0.0)
    mounting: Annotated[
        MountingTable | None,
        about(
            "How the array sits on the axis; it replaces the array file's own axis, and with it go cube_offset_m and "
            "axis_inclination_rad, which follow from it.",
            default="upright, by cube_offset_m and axis_inclination_rad",
        ),
    ] = None
    sample_rate_hz: Annotated[Positive, about("Nominal sample rate.", "Hz")] = 100.0
    drive: Annotated[TwinDriveTable, about("Reference that drives the simulated rig.")] = TwinDriveTable()
    sensor: Annotated[TwinSensorTable, about("How the chips are set up.")] = TwinSensorTable()
    effect: Annotated[tuple[EffectTable, ...], about("Extensions of the model; a nominal twin has none.")] = ()
