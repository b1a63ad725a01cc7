"""What a picture of a result shows: panels with series, apart from who draws them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["OF_TIME", "Panel", "Series", "axis_series", "columns_of", "one_row", "text_column"]

OF_TIME = "time, s"
"""Label along a line over time."""


@dataclass(frozen=True)
class Series:
    """Values of one name in a panel.

    Parameters
    ----------
    name : str
        Name in the legend, empty for none.
    values : ndarray, shape (n,)
        Values, in the unit of the panel.
    std : ndarray, shape (n,), optional
        Standard deviations, drawn as a band or bars of ±2σ.
    x : ndarray, shape (n,), optional
        Where the values are, if not at the places of the panel.
    chip : int, optional
        Number of the chip whose colour the series has; by default that of its place in the panel.
    role : {"", "x", "y", "z", "before", "after", "noise"}
        Body axis, or part in a comparison, whose colour the series has.
    style : {"line", "dots", "dashes", "points"}
        How a line is drawn; points are not joined.
    """

    name: str
    values: NDArray[np.float64]
    std: NDArray[np.float64] | None = None
    x: NDArray[np.float64] | None = None
    chip: int | None = None
    role: str = ""
    style: str = "line"


@dataclass(frozen=True)
class Panel:
    """Series that share their axes.

    Parameters
    ----------
    title : str
        What is drawn.
    y_label : str
        Quantity and unit.
    series : tuple of Series
        The series, the first at the back.
    x : ndarray, shape (n,), or tuple of str
        Numbers along a line, or names: then each value is a dot with its bar.
    x_label : str
        Quantity and unit along the line.
    scale : {"linear", "zero", "log"}
        ``zero``: the values' axis begins at zero. ``log``: it is logarithmic, and so is the axis along a line.
    shaded : tuple of float, optional
        Part along a line that is shaded: its first and last place.
    """

    title: str
    y_label: str
    series: tuple[Series, ...]
    x: NDArray[np.float64] | tuple[str, ...]
    x_label: str = OF_TIME
    scale: str = "linear"
    shaded: tuple[float, float] | None = None

    @property
    def by_name(self) -> bool:
        """Whether the values stand over names."""
        return isinstance(self.x, tuple)


def axis_series(values: NDArray[np.float64], std: NDArray[np.float64] | None = None) -> tuple[Series, ...]:
    """Return the components of vectors (n, 3), each in the colour of its axis, with standard deviations (n, 3)."""
    parts = [None] * 3 if std is None else std.T
    return tuple(Series(name, value, part, role=name) for name, value, part in zip("xyz", values.T, parts, strict=True))


def one_row(values: Mapping[str, object]) -> dict[str, NDArray[Any]]:
    """Return values as a table of one row, by name with unit; what is no number is text, and empty where it is None."""
    return {name: text_column([""]) if value is None else _column([value]) for name, value in values.items()}


def columns_of(rows: Iterable[object], names: str) -> dict[str, NDArray[Any]]:
    """Return a table of results: a row each, and of their attributes the ``names``, between spaces.

    A column of numbers has NaN where one is None; others are texts.
    """
    listed = list(rows)
    return {name: _column([getattr(row, name) for row in listed]) for name in names.split()}


def _column(values: Sequence[Any]) -> NDArray[Any]:
    if all(value is None or isinstance(value, int | float | np.number | np.bool_) for value in values):
        return np.array([np.nan if value is None else value for value in values])
    return text_column(map(str, values))


def text_column(values: Iterable[str]) -> NDArray[np.object_]:
    """Return texts as a column of a table."""
    return np.array(list(values), dtype=object)
