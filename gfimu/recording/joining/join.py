"""One recording of channels and a reference that were logged on two clocks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from gfimu.base.declared import Declared, Table, figure
from gfimu.base.errors import InputError
from gfimu.base.results import Panel, PlottedResult, Series, text_column
from gfimu.recording.doubts.rails import rails_of
from gfimu.recording.importing.piece import nearest_rows
from gfimu.recording.joining.alignment import align
from gfimu.recording.joining.reference_file import ReferenceSeries
from gfimu.recording.joining.signals import Alignment, Signals, functions_of, smooth, uniform
from gfimu.recording.quantities import TIME_COLUMNS
from gfimu.recording.recording import Recording

__all__ = ["FAR", "Joined", "grids", "join_reference"]

_MOST_ROWS = 20_000  # of the grid on which offsets are searched
_FINEST = 0.005  # s, step of that grid
_ODDS = 30.0  # nats, by which the best offset has to beat the next, and a foreign reference
_LEVERS = 5.0  # standard deviations between the levers by ω² and by α
_LEVER_SHARE = 0.15  # of a lever: gains, axes and a tilt of the table make it differ by so much
_LOST = 0.2  # of the variance, on a quarter that the fit did not see
_FOREIGN = 6  # references of shuffled pieces
_MOST_RATE_ERROR = 0.5  # ratio that can be searched at most
_SHORTEST_WINDOW, _LONGEST_WINDOW = 0.05, 1.0  # s, of the smoothing; at least three samples of the reference
_NOISY = 0.05  # of the variance of α, that is noise
_LARGEST_STDS = 3.0  # standard deviations of the time between the clocks that have to be below FAR
_RATE_STDS = 5.0  # standard deviations from which a rate error is no chance: the stated ones may be low by a factor


FAR = 0.3
"""Offset beyond which a reference is moved before a diagnosis, s: `tacho_latency` is searched up to there."""


@dataclass(frozen=True)
class Lever(Declared):
    """Distance of a chip from the axis."""

    by_rate: Annotated[float, figure("Distance by ω².", "m")]
    by_acceleration: Annotated[float, figure("Distance by α.", "m")]


@dataclass(frozen=True)
class Joined(Declared, PlottedResult):
    """Channels and a reference of two clocks in one recording: t = offset + (1 + rate error) · t_reference.

    Parameters
    ----------
    recording : Recording
        The channels at their own times, with each value of the reference in the row nearest in time and, in a column of
        its own (``tacho_t_s``), the time at which it was read; NaN in between.
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
    alignment: Annotated[Alignment, figure("Offset and rate error.", flat=True)]
    odds_over_second: Annotated[
        float,
        figure(
            "Log odds over the next-best offset.",
            "nats",
            key="log_odds_over_second",
            form=".0f",
            head="log odds over the next-best offset",
        ),
    ]
    odds_over_foreign: Annotated[
        float,
        figure(
            "Log odds over shuffled references.",
            "nats",
            key="log_odds_over_foreign",
            form=".0f",
            head="log odds over shuffled references",
        ),
    ]
    levers_m: Annotated[
        dict[str, Lever], figure("Distance of each chip from the axis, by two terms that have to agree.", "m")
    ]
    doubts: Annotated[tuple[str, ...], figure("Why the two files may not belong together.")]
    by_own_rate: Recording
    by_reference_clock: Recording

    @property
    def explained(
        self,
    ) -> Annotated[
        dict[str, float],
        figure("Share of each channel's variance that the reference explains.", before="odds_over_second"),
    ]:
        """Share of each channel's variance that the reference explains."""
        return dict(zip(self.recording.channels, self.alignment.explained.tolist(), strict=False))

    @property
    def second_offset_s(
        self,
    ) -> Annotated[
        float,
        figure(
            "Next-best offset apart from this one; null without any.",
            "s",
            before="odds_over_second",
            form=".5g",
            head="next-best offset",
        ),
    ]:
        """Next-best offset apart from this one, s; NaN without any."""
        return self.alignment.second_offset

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
        return {"channel": text_column(self.explained), "explained_share": np.array([*self.explained.values()])}

    def shown(self) -> Iterator[Table | str]:
        """Yield the table and the doubts that people read."""
        yield Table("Two clocks", ("quantity", "value"), self._facts())
        yield from self._notes()

    def _heading(self) -> str:
        return "Two clocks"

    def _facts(self) -> list[tuple[str, str]]:
        most = f"{100 * float(self.alignment.explained.max()):.3g} %"
        levers = [
            (
                f"distance of chip {chip} from the axis, by ω² and by α",
                f"{1e3 * one.by_rate:.4g} and {1e3 * one.by_acceleration:.4g} mm",
            )
            for chip, one in self.levers_m.items()
        ]
        explained = ("variance of a channel explained, most", most)
        return [*self.alignment.facts(), explained, *self.facts(), *levers]

    def _notes(self) -> tuple[str, ...]:
        return tuple(f"In doubt: {doubt}." for doubt in self.doubts)

    def _panels(self) -> list[Panel]:
        shares = Series("", 100.0 * np.array([*self.explained.values()]))
        return [
            Panel("explained by the reference", "share of variance, %", (shares,), tuple(self.explained), scale="zero")
        ]


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
        Join the two even if they don't seem to belong together.
    seen : Recording, optional
        Series that are aligned in place of the channels, such as combinations of them.

    Raises
    ------
    InputError
        If the reference does not change, the files are too short, or they don't belong together.
    """
    if not 0.0 <= most_rate_error <= _MOST_RATE_ERROR:
        raise InputError(f"largest rate error {most_rate_error}: give a ratio of 0 to {_MOST_RATE_ERROR:g}")
    signals = grids(recording if seen is None else seen, reference)
    found = align(signals, most_rate_error=most_rate_error)
    if found is None:
        raise InputError(
            f"{reference.source}: the reference does not change; a time can't be found from a constant rate"
        )
    over_second = float("inf") if np.isnan(found.second_offset) else found.odds_over(found.second_explained)
    over_foreign = min(found.odds_over(one) for one in _foreign(signals))
    levers, differ = (
        _levers(recording, found, signals.noisy) if signals.angle is not None and seen is None else ({}, [])
    )
    doubts = []
    if over_foreign < _ODDS:
        doubts.append("a reversed or shuffled reference fits nearly as well")
    if over_second < _ODDS:
        doubts.append(f"an offset of {found.second_offset:.4g} s fits nearly as well as {found.offset:.4g} s")
    if found.odds_of_motion < _ODDS:
        doubts.append("the reference changes too little: its square and acceleration hardly show in the channels")
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
    unsure = _undetermined(found, most_rate_error)
    if (doubts or unsure) and not force:
        reason = f"these recordings don't seem to belong together: {'; '.join(doubts)}" if doubts else unsure
        raise InputError(f"{reference.source}: {reason}; --force (force=True) joins them all the same")
    doubts += [unsure] if unsure else []
    return Joined(joined, found, over_second, over_foreign, levers, tuple(doubts), *others)


def _undetermined(found: Alignment, most_rate_error: float) -> str:
    """Return why an estimate is of no use, and a remedy; empty if it is."""
    if found.at_bound:
        return (
            f"the rate error of the clocks reaches the bound of its search, ±{100 * most_rate_error:g} %; "
            "search further (--most-rate-error), or record a motion whose rate changes more often"
        )
    if not _LARGEST_STDS * found.largest_std < FAR:
        return (
            f"the clocks are known to {found.largest_std:.2g} s (1 std) only at the ends of the common time; record a "
            "motion whose rate changes more often, or give a smaller --most-rate-error if both clocks are good"
        )
    return ""


def grids(recording: Recording, reference: ReferenceSeries) -> Signals:
    """Return channels without clipped samples and functions of the reference on uniform grids of one step."""
    t_reference, rate = reference.rate()
    if len(recording) < 16:
        raise InputError("a recording of fewer than sixteen samples can't be aligned; record longer")
    longest = max(recording.duration, float(t_reference[-1] - t_reference[0]))
    period = float(np.median(np.diff(t_reference)))
    step = max(_FINEST, recording.sample_period, longest / _MOST_ROWS)
    coarse = max(step, period / 4.0)  # a slow reference has no finer detail
    step = min(max(step, 0.25 * coarse), coarse)
    angle, walk = reference.angle()
    on_grid = t_reference[0] + step * np.arange(int((t_reference[-1] - t_reference[0]) / step) + 1)
    rate = CubicSpline(t_reference, rate)(on_grid) if period > step else uniform(t_reference, rate, step)[0]
    functions, width, noisy = _smooth_functions(rate, step, period, reference.rate_noise())
    readings = recording.readings.copy()
    for column in readings.T:
        for rail in rails_of(column):
            column[rail.on] = np.nan
    readings, known = uniform(recording.t_s, readings, step)
    spoilt = np.column_stack([np.convolve(one, np.ones(width), "same") > 0.5 for one in (~known).T.astype(float)])
    return Signals(
        step,
        float(recording.t_s[0]),
        float(t_reference[0]),
        smooth(readings, width),
        ~spoilt,
        functions,
        rate,
        None if angle is None else angle(on_grid),
        walk,
        width,
        noisy,
    )


def _smooth_functions(
    rate: NDArray[np.float64], step: float, period: float, noise: float
) -> tuple[NDArray[np.float64], int, float]:
    """Return the functions of a reference, smoothed, the window, so long that α is not noise, and the noise that is.

    The noise is the share of the variance of α by which its coefficients are too small; others would make up for it.
    Of a rate with white noise σ every P seconds, a Hann window of W seconds leaves a variance 2π² σ² P / W³ in α.
    """
    functions = functions_of(rate, step)
    fastest = float(np.quantile(np.linalg.norm(rate, axis=1), 0.95))
    longest = min(2.0 * np.pi / max(fastest, 1e-9), _LONGEST_WINDOW)  # a turn, of which half a wave is left
    window = max(3.0 * period, _SHORTEST_WINDOW)
    while True:
        width = round(window / step) | 1
        smoothed = smooth(functions, width)
        alpha = float(np.mean(np.var(smoothed[:, 1:] if rate.shape[1] == 1 else smoothed[:, 6:], axis=0)))
        noisy = 2.0 * np.pi**2 * noise**2 * period / window**3 / max(alpha, 1e-12)
        if noisy < _NOISY or 1.25 * window > longest:
            return smoothed, width, min(noisy, 1.0)
        window *= 1.25


def _foreign(signals: Signals) -> list[NDArray[np.float64]]:
    """Return what references explain that can't belong to the channels: reversed, and shuffled in pieces."""
    rng, rate = np.random.default_rng(0), signals.rate
    pieces = np.array_split(rate, max(len(rate) // max(int(2.0 / signals.step), 1), 4))
    others: list[NDArray[np.float64]] = [rate[::-1]]
    for _ in range(_FOREIGN):
        order = rng.permutation(len(pieces))
        others.append(np.asarray(np.concatenate([pieces[place][:: rng.choice([1, -1])] for place in order])))
    found = []
    for other in others:
        smoothed = smooth(np.asarray(other), signals.width)
        functions = smooth(functions_of(smoothed, signals.step), signals.width)
        angle = None if signals.angle is None else np.cumsum(other[:, 0]) * signals.step
        foreign = replace(signals, functions=functions, rate=other, angle=angle)
        one = align(foreign, most_rate_error=0.0, refine=False)
        found.append(np.zeros(signals.readings.shape[1]) if one is None else one.explained)
    return found


def _levers(recording: Recording, found: Alignment, noisy: float) -> tuple[dict[str, Lever], list[str]]:
    """Return each tri-axial chip's distance from the axis by ω² and by α, and where the two disagree.

    The centripetal part points to the axis, the tangential one across it: they have one length and a right angle.
    """
    groups: dict[str, list[int]] = {}
    for index, name in enumerate(recording.channels):
        groups.setdefault(name[:-1], []).append(index)
    levers, differ = {}, []
    for chip, places in groups.items():
        if len(places) != 3:
            continue
        by_rate, by_acceleration = found.coefficients[:, places]  # (3,) each, m
        std = float(np.hypot(*np.linalg.norm(found.coefficient_std[:, places], axis=1)))
        lengths = float(np.linalg.norm(by_rate)), float(np.linalg.norm(by_acceleration))
        levers[chip] = Lever(*lengths)
        largest = max(lengths)
        allowed = _LEVERS * std + (_LEVER_SHARE + noisy) * largest
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
