"""Columns of numbers in the text of an HTML page: rounded to a stated step, differenced, deflated, in base64.

A column of n values is n 32-bit integers, the values divided by the step. Smooth columns are stored as differences of
first or second order, whose numbers are small. The bytes of equal weight stand together, which deflates better. A NaN
repeats the value before it, and a bit per value says where. The script ``plots.js`` reads the columns in their order.
"""

from __future__ import annotations

import base64
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Packed", "enveloped"]

_LARGEST = 2**28  # of an integer; a second difference of such is within 32 bits
_FINEST = 1e-12  # step of a column of zeros


class Packed:
    """Columns that are added one by one and written as one text."""

    def __init__(self) -> None:
        self._columns: list[dict[str, Any]] = []
        self._bytes: list[bytes] = []

    def add(self, values: NDArray[np.float64], step: float, *, order: int = 0) -> int:
        """Add a column and return its number.

        Parameters
        ----------
        values : ndarray, shape (n,)
            Values; NaN and infinite ones become gaps.
        step : float
            What they are rounded to, in their unit. It is made larger where the values need more than 28 bits.
        order : {0, 1, 2}
            Order of the differences that are stored.

        Returns
        -------
        int
            Number of the column, from 0.
        """
        values = np.asarray(values, dtype=float)
        known = np.isfinite(values)
        filled = _filled(values, known)
        offset = float(filled[0]) if len(filled) else 0.0
        largest = float(np.abs(filled - offset).max(initial=0.0))
        step = max(step, largest / _LARGEST, _FINEST)
        whole = np.round((filled - offset) / step).astype(np.int64)
        for _ in range(order):
            whole = np.diff(whole, prepend=0)
        self._bytes.append(whole.astype("<i4").view(np.uint8).reshape(-1, 4).T.tobytes())
        gaps = not known.all()
        if gaps:
            self._bytes.append(np.packbits(known, bitorder="little").tobytes())
        self._columns.append({"n": len(values), "step": step, "offset": offset, "order": order, "gaps": gaps})
        return len(self._columns) - 1

    @property
    def columns(self) -> list[dict[str, Any]]:
        """What the reader has to know of each column, for JSON."""
        return self._columns

    def text(self) -> str:
        """Return the bytes of all columns, deflated (zlib), in base64."""
        return base64.b64encode(zlib.compress(b"".join(self._bytes), 6)).decode("ascii")


def _filled(values: NDArray[np.float64], known: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Repeat the last known value in gaps, and the first before it; zeros where none is known."""
    if not known.any():
        return np.zeros(len(values))
    last = np.maximum.accumulate(np.where(known, np.arange(len(values)), -1))
    last[last < 0] = int(np.argmax(known))
    return values[last]


@dataclass(frozen=True)
class Envelope:
    """Lowest, highest and mean value of groups of samples.

    Parameters
    ----------
    t : ndarray, shape (2 m,)
        Start and middle of each group, s.
    edges : ndarray, shape (2 m,)
        Lowest and highest value of each group, NaN without a sample.
    mean : ndarray, shape (2 m,)
        Mean of each group, twice.
    """

    t: NDArray[np.float64]
    edges: NDArray[np.float64]
    mean: NDArray[np.float64]


def enveloped(t: NDArray[np.float64], values: NDArray[np.float64], group: int) -> Envelope:
    """Return the envelope of values (n,) at times (n,) over groups of samples, so that no peak is lost.

    The last group may be shorter than the others.
    """
    starts = np.arange(0, len(t), group)
    known = np.isfinite(values)
    low = np.minimum.reduceat(np.where(known, values, np.inf), starts)
    high = np.maximum.reduceat(np.where(known, values, -np.inf), starts)
    count = np.add.reduceat(known.astype(float), starts)
    total = np.add.reduceat(np.where(known, values, 0.0), starts)
    edges = np.where(count[:, None] > 0, np.column_stack([low, high]), np.nan)
    mean = np.where(count > 0, total / np.maximum(count, 1.0), np.nan)
    ends = np.append(starts[1:], len(t)) - 1
    middles = 0.5 * (t[starts] + t[ends])
    return Envelope(np.column_stack([t[starts], middles]).ravel(), edges.ravel(), np.repeat(mean, 2))
