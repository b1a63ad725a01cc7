"""Accelerometer arrays: where each sensing axis sits on the body and where it points.

The array is the geometry only. The regression matrix J of the GF-IMU paper (its step 4) and the matrix Q of the
centripetal terms follow from it; both are in body axes about the body's origin.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tomli_w
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array_file import ArrayFile, ChipTable
from gfimu.array.parts.files import add_part_file, is_part_file
from gfimu.array.turning_axis import TurningAxis
from gfimu.base.errors import InputError
from gfimu.base.files.input_file import is_ordinary
from gfimu.base.files.model_files import find_model, read_toml
from gfimu.base.files.schema import read
from gfimu.base.optional_packages import require
from gfimu.base.results import TableResult, drawn_chips, text_column
from gfimu.base.short_repr import joined, short_repr

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["OMEGA_PRODUCTS", "AccelerometerArray", "Chip", "check_chips"]

OMEGA_PRODUCTS = ("xx", "yy", "zz", "xy", "xz", "yz")
"""Order of the six products of the angular rate that the columns of Q multiply."""

_AXIS_NORM_TOLERANCE = 1e-6
_MOST_CHIPS = 1000  # numerical: a score takes 250 MB at 500 chips, 1 GB at 2000


@dataclass(frozen=True)
class Chip:
    """One accelerometer chip with one, two or three sensing axes at one point of the body.

    Parameters
    ----------
    name : str
        Chip name; channel names are this plus ``1``, ``2``, ``3``.
    position : ndarray, shape (3,)
        Position of the proof mass in the body frame, m.
    axes : ndarray, shape (k, 3)
        Unit vectors of the sensing axes in the body frame.
    part : str
        Name of the part in ``models/parts``, or of a part file of the user's.
    supply : float or None
        Supply voltage of this chip, V; None: that of the scenario.
    output_data_rate : float or None
        Output data rate that this chip is set to, Hz; None: that of the scenario.
    own_clock : bool
        Whether the chip samples by a clock of its own.

    Examples
    --------
    >>> import gfimu
    >>> chip = gfimu.AccelerometerArray.load("cube12").chips[0]
    >>> chip.name, chip.channels
    ('a1', ('a11', 'a12', 'a13'))
    """

    name: str
    position: NDArray[np.float64]
    axes: NDArray[np.float64]
    part: str = "adxl345"
    supply: float | None = None
    output_data_rate: float | None = None
    own_clock: bool = False

    def __repr__(self) -> str:
        return short_repr(self).replace(", own_clock=False", "")

    @property
    def channels(self) -> tuple[str, ...]:
        """Channel names, one per sensing axis."""
        return tuple(f"{self.name}{axis + 1}" for axis in range(len(self.axes)))

    def to_dict(self) -> dict[str, Any]:
        """Return the ``[[chip]]`` table of an array file."""
        settings = {"supply_V": self.supply, "output_data_rate_hz": self.output_data_rate}
        return {
            "name": self.name,
            "part": self.part,
            "position_m": self.position.tolist(),
            "axes": self.axes.tolist(),
            **{key: value for key, value in settings.items() if value is not None},
            **({"own_clock": True} if self.own_clock else {}),
        }


def check_chips(count: int, source: str | Path) -> None:
    """Raise `InputError` for more chips than an array can have: what is computed of it grows with their square."""
    if count > _MOST_CHIPS:
        raise InputError(f"{source}: has {count} chips, more than {_MOST_CHIPS}; give those of one array")


@dataclass(frozen=True)
class AccelerometerArray(TableResult):
    """A rigid set of accelerometer chips.

    Parameters
    ----------
    name : str
        Name of the array.
    chips : tuple of Chip
        The chips, in the order of the channels.
    length_unit : float
        Length that scoring calls 1, m (half the cube's edge for a cube).
    description : str
        Description, one line.
    part_files : mapping of str to str
        Text of the part files that are not in ``models/parts``, by the name that the chips use.
    turning_axis : TurningAxis, optional
        The axis about which alone the array turns, where it is known.

    Examples
    --------
    >>> import gfimu
    >>> cube = gfimu.AccelerometerArray.load("cube12")
    >>> cube
    AccelerometerArray('cube12', 4 chips (adxl345), 12 channels)
    >>> cube.regression_matrix.shape
    (12, 6)
    """

    name: str
    chips: tuple[Chip, ...]
    length_unit: float = 0.05
    description: str = ""
    part_files: Mapping[str, str] = field(default_factory=dict)
    turning_axis: TurningAxis | None = None

    def __repr__(self) -> str:
        parts = ", ".join(dict.fromkeys(chip.part for chip in self.chips))
        return joined(self, [repr(self.name), f"{len(self.chips)} chips ({parts})", f"{self.n_channels} channels"])

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per channel: its chip and part, position of the chip, m, and sensing axis, body frame."""
        chips = [self.chips[place] for place in self.chip_of_channel]
        return {
            "channel": text_column(self.channels),
            "chip": text_column(chip.name for chip in chips),
            "part": text_column(chip.part for chip in chips),
            **{f"position_{axis}_m": self.positions[:, index] for index, axis in enumerate("xyz")},
            **{f"axis_{axis}": self.axes[:, place] for place, axis in enumerate("xyz")},
        }

    def _table_metadata(self) -> dict[str, Any]:
        return {"array": self.name}

    def _heading(self) -> str:
        return f"Array {self.name}"

    def _facts(self) -> list[tuple[str, str]]:
        return [("what it is", self.description)] if self.description else []

    def plot(self, figure: Figure | None = None) -> Figure:
        """Draw the chips with their sensing axes in 3-D, body frame, lengths in mm.

        Parameters
        ----------
        figure : Figure, optional
            Where to draw; a new figure by default.

        Raises
        ------
        MissingPackageError
            If matplotlib is not installed.
        """
        require("plot", "matplotlib")
        chips = [(chip.name, chip.position, chip.axes) for chip in self.chips]
        return drawn_chips(self.name, chips, figure)

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels, in column order of every reading matrix."""
        return tuple(channel for chip in self.chips for channel in chip.channels)

    @cached_property
    def positions(self) -> NDArray[np.float64]:
        """Position of each sensing axis in the body frame, m, shape (c, 3)."""
        return np.repeat(self.chip_positions, [len(chip.axes) for chip in self.chips], axis=0)

    @cached_property
    def axes(self) -> NDArray[np.float64]:
        """Unit vector of each sensing axis in the body frame, shape (c, 3)."""
        return np.concatenate([chip.axes for chip in self.chips])

    @cached_property
    def chip_positions(self) -> NDArray[np.float64]:
        """Position of each chip in the body frame, m, shape (k, 3)."""
        return np.array([chip.position for chip in self.chips])

    @cached_property
    def chip_of_channel(self) -> NDArray[np.intp]:
        """Index of the chip that each channel belongs to, shape (c,)."""
        return np.repeat(np.arange(len(self.chips)), [len(chip.axes) for chip in self.chips])

    def output_data_rates(self, sample_rate: float) -> NDArray[np.float64]:
        """Return the output data rate of each channel, shape (c,), Hz: that of its chip, else ``sample_rate``."""
        rates = np.array([chip.output_data_rate or sample_rate for chip in self.chips])
        return rates[self.chip_of_channel]

    @property
    def n_channels(self) -> int:
        """Number of sensing axes."""
        return len(self.channels)

    @cached_property
    def regression_matrix(self) -> NDArray[np.float64]:
        """Regression matrix J, shape (c, 6), of reading = J [alpha; p] + centripetal terms.

        Row i is [(r_i × θ_i)ᵀ, θ_iᵀ] (GF-IMU paper, step 4); lengths in m.
        """
        return np.hstack([np.cross(self.positions, self.axes), self.axes])

    @cached_property
    def centripetal_matrix(self) -> NDArray[np.float64]:
        """Matrix Q, shape (c, 6), of ``Q s = θ_iᵀ (ωωᵀ − |ω|² I) r_i`` with s the products `OMEGA_PRODUCTS` of ω."""
        x, y, z = self.positions.T
        a, b, c = self.axes.T
        return np.column_stack(
            [
                -(b * y + c * z),
                -(a * x + c * z),
                -(a * x + b * y),
                a * y + b * x,
                a * z + c * x,
                b * z + c * y,
            ]
        )

    def centripetal_about(self, direction: ArrayLike) -> NDArray[np.float64]:
        """Return what the channels read per squared rate about a direction through the origin, shape (c,), m."""
        unit = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
        inward = np.outer(self.positions @ unit, unit) - self.positions  # u × (u × r)
        return np.asarray(np.sum(self.axes * inward, axis=1))

    def index(self, channel: str) -> int:
        """Column of a channel; raises `InputError` that lists the channels."""
        try:
            return self.channels.index(channel)
        except ValueError:
            raise InputError(
                f"array {self.name!r} has no channel {channel!r}; its channels: {', '.join(self.channels)}"
            ) from None

    def with_geometry(self, positions: ArrayLike, axes: Sequence[ArrayLike]) -> AccelerometerArray:
        """Return the same chips at other positions, shape (k, 3), m, with other axes, each of shape (k_i, 3)."""
        moved = np.asarray(positions, dtype=float)
        chips = tuple(
            replace(chip, position=position, axes=np.asarray(chip_axes, dtype=float))
            for chip, position, chip_axes in zip(self.chips, moved, axes, strict=True)
        )
        return replace(self, chips=chips)

    def with_part(self, part: str) -> AccelerometerArray:
        """Return the same array with every chip of one part."""
        return replace(self, chips=tuple(replace(chip, part=part) for chip in self.chips))

    def with_part_file(self, part: str, *, beside: Path | None = None) -> tuple[AccelerometerArray, str]:
        """Return the array with the text of a part file kept in it, and the name by which it is kept.

        A part of ``models/parts`` stays as it is. Raises `InputError` if there is no such file.
        """
        if not is_part_file(part):
            return self, part
        files, kept = add_part_file(self.part_files, part, beside)
        return replace(self, part_files=files), kept

    def relative_to(self, origin: ArrayLike) -> AccelerometerArray:
        """Return the same array with its body origin moved to ``origin``, shape (3,), m."""
        return self.with_geometry(self.chip_positions - np.asarray(origin, dtype=float), [c.axes for c in self.chips])

    @classmethod
    def load(cls, name: str | Path, *, beside: Path | None = None) -> AccelerometerArray:
        """Load an array by name (in ``models/arrays``) or from a TOML file.

        Raises
        ------
        InputError
            If the array is unknown (the message lists the names) or the file is malformed.
        """
        path = find_model("arrays", name, beside=beside)
        array = cls.from_dict(read_toml(path), source=str(path))
        for part in dict.fromkeys(chip.part for chip in array.chips if is_part_file(chip.part)):
            if any(is_ordinary(folder / part) for folder in (path.parent, Path())):  # others fail where they are needed
                array, kept = array.with_part_file(part, beside=path.parent)
                chips = tuple(replace(chip, part=kept) if chip.part == part else chip for chip in array.chips)
                array = replace(array, chips=chips)
        return array

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], *, source: str = "array") -> AccelerometerArray:
        """Build an array from the content of an array file (`gfimu.array.array_file.ArrayFile`).

        Raises
        ------
        InputError
            If a key is missing, unknown or has a wrong value; the message names the table, the key and what is valid.
        """
        file = read(data, ArrayFile, source)
        check_chips(len(file.chip), source)
        chips = tuple(_chip(entry, number, source) for number, entry in enumerate(file.chip, start=1))
        channels = [channel for chip in chips for channel in chip.channels]
        if len(set(channels)) != len(channels):
            raise InputError(f"{source}: two chips share a name; give each its own")
        length = file.length_unit_m or float(np.max(np.abs([chip.position for chip in chips]))) or 1.0
        return cls(
            file.name if "name" in data else Path(source).stem,
            chips,
            length,
            file.description,
            turning_axis=_axis(file, source),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the content of the array file."""
        turning = {} if self.turning_axis is None else {"turning_axis": self.turning_axis.to_dict()}
        return {
            "name": self.name,
            "description": self.description,
            "length_unit_m": self.length_unit,
            **turning,
            "chip": [chip.to_dict() for chip in self.chips],
        }

    def to_toml(self) -> str:
        """Return the text of the array file."""
        return self._toml

    @cached_property
    def _toml(self) -> str:
        return tomli_w.dumps(self.to_dict())


def _chip(table: ChipTable, number: int, source: str) -> Chip:
    """Build the chip of a ``[[chip]]`` table."""
    where = f"{source}: [[chip]] {number}"
    try:
        axes = np.atleast_2d(np.array(table.axes, dtype=float))
    except ValueError:  # rows of different lengths
        axes = np.empty(0)
    if axes.ndim != 2 or axes.shape[1] != 3:
        raise InputError(f"{where}: axes = {list(table.axes)!r} must be one to three rows of three numbers")
    norms = np.linalg.norm(axes, axis=1)
    if np.any(np.abs(norms - 1) > _AXIS_NORM_TOLERANCE):
        raise InputError(f"{where}: axes must be unit vectors; one has length {norms[np.argmax(abs(norms - 1))]:.6g}")
    return Chip(
        table.name or f"a{number}",
        np.array(table.position_m),
        axes,
        table.part,
        table.supply_V,
        table.output_data_rate_hz,
        table.own_clock,
    )


def _axis(file: ArrayFile, source: str) -> TurningAxis | None:
    """Return the axis of an array file, of whichever of its two tables it has."""
    if file.turning_axis is not None and file.mounting is not None:
        raise InputError(f"{source}: has both [turning_axis] and [mounting], which say the same; leave one out")
    if file.mounting is not None:
        return TurningAxis.from_mounting(file.mounting, source=source)
    return None if file.turning_axis is None else TurningAxis.from_table(file.turning_axis, source=source)
