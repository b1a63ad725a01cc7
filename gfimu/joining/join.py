"""One recording of channels and a reference that were logged on two clocks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from gfimu.errors import InputError
from gfimu.importing.piece import nearest_rows
from gfimu.joining.alignment import align
from gfimu.joining.reference_file import ReferenceSeries
from gfimu.joining.signals import Alignment, Signals, functions_of, uniform
from gfimu.recording import Recording
from gfimu.results import Panel, PlottedResult, Series, text_column
from gfimu.units import TIME_COLUMNS

__all__ = ["FAR", "Joined", "grids", "join_reference"]

_MOST_ROWS = 20_000  # of the grid on which offsets are searched
_FINEST = 0.005  # s, step of that grid
_ODDS = 30.0  # nats, by which the best offset has to beat the next, and a foreign reference
_LEVERS = 5.0  # standard deviations between the levers by ω² and by α
_LEVER_SHARE = 0.15  # of a lever: gains, axes and a tilt of the table make it differ by so much
_LOST = 0.2  # of the variance, on a quarter that the fit did not see
_FOREIGN = 6  # references of shuffled pieces
_MOST_RATE_ERROR = 0.5  # ratio that can be searched at most
_RATE_STDS = 5.0  # standard deviations from which a rate error is no chance: the stated ones may be low by a factor


FAR = 0.3
"""Offset beyond which a reference is moved before a diagnosis, s: `tacho_latency` is searched up to there."""


@dataclass(frozen=True)
class Joined(PlottedResult):
    """A recording with its reference on one clock, and the standard deviation of the clock's offset and rate.

    Parameters
    ----------
    recording : Recording
        The channels at their own times, with each value of the reference in the row nearest in time and, in a column of
        its own (``tacho_t_s``), the time at which it was read; NaN in between.
    alignment : Alignment
        Offset and rate error with their standard deviations.
    odds_over_second : float
        Log odds over the next-best offset, nats.
    odds_over_foreign : float
        Log odds over the best of references that can't belong to the channels, nats: this one reversed, and shuffled.
    doubts : tuple of str
        Why the two may not belong together; empty if they do.
    levers_m : dict of str to (float, float)
        Distance of each tri-axial chip from the axis by ω² and by α, m, for a table's reference.
    by_own_rate : Recording
        The same with the rate error left in: both clocks agree at the first sample of the channels, and the reference's
        runs at its own rate from there. A diagnosis finds `clock_error` in it.
    by_reference_clock : Recording
        The same with the channels' times on the reference's clock, which rates in rad/s are of.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.join("accelerometers.csv", "tacho.csv").recording  # doctest: +SKIP
    """

    recording: Recording
    alignment: Alignment
    odds_over_second: float
    odds_over_foreign: float
    doubts: tuple[str, ...]
    levers_m: dict[str, tuple[float, float]]
    by_own_rate: Recording
    by_reference_clock: Recording

    @property
    def offset_at_start(self) -> tuple[float, float]:
        """Time of the channels' clock less the reference's at the first sample of the channels, s, and its std."""
        found, t = self.alignment, self.recording.t_s
        start = float(t[0])
        late = start - (start - found.offset) / (1.0 + found.rate_error)
        return late, float(np.hypot(found.offset_std, found.rate_error_std * 0.5 * found.overlap_s))

    @property
    def is_far(self) -> bool:
        """Whether the clocks are further apart at the first sample than a late reference is."""
        return abs(self.offset_at_start[0]) > FAR

    @property
    def has_rate_error(self) -> bool:
        """Whether the clocks run at different rates by more than chance."""
        return abs(self.alignment.rate_error) > _RATE_STDS * self.alignment.rate_error_std

    @property
    def clock(self) -> dict[str, float]:
        """Offset at the first sample and rate error with their standard deviations, as a diagnosis reports them."""
        late, std = self.offset_at_start
        found = self.alignment
        return {
            "offset_s": late,
            "offset_std_s": std,
            "rate_error": found.rate_error,
            "rate_error_std": found.rate_error_std,
        }

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per channel: the share of its variance that the reference explains."""
        explained = self._explained()
        return {"channel": text_column(explained), "explained_share": np.array([*explained.values()])}

    def _explained(self) -> dict[str, float]:
        return dict(zip(self.recording.channels, self.alignment.explained.tolist(), strict=False))

    def _heading(self) -> str:
        return "Two clocks"

    def _facts(self) -> list[tuple[str, str]]:
        found = self.alignment
        facts = [
            ("time of the channels where the reference reads 0", f"{found.offset:.6g} ± {found.offset_std:.2g} s"),
            ("rate error of the clocks", f"{100 * found.rate_error:.4g} ± {100 * found.rate_error_std:.2g} %"),
            ("common time", f"{found.overlap_s:.5g} s"),
            ("log odds over the next offset", f"{self.odds_over_second:.0f} nats"),
            ("log odds over shuffled references", f"{self.odds_over_foreign:.0f} nats"),
        ]
        levers = self.levers_m.items()
        return facts + [
            (f"distance of chip {chip} from the axis, by ω² and by α", f"{1e3 * a:.4g} and {1e3 * b:.4g} mm")
            for chip, (a, b) in levers
        ]

    def _notes(self) -> tuple[str, ...]:
        return tuple(f"In doubt: {doubt}." for doubt in self.doubts)

    def _panels(self) -> list[Panel]:
        explained = self._explained()
        shares = Series("", 100.0 * np.array([*explained.values()]))
        return [Panel("explained by the reference", "share of variance, %", (shares,), tuple(explained), scale="zero")]

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as JSON holds them."""
        found = self.alignment
        return {
            "offset_s": found.offset,
            "offset_std_s": found.offset_std,
            "rate_error": found.rate_error,
            "rate_error_std": found.rate_error_std,
            "overlap_s": found.overlap_s,
            "explained": self._explained(),
            "second_offset_s": found.second_offset,
            "log_odds_over_second": self.odds_over_second,
            "log_odds_over_foreign": self.odds_over_foreign,
            "levers_m": {chip: {"by_rate": a, "by_acceleration": b} for chip, (a, b) in self.levers_m.items()},
            "doubts": list(self.doubts),
        }


def join_reference(
    recording: Recording,
    reference: ReferenceSeries,
    *,
    most_rate_error: float = 0.02,
    force: bool = False,
    seen: Recording | None = None,
) -> Joined:
    """Align a reference with channels of another clock and put both into one recording.

    Parameters
    ----------
    recording : Recording
        Channels, m/s².
    reference : ReferenceSeries
        Tachometer, angle, command or gyro with times of its own.
    most_rate_error : float
        Largest rate error between the clocks that is searched.
    force : bool
        Join nevertheless where the two don't seem to belong together.
    seen : Recording, optional
        Series that are aligned in place of the channels, such as combinations of them.

    Raises
    ------
    InputError
        If the reference does not change, the files are too short, or they don't belong together.
    """
    if not 0.0 <= most_rate_error <= _MOST_RATE_ERROR:
        raise InputError(f"largest rate error {most_rate_error}: give a ratio of 0 to {_MOST_RATE_ERROR:g}")
    signals, rate, width = grids(recording if seen is None else seen, reference)
    found = align(signals, most_rate_error=most_rate_error)
    if found is None:
        raise InputError(
            f"{reference.source}: the reference does not change; a time can't be found from a constant rate"
        )
    over_second = float("inf") if np.isnan(found.second_offset) else found.odds_over(found.second_explained)
    over_foreign = min(found.odds_over(one) for one in _foreign(signals, rate, width))
    levers, differ = _levers(recording, found) if rate.shape[1] == 1 and seen is None else ({}, [])
    doubts = []
    if over_foreign < _ODDS:
        doubts.append("a reversed or shuffled reference fits nearly as well")
    if over_second < _ODDS:
        doubts.append(f"an offset of {found.second_offset:.4g} s fits nearly as well as {found.offset:.4g} s")
    share = float(np.average(found.explained, weights=np.maximum(signals.readings.var(axis=0), 1e-18)))
    if found.predicted < share - _LOST:
        doubts.append(
            f"{100 * share:.0f}% of the readings' variance is explained, but only "
            f"{100 * max(found.predicted, 0.0):.0f}% of a quarter that the fit did not see"
        )
    doubts += differ
    theirs = found.offset + (1.0 + found.rate_error) * reference.t_s
    joined = _joined(recording, reference, found, theirs)
    start = float(recording.t_s[0])
    own, rows = (start + (one - start) / (1.0 + found.rate_error) for one in (theirs, recording.t_s))
    others = [_joined(one, reference, found, own) for one in (recording, replace(recording, t_s=rows))]
    if doubts and not force:
        raise InputError(
            f"{reference.source}: these recordings don't seem to belong together: {'; '.join(doubts)}; "
            "--force (force=True) joins them nevertheless"
        )
    return Joined(joined, found, over_second, over_foreign, tuple(doubts), levers, *others)


def grids(recording: Recording, reference: ReferenceSeries) -> tuple[Signals, NDArray[np.float64], int]:
    """Return channels and functions of the reference on uniform grids of one step; its rate; the smoothing window."""
    t_reference, rate = reference.rate()
    if len(recording) < 16:
        raise InputError("a recording of fewer than sixteen samples can't be aligned; record longer")
    longest = max(recording.duration, float(t_reference[-1] - t_reference[0]))
    period = float(np.median(np.diff(t_reference)))
    step = max(_FINEST, recording.sample_period, longest / _MOST_ROWS)
    coarse = max(step, period / 4.0)  # a slow reference has no finer detail
    step = min(max(step, 0.25 * coarse), coarse)
    width = round(max(3.0 * period, 0.05) / step) | 1  # three samples of the reference, or a twentieth of a second
    readings = _smooth(uniform(recording.t_s, recording.readings, step), width)
    rate = _on_grid(t_reference, rate, step) if period > step else uniform(t_reference, rate, step)
    functions = _smooth(functions_of(rate, step), width)
    return Signals(step, float(recording.t_s[0]), float(t_reference[0]), readings, functions), rate, width


def _on_grid(t: NDArray[np.float64], rate: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Return a rate that comes less often than every step on a uniform grid, by a cubic spline through its samples."""
    grid = t[0] + step * np.arange(int((t[-1] - t[0]) / step) + 1)
    return np.asarray(CubicSpline(t, rate)(grid))


def _smooth(values: NDArray[np.float64], width: int) -> NDArray[np.float64]:
    """Return series (n, k) smoothed by a Hann window of some samples, an odd number."""
    window = np.hanning(width + 2)[1:-1]
    window = np.asarray(window / window.sum())
    half = width // 2
    padded = np.pad(values, ((half, half), (0, 0)), mode="edge")
    return np.column_stack([np.convolve(one, window, mode="valid") for one in padded.T])


def _foreign(signals: Signals, rate: NDArray[np.float64], width: int) -> list[NDArray[np.float64]]:
    """Return what references explain that can't belong to the channels: reversed, and shuffled in pieces."""
    rng = np.random.default_rng(0)
    pieces = np.array_split(rate, max(len(rate) // max(int(2.0 / signals.step), 1), 4))
    others: list[NDArray[np.float64]] = [rate[::-1]]
    for _ in range(_FOREIGN):
        order = rng.permutation(len(pieces))
        others.append(np.asarray(np.concatenate([pieces[place][:: rng.choice([1, -1])] for place in order])))
    found = []
    for other in others:
        functions = _smooth(functions_of(_smooth(np.asarray(other), width), signals.step), width)
        one = align(replace(signals, functions=functions), most_rate_error=0.0, refine=False)
        found.append(np.zeros(signals.readings.shape[1]) if one is None else one.explained)
    return found


def _levers(recording: Recording, found: Alignment) -> tuple[dict[str, tuple[float, float]], list[str]]:
    """Return each tri-axial chip's distance from the axis by ω² and by α, and where the two disagree.

    The centripetal part points to the axis, the tangential one across it: they have one length and a right angle.
    """
    groups: dict[str, list[int]] = {}
    for place, name in enumerate(recording.channels):
        groups.setdefault(name[:-1], []).append(place)
    levers, differ = {}, []
    for chip, places in groups.items():
        if len(places) != 3:
            continue
        by_rate, by_acceleration = found.coefficients[:, places]  # (3,) each, m
        std = float(np.hypot(*np.linalg.norm(found.coefficient_std[:, places], axis=1)))
        lengths = float(np.linalg.norm(by_rate)), float(np.linalg.norm(by_acceleration))
        levers[chip] = lengths
        largest = max(lengths)
        allowed = _LEVERS * std + _LEVER_SHARE * largest
        along = abs(float(by_rate @ by_acceleration)) / max(largest, 1e-12)
        if abs(lengths[0] - lengths[1]) > allowed:
            differ.append(f"chip {chip} is {lengths[0]:.3g} m off the axis by ω² and {lengths[1]:.3g} m by α")
        elif along > allowed:
            differ.append(f"the parts by ω² and by α of chip {chip} are not at a right angle")
    return levers, differ


def _joined(
    recording: Recording, reference: ReferenceSeries, found: Alignment, theirs: NDArray[np.float64]
) -> Recording:
    """Return the recording with the reference, read at ``theirs`` (m,), s, in the nearest rows, and its times."""
    columns = dict(recording.reference)
    for name, values in reference.columns.items():
        columns[name], read = nearest_rows(recording.t_s, theirs, values)
        if name in TIME_COLUMNS:
            columns[TIME_COLUMNS[name]] = read
    facts = {
        "reference_offset_s": found.offset,
        "reference_offset_std_s": found.offset_std,
        "reference_rate_error": found.rate_error,
        "reference_rate_error_std": found.rate_error_std,
    }
    return replace(recording, reference=columns, metadata={**recording.metadata, **facts})
