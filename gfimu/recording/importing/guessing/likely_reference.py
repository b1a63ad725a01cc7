"""Which column of a recording may be the reference that it lacks, by its name, and what to do with it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from gfimu.recording.importing.column_map import REFERENCE_KINDS, UNMAPPED
from gfimu.recording.importing.guessing.names import is_rate
from gfimu.recording.importing.guessing.parts import known_reference, varies
from gfimu.recording.quantities import GYRO_COLUMNS, REFERENCE_UNITS, TIME_COLUMNS, reference_quantity
from gfimu.recording.units import factor_of, kind_of, unit_of_name

__all__ = ["LikelyReference", "likely_references", "reference_remedy"]

_TRUTH = "truth_"  # of a simulated recording: what no sensor reads
_NO_REFERENCE = {"t_s", *TIME_COLUMNS.values()}
_MOST = 2  # columns in a message


@dataclass(frozen=True)
class LikelyReference:
    """A column that may be a reference.

    Parameters
    ----------
    column : str
        Its name in the recording.
    reference : str
        The reference: ``tacho_rad_s``, ``angle_rad`` and so on.
    unit : str
        Its unit by its name; the usual one, where the name has none.
    is_unit_known : bool
        Whether the name has a unit.
    """

    column: str
    reference: str
    unit: str
    is_unit_known: bool

    @property
    def remedy(self) -> str:
        """What to do with it, for a message: a key of the column map, or the name that the column needs."""
        if self.column.startswith(UNMAPPED):
            column = self.column.removeprefix(UNMAPPED)
            check = "" if self.is_unit_known else ", with the right unit"
            return (
                f"column {column} may be it: add reference.{self.reference}"
                f'={{column="{column}", unit="{self.unit}"}} to its column map (--map-set){check}'
            )
        quantity, kind = str(reference_quantity(self.reference)), REFERENCE_KINDS[self.reference]
        units = REFERENCE_UNITS[quantity]
        names = [f"{quantity}_{unit}" for unit in units]
        if self.is_unit_known:
            factor = factor_of(self.unit, kind)
            same = [name for name, other in zip(names, units.values(), strict=True) if abs(other / factor - 1) < 1e-9]
            if not same:
                return f"column {self.column} may be it: multiply it by {factor:.6g} and name it {names[0]}"
            return f"column {self.column} may be it: name it {same[0]}"
        if len(names) == 1:
            return f"column {self.column} may be it: name it {names[0]}"
        return f"column {self.column} may be it: name it {', '.join(names[:-1])} or {names[-1]} by its unit"


def likely_references(columns: Mapping[str, NDArray[Any]], reference: str = "") -> list[LikelyReference]:
    """Return columns that may be a reference by their names, the most likely first.

    For a tachometer that is the column of a rate; without one, that of a gyro along one axis, z before others. For a
    gyro's axis it is the column of a rate along it.

    Parameters
    ----------
    columns : mapping of str to ndarray, shape (n,)
        Columns that a recording has, by name: those that it does not know, and its references. Text and columns of
        one value are left out.
    reference : str
        The reference that is looked for, SI; by default any that the name itself says.
    """
    names = [
        name
        for name, values in columns.items()
        if name not in _NO_REFERENCE and not name.startswith(_TRUTH) and varies(values)
    ]
    found = [
        LikelyReference(name, known[0], known[1], _has_unit(name))
        for name in names
        if name not in REFERENCE_KINDS
        for known in [known_reference(name.removeprefix(UNMAPPED))]
        if known is not None and reference in {"", known[0]}
    ]
    if found or reference not in {"tacho_rad_s", *GYRO_COLUMNS}:
        return found
    is_tacho = reference == "tacho_rad_s"
    axis = "z" if is_tacho else reference.split("_")[1]
    gyros = sorted((name for name in names if _is_gyro(name)), key=lambda name: not _is_along(name, axis))
    gyros = [name for name in gyros if is_tacho or _is_along(name, axis)]
    units = {name: unit_of_name(name)[1] if name not in GYRO_COLUMNS else "" for name in gyros}
    return [LikelyReference(name, reference, units[name] or "rad/s", bool(units[name])) for name in gyros[:1]]


def reference_remedy(columns: Mapping[str, NDArray[Any]], reference: str) -> str:
    """Return the remedy for a message that a recording lacks a reference; empty where no column may be it.

    Parameters
    ----------
    columns : mapping of str to ndarray, shape (n,)
        Columns that the recording has, as `likely_references` takes them.
    reference : str
        The reference that it lacks, SI.
    """
    return ", or ".join(one.remedy for one in likely_references(columns, reference)[:_MOST])


def _has_unit(name: str) -> bool:
    plain = name.removeprefix(UNMAPPED)
    return bool(unit_of_name(plain)[1] or kind_of(plain))


def _is_gyro(name: str) -> bool:
    return name in GYRO_COLUMNS or (name not in REFERENCE_KINDS and is_rate(name.removeprefix(UNMAPPED)))


def _is_along(name: str, axis: str) -> bool:
    return re.search(rf"(?<![b-z]){axis}(?![a-z])", unit_of_name(name.lower())[0]) is not None
