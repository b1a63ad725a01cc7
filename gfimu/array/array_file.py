"""The array file: chips on a rigid body, and the axis about which alone it turns."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from gfimu.base.files.schema import NotNegative, Positive, Table, Triple, about

__all__ = ["CHIP_NAME", "ArrayFile", "ChipTable", "MountingTable", "TurningAxisTable"]

_Row = list[float]

CHIP_NAME = r"[\w.+ -]*"
"""Regular expression of a chip's name, which becomes that of columns, of sites in MJCF and of entities in rerun."""


class ChipTable(Table, frozen=True):
    """One accelerometer chip with one, two or three sensing axes at one point of the body."""

    position_m: Annotated[Triple, about("Position of the proof mass, body frame.", "m", example=[0.05, 0.05, 0.05])]
    axes: Annotated[
        Annotated[tuple[_Row | float, ...], msgspec.Meta(min_length=1, max_length=3)],
        about(
            "Unit vectors of the sensing axes, body frame: one to three rows of three numbers.",
            must_be="lists of numbers: one to three rows of three",
            example=[[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        ),
    ]
    name: Annotated[
        str,
        about(
            "Name of the chip; its channels are the name and 1, 2, 3.",
            default="a1, a2 … in their order",
            must_be="made of letters, digits, spaces and _ - + .",
            pattern=rf"^{CHIP_NAME}(?![\s\S])",
        ),
    ] = ""
    part: Annotated[str, about("Name of a part (gfimu list parts), or the path of a part file beside this file.")] = (
        "adxl345"
    )
    supply_V: Annotated[Positive | None, about("Supply voltage of this chip.", "V", default="that of the scenario")] = (
        None
    )
    output_data_rate_hz: Annotated[
        Positive | None,
        about(
            "Output data rate that this chip is set to; its noise and bandwidth follow.",
            "Hz",
            default="that of the scenario",
        ),
    ] = None
    own_clock: Annotated[
        bool,
        about("Whether the chip samples by a clock of its own, so that its samples drift against the board's."),
    ] = False


class TurningAxisTable(Table, frozen=True):
    """The axis about which alone the body turns, where it is known: a table, a wheel, a pendulum."""

    direction: Annotated[
        str | Triple,
        about(
            "Direction of the axis, body frame: x, y, z (or -z), or three numbers of any length.",
            must_be="x, y, z or a list of 3 finite numbers",
            example=[0, 0, 1],
        ),
    ]
    point_m: Annotated[Triple, about("A point of the axis, body frame.", "m")] = (0.0, 0.0, 0.0)
    hub: Annotated[
        Literal["fixed", "free"],
        about("Whether the axis stands still (a table), or moves with a body of unknown acceleration (a wheel)."),
    ] = "fixed"
    inclination_rad: Annotated[
        float | None, about("Angle between the axis and the vertical, 0 (upright) to π.", "rad", default="estimated")
    ] = None
    point_std_m: Annotated[
        NotNegative, about("Standard deviation of the point, each direction across the axis; 0: exact.", "m")
    ] = 0.0
    direction_std_rad: Annotated[
        NotNegative, about("Standard deviation of the direction, each of two angles; 0: exact.", "rad")
    ] = 0.0
    lever_std_m: Annotated[
        NotNegative, about("Standard deviation of the place of each chip, each direction; 0: exact.", "m")
    ] = 0.0
    rotation_std_rad: Annotated[
        NotNegative, about("Standard deviation of the orientation of each chip, each of three angles; 0: exact.", "rad")
    ] = 0.0
    bias_std_m_s2: Annotated[
        NotNegative, about("Standard deviation of the constant bias of each channel; 0: exact.", "m/s²")
    ] = 0.0


class MountingTable(Table, frozen=True):
    """Older form of `[turning_axis]`, which can still be read."""

    axis: Annotated[Triple, about("Direction of the axis, body frame.", example=[0, 0, 1])]
    origin_m: Annotated[Triple, about("A point of the axis, body frame.", "m")] = (0.0, 0.0, 0.0)
    inclination_deg: Annotated[
        float | None, about("Angle between the axis and the vertical, 0 (upright) to 180.", "°", default="estimated")
    ] = None
    hub: Annotated[
        Literal["fixed", "moving"],
        about("Whether the axis stands still (a table), or moves with a body of unknown acceleration (a wheel)."),
    ] = "fixed"


class ArrayFile(Table, frozen=True):
    """A rigid set of accelerometer chips: where they sit, and where their sensing axes point."""

    chip: Annotated[
        Annotated[tuple[ChipTable, ...], msgspec.Meta(min_length=1)],
        about("The chips, in the order of the channels."),
    ]
    name: Annotated[str, about("Name of the array.", default="the name of the file")] = ""
    description: Annotated[str, about("Description, one line.")] = ""
    length_unit_m: Annotated[
        Positive | None,
        about("Length that scoring calls 1 (half the edge of a cube).", "m", default="the largest coordinate"),
    ] = None
    turning_axis: Annotated[
        TurningAxisTable | None, about("The axis about which alone the body turns.", default="a free body")
    ] = None
    mounting: Annotated[
        MountingTable | None, about("The same axis in other words; a file has one of the two.", default="a free body")
    ] = None
