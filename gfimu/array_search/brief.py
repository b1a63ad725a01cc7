"""The design brief: a file that says what array is wanted, for which volume and by what it is judged."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array_search.objectives import Conditions, ObjectiveTable
from gfimu.array_search.problem import Problem, Sites, ToleranceTable
from gfimu.array_search.shapes import Shape, box, cylinder, sphere
from gfimu.base.errors import InputError
from gfimu.base.files.input_file import check_input
from gfimu.base.files.model_files import read_toml
from gfimu.base.files.schema import NotNegative, Positive, Table, Triple, about, read

__all__ = ["BoxTable", "BriefFile", "SitesTable", "load_brief", "problem_of", "sites_of_array", "sites_of_csv"]

_Centre = Annotated[Triple, about("Centre, body frame.", "m")]
_Edges = Annotated[Triple, about("Edges along body x, y, z; zero makes it flat.", "m", example=[0.1, 0.1, 0.05])]
_Radius = Annotated[Positive, about("Radius.", "m", example=0.04)]
_Height = Annotated[NotNegative, about("Height along the axis; zero makes it a disc.", "m", example=0.08)]
_Along = Annotated[Literal["x", "y", "z"], about("Body axis along which it stands.")]


class BoxTable(Table, frozen=True, tag_field="kind", tag="box"):
    """A box along the body axes."""

    edges_m: _Edges
    centre_m: _Centre = (0.0, 0.0, 0.0)

    def shape(self) -> Shape:
        """Return the shape."""
        return box(self.edges_m, self.centre_m)


class SphereTable(Table, frozen=True, tag_field="kind", tag="sphere"):
    """A ball."""

    radius_m: _Radius
    centre_m: _Centre = (0.0, 0.0, 0.0)

    def shape(self) -> Shape:
        """Return the shape."""
        return sphere(self.radius_m, self.centre_m)


class CylinderTable(Table, frozen=True, tag_field="kind", tag="cylinder"):
    """A cylinder along a body axis."""

    radius_m: _Radius
    height_m: _Height
    axis: _Along = "z"
    centre_m: _Centre = (0.0, 0.0, 0.0)

    def shape(self) -> Shape:
        """Return the shape."""
        return cylinder(self.radius_m, self.height_m, self.axis, self.centre_m)


class SitesTable(Table, frozen=True, tag_field="kind", tag="sites"):
    """Candidate sites, at most one chip on each."""

    file: Annotated[
        str,
        about(
            "MJCF file (.xml), array file (.toml), or CSV file with columns x_m, y_m, z_m and, where axes are given, "
            "axis_x, axis_y, axis_z; rows of one place are axes of one site.",
            example="mounts.csv",
        ),
    ]
    names: Annotated[str, about("Of an MJCF file: pattern of the names of the sites, such as mount_*.")] = "*"


class BriefFile(Table, frozen=True):
    """What array is wanted: chips, where they may sit and point, and what is to be small."""

    volume: Annotated[BoxTable | SphereTable | CylinderTable | SitesTable, about("Where chips may sit.")] = BoxTable(
        (0.1, 0.1, 0.1)
    )
    keep_out: Annotated[
        tuple[BoxTable | SphereTable | CylinderTable, ...], about("Where the middle of no chip may be.")
    ] = ()
    objective: Annotated[ObjectiveTable, about("What is to be small.")] = ObjectiveTable()
    tolerance: Annotated[ToleranceTable | None, about("Errors of machining for worst cases.", default="none")] = None
    chips: Annotated[Annotated[int, msgspec.Meta(ge=1, le=200)] | None, about("Number of chips.")] = None
    axes_per_chip: Annotated[int, about("Sensing axes of a chip.", ge=1, le=3)] = 3
    directions: Annotated[
        Literal["free", "body", "site"] | Annotated[tuple[Triple, ...], msgspec.Meta(min_length=1)],
        about(
            "Of sensing axes: free, along the body axes, as the sites give them, or a list of directions. Tri-axial "
            "chips lie along the body axes, as their turn changes no figure but fault.",
            must_be="free, body, site, or rows of three numbers",
        ),
    ] = "free"
    min_spacing_m: Annotated[NotNegative, about("Least distance between two chips.", "m")] = 0.005
    non_recursive: Annotated[bool, about("Only arrays whose α is free of ω².")] = False
    part: Annotated[str, about("Name of a part (gfimu list parts), for noise and bias.")] = "adxl345"
    starts: Annotated[int, about("Most random starts; fewer once ten agree.", ge=1, le=100_000)] = 40
    seed: Annotated[int, about("Seed of the starts.", ge=0)] = 0


def load_brief(path: str | Path) -> BriefFile:
    """Read a design brief from a TOML file and check it.

    Raises
    ------
    InputError
        If it can't be read, or a key is wrong.
    """
    return read(read_toml(Path(path)), BriefFile, str(path))


def problem_of(brief: BriefFile, sites: Sites | None = None) -> tuple[Problem, Conditions]:
    """Return what may be built, and the conditions of the objectives.

    Parameters
    ----------
    brief : BriefFile
        The brief, with its number of chips.
    sites : Sites, optional
        The candidate sites that its volume names (`sites_of_array`, `sites_of_csv`).

    Raises
    ------
    InputError
        If something is out of range, or the chips can't fit.
    GeometryError
        If there are too few channels.
    """
    if brief.chips is None:
        raise InputError("no number of chips: give chips in the brief, or --chips")
    wanted = brief.objective
    volume = sites if isinstance(brief.volume, SitesTable) else brief.volume.shape()
    assert volume is not None
    if brief.directions == "site" and not (isinstance(volume, Sites) and volume.axes):
        raise InputError("directions = 'site': the volume has no sites with axes; choose free, body or a list")
    if isinstance(volume, Sites) and brief.directions != "site":
        volume = Sites(volume.positions, (), volume.name)
    named = {"free": None, "site": None, "body": np.eye(3)}
    chosen = named[brief.directions] if isinstance(brief.directions, str) else np.array(brief.directions, dtype=float)
    problem = Problem(
        brief.chips,
        brief.axes_per_chip,
        volume,
        tuple(one.shape() for one in brief.keep_out),
        brief.min_spacing_m,
        chosen,
        brief.non_recursive,
        brief.tolerance,
        wanted.length_unit_m,
    )
    return problem, Conditions(**msgspec.structs.asdict(wanted), part=brief.part)


def sites_of_array(array: AccelerometerArray, name: str) -> Sites:
    """Return the places of an array's chips as candidate sites, with their axes."""
    return Sites(array.chip_positions, tuple(chip.axes for chip in array.chips), name)


def sites_of_csv(path: str | Path) -> Sites:
    """Read candidate sites from a CSV file with columns x_m, y_m, z_m and, optionally, axis_x, axis_y, axis_z.

    Raises
    ------
    InputError
        If a column is missing, or a value is no finite number; the message names the line.
    """
    check_input(Path(path))
    with Path(path).open(encoding="utf-8-sig", newline="") as stream:
        reader = csv.DictReader(line for line in stream if not line.startswith("#"))
        names = [fieldname.strip() for fieldname in reader.fieldnames or []]
        columns = ["x_m", "y_m", "z_m"]
        missing = [column for column in columns if column not in names]
        if missing:
            raise InputError(f"{path}: no column {missing[0]}; the first line must name x_m, y_m, z_m")
        directed = "axis_x" in names
        columns += ["axis_x", "axis_y", "axis_z"] if directed else []
        reader.fieldnames = names
        rows = [_numbers(row, columns, f"{path}: site {number}") for number, row in enumerate(reader, start=1)]
    if not rows:
        raise InputError(f"{path}: no candidate site; add a line per site")
    table = np.array(rows)
    places, index = np.unique(table[:, :3], axis=0, return_inverse=True)
    axes: tuple[NDArray[np.float64], ...] = ()
    if directed:
        lengths = np.linalg.norm(table[:, 3:], axis=1, keepdims=True)
        if not lengths.all():
            raise InputError(f"{path}: site {int(np.argmin(lengths)) + 1}: its axis has length zero; give a direction")
        units = table[:, 3:] / lengths
        axes = tuple(units[index.reshape(-1) == one] for one in range(len(places)))
    return Sites(places, axes, str(path))


def _numbers(row: dict[str, str], columns: list[str], where: str) -> list[float]:
    found = []
    for name in columns:
        try:
            value = float(row.get(name) or "nan")
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise InputError(f"{where}: {name} = {row.get(name)!r} must be a finite number")
        found.append(value)
    return found
