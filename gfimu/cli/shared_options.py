"""The options that several commands take: one name, one description and one way to complete each.

`shared` makes such an option for a command; what is special to the command goes before (`when`) or behind (`more`) the
common description. A test holds that every option of two commands comes from this table.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from gfimu.cli import completion

__all__ = [
    "KNOWN_AXIS",
    "SHARED",
    "ForceOption",
    "JsonOption",
    "MapOption",
    "MapSetOption",
    "PictureOption",
    "ReferenceMapOption",
    "ReferenceMapSetOption",
    "RrdOption",
    "Shared",
    "TwinOption",
    "shared",
]

KNOWN_AXIS = "Rotation about a known axis"
_FOREIGN = "A file of another layout"
_REPEATED = "may be repeated"


@dataclass(frozen=True)
class Shared:
    """An option of several commands.

    Parameters
    ----------
    text : str
        Description that all commands have in common.
    metavar : str
        What stands for its value in help: a unit, or a kind of thing; empty for a flag.
    panel : str
        Heading under which help lists it; empty for the usual options.
    complete : callable, optional
        Gives the values that a shell offers.
    """

    text: str
    metavar: str = ""
    panel: str = ""
    complete: Callable[[str], list[tuple[str, str]]] | None = None


SHARED: dict[str, Shared] = {
    "--array": Shared(
        "Array: a name, an array file (.toml) or an MJCF file with sites (.xml)", "ARRAY", complete=completion.arrays
    ),
    "--axis": Shared(
        "Axis about which alone the array turns: x, y, z or 0,0,1. Few chips then suffice.",
        "AXIS",
        KNOWN_AXIS,
        completion.words("x", "y", "z"),
    ),
    "--axis-point": Shared("A point of that axis, body frame, m.", "X Y Z", KNOWN_AXIS),
    "--baud": Shared("Speed of the line, bits per second", "BAUD"),
    "--bias-mg": Shared("Bias of each channel, 1 σ, mg", "MG"),
    "--bias-std-m-s2": Shared("Standard deviation of each channel's bias, m/s²", "M/S²"),
    "--by": Shared(f"Factor to group by; {_REPEATED}. A range is cut into fifths.", "FACTOR"),
    "--calibration": Shared("Calibration to apply first (.json, from gfimu calibrate).", "FILE"),
    "--chips": Shared("Number of chips", "N"),
    "--data": Shared("Folder of the measured data, for the set real.", "DIR"),
    "--direction-std-rad": Shared("With --axis: how exactly its direction is known, rad.", "RAD", KNOWN_AXIS),
    "--duration": Shared("Length of the run, s", "S"),
    "--force": Shared("Go on where the checks of units, time, array and channels refuse the file"),
    "--gravity": Shared("Local gravity, m/s²", "M/S²"),
    "--gyro": Shared("Fuse the gyro columns as well"),
    "--hub": Shared(
        "With --axis: fixed (a table) or free (a wheel on a moving body).",
        "KIND",
        KNOWN_AXIS,
        completion.words("fixed", "free"),
    ),
    "--image": Shared(
        "Image: gfimu, selfcheck, or an ELF or .bin file.", "IMAGE", complete=completion.words("gfimu", "selfcheck")
    ),
    "--inclination-rad": Shared(
        "Angle between --axis and the vertical, rad; else from the data, or 0 (a free hub: π/2) where there are none.",
        "RAD",
        KNOWN_AXIS,
    ),
    "--json": Shared("Print one JSON object instead of tables; gfimu schema COMMAND describes it."),
    "--keep-faulty": Shared("Use channels that contradict the others, too"),
    "--latitude": Shared("Latitude, degrees", "DEG"),
    "--limit": Shared("Only so many worlds of each set, which stand in random order.", "N"),
    "--lever-std-m": Shared("With --axis: how exactly each chip's place is known, m.", "M", KNOWN_AXIS),
    "--map": Shared("Column map: a name, or a TOML file (gfimu inspect writes one).", "MAP", _FOREIGN, completion.maps),
    "--map-set": Shared(
        "Set a key of the column map, or with no --map all of it: time.column=t time.unit=ms unit=g channels.a11=ax "
        f"drop=corrupt,duplicates; {_REPEATED}.",
        "KEY=VALUE",
        _FOREIGN,
    ),
    "--noise-ug": Shared("White noise of each channel, one-sided density, µg/√Hz", "UG"),
    "--picture": Shared("Picture to write (.png, .svg, .pdf)", "FILE"),
    "--point-std-m": Shared("With --axis: how exactly --axis-point is known, m.", "M", KNOWN_AXIS),
    "--port": Shared("Port of the board", "PORT"),
    "--range": Shared("Range of the chips: ±2, 4, 8 or 16 g", "G"),
    "--rate": Shared("Sample rate, Hz", "HZ"),
    "--reference-map": Shared("Column map of the file of references.", "MAP", _FOREIGN, completion.maps),
    "--reference-map-set": Shared(f"Set a key of the reference's column map; {_REPEATED}.", "KEY=VALUE", _FOREIGN),
    "--rest-threshold": Shared("Threshold of rest, reading unit squared; else from the data.", "UNIT²"),
    "--rotation-std-rad": Shared("With --axis: how exactly each chip's orientation is known, rad.", "RAD", KNOWN_AXIS),
    "--rrd": Shared("Rerun recording to write (.rrd)", "FILE"),
    "--scenario": Shared("Scenario: a name, or a scenario file (.toml)", "SCENARIO", complete=completion.scenarios),
    "--seed": Shared("Seed of everything left to chance", "N"),
    "--sets": Shared(
        f"Set of worlds; {_REPEATED}. All that are drawn by default.",
        "SET",
        complete=completion.words("own", "independent", "unlisted", "dcmotor", "real"),
    ),
    "--speed-rad-s": Shared("Angular rate, rad/s", "RAD/S"),
    "--split": Shared(
        "Worlds to develop on (dev), or those of the published table (test).",
        "SPLIT",
        complete=completion.words("dev", "test"),
    ),
    "--table": Shared("Table, topic or member of a file that holds several.", "NAME", _FOREIGN),
    "--twin": Shared(
        "Twin, what the simulation assumes: a name, or a twin file (.toml).", "TWIN", complete=completion.twins
    ),
    "--unknown-start": Shared("The body may turn already when the run begins"),
    "--workers": Shared("Processes to work in; by default one per processor", "N"),
}
"""Options by name."""


def shared(name: str, *, when: str = "", more: str = "", also: str = "", **settings: Any) -> Any:
    """Return an option of the table for a command.

    Parameters
    ----------
    name : str
        Its name.
    when : str
        When it has a use, before the common description.
    more : str
        What is special to the command, behind the common description.
    also : str
        A second name.
    **settings
        Further arguments of `typer.Option`.
    """
    one = SHARED[name]
    text = f"{when}{one.text}{more}"
    text = text if text.endswith((".", "?")) else f"{text}."
    return typer.Option(
        *([name, also] if also else [name]),
        help=text,
        metavar=one.metavar or None,
        rich_help_panel=one.panel or None,
        autocompletion=one.complete,
        **settings,
    )


JsonOption = Annotated[bool, shared("--json")]
ForceOption = Annotated[bool, shared("--force")]
MapOption = Annotated[str | None, shared("--map")]
MapSetOption = Annotated[list[str] | None, shared("--map-set")]
ReferenceMapOption = Annotated[str | None, shared("--reference-map")]
ReferenceMapSetOption = Annotated[list[str] | None, shared("--reference-map-set")]
PictureOption = Annotated[Path | None, shared("--picture")]
RrdOption = Annotated[Path | None, shared("--rrd")]
TwinOption = Annotated[str, shared("--twin")]
