"""Triads of an unknown table: columns that belong together as x, y and z, of acceleration or of rate."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.recording.importing.guessing.units import rest_windows, sphere_of, triad_values, unit_of_acceleration
from gfimu.recording.importing.notation import kind_of, unit_of_name
from gfimu.recording.importing.raw_table import RawTable

__all__ = ["Triad", "find_triads", "is_acceleration", "is_rate"]

_STRONG = re.compile(r"acc|force|adxl|mma\d|lis\d|bma\d|kx\d|kxrb", re.IGNORECASE)
_WEAK = re.compile(r"^a[xyz_\d\[ ]|_a_|^a_", re.IGNORECASE)
_SINGLE = re.compile(r"a_?\d|a[_ ]?[xyz](?![a-z])", re.IGNORECASE)
_GYRO = re.compile(r"gyr|omega|angular|^w[xyz_\d\[ ]|^w_|rate|rot|itg", re.IGNORECASE)
_FREE = re.compile(r"free|lin\w* ?acc|without ?g|user ?acc", re.IGNORECASE)
_NUMBERED = re.compile(r"(?P<before>.*?)(?P<number>\d+)(?P<after>\D*)")
_NEITHER = re.compile(
    r"mag(?!nitude)|^m_?[xyz]$|euler|quat|orient|^field[ _]?[xyz]|_field|angle|roll|pitch|yaw|pos|vel_|std|cov|temp|gps"
    r"|^q_?[0-3wxyz]$|mat\[|rotm|dcm|setpoint|motor|axis[pidf]|command|gravity|uncal",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Triad:
    """Three columns that belong together.

    Parameters
    ----------
    columns : tuple of str
        Names along x, y and z.
    kind : str
        ``acceleration``, ``rate``, or empty.
    """

    columns: tuple[str, str, str]
    kind: str


def find_triads(table: RawTable, taken: Sequence[str] = ()) -> list[Triad]:
    """Return columns whose names differ in x, y, z (or 0, 1, 2 or 1, 2, 3) alone, or are numbered on, of force or rate.

    Where the numbers of one triad are gravity at rest, others count as acceleration only if their names say so.
    """
    free = {_short(name): name for name in table.columns if name not in taken and table.columns[name].dtype != object}
    if not table.named:
        return _by_gravity(
            table, [(one, False) for run in _runs(table, free.values()) for one in _without_names(table, run)]
        )
    numbered = _numbered(table, free)
    found: list[tuple[Triad, bool]] = [(Triad(one, "acceleration"), True) for one in numbered]
    used: set[str] = {_short(name) for one in numbered for name in one}
    for short, name in free.items():
        for axes in (("x", "y", "z"), ("0", "1", "2"), ("1", "2", "3")):
            for place in (spot for spot, letter in enumerate(short) if letter == axes[0]):
                three = [short[:place] + axis + short[place + 1 :] for axis in axes]
                if all(one in free for one in three) and not used & set(three):
                    columns = (name, free[three[1]], free[three[2]])
                    # More than three with numbers are axes of one each, unless gravity is their length.
                    fourth = short[:place] + str(int(axes[2]) + 1) + short[place + 1 :] if axes[2] != "z" else ""
                    if fourth in free and not _is_gravity(table, columns):
                        continue
                    used |= set(three)
                    kind, by_name = _kind(table, columns)
                    found.append((Triad(columns, kind), by_name))
    return _by_gravity(table, found)


def _numbered(table: RawTable, free: Mapping[str, str]) -> list[tuple[str, str, str]]:
    """Return threes of columns whose names are numbered on over several chips, as CH0 … CH11, if all show gravity.

    Parameters
    ----------
    table : RawTable
        The table.
    free : mapping of str to str
        Columns by their names without unit, in small letters.
    """
    series: dict[tuple[str, str], dict[int, str]] = {}
    for short, name in free.items():
        found = _NUMBERED.fullmatch(short)
        if found and not _NEITHER.search(short):
            series.setdefault((found["before"], found["after"]), {})[int(found["number"])] = name
    threes: list[tuple[str, str, str]] = []
    for columns in series.values():
        order = sorted(columns)
        if len(order) < 6 or len(order) % 3 or order != list(range(order[0], order[0] + len(order))):
            continue
        groups = [(columns[at], columns[at + 1], columns[at + 2]) for at in order[::3]]
        if all(_is_gravity(table, group) for group in groups):
            threes += groups
    return threes


def _known(table: RawTable, name: str) -> NDArray[np.float64]:
    values = table.numbers(name)
    known = values[np.isfinite(values)]
    return known if len(known) else np.zeros(1)


def _without_names(table: RawTable, names: Sequence[str]) -> list[Triad]:
    """Return threes of neighbours, begun so that gravity is the length of as many as can be.

    Gravity that lies along one axis is the length of any three with that axis. So a beginning that leaves no column
    over at the start goes before others, and what stands between triads of gravity is grouped only then anew.
    """
    ways = [_threes(table, names[:first]) + _threes(table, names[first:]) for first in range(3)]
    ways.append(_one_by_one(table, names))
    gravity = [sum(one.kind == "acceleration" and _is_gravity(table, one.columns) for one in way) for way in ways]
    return ways[gravity.index(max(gravity))]


def _runs(table: RawTable, names: Collection[str]) -> list[list[str]]:
    """Return neighbours that vary; what never does, as a covariance or a flag, parts them. All where too few vary."""
    runs: list[list[str]] = [[]]
    for name in table.columns:
        if name in names and np.ptp(_known(table, name)) > 0.0:
            runs[-1].append(name)
        elif runs[-1]:
            runs.append([])
    return runs if any(len(run) >= 3 for run in runs) else [list(names)]


def _one_by_one(table: RawTable, names: Sequence[str]) -> list[Triad]:
    """Return neighbours of which gravity is the length from the first one on, and threes of what stands between."""
    found: list[Triad] = []
    apart: list[str] = []
    place = 0
    while place < len(names):
        three = tuple(names[place : place + 3])
        if len(three) == 3 and _is_gravity(table, (three[0], three[1], three[2])):
            found += _threes(table, apart)
            found.append(Triad((three[0], three[1], three[2]), "acceleration"))
            apart = []
            place += 3
        else:
            apart.append(names[place])
            place += 1
    return found + _threes(table, apart)


def _is_gravity(table: RawTable, columns: tuple[str, str, str]) -> bool:
    return _kind_by_numbers(table, columns) == "acceleration" and unit_of_acceleration(table, columns).is_gravity


def _threes(table: RawTable, names: Sequence[str]) -> list[Triad]:
    groups = [(names[first], names[first + 1], names[first + 2]) for first in range(0, len(names) - 2, 3)]
    return [Triad(group, _kind_by_numbers(table, group)) for group in groups]


def _by_gravity(table: RawTable, triads: Sequence[tuple[Triad, bool]]) -> list[Triad]:
    """Return triads; where one shows gravity, others that neither show it nor are named so are no acceleration."""
    gravity = [one.kind == "acceleration" and unit_of_acceleration(table, one.columns).is_gravity for one, _ in triads]
    if not any(one.kind == "acceleration" for one, _ in triads):
        # A wheel that never rests shows no gravity; without names something has to be the acceleration.
        return [replace(one, kind="acceleration") if one.kind and not by_name else one for one, by_name in triads]
    if not any(gravity):
        return [one for one, _ in triads]
    return [
        replace(one, kind="rate") if one.kind == "acceleration" and not fits and not by_name else one
        for (one, by_name), fits in zip(triads, gravity, strict=True)
    ]


def is_acceleration(name: str) -> bool:
    """Whether a column is an acceleration by its unit or its name."""
    plain, unit = unit_of_name(name)
    if _NEITHER.search(plain) or _GYRO.search(plain):
        return False
    return kind_of(unit) == "acceleration" if unit else bool(_STRONG.search(plain) or _SINGLE.match(plain))


def is_rate(name: str) -> bool:
    """Whether a column is an angular rate by its unit or its name."""
    plain, unit = unit_of_name(name)
    if _NEITHER.search(plain):
        return False
    return kind_of(unit) == "rate" if unit else bool(_GYRO.search(plain))


def _short(name: str) -> str:
    return unit_of_name(name)[0].lower()


def _kind(table: RawTable, columns: tuple[str, str, str]) -> tuple[str, bool]:
    """Return what three columns measure, and whether their names say so: by unit, by name, or by their numbers."""
    plain, unit = unit_of_name(columns[0])
    kind = kind_of(unit) if unit else ""
    if unit and kind not in {"acceleration", "rate"}:
        return "", True
    for name in (plain, table.name):
        if _NEITHER.search(name):
            return "", True
        if (kind == "acceleration" or not kind) and _FREE.search(name):
            # ROS has gravity in its linear acceleration, phones have not.
            return ("acceleration" if unit_of_acceleration(table, columns).is_gravity else ""), True
        if kind:
            return kind, True
        if _GYRO.search(name):
            return "rate", True
        if _STRONG.search(name):
            return "acceleration", True
    if _WEAK.search(plain):
        return "acceleration", False
    return _kind_by_numbers(table, columns), False


def _kind_by_numbers(table: RawTable, columns: Sequence[str]) -> str:
    """Return acceleration where the length of the vector at rest is the same in all poses, else rate near zero."""
    values = triad_values(table, columns)
    windows = rest_windows(values)
    if not len(windows) or not values[np.isfinite(values)].any():
        return ""
    lengths = np.linalg.norm(windows, axis=1)
    spread = float(np.std(lengths) / max(np.median(lengths), 1e-12))
    largest = float(np.nanmax(np.abs(values)))
    if spread < 0.1 and np.median(lengths) > 0.02 * largest:
        return "acceleration"
    return "acceleration" if sphere_of(windows) is not None else "rate"
