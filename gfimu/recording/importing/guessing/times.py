"""The column of times of an unknown table and its unit; or a counter of samples, or a rate that the file states."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.recording.doubts.stamps import steady_clock
from gfimu.recording.importing.clock import parts_of
from gfimu.recording.importing.column_map import TimeSpec
from gfimu.recording.importing.dates import nanoseconds_of
from gfimu.recording.importing.raw_table import RawTable
from gfimu.recording.units import factor_of, kind_of, unit_of_name

__all__ = ["RATES", "TimeGuess", "find_time", "stated_rate"]

RATES = (5.0, 8000.0)  # Hz, of a recording of motion
_WORDS = ("time", "stamp", "sec", "clock", "tick", "zeit", "t_", "epoch", "unix", "milli", "micro", "date", "elapsed")
_COUNTERS = re.compile(r"count|sample|index|packet|frame|seq|row|^n$|^nr|^no\.?$|^i$|^idx|^#$|iteration", re.IGNORECASE)
_HINTS = {"ns": ("ns", "nano", "nanos"), "us": ("us", "micro", "micros", "fine"), "ms": ("ms", "milli", "millis")}
_DAYS = (2e4, 1e6)  # of dates as numbers in spreadsheets and MATLAB, from 1954 in the one to far on in the other
_UNKNOWN_RATE_HZ = 100.0  # stands in a suggested map until the user gives the rate
_LEAST_WRAP = 256.0  # a counter of one byte
_LARGEST_COUNTER = 2.0**64
_NEAR_WRAP = 0.02  # of the wrap, by which a step back may miss it: samples lost there
_LOOKED_AT = 50  # texts
_MOST_PARTS = 8  # restarts of a logger: what goes back more often is no time
_ROUND_RATE = 2e-3  # relative, by which a rate found from rounded times is taken for a whole number
_SAID_RATE = re.compile(
    r"(?:(?:sampl[a-z]{0,4}|output|update|data|logging|acq[a-z]{0,12})[_ -]{0,3}"
    r"|(?<![a-z])(?<!baud )(?<!bit )(?<!heart ))(?:rate|freq[a-z]{0,8})(?![a-z])|(?<![a-z])(?:odr|fs)(?![a-z])",
    re.IGNORECASE,
)
_SAID_PERIOD = re.compile(
    r"(?:interval|period|delta[ _]?[xt]|\bdt)(?P<unit>_[mun]?s)?\b[^\d\n]{0,12}?(?P<number>\d*\.?\d+(?:e-?\d+)?)"
    r"\s*(?P<after>[mun]?s(?:ec\w*)?\b)?",
    re.IGNORECASE,
)
_LONGEST_STATED = 1000  # numerical: characters of a line that states a rate
_NUMBER = re.compile(r"(?<![\w.])(\d+(?:[.,]\d+)?)\s*(k?hz)?", re.IGNORECASE)
_HERTZ = re.compile(r"(\d+(?:[.,]\d+)?)\s*(k?)(?:hz|sps)\b", re.IGNORECASE)


@dataclass(frozen=True)
class TimeGuess:
    """How the times of a table may be read.

    Parameters
    ----------
    spec : TimeSpec
        As in a column map.
    why : str
        What it rests on.
    sure : bool
        Whether nothing else is as likely.
    is_rate_known : bool
        False where the rate in ``spec`` only holds a place.
    columns : tuple of str
        Columns that are times or counters, so nothing else.
    """

    spec: TimeSpec
    why: str
    sure: bool = True
    is_rate_known: bool = True
    columns: tuple[str, ...] = ()


def find_time(table: RawTable) -> TimeGuess:
    """Return how the times of a table may be read: a column with its unit, else a counter, else a rate alone."""
    found = sorted(_candidates(table), key=lambda one: -one[0])
    times = tuple(str(guess.spec.column) for score, guess in found if score > 0.5 and guess.spec.column is not None)
    if found:
        best = found[0][1]
        own = best.columns if best.spec.column is None else (str(best.spec.column),)
        return TimeGuess(best.spec, best.why, best.sure, best.is_rate_known, tuple(dict.fromkeys((*own, *times))))
    rate = stated_rate(table)
    if rate is not None:
        return TimeGuess(TimeSpec(rate_hz=rate[0]), f"no column of times; the file states {rate[1]!r}")
    why = (
        f"no column of times and no stated rate: rate_hz = {_UNKNOWN_RATE_HZ:g} only holds the place, give the true one"
    )
    return TimeGuess(TimeSpec(rate_hz=_UNKNOWN_RATE_HZ), why, False, False)


def stated_rate(table: RawTable) -> tuple[float, str] | None:
    """Return the sample rate that the lines before the samples state, Hz, and the words; None without one."""
    rates: dict[float, str] = {}
    for line in (line[:_LONGEST_STATED] for line in table.preamble):
        for said in _SAID_RATE.finditer(line):
            number = _NUMBER.search(line, said.end())
            if number is None or number.start() - said.end() > 12:
                continue
            rate = float(number[1].replace(",", ".")) * (1e3 if (number[2] or "").lower() == "khz" else 1.0)
            if RATES[0] <= rate <= RATES[1]:
                return rate, line[said.start() : number.end()].strip()
        for period in _SAID_PERIOD.finditer(line):
            unit = (period["unit"] or period["after"] or "s").strip("_").lower()
            seconds = float(period["number"]) * {"m": 1e-3, "u": 1e-6, "n": 1e-9}.get(unit[0], 1.0)
            if seconds and RATES[0] <= 1.0 / seconds <= RATES[1]:
                return float(f"{1.0 / seconds:.12g}"), period[0].strip()
        for hertz in _HERTZ.finditer(line):
            rate = float(hertz[1].replace(",", ".")) * (1e3 if hertz[2] else 1.0)
            rates.setdefault(rate, hertz[0])
    if len(rates) == 1:
        ((rate, words),) = rates.items()
        return (rate, words) if RATES[0] <= rate <= RATES[1] else None
    return None


def _candidates(table: RawTable) -> Iterator[tuple[float, TimeGuess]]:
    """Yield columns that may be the time, with a score: a unit in the name 6, a word of time 4, texts 3.5."""
    for index, (name, values) in enumerate(table.columns.items()):
        is_text = values.dtype == object
        if values.dtype.kind == "M":
            stamps = values.astype("datetime64[ns]").astype(np.int64)
            found = _of_seconds(name, np.asarray((stamps - stamps[0]) * 1e-9, dtype=np.float64))
        elif is_text:
            found = _of_texts(name, values)
        else:
            found = _of_numbers(table, name, values)
        if found is not None:
            yield found[0] - 0.01 * index, found[1]


def _of_texts(name: str, values: NDArray[Any]) -> tuple[float, TimeGuess] | None:
    known = nanoseconds_of(values[:_LOOKED_AT])[1]
    if known.mean() < 0.5:
        return None
    stamps, known = nanoseconds_of(values)
    if not known.any():
        return None
    seconds: NDArray[np.float64] = np.full(len(stamps), np.nan)
    seconds[known] = (stamps[known] - stamps[known][0]) * 1e-9
    return _of_seconds(name, seconds)


def _of_seconds(name: str, seconds: NDArray[np.float64]) -> tuple[float, TimeGuess] | None:
    """Return how a column of dates or times of day can be the time."""
    steps = np.diff(seconds[np.isfinite(seconds)])
    if len(steps) < 3 or not (steps > 0).any():
        return None
    rounded = _rounded(name, seconds, 1.0)
    if rounded is not None:
        return rounded
    usual = float(np.median(steps[steps > 0]))
    why = f"{name} holds dates or times of day, {1.0 / usual:.4g} Hz"
    return 3.5 - _scatter(steps, usual), TimeGuess(TimeSpec(name, "datetime", part=_part(seconds)), why)


def _of_numbers(table: RawTable, name: str, values: NDArray[Any]) -> tuple[float, TimeGuess] | None:
    """Return how a column of numbers can be the time, if it can, and how likely that is."""
    known = values[np.isfinite(np.asarray(values, dtype=float))]
    steps = np.diff(known).astype(float)
    if len(steps) < 3 or not (steps > 0).any():
        return None
    plain, unit = unit_of_name(name)
    has_unit = bool(unit) and kind_of(unit) == "time"
    word = any(mark in plain.lower() for mark in _WORDS) or plain.lower() in {"t", "ts", "ms", "us"} or has_unit
    counter = None if word and not _COUNTERS.search(plain) else _counter(table, name, values, steps)
    if counter is not None:
        return counter
    within = _within_seconds(name, known, steps)
    if within is not None:
        return within
    usual = float(np.median(steps[steps > 0]))
    if float(np.mean(steps > 0)) < 0.9:
        return _rounded(name, values, factor_of(unit, "time") if has_unit else None) if word else None
    if float(np.mean(steps < 0)) > 0.01:
        return None
    if len(parts_of(np.asarray(values, dtype=float))) > _MOST_PARTS:
        return None
    wrap = _wrap(steps, usual)
    part = None if wrap is not None else _part(np.asarray(values, dtype=float))
    scatter = _scatter(steps, usual)
    units = [unit] if has_unit else _units_to_try(plain, float(known[0]), usual)
    for candidate in units:
        factor = factor_of(candidate, "time")
        steady = None if wrap is not None or part is not None else steady_clock(known.astype(float) * factor)
        rate = 1.0 / (usual * factor) if steady is None else steady.rate_hz
        if not has_unit and not RATES[0] <= rate <= RATES[1]:
            continue
        if steady is not None:
            why = f"{name}: its times {steady.sentence}"
            return 4.0 if word else 1.0, TimeGuess(TimeSpec(rate_hz=rate), why, False, columns=(name,))
        spec = TimeSpec(name, candidate, wrap=wrap, part=part)
        if has_unit:
            return 6.0 - scatter, TimeGuess(spec, f"the name of {name} has its unit; {rate:.4g} Hz")
        why = f"{name} increases by {usual:.6g} per row, which in {candidate} is {rate:.4g} Hz"
        return (4.0 if word else 1.0) - scatter, TimeGuess(spec, why, word or scatter < 0.5)
    return None


def _units_to_try(plain: str, first: float, usual: float) -> list[str]:
    """Return units of a column of times without one, the most likely first: by the end of its name, by its size."""
    order = [unit for unit, marks in _HINTS.items() if any(plain.lower().endswith(mark) for mark in marks)]
    order += ["d"] if _DAYS[0] < first < _DAYS[1] and usual < 1e-5 else []
    return [*order, *(one for one in ("s", "ms", "us", "ns") if one not in order)]


def _scatter(steps: NDArray[np.float64], usual: float) -> float:
    """Return by how much of itself the period of a column scatters, at most 0.5: of two clocks the steadier counts."""
    return min(0.5, float(np.median(np.abs(steps - usual))) / usual)


def _counter(
    table: RawTable, name: str, values: NDArray[Any], steps: NDArray[np.float64]
) -> tuple[float, TimeGuess] | None:
    """Return how a column that counts samples gives the time."""
    back = steps[steps < 0]
    wrap = float(1.0 - back.min()) if len(back) else None
    if wrap is not None and (wrap < 4.0 or math.log2(wrap) % 1.0 or len(back) > 0.3 * len(steps)):
        wrap = None  # it starts anew where the recording does
    ones = float(np.mean(np.isin(steps, [1.0] if wrap is None else [1.0, 1.0 - wrap])))
    if ones < 0.9:
        return None
    part = _part(np.asarray(values, dtype=float)) if wrap is None else None
    rate = stated_rate(table)
    if rate is None and not _COUNTERS.search(unit_of_name(name)[0]):
        return None
    if rate is None:
        spec = TimeSpec(name, rate_hz=_UNKNOWN_RATE_HZ, wrap=wrap, part=part)
        why = (
            f"{name} counts samples, and the file states no rate: rate_hz = {_UNKNOWN_RATE_HZ:g} only holds the place, "
            "give the true one"
        )
        return 0.5, TimeGuess(spec, why, False, False)
    why = f"{name} counts samples; the file states {rate[1]!r}"
    return 0.9, TimeGuess(TimeSpec(name, rate_hz=rate[0], wrap=wrap, part=part), why)


def _rounded(name: str, values: NDArray[Any], factor: float | None) -> tuple[float, TimeGuess] | None:
    """Return the rate of rows whose times are rounded so that several share one, from their number per time."""
    rows = np.flatnonzero(np.isfinite(np.asarray(values, dtype=float)))
    steps = np.diff(values[rows]).astype(float)
    changes = np.flatnonzero(steps > 0)
    if (steps < 0).any() or len(changes) < 4 or len(changes) > 0.7 * len(steps):
        return None
    first, last = rows[changes[0] + 1], rows[changes[-1] + 1]
    span = float(values[last] - values[first])
    for unit in [1.0] if factor is not None else [1.0, 1e-3, 1e-6, 1e-9]:
        rate = (last - first) / (span * unit * (factor or 1.0))
        if RATES[0] <= rate <= RATES[1]:
            whole = round(rate)
            spec = TimeSpec(rate_hz=float(whole if abs(rate / whole - 1.0) < _ROUND_RATE else f"{rate:.6g}"))
            each = len(values) / (len(changes) + 1)
            why = (
                f"{name} is rounded, {each:.3g} rows to a time: {rate:.6g} rows per second, taken as constant; gaps "
                "don't show"
            )
            return 1.5, TimeGuess(spec, why, False, columns=(name,))
    return None


def _within_seconds(name: str, values: NDArray[Any], steps: NDArray[np.float64]) -> tuple[float, TimeGuess] | None:
    """Return how a column can be the time that counts ms, µs or ns within each second, beside one of whole seconds."""
    back = steps[steps < 0]
    if values.dtype.kind not in "iu" or len(back) < 3 or values.min() < 0:
        return None
    usual = float(np.median(steps[steps > 0]))
    for unit, wrap in (("ms", 1e3), ("us", 1e6), ("ns", 1e9)):
        rate = 1.0 / (usual * factor_of(unit, "time"))
        fits = 0.9 * wrap <= float(values.max()) < wrap and bool(np.all(wrap + back <= 3.0 * usual))
        if fits and RATES[0] <= rate <= RATES[1]:
            why = f"{name} counts {unit} within each second, {rate:.4g} Hz; gaps of a second or more don't show"
            return 3.0, TimeGuess(TimeSpec(name, unit, wrap=wrap), why)
    return None


def _part(seconds: NDArray[np.float64]) -> int | None:
    """Return the number of the longest part where the clock starts anew; None where it starts once."""
    parts = parts_of(seconds)
    if len(parts) == 1:
        return None
    return 1 + max(range(len(parts)), key=lambda place: parts[place].stop - parts[place].start)


def _wrap(steps: NDArray[np.float64], usual: float) -> float | None:
    """Return the number at which a counter starts anew, a power of two; None where times merely go back."""
    back = steps[steps < 0]
    if not 0 < len(back) <= 0.01 * len(steps) or np.any(steps != np.round(steps)) or -back.min() > _LARGEST_COUNTER:
        return None
    wrap = float(2.0 ** math.ceil(math.log2(-back.min())))
    near = wrap + back <= max(3.0 * usual, _NEAR_WRAP * wrap)
    return wrap if wrap >= _LEAST_WRAP and near.all() else None
