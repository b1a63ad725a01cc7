"""Dates and times of day as texts of any usual form, as whole nanoseconds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

__all__ = ["nanoseconds_of"]

_DAY_NS = 86_400_000_000_000
_DATE = r"(?:(?P<y>\d{4})[-/.](?P<m>\d{1,2})[-/.](?P<d>\d{1,2})|(?P<p>\d{1,2})[-/.](?P<q>\d{1,2})[-/.](?P<r>\d{4}))"
_CLOCK = (
    r"(?:(?P<H>\d{1,2}):(?P<M>\d{2})(?::(?P<S>\d{2})(?:[.,:](?P<f>\d+))?)?"
    r"|(?P<H2>\d{1,2})[.h](?P<M2>\d{2})[.m](?P<S2>\d{2})(?:[.,](?P<f2>\d+))?s?)"
)
_HALF = r"(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?"
_ZONE = r"(?:\s*(?P<zone>Z|z|UTC|GMT|[+-]\d{2}:?\d{2}))?(?:\s+\[?[A-Za-z]+(?:/[A-Za-z_]+)?\]?)?"
_FULL = rf'^[\s"]*(?:\d+ days?,? +)?(?:{_DATE})?[T _,]*{_CLOCK}{_HALF}{_ZONE}[\s"]*$'
_MINUTES = r'^[\s"]*(?P<M>\d{1,3}):(?P<S>\d{2})(?:[.,](?P<f>\d+))?[\s"]*$'


def nanoseconds_of(values: NDArray[Any] | Sequence[Any]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return dates or times of day as nanoseconds, and which of them are such.

    A date counts from 1970, by its time zone if it has one. A time of day counts from midnight of the first row; where
    it goes back by more than half a day (half an hour, for minutes and seconds alone), the next day (hour) has begun.
    Of dates as 05/17/2024 and 17.05.2024 the first number is the month with a slash, the day with a point, unless it
    is above twelve.

    Parameters
    ----------
    values : sequence of n texts

    Returns
    -------
    ndarray of int64, shape (n,)
        Nanoseconds; of no meaning where a value is none.
    ndarray of bool, shape (n,)
        Values that are a date or a time of day.
    """
    texts = pa.array([None if value is None else str(value) for value in values], pa.string())
    known = np.zeros(len(texts), dtype=bool)
    if not len(texts):
        return np.zeros(0, dtype=np.int64), known
    parts = pc.extract_regex(texts, _FULL)
    if parts.null_count > len(parts) // 2:
        parts = pc.extract_regex(texts, _MINUTES)
        if parts.null_count > len(parts) // 2:
            return np.zeros(len(texts), dtype=np.int64), known
    known = parts.is_valid().to_numpy(zero_copy_only=False)
    found = {parts.type.field(index).name: column for index, column in enumerate(parts.flatten())}

    def number(name: str) -> NDArray[np.int64]:
        """Return a part as whole numbers; 0 where it is not there."""
        if name not in found:
            return np.zeros(len(texts), dtype=np.int64)
        plain = pc.if_else(pc.equal(pc.fill_null(found[name], ""), ""), "0", found[name])
        return np.asarray(pc.cast(plain, pa.int64()).to_numpy(zero_copy_only=False), dtype=np.int64)

    def fraction(name: str) -> NDArray[np.int64]:
        if name not in found:
            return np.zeros(len(texts), dtype=np.int64)
        digits = pc.utf8_slice_codeunits(pc.utf8_rpad(pc.fill_null(found[name], ""), 9, "0"), 0, 9)
        return np.asarray(pc.cast(digits, pa.int64()).to_numpy(zero_copy_only=False), dtype=np.int64)

    hours = number("H") + number("H2")
    if "half" in found:
        half = np.char.lower(np.array(pc.fill_null(found["half"], "").to_pylist(), dtype=str))
        hours = np.where(half == "p", hours % 12 + 12, np.where(half == "a", hours % 12, hours))
    clock = (hours * 3600 + (number("M") + number("M2")) * 60 + number("S") + number("S2")) * 1_000_000_000
    clock = clock + fraction("f") + fraction("f2")
    year = number("y") + number("r")
    known &= (hours < 24) & (number("M") + number("M2") < (60 if "H" in found else 1000))
    if not (year[known] > 0).all():
        return _unrolled(clock, known, _DAY_NS if "H" in found else 3_600_000_000_000), known
    month, day = number("m"), number("d")
    first, second = number("p"), number("q")
    months_first = _months_first(texts, first, second)
    month = month + (first if months_first else second)
    day = day + (second if months_first else first)
    known &= (month >= 1) & (month <= 12) & (day >= 1) & (day <= 31)
    start = (year - 1970).astype("timedelta64[Y]") + np.datetime64("1970", "Y")
    days = (start.astype("datetime64[M]") + (month - 1)).astype("datetime64[D]").astype(np.int64) + day - 1
    return np.asarray(days * _DAY_NS + clock - _zone(found.get("zone")), dtype=np.int64), known


def _months_first(texts: pa.Array, first: NDArray[np.int64], second: NDArray[np.int64]) -> bool:
    """Whether the first number of a date is the month."""
    if (first > 12).any():
        return False
    return bool((second > 12).any()) or "/" in str(texts[0])


def _zone(zones: pa.Array | None) -> NDArray[np.int64] | int:
    """Return the offsets of time zones, ns."""
    if zones is None:
        return 0
    coded = pc.dictionary_encode(pc.fill_null(zones, ""))
    offsets = []
    for zone in coded.dictionary.to_pylist():
        sign = -1 if zone[:1] == "-" else 1
        digits = zone.lstrip("+-").replace(":", "")
        offsets.append(sign * (int(digits[:2]) * 60 + int(digits[2:])) * 60_000_000_000 if digits.isdigit() else 0)
    return np.array(offsets, dtype=np.int64)[coded.indices.to_numpy(zero_copy_only=False)]


def _unrolled(clock: NDArray[np.int64], known: NDArray[np.bool_], period: int) -> NDArray[np.int64]:
    """Return times of day that go on over midnight, or minutes that go on over the hour."""
    steps = np.diff(clock[known], prepend=clock[known][:1])
    turns = np.cumsum((steps < -period // 2).astype(np.int64) - (steps > period // 2).astype(np.int64))
    found = clock.copy()
    found[known] += period * turns
    return np.asarray(found, dtype=np.int64)
