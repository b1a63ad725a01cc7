"""Wrong samples of channels, found by the samples alone: corrupt, misread, frozen, clipped, dead, noisy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gfimu.base.difference_noise import difference_noise
from gfimu.recording.doubts.doubt import Doubt, rows_in_words
from gfimu.recording.doubts.rails import is_within_range, rails_of
from gfimu.recording.policy import SamplePolicy

__all__ = [
    "chips_of",
    "frozen_rows",
    "least_step",
    "rate_doubts",
    "sample_doubts",
    "sentinels_of",
    "typical_noise",
    "wrong_reads",
]

_POLICY = SamplePolicy()
_SENTINELS = (
    99.0,
    999.0,
    9999.0,
    99999.0,
    999999.0,
    32767.0,
    32768.0,
    8388607.0,
    8388608.0,
    2147483647.0,
    2147483648.0,
)  # numerical: what loggers write where they have no number
_AROUND = (-2, -1, 1, 2)  # numerical: rows beside a reading


def sample_doubts(
    columns: Mapping[str, NDArray[np.float64]],
    chips: Sequence[Sequence[str]],
    *,
    unit: str = "",
    least_noise: Mapping[str, float] | None = None,
) -> list[Doubt]:
    """Return what is odd about the readings of channels.

    Parameters
    ----------
    columns : mapping of str to ndarray, shape (n,)
        Readings by channel; NaN where one is missing.
    chips : sequence of sequence of str
        Channels that are read together.
    unit : str
        Their unit, for sentences.
    least_noise : mapping of str to float, optional
        White noise that a channel of the part has at least. A level that is computed or held without noise is no rail,
        and a constant channel is dead only beside others that have noise.
    """
    found: list[Doubt] = []
    noise: dict[str, float] = {}
    floor = least_noise or {}
    constant: dict[str, float] = {}
    alive: list[str] = []  # channels with noise of their own
    size = f" {unit}" if unit else ""
    for name, values in columns.items():
        present = np.isfinite(values)
        known = values[present]
        if not len(known):
            found.append(Doubt("dead", f"{name} has no readings: check its wiring", False, (name,)))
            continue
        corrupt = _corrupt(values)
        if corrupt.any():
            most = float(np.abs(values[corrupt]).max())
            text = f"{name}: {int(corrupt.sum())} values that can be no reading, up to {most:.3g}"
            found.append(Doubt("corrupt", text, False, (name,), np.flatnonzero(corrupt), is_no_reading=True))
            known = values[present & ~corrupt]
        if not present.all():
            text = f"{name}: {int(np.sum(~present))} of {len(values)} cells are empty"
            found.append(Doubt("missing", text, False, (name,), np.flatnonzero(~present), is_minor=True))
        if len(known) < _POLICY.fewest:
            continue
        if known.min() == known.max():
            constant[name] = float(known[0])
            continue
        noise[name] = difference_noise(known)
        if typical_noise(known) <= floor.get(name, 0.0):
            continue
        alive.append(name)
        held = frozen_rows(np.where(corrupt, np.nan, values), noise[name])
        if len(held):
            text = (
                f"{name} holds one value for up to {_longest(held)} rows ({rows_in_words(held[:1])} on), although it "
                "has noise: its chip had stopped, or samples were repeated"
            )
            found.append(Doubt("frozen", text, False, (name,), held, is_no_reading=True))
        for rail in rails_of(np.where(corrupt, np.nan, values)):
            count = int(rail.on.sum())
            text = f"{name} reads its rail ({rail.side} {rail.level:.4g}{size}) in {count} samples; set a wider range"
            found.append(Doubt("clipped", text, False, (name,), np.flatnonzero(rail.on), is_no_reading=True))
    if len(alive) >= max(1, len(noise) // 2):
        for name, value in constant.items():
            text = f"{name} reads {value:.5g}{size} throughout: check its chip"
            found.append(Doubt("dead", text, False, (name,), is_no_reading=True))
    found += _noisy(noise)
    on_rails = {name: one.rows for one in found if one.kind == "clipped" for name in one.channels}
    for chip in chips:
        axes = [name for name in chip if name in alive]
        if axes:
            found += wrong_reads({name: columns[name] for name in axes}, {name: on_rails.get(name) for name in axes})
    return found


def rate_doubts(name: str, values: NDArray[np.float64]) -> list[Doubt]:
    """Return what is odd about a reference rate, (n,), rad/s: values that can be none, misread ones, and rails.

    A pulse too few or too many makes half the rate or twice it. Rows without a value are those between its samples.
    """
    rows = np.flatnonzero(np.isfinite(values))
    found = sample_doubts({name: values[rows]}, [[name]], unit="rad/s")
    return [replace(one, rows=rows[one.rows]) for one in found if one.kind in {"corrupt", "wrong_read", "clipped"}]


def chips_of(channels: Sequence[str]) -> list[list[str]]:
    """Return the channels of each chip, by their names: a11, a12 and a13 are of chip a1."""
    chips: dict[str, list[str]] = {}
    for name in channels:
        chips.setdefault(name[:-1], []).append(name)
    return list(chips.values())


def typical_noise(values: NDArray[np.float64]) -> float:
    """Return the white noise of readings, (n,), by the mean of their second differences, in their unit.

    A mean, unlike a median, shows noise of less than the steps of the readings; single large differences count little.
    """
    second = np.abs(np.diff(values, n=2))
    second = second[np.isfinite(second)]
    if not len(second):
        return 0.0
    return float(np.mean(np.minimum(second, 20.0 * np.mean(second)))) / np.sqrt(
        12.0 / np.pi
    )  # numerical: of white noise


def frozen_rows(values: NDArray[np.float64], noise: float) -> NDArray[np.intp]:
    """Return the rows in which a channel, (n,), repeats the reading before too often for its noise, within its range.

    How often a reading repeats the one before by chance follows from the channel itself, away from these rows.
    """
    edges = np.flatnonzero(np.diff(values, prepend=np.nan, append=np.nan) != 0.0)
    lengths = np.diff(edges)
    usual = lengths[lengths <= _POLICY.longest_equal]
    if not len(usual) or len(usual) == len(lengths):
        return np.empty(0, dtype=np.intp)
    repeats = 1.0 - len(usual) / float(usual.sum())  # of readings that repeat the one before
    least = np.log(_POLICY.chance / len(values)) / np.log(max(repeats, _POLICY.least_repeats))
    step = least_step(values)
    found = []
    for place in np.flatnonzero(lengths > max(least, _POLICY.longest_equal)):
        start, stop = int(edges[place]), int(edges[place + 1])
        beyond = min(np.sum(values > values[start]), np.sum(values < values[start]))
        is_inside = beyond > max(_POLICY.beyond_pile * (stop - start), _POLICY.garbage)
        if is_inside or is_within_range(values, start, stop, step, noise):
            found.append(np.arange(start, stop))
    return np.concatenate(found) if found else np.empty(0, dtype=np.intp)


def _longest(rows: NDArray[np.intp]) -> int:
    """Return the largest number of rows in a row."""
    edges = np.flatnonzero(np.diff(rows, prepend=-2, append=rows[-1] + 2) != 1)
    return int(np.diff(edges).max())


def _corrupt(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mark values, (n,), that are too large for a measurement."""
    usual = float(np.nanmedian(np.abs(values))) or 1.0
    return np.asarray(np.abs(values) > _POLICY.corrupt * usual)


def _noisy(noise: Mapping[str, float]) -> Iterator[Doubt]:
    usual = float(np.median(list(noise.values()))) if noise else 0.0
    for name, level in noise.items():
        if usual > 0.0 and level > _POLICY.noisy * usual:
            text = f"{name} is noisy: {level:.3g} per sample, {level / usual:.2g} times the median of the channels"
            yield Doubt("noisy", text, False, (name,), is_minor=True)


def wrong_reads(
    chip: Mapping[str, NDArray[np.float64]], on_rails: Mapping[str, NDArray[np.intp] | None] | None = None
) -> list[Doubt]:
    """Return the single readings of a chip that its registers did not hold, and those that only stand out.

    A reading stands out where it is far from the two before and the two after it, beside the noise and what those
    differ by. It is wrong where all axes of the chip are the same multiple of what is around them: zero, twice, half
    or minus. A knock, which a slow chip may read once, is no such multiple.

    Parameters
    ----------
    chip : mapping of str to ndarray, shape (n,)
        Readings by axis.
    on_rails : mapping of str to ndarray of int, optional
        Rows on a rail by axis: they are no such readings.
    """
    values = np.column_stack(list(chip.values()))  # (n, k)
    if len(values) < _POLICY.fewest:
        return []
    noise = np.array([max(difference_noise(one[np.isfinite(one)]), 0.5 * least_step(one)) for one in values.T])
    rows = np.flatnonzero((_far(values, noise)).any(axis=1) | (values == 0.0).all(axis=1))
    for on in (on_rails or {}).values():
        rows = np.setdiff1d(rows, on if on is not None else [])
    rows = rows[(rows >= 2) & (rows < len(values) - 2)]
    if not len(rows) or len(rows) > _POLICY.most_wrong * len(values):
        return []
    around = values[rows[:, None] + np.array(_AROUND)]  # (r, 4, k)
    middle = np.median(around, axis=1)
    width = _POLICY.apart * noise + _POLICY.rough * np.ptp(around, axis=1)
    seen = np.isfinite(around).all(axis=(1, 2)) & np.isfinite(values[rows]).all(axis=1)
    away = np.abs(values[rows] - middle) > width
    multiples = {
        factor: np.all(np.abs(values[rows] - factor * middle) < np.where(factor == 0.0, noise, width), axis=1)
        for factor in _POLICY.multiples
    }
    is_clear = (np.abs(middle) > _POLICY.clear * noise).any(axis=1)
    wrong = np.logical_or.reduce(list(multiples.values())) & is_clear & seen & away.any(axis=1)
    if values.shape[1] == 1 and int(wrong.sum()) < 2:  # of one axis a single value may be any multiple
        wrong[:] = False
    names = tuple(chip)
    found = []
    if wrong.any():
        text = (
            f"{', '.join(names)}: {int(wrong.sum())} single readings are zero or a multiple of those around them "
            f"({rows_in_words(rows[wrong])}), as of a misread register or a lost pulse; results do without them "
            "(gfimu convert --drop wrong_read)"
        )
        found.append(Doubt("wrong_read", text, False, names, rows[wrong], is_no_reading=True))
    spikes = rows[away.any(axis=1) & seen & ~wrong]
    if len(spikes):
        text = (
            f"{', '.join(names)}: {len(spikes)} single readings are far from those around them "
            f"({rows_in_words(spikes)}): misread, or knocks"
        )
        found.append(Doubt("spike", text, False, names, spikes, is_minor=True))
    return found


def _far(values: NDArray[np.float64], noise: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mark readings, (n, k), that are on one side of both neighbours by more than their noise."""
    before = np.diff(values, axis=0, prepend=values[:1])
    after = np.diff(values, axis=0, append=values[-1:])
    least = np.minimum(np.abs(before), np.abs(after))
    return np.asarray((before * after < 0.0) & (least > _POLICY.apart * noise))


def least_step(values: NDArray[np.float64]) -> float:
    """Return the least difference between readings, in their unit: one count of what is not averaged."""
    steps = np.diff(np.unique(values[np.isfinite(values)]))
    return float(steps.min()) if len(steps) else 0.0


def sentinels_of(values: NDArray[np.float64]) -> tuple[float, ...]:
    """Return numbers of a channel, (n,), that stand for a missing value: -9999 and the like, far from all others."""
    found: list[float] = []
    levels = np.unique(values[np.isfinite(values)])
    for _ in range(2):
        if len(levels) < _POLICY.least_levels:
            break
        for extreme, rest in ((levels[0], levels[1:]), (levels[-1], levels[:-1])):
            away = float(min(abs(extreme - rest[0]), abs(extreme - rest[-1])))
            if abs(float(extreme)) in _SENTINELS and away > _POLICY.sentinel_apart * max(float(np.ptp(rest)), 1e-9):
                found.append(float(extreme))
                levels = rest
                break
    return tuple(found)
