"""One recording of channels and a reference that were logged on two clocks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.declared import Declared, Table, figure
from gfimu.base.errors import InputError
from gfimu.base.results import Panel, PlottedResult, Series, text_column
from gfimu.recording.importing.piece import at_times, chip_names, nearest_rows
from gfimu.recording.joining.alignment import Alignment
from gfimu.recording.joining.series import ReferenceSeries, align_series
from gfimu.recording.quantities import TIME_COLUMNS
from gfimu.recording.recording import Recording

__all__ = ["FAR", "Joined", "aligned", "join_reference"]

_LEVERS = 5.0  # standard deviations between the levers by ω² and by α
_LEVER_SHARE = 0.15  # of a lever: gains, axes and a tilt of the table make it differ by so much
_MOST_RATE_ERROR = 0.5  # ratio that can be searched at most
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
    reference_origin_s : float
        Time on the reference's clock at which its times are zero, s.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.join("accelerometers.csv", "tacho.csv").recording  # doctest: +SKIP
    """

    recording: Recording
    alignment: Annotated[Alignment, figure("Offset and rate error.", flat=True)]
    levers_m: Annotated[
        dict[str, Lever], figure("Distance of each chip from the axis, by two terms that have to agree.", "m")
    ]
    doubts: Annotated[tuple[str, ...], figure("Why the two files may not belong together.")]
    by_own_rate: Recording
    by_reference_clock: Recording
    reference_origin_s: float = 0.0

    @property
    def explained(
        self,
    ) -> Annotated[
        dict[str, float],
        figure("Share of each channel's variance that the reference explains.", before="levers_m"),
    ]:
        """Share of each channel's variance that the reference explains."""
        return dict(zip(self.recording.channels, self.alignment.explained.tolist(), strict=False))

    @property
    def clock_shift_s(
        self,
    ) -> Annotated[
        float,
        figure(
            "What the reference's clock reads less what the channels' reads, in the middle, as the files state it.",
            "s",
            before="levers_m",
            form=".7g",
            head="reference's clock less the channels', in the middle",
        ),
    ]:
        """What the reference's clock reads less what the channels' reads, in the middle of the common time, s."""
        origin = self.recording.metadata.get("time_origin_s", 0.0)
        return self.reference_origin_s - float(origin) - float(self.alignment.apart(self.alignment.middle_s))

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

    def carrying(self, array: AccelerometerArray) -> Joined:
        """Return the recordings of two loggers with the array of both, whose channels are in their order."""
        recordings = [self.recording, self.by_own_rate, self.by_reference_clock]
        if len(self.recording.channels) != array.n_channels:
            raise InputError(
                f"the two loggers have {len(self.recording.channels)} channels, array {array.name!r} has "
                f"{array.n_channels}; give the array that holds the chips of both"
            )
        names = self.recording.channels if set(self.recording.channels) == set(array.channels) else array.channels
        carried = [replace(one, channels=names).carrying(array) for one in recordings]
        return replace(self, recording=carried[0], by_own_rate=carried[1], by_reference_clock=carried[2])

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
    """Align a reference, or another logger on the same body, with channels, and put both into one recording.

    Parameters
    ----------
    recording : Recording
        Channels, m/s².
    reference : ReferenceSeries
        Tachometer, angle, command, gyro or another logger's channels with times of its own.
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
    found = aligned(recording if seen is None else seen, reference, most_rate_error=most_rate_error)
    if found is None:
        raise InputError(
            f"{reference.source}: the reference does not change; a time can't be found from a constant rate"
        )
    is_table = not reference.channels and reference.gyro is None
    levers, differ = _levers(recording, found) if is_table and seen is None else ({}, [])
    doubts = [*found.doubts, *differ]
    theirs = found.offset + (1.0 + found.rate_error) * reference.t_s
    joined = _joined(recording, reference, found, theirs)
    start = float(recording.t_s[0])
    own, rows = (start + (one - start) / (1.0 + found.rate_error) for one in (theirs, recording.t_s))
    by_own, by_reference = (_joined(one, reference, found, own) for one in (recording, replace(recording, t_s=rows)))
    unsure = _undetermined(found, most_rate_error)
    if (doubts or unsure) and not force:
        reason = f"these recordings don't seem to belong together: {'; '.join(doubts)}" if doubts else unsure
        raise InputError(f"{reference.source}: {reason}; --force (force=True) joins them all the same")
    doubts += [unsure] if unsure else []
    return Joined(joined, found, levers, tuple(doubts), by_own, by_reference, reference.origin_s)


def aligned(recording: Recording, reference: ReferenceSeries, *, most_rate_error: float = 0.02) -> Alignment | None:
    """Return offset and rate error between the channels' clock and the reference's; None if it does not change.

    Raises
    ------
    InputError
        If the files are too short, or ``most_rate_error`` is out of its range.
    """
    if not 0.0 <= most_rate_error <= _MOST_RATE_ERROR:
        raise InputError(f"largest rate error {most_rate_error}: give a ratio of 0 to {_MOST_RATE_ERROR:g}")
    if len(recording) < 16:
        raise InputError("a recording of fewer than sixteen samples can't be aligned; record longer")
    channels = dict(zip(recording.channels, recording.readings.T, strict=True))
    own = ReferenceSeries("the channels", recording.t_s, recording.reference, channels=channels)
    return align_series(own, reference, most_rate_error=most_rate_error)


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


def _levers(recording: Recording, found: Alignment) -> tuple[dict[str, Lever], list[str]]:
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
        by_rate, by_acceleration = found.coefficients[1:3, places]  # (3,) each, m
        std = float(np.hypot(*np.linalg.norm(found.coefficient_std[1:3, places], axis=1)))
        lengths = float(np.linalg.norm(by_rate)), float(np.linalg.norm(by_acceleration))
        levers[chip] = Lever(*lengths)
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
    columns, channels = dict(recording.reference), dict(zip(recording.channels, recording.readings.T, strict=True))
    for name, values in reference.columns.items():
        if reference.channels and name in columns:
            continue  # the first logger has its own
        columns[name], read = nearest_rows(recording.t_s, theirs, values)
        if name in TIME_COLUMNS:
            columns[TIME_COLUMNS[name]] = read
    for name, values in zip(
        chip_names(recording.channels, [*reference.channels]), reference.channels.values(), strict=True
    ):
        channels[name] = at_times(recording.t_s, theirs, values)
    facts = {
        "reference_offset_s": found.offset,
        "reference_offset_std_s": found.offset_std,
        "reference_rate_error": found.rate_error,
        "reference_rate_error_std": found.rate_error_std,
    }
    metadata = {**recording.metadata, **facts}
    joined = replace(
        recording,
        readings=np.column_stack([*channels.values()]),
        channels=tuple(channels),
        reference=columns,
        metadata=metadata,
    )
    return joined.between(theirs[0], theirs[-1]) if reference.channels else joined
