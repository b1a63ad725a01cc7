"""Patterns that one thing upstream of all chips leaves in numbers per channel or per chip.

A fault of one chip leaves numbers that nothing binds to those of the others. What is wrong before the chips (the
reference, the motion of the table, gravity, an array that leans) shows in all of them at once, in the ratio of the
arms, of the shares of gravity or of the places. Arms are those of the whole array about the vertical axis of the table.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray

__all__ = ["NOTHING", "SPARE", "Pattern", "channel_patterns", "chip_patterns", "distinct", "pair_patterns"]

NOTHING = float(np.sqrt(np.finfo(float).eps))
"""Numerical: share of a pattern, or of a metre, that is rounding."""
SPARE = 2
"""Numerical: numbers that a pattern must have more than it has free ones."""


@dataclass(frozen=True)
class Pattern:
    """A pattern of some numbers.

    Parameters
    ----------
    name : str
        What the numbers are in proportion to, for people.
    columns : ndarray, shape (m, r)
        The m numbers from r free ones.
    common : bool
        Whether one thing before all chips makes it; else one thing in each chip does.
    """

    name: str
    columns: NDArray[np.float64]
    common: bool = True

    @property
    def is_of_equals(self) -> bool:
        """Whether all numbers that it has in a column are the same."""
        largest = np.abs(self.columns).max(axis=0)
        near = np.abs(self.columns - largest) < NOTHING * largest
        return bool((near | (np.abs(self.columns) < NOTHING * largest)).all())


def channel_patterns(array: AccelerometerArray, mounting: NDArray[np.float64]) -> list[Pattern]:
    """Return patterns of a number per channel.

    Parameters
    ----------
    array : AccelerometerArray
        The array.
    mounting : ndarray, shape (3, 3)
        Rotation matrix from the body to the table.
    """
    axes, places = array.axes @ mounting.T, array.positions @ mounting.T  # (c, 3)
    axis = _axis_of_channel(array)
    tangential = np.cross(places, axes)[:, 2]  # reading per angular acceleration, m
    centripetal = -np.sum(places[:, :2] * axes[:, :2], axis=1)  # reading per squared rate, m
    everywhere = [
        (f"{name} on {where}", field * mask)
        for where, mask in _groups(axis)
        for name, field in _fields(array, mounting, array.chip_of_channel)
    ]
    found = [
        ("the centripetal arm", centripetal),
        ("the inverse of the centripetal arm", _inverse(centripetal)),
        ("the square of the centripetal arm", centripetal**2),
        ("the tangential arm", tangential),
        ("the inverse of the tangential arm", _inverse(tangential)),
        ("the share of gravity", axes[:, 2]),
        *everywhere,
        ("centripetal and tangential arm, as of one spin", np.column_stack([centripetal, tangential])),
        ("a rigid motion of the whole array", np.hstack([axes, np.cross(places, axes)])),
    ]
    each = np.eye(axis.max() + 1)[axis]  # (c, 3)
    for name, field in _fields(array, mounting, array.chip_of_channel):
        found.append((f"{name}, a number per sensing axis", field[:, None] * each))
    return [Pattern(name, columns.reshape(len(axis), -1)) for name, columns in found]


def chip_patterns(array: AccelerometerArray, mounting: NDArray[np.float64], components: int) -> list[Pattern]:
    """Return patterns of some numbers per chip, those of a chip after each other; as `channel_patterns`."""
    count = len(array.chips)
    fields = _fields(array, mounting, np.arange(count))
    unit = np.eye(components)
    found = [
        (f"{name} on component {index + 1}", np.outer(field, one).ravel())
        for index, one in enumerate(unit)
        for name, field in fields
    ]
    if components == 3:
        centred = array.chip_positions - array.chip_positions.mean(axis=0)
        turned = np.stack([np.cross(one, centred).ravel() for one in unit], axis=1)
        flat = (centred * [1.0, 1.0, 0.0]).ravel()
        found += [
            (f"a turn of the whole array about {name}", column) for name, column in zip("xyz", turned.T, strict=True)
        ]
        found += [
            ("the distance from the centre", centred.ravel()),
            ("the distance from the axis", flat),
            ("a turn of the whole array", turned),
            ("a turn about z and the distance from the axis", np.column_stack([turned[:, 2], flat])),
        ]
    for name, field in fields[:3]:
        found.append(
            (f"{name}, a number per component", np.stack([np.outer(field, one).ravel() for one in unit], axis=1))
        )
    return [Pattern(name, columns.reshape(count * components, -1)) for name, columns in found]


def pair_patterns(array: AccelerometerArray, pairs: Sequence[tuple[int, int]]) -> list[Pattern]:
    """Return the pattern of a number per ordered pair of channels of a chip that turned axes leave.

    What channel i picks up from j, j picks up from i with the other sign.
    """
    place = {pair: index for index, pair in enumerate(pairs)}
    half = [(i, j) for i, j in pairs if i < j]
    turned = np.zeros((len(pairs), len(half)))
    for column, (i, j) in enumerate(half):
        turned[place[i, j], column], turned[place[j, i], column] = 1.0, -1.0
    chip = np.array([array.chip_of_channel[i] for i, _ in half])
    groups = [chip >= 0, *(chip == number for number in range(len(array.chips)))]
    return [Pattern("axes that are turned, opposite in every pair", turned[:, group], common=False) for group in groups]


def distinct(patterns: Sequence[Pattern], prior: NDArray[np.float64]) -> list[Pattern]:
    """Return patterns in units of the prior (m,), of unit rms, without those that span what another does.

    Left out is also what rests on hardly more numbers than it has free ones.
    """
    kept: list[Pattern] = []
    spans: list[NDArray[np.float64]] = []
    for pattern in patterns:
        columns = pattern.columns / prior[:, None]
        columns = columns[:, np.linalg.norm(columns, axis=0) > 0.0]
        if not columns.shape[1]:
            continue
        used = int((np.abs(columns) > NOTHING * np.abs(columns).max()).any(axis=1).sum())
        left, power, _ = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), full_matrices=False)
        if used < columns.shape[1] + SPARE or power[-1] < NOTHING * power[0]:
            continue
        if any(span.shape == left.shape and np.sum((span.T @ left) ** 2) > left.shape[1] - NOTHING for span in spans):
            continue
        spans.append(left)
        kept.append(Pattern(pattern.name, columns / np.linalg.norm(columns, axis=0) * np.sqrt(used), pattern.common))
    return kept


def _fields(
    array: AccelerometerArray, mounting: NDArray[np.float64], chip: NDArray[np.intp]
) -> list[tuple[str, NDArray[np.float64]]]:
    """Return functions of the place of a chip, at some chips."""
    x, y, z = (array.chip_positions @ mounting.T)[chip].T
    radius = np.hypot(x, y)
    order = np.arange(len(array.chips))[chip]
    return [
        ("the same", np.ones(len(chip))),
        ("x", x),
        ("y", y),
        ("z", z - z.mean()),
        ("the radius", radius),
        ("the inverse of x", _inverse(x)),
        ("the inverse of y", _inverse(y)),
        ("the inverse of the radius", _inverse(radius)),
        ("the number of the chip", order - order.mean()),
    ]


def _groups(axis: NDArray[np.intp]) -> list[tuple[str, NDArray[np.bool_]]]:
    """Return groups of channels (c,), given the sensing axis of each."""
    single = [(f"sensing axis {index + 1}", axis == index) for index in range(axis.max() + 1)]
    return [("every channel", axis >= 0), *single, ("sensing axes 1 and 2", axis < 2)]


def _axis_of_channel(array: AccelerometerArray) -> NDArray[np.intp]:
    return np.concatenate([np.arange(len(chip.axes)) for chip in array.chips])


def _inverse(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.divide(1.0, values, out=np.zeros_like(values), where=np.abs(values) > NOTHING)
