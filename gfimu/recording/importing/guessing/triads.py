"""Triads of an unknown table: columns that belong together as x, y and z, of acceleration or of rate.

Which columns belong together follows from their names (x, y, z; numbers) or, without names, from their order. What
they measure is scored: unit and words of the name, the name of the table, and the numbers, by gravity at rest.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gfimu.recording.importing.guessing.names import OTHER, evidence_of_names, is_acceleration, is_rate, words_of
from gfimu.recording.importing.guessing.units import (
    TriadUnit,
    rest_windows,
    sphere_of,
    triad_values,
    unit_of_acceleration,
)
from gfimu.recording.importing.raw_table import RawTable
from gfimu.recording.policy import GuessPolicy
from gfimu.recording.units import kind_of, unit_of_name

__all__ = ["Triad", "find_triads"]

_NUMBERED = re.compile(r"(?P<before>.*?)(?P<number>\d+)(?P<after>\D*)")
_ARTICLES = {"": "another quantity", "acceleration": "an acceleration", "rate": "a rate"}
_ANGLES = ("roll", "pitch", "yaw")  # about x, y and z
_AXES = (("x", "y", "z"), ("0", "1", "2"), ("1", "2", "3"))
_ROUND = 0.1  # relative: by which the length at rest scatters where it is the same in all poses
_NEAR_ZERO = 0.02  # of the largest reading
_STEADY = 1e-3  # of the length: less than any accelerometer that is moved varies
_POLICY = GuessPolicy()


@dataclass(frozen=True)
class Triad:
    """Three columns that belong together.

    Parameters
    ----------
    columns : tuple of str
        Names along x, y and z.
    kind : str
        ``acceleration``, ``rate``, or empty.
    by_name : bool
        Whether the names, and not the numbers alone, show the kind.
    shows_gravity : bool
        Whether the length at rest is gravity.
    is_usual : bool
        Whether it is gravity in a usual unit or a usual number of counts.
    is_processed : bool
        Whether the names are those of an acceleration that a program has computed from others.
    why_not : str
        For a reason, where the numbers contradict the names; empty if they don't.
    unit : (str, float)
        Unit and scale by which the length at rest is gravity.
    off : float
        Relative distance of that length from gravity.
    """

    columns: tuple[str, str, str]
    kind: str
    by_name: bool = False
    shows_gravity: bool = False
    is_usual: bool = False
    is_processed: bool = False
    why_not: str = ""
    unit: tuple[str, float] = ("", 1.0)
    off: float = 0.0


def find_triads(table: RawTable, taken: Sequence[str] = ()) -> list[Triad]:
    """Return columns whose names differ in x, y, z (or 0, 1, 2 or 1, 2, 3) alone, or are numbered on, of force or rate.

    Where the numbers of one triad are gravity at rest, others count as acceleration only if their names are those of
    one; an acceleration that a program has computed counts only where nothing else shows gravity.
    """
    free = {_short(name): name for name in table.columns if name not in taken and table.columns[name].dtype != object}
    if not table.named:
        return _chosen([one for run in _runs(table, free.values()) for one in _without_names(table, run)], named=False)
    found = _numbered(table, free)
    used = {_short(name) for one in found for name in one.columns}
    for short, name in free.items():
        for three in _threes_of(short):
            if all(one in free for one in three) and not used & set(three):
                columns = (name, free[three[1]], free[three[2]])
                triad = _triad(table, columns)
                # More than three with numbers are axes of one each, unless gravity is their length.
                if _goes_on(three, free) and not triad.shows_gravity:
                    continue
                used |= set(three)
                found.append(triad)
    others = [name for short, name in free.items() if short not in used]
    return _chosen([*found, *_of_one_stem(table, others)], named=True)


def _of_one_stem(table: RawTable, names: Sequence[str]) -> list[Triad]:
    """Return neighbours that are forces, or rates, by name and differ in one word, as roll, pitch and yaw."""
    stems: dict[tuple[str, ...], list[str]] = {}
    for name in names:
        words = words_of(name).split()
        for place in (place for place, word in enumerate(words) if word.isalpha()):
            stem = (unit_of_name(name)[1], *words[:place], "", *words[place + 1 :])
            stems.setdefault(stem, []).append(name)
    found = []
    for three in (one for one in stems.values() if len(one) == 3):
        angles = [next((angle for angle in _ANGLES if angle in words_of(name)), "") for name in three]
        if all(map(is_rate, three)) and sorted(angles) == sorted(_ANGLES):
            first, second, third = (three[angles.index(angle)] for angle in _ANGLES)
            found.append(_triad(table, (first, second, third)))
        elif all(map(is_acceleration, three)):
            why = "; which of them is x, y and z is a guess"
            found.append(replace(_triad(table, (three[0], three[1], three[2])), why_not=why))
    return found


def _threes_of(short: str) -> list[tuple[str, str, str]]:
    """Return the names of three axes of which a name is the first; the last letter or number first, ``a11`` as a12."""
    found = []
    for first, second, third in _AXES:
        places = [place for place, letter in enumerate(short) if letter == first]
        found += [
            (short, *(short[:place] + axis + short[place + 1 :] for axis in (second, third))) for place in places[::-1]
        ]
    return [(one, two, three) for one, two, three in found]


def _goes_on(three: tuple[str, str, str], free: Mapping[str, str]) -> bool:
    """Whether a fourth name follows three numbered ones."""
    place = next(spot for spot, (one, two) in enumerate(zip(three[0], three[1], strict=True)) if one != two)
    last = three[2][place]
    return last.isdigit() and three[2][:place] + str(int(last) + 1) + three[2][place + 1 :] in free


def _numbered(table: RawTable, free: Mapping[str, str]) -> list[Triad]:
    """Return the threes that show gravity in columns whose names are numbered on, as CH0 … CH11, as without names.

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
        if found and not OTHER.search(words_of(name)):
            series.setdefault((found["before"], found["after"]), {})[int(found["number"])] = name
    threes: list[Triad] = []
    for columns in series.values():
        order = sorted(columns)
        is_usual = len(order) == len(_AXES[0]) and order[0] in {0, 1}
        if is_usual or len(order) % 3 or any(two - one != 1 for one, two in pairwise(order)):
            continue
        found_here = _threes(table, [columns[number] for number in order])
        if any(one.shows_gravity for one in found_here) and all(
            one.shows_gravity or one.kind == "rate" for one in found_here
        ):
            threes += found_here
    return threes


def _known(table: RawTable, name: str) -> NDArray[np.float64]:
    values = table.numbers(name)
    known = values[np.isfinite(values)]
    return known if len(known) else np.zeros(1)


def _without_names(table: RawTable, names: Sequence[str]) -> list[Triad]:
    """Return threes of neighbours, begun so that gravity is the length of as many as can be.

    Gravity that lies along one axis is the length of any three with that axis. So of ways with as many the one that
    begins first is taken, and of these the one that leaves no column over at the start.
    """
    ways = [_threes(table, names[:first]) + _threes(table, names[first:]) for first in range(3)]
    ways.append(_one_by_one(table, names))
    gravity = [[names.index(one.columns[0]) for one in way if one.shows_gravity] for way in ways]
    best = max(gravity, key=lambda places: (len(places), -places[0] if places else 0))
    return ways[gravity.index(best)]


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
        three = _threes(table, names[place : place + 3])
        if three and three[0].shows_gravity:
            found += [*_threes(table, apart), *three]
            apart = []
            place += 3
        else:
            apart.append(names[place])
            place += 1
    return found + _threes(table, apart)


def _threes(table: RawTable, names: Sequence[str]) -> list[Triad]:
    return [_triad(table, (names[at], names[at + 1], names[at + 2])) for at in range(0, len(names) - 2, 3)]


def _chosen(triads: list[Triad], *, named: bool) -> list[Triad]:
    """Return triads; where one shows gravity, others that neither show it nor are named so are no acceleration."""
    if not any(one.kind == "acceleration" for one in triads):
        # A wheel that never rests shows no gravity; without names something has to be the acceleration.
        return triads if named else [replace(one, kind="acceleration") if one.kind else one for one in triads]
    showing = [one for one in triads if one.kind == "acceleration" and one.shows_gravity]
    if not showing:
        return [replace(one, kind="") if one.is_processed or (named and not one.by_name) else one for one in triads]
    raw = any(not one.is_processed for one in showing)
    usual = any(one.is_usual for one in showing)
    best = min(showing, key=lambda one: one.off)
    found = []
    for one in triads:
        if one.is_processed and one.kind == "acceleration" and (raw or not one.shows_gravity):
            found.append(replace(one, kind=""))
        elif one in showing and usual and not one.is_usual and not one.by_name:
            found.append(replace(one, kind=""))  # of constant length without being gravity: a magnetic field
        elif (
            (one in showing and not named)
            and (one.unit != best.unit and one.unit[1] == 1.0)  # counts have the gain and bias of a raw chip
            and one.off > _POLICY.exact_counts
        ):
            found.append(replace(one, kind=""))  # beside a chip that shows gravity in another unit
        elif one.kind == "acceleration" and not one.shows_gravity and not one.by_name:
            found.append(replace(one, kind="rate"))
        else:
            found.append(one)
    return found


def _short(name: str) -> str:
    return unit_of_name(name)[0].lower()


def _triad(table: RawTable, columns: tuple[str, str, str]) -> Triad:
    """Return three columns with what they measure by all evidence: unit, words, the table's name, and the numbers."""
    words = words_of(columns[0]) if table.named else ""
    named, is_processed = evidence_of_names(words, words_of(table.name), unit_of_name(columns[0])[1])
    numbers, unit = _evidence_of_numbers(table, columns)
    kinds = ("", "acceleration", "rate")  # of equal ones the first
    kind = max(kinds, key=lambda one: named.get(one, 0.0) + numbers.get(one, 0.0))
    by_name = max(kinds, key=lambda one: named.get(one, 0.0))
    why_not = ""
    if kind != by_name and named:
        why_not = f"; its name is that of {_ARTICLES[by_name]}, its numbers are not"
    is_sure = named.get(kind, 0.0) >= _POLICY.letter
    gravity = unit is not None and unit.is_gravity and kind == "acceleration"
    is_usual = gravity and unit is not None and not any(unit.offset)
    found = Triad(columns, kind, is_sure, gravity, is_usual, is_processed, why_not)
    return found if unit is None else replace(found, unit=(unit.unit, unit.scale), off=unit.off)


def _evidence_of_numbers(table: RawTable, columns: tuple[str, str, str]) -> tuple[dict[str, float], TriadUnit | None]:
    """Return log odds of what three columns measure by their length at rest, and its unit as an acceleration."""
    values = triad_values(table, columns)
    windows = rest_windows(values)
    unit = unit_of_name(columns[0])[1]
    if not len(windows) or not values[np.isfinite(values)].any() or (unit and kind_of(unit) != "acceleration"):
        return {}, None
    lengths = np.linalg.norm(windows, axis=1)
    usual = float(np.median(lengths))
    is_constant = float(np.std(lengths)) < _ROUND * usual and usual > _NEAR_ZERO * float(np.nanmax(np.abs(values)))
    is_sphere = sphere_of(windows) is not None
    if not is_constant and not is_sphere:
        return {"rate": _POLICY.zero}, None
    if max(abs(usual - 1.0), float(np.std(lengths))) < _POLICY.unit_vector:
        return {}, None  # a direction or a part of a quaternion, which a program has computed
    guess = unit_of_acceleration(table, columns)
    is_gravity = guess.is_gravity
    if not (is_gravity and not any(guess.offset)) and float(np.nanmax(np.nanstd(values, axis=0))) < _STEADY * usual:
        return {}, None  # what hardly varies, as a place on the Earth
    odds = _POLICY.constant + (_POLICY.gravity if is_gravity else 0.0) + (_POLICY.poses if is_sphere else 0.0)
    return {"acceleration": odds}, guess
