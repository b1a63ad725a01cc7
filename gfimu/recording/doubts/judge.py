"""The judgement of a recording: times, readings, units, order and sign of the channels, array and references.

The array's redundant directions and gravity at rest show whether the channels fit one rigid body
(`gfimu.recording.evidence.rigid`). A recording is refused only where errors within the data sheets' limits can't be the
reason and one other way to read the file explains nearly all of it; where that other way explains nearly all of a
smaller contradiction, there is a warning; otherwise nothing is said.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.observability import unseen_motions
from gfimu.array.parts.limits import PartLimits
from gfimu.base.errors import InputError, warn
from gfimu.recording.carried_array import warn_of_other_array
from gfimu.recording.doubts.doubt import Doubt
from gfimu.recording.doubts.samples import chips_of, rate_doubts, sample_doubts, typical_noise
from gfimu.recording.doubts.stamps import stamp_doubts
from gfimu.recording.evidence.explanation import explanations
from gfimu.recording.evidence.gathering import gather
from gfimu.recording.evidence.gravity import gravity_text
from gfimu.recording.evidence.reference_rate import odd_rates
from gfimu.recording.evidence.rigid import Evidence, Otherwise
from gfimu.recording.evidence.ways import TIME_UNITS, time_text
from gfimu.recording.policy import SamplePolicy
from gfimu.recording.quantities import GYRO_COLUMNS
from gfimu.recording.recording import Recording

__all__ = ["dead_channels", "doubts_of", "examine", "refuse_or_warn", "without_doubtful"]

_FEWEST = 50  # samples
_RATES = ("tacho_rad_s", *GYRO_COLUMNS)
_ALIKE = 1.5  # ratio of the costs of two ways that can't be separated
_AS_GOOD = 0.05  # of the contradiction is left: as good as nothing, whatever another way leaves
_RATE_RATIO = 1.5  # between the rate by the times and the metadata's, for a refusal
_FOLLOWS = 0.5  # correlation of the turning with the tachometer, by which the sign of the turning is sure; by choice
_SLOWEST = 2.0  # Hz, a rate that is plausible for a moving body


def refuse_or_warn(findings: Iterable[Doubt], *, force: bool = False) -> tuple[Doubt, ...]:
    """Raise for the first finding that refuses the recording, unless forced; returns all of them.

    Raises
    ------
    InputError
        With the cause and the remedy.
    """
    found = tuple(findings)
    for finding in found:
        if finding.refused and not force:
            raise InputError(f"{finding.text}; --force (force=True) goes on nevertheless")
    return found


def examine(
    recording: Recording,
    array: AccelerometerArray | None = None,
    *,
    source: str | Path = "",
    force: bool = False,
    apart_from: Collection[str] = (),
    whose: str = "the given",
) -> tuple[Doubt, ...]:
    """Refuse or warn of a recording that its array contradicts: the gate of every command that reads one.

    Parameters
    ----------
    recording : Recording
        Readings in m/s² or raw counts.
    array : AccelerometerArray, optional
        The array that it is taken to be of; its own by default. Without one only times and readings are judged.
    source : str or Path
        Its name, for messages.
    force : bool
        Warn where the recording would be refused.
    apart_from : collection of str
        Kinds of findings (`Doubt.kind`) that are left out: those that the caller explains itself.
    whose : str
        Whose array ``array`` is, for the warning that the recording carries another one; empty for no such warning.

    Returns
    -------
    tuple of Doubt
        What was found, as `doubts_of`; each that is not minor is a `gfimu.base.errors.RecordingWarning` too.

    Raises
    ------
    InputError
        With cause and remedy, if the recording should not be used as it is; or if it lacks channels of ``array``.
    """
    if array is None:
        array = _own_array(recording)
    elif whose:
        warn_of_other_array(recording.metadata, array, str(source) or "the recording", whose=whose)
    name = f"{source}: " if str(source) else ""
    judged = recording if array is None else _in_si(recording, array)
    found = [replace(one, text=f"{name}{one.text}") for one in doubts_of(judged, array) if one.kind not in apart_from]
    refuse_or_warn(found, force=force)
    for one in found:
        if not one.is_minor:
            warn(one.text)
    return tuple(found)


def _own_array(recording: Recording) -> AccelerometerArray | None:
    """Return the array of a recording that has all its channels; None without one."""
    try:
        array = recording.array
    except InputError:
        return None
    return None if array is None or not set(array.channels) <= set(recording.channels) else array


def _in_si(recording: Recording, array: AccelerometerArray) -> Recording:
    """Return readings in m/s², by the size of a count that the recording states or the parts have."""
    if recording.unit == "m_s2":
        return recording
    size = recording.metadata.get("lsb_m_s2")
    readings = recording.readings[:, [recording.channels.index(name) for name in array.channels]]
    if not isinstance(size, int | float):
        limits = _limits(recording, array)
        size = np.ones(array.n_channels) if limits is None else limits.lsb
    return replace(recording, readings=readings * size, channels=array.channels, unit="m_s2")


def doubts_of(recording: Recording, array: AccelerometerArray | None = None) -> tuple[Doubt, ...]:
    """Judge a recording: its times, its readings, and, with an array, what contradicts the array.

    Parameters
    ----------
    recording : Recording
        Readings in m/s²; without an array raw counts as well.
    array : AccelerometerArray, optional
        The array that it is taken to be of.

    Returns
    -------
    tuple of Doubt
        Refusals first, minor ones last. Nothing is refused and no warning given of a recording that a correct array
        within its data sheets' limits may have made.

    Raises
    ------
    InputError
        If the recording lacks channels of the array, or holds raw counts.
    """
    limits = None if array is None else _limits(recording, array)
    samples = _of_samples(recording, array, limits)
    found = [*samples, *_of_rates(recording), *stamp_doubts(recording.t_s)]
    if array is not None and limits is not None and len(recording) >= _FEWEST:
        dead = dead_channels(samples)
        alive = np.array([name not in dead for name in array.channels])
        found += _against_array(without_doubtful(recording, array, samples), array, limits, alive)
    return tuple(sorted(found, key=lambda one: (not one.refused, one.is_minor, one.kind == "dead")))


def dead_channels(doubts: Iterable[Doubt]) -> list[str]:
    """Return the channels that are dead."""
    return [name for one in doubts if one.kind == "dead" for name in one.channels]


def without_doubtful(recording: Recording, array: AccelerometerArray | None, doubts: Iterable[Doubt]) -> Recording:
    """Return the recording with wrong samples (`Doubt.is_no_reading`) marked as missing, in SI or counts.

    Parameters
    ----------
    recording : Recording
        Readings of c channels.
    array : AccelerometerArray, optional
        In whose order the channels are to be; by default in their own.
    doubts : iterable of Doubt
        What was found.
    """
    names = recording.channels if array is None else array.channels
    missing = [one for one in doubts if one.is_no_reading]
    if not missing:
        return recording
    readings = (recording.readings if array is None else recording.for_array(array)).copy()
    reference = dict(recording.reference)
    for one in missing:
        rows = one.rows if len(one.rows) else slice(None)
        for name in one.channels:
            if name in reference:
                reference[name] = reference[name].copy()
                reference[name][rows] = np.nan
            elif name in names:
                readings[rows, names.index(name)] = np.nan
    return replace(recording, readings=readings, channels=tuple(names), reference=reference)


def _of_samples(recording: Recording, array: AccelerometerArray | None, limits: PartLimits | None) -> list[Doubt]:
    """Judge the readings, by channel and by chip."""
    names = recording.channels if array is None else array.channels
    readings = recording.readings if array is None else recording.for_array(array)
    floor: Mapping[str, float] = dict.fromkeys(names, SamplePolicy().quietest if recording.unit == "m_s2" else 0.0)
    if limits is not None:
        floor = dict(zip(names, (SamplePolicy().least_noise * limits.noise).tolist(), strict=True))
    unit = "m/s²" if recording.unit == "m_s2" else ""
    columns = dict(zip(names, readings.T, strict=True))
    return sample_doubts(columns, chips_of(names), unit=unit, least_noise=floor)


def _of_rates(recording: Recording) -> list[Doubt]:
    """Judge the rates of a tachometer and a gyro; a table that keeps its largest speed is at no rail."""
    found = [
        one for name in _RATES if name in recording.reference for one in rate_doubts(name, recording.reference[name])
    ]
    return [one for one in found if one.kind != "clipped" or one.channels[0] in GYRO_COLUMNS]


def _against_array(
    recording: Recording, array: AccelerometerArray, limits: PartLimits, alive: NDArray[np.bool_]
) -> list[Doubt]:
    """Look for a wrong unit, time, order or sign of columns, a wrong array, and a reference of another body."""
    readings = recording.for_array(array)
    found = [*_time_against_metadata(recording), *_duplicates(readings, limits, array)]
    if not found and np.count_nonzero(alive) > 3:
        evidence = gather(recording, array, limits, alive)
        found += _decide(evidence)
        if not found and evidence.up is not None:  # the table may be inclined: its axis is no vertical then
            found += _decide(replace(evidence, up=None))
        if not found:
            found += _slow(recording, readings, limits)
        if not found and not len(evidence.rests):  # gravity can't be read off a rest; the quietest seconds hold it too
            text, _ = gravity_text(recording, array, limits)
            found += [Doubt("unit", f"{text} (likely, not certain)", False)] if text else []
    if not found and unseen_motions(array):  # too few channels to contradict one another
        text, refused = gravity_text(recording, array, limits)
        found += [Doubt("unit", text, refused)] if text else []
    if not found:
        found += [Doubt("reference", one.text, one.certain) for one in odd_rates(recording, array, limits, alive)]
    return found


def _limits(recording: Recording, array: AccelerometerArray) -> PartLimits | None:
    """Return the limits by the data sheets; None where they are not known."""
    if len(recording) < 2:
        return None
    try:
        return PartLimits.of(array, min(max(recording.sample_rate, 1.0), 1e5))
    except InputError:
        return None


def _time_against_metadata(recording: Recording) -> list[Doubt]:
    """Compare the rate by the sample times with the one that the metadata state."""
    stated = recording.metadata.get("sample_rate_hz")
    if not isinstance(stated, int | float) or isinstance(stated, bool) or not 0.0 < stated < np.inf:
        return []
    ratio = float(stated) / recording.sample_rate
    if 1.0 / _RATE_RATIO < ratio < _RATE_RATIO:
        return []
    for factor, name in TIME_UNITS.items():
        if abs(ratio * factor - 1.0) < _RATE_RATIO - 1.0:
            text = time_text(
                name, factor, f"the metadata state {stated:g} Hz, the column gives {recording.sample_rate:.4g} Hz"
            )
            return [Doubt("time", text, True)]
    text = (
        f"column t_s gives {recording.sample_rate:.4g} Hz and the metadata state {stated:g} Hz; "
        "correct t_s, or sample_rate_hz in the metadata"
    )
    return [Doubt("time", text, False)]


def _slow(recording: Recording, readings: NDArray[np.float64], limits: PartLimits) -> list[Doubt]:
    """Warn of a rate that is implausible for a body that moves."""
    rate = recording.sample_rate
    seen = np.isfinite(readings).any(axis=0)
    moves = np.nanstd(readings[:, seen], axis=0) > 5.0 * limits.noise[seen]
    if rate < _SLOWEST and moves.any():
        text = (
            f"column t_s gives {rate:.4g} samples per second while the body moves: if it is in milliseconds or "
            "microseconds, convert it to seconds"
        )
        return [Doubt("time", text, False)]
    if rate > 1.5 * limits.output_rate[1]:
        text = (
            f"column t_s gives {rate:.4g} samples per second and the part's fastest rate is "
            f"{limits.output_rate[1]:g} Hz; check its unit"
        )
        return [Doubt("time", text, False)]
    return []


def _duplicates(readings: NDArray[np.float64], limits: PartLimits, array: AccelerometerArray) -> list[Doubt]:
    """Find columns that hold the same values throughout though each should have noise of its own."""
    noise = np.array([typical_noise(column) for column in readings.T])
    found = []
    for one, two in combinations(range(array.n_channels), 2):
        if min(noise[one] / limits.noise[one], noise[two] / limits.noise[two]) < SamplePolicy().least_noise:
            continue
        if np.array_equal(readings[:, one], readings[:, two], equal_nan=True):
            names = array.channels[one], array.channels[two]
            text = (
                f"channels {names[0]} and {names[1]} hold the same values in all {len(readings)} samples: one column "
                "was written twice; export the recording again, or leave the wrong one empty"
            )
            found.append(Doubt("duplicate", text, True, names))
    return found


def _decide(evidence: Evidence) -> list[Doubt]:
    """Compare the file as given with the other ways to read it."""
    found = explanations(evidence)
    if not found:
        return []
    best = found[0]
    # A mirrored way fits as well where two chips are each other's mirror image; the sign of the tachometer decides.
    turned = {id(one): evidence.follows_tacho(one.way) for one in found if one.left < max(_AS_GOOD, _ALIKE * best.left)}
    if max(turned.values()) > _FOLLOWS:
        found = [one for one in found if turned.get(id(one), -1.0) > -_FOLLOWS]
        best = found[0]
    # A whole chip is in another unit more often than one of its axes; one axis alone shows in the noise of the others.
    wider = [one for one in found if one.way.kind == best.way.kind and one.left < max(_AS_GOOD, _ALIKE * best.left)]
    best = max(wider, key=lambda one: len(one.way.channels))
    alike = [one.way for one in found if one is not best and one.left < _ALIKE * best.left]
    return [_finding(best.way, alike, refused=best.refused)]


def _finding(way: Otherwise, alike: Sequence[Otherwise], *, refused: bool) -> Doubt:
    text = way.text if refused else f"{way.text} (likely, not certain)"
    others = [one for one in alike if one.kind == way.kind and one.about != way.about][:3]
    if others and way.channels:
        text += "; as likely: " + ", or ".join(one.about for one in others)
    return Doubt(way.kind, text, refused, way.channels)
