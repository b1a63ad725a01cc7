"""Checks of a recording against its array alone: units, time, order and sign of the channels, dead channels.

The array's redundant directions and gravity at rest show whether the channels fit one rigid body
(`gfimu.recording.evidence.rigid`). A recording is refused only where errors within the data sheets' limits can't be the
reason and one other way to read the file explains nearly all of it; where that other way explains nearly all of a
smaller contradiction, there is a warning; otherwise nothing is said.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.observability import unseen_motions
from gfimu.array.parts.limits import PartLimits
from gfimu.base.errors import InputError, warn
from gfimu.recording.carried_array import warn_of_other_array
from gfimu.recording.evidence.explanation import explanations
from gfimu.recording.evidence.gathering import gather
from gfimu.recording.evidence.gravity import gravity_text
from gfimu.recording.evidence.reference_rate import odd_rates
from gfimu.recording.evidence.rigid import Evidence, Otherwise
from gfimu.recording.evidence.ways import TIME_UNITS, time_text
from gfimu.recording.recording import Recording

__all__ = ["Finding", "check_recording", "examine", "noisy_channels", "refuse_or_warn", "without_dead_channels"]

_FEWEST = 50  # samples
_LEAST_NOISE = 0.3  # of the data sheet's: from that on a channel surely has noise of its own
_ALIKE = 1.5  # ratio of the costs of two ways that can't be separated
_AS_GOOD = 0.05  # of the contradiction is left: as good as nothing, whatever another way leaves
_RATE_RATIO = 1.5  # between the rate by the times and the metadata's, for a refusal
_FOLLOWS = 0.5  # correlation of the turning with the tachometer, by which the sign of the turning is sure; by choice
_SLOWEST = 2.0  # Hz, a rate that is plausible for a moving body


@dataclass(frozen=True)
class Finding:
    """Something wrong with a recording.

    Parameters
    ----------
    kind : str
        ``time``, ``unit``, ``chip_unit``, ``sign``, ``exchange``, ``duplicate``, ``array``, ``reference``,
        ``rest_bias``, ``dead`` or ``clipped``.
    text : str
        Cause and remedy, one line.
    refused : bool
        Whether the recording should not be used as it is; otherwise this is a warning.
    channels : tuple of str
        Channels that it is about.
    """

    kind: str
    text: str
    refused: bool
    channels: tuple[str, ...] = ()


def refuse_or_warn(findings: Iterable[Finding], *, force: bool = False) -> tuple[Finding, ...]:
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
) -> tuple[Finding, ...]:
    """Refuse or warn of a recording that its array contradicts: the gate of every command that reads one.

    Parameters
    ----------
    recording : Recording
        Readings in m/s² or raw counts.
    array : AccelerometerArray, optional
        The array that it is taken to be of; its own by default. Nothing is looked for where it has none.
    source : str or Path
        Its name, for messages.
    force : bool
        Warn where the recording would be refused.
    apart_from : collection of str
        Kinds of findings (`Finding.kind`) that are left out: those that the caller explains itself.
    whose : str
        Whose array ``array`` is, for the warning that the recording carries another one; empty for no such warning.

    Returns
    -------
    tuple of Finding
        What was found, as `check_recording`; each is a `gfimu.base.errors.RecordingWarning` too.

    Raises
    ------
    InputError
        With cause and remedy, if the recording should not be used as it is; or if it lacks channels of ``array``.
    """
    if array is None:
        try:
            array = recording.array
        except InputError:
            return ()
        if array is None or not set(array.channels) <= set(recording.channels):
            return ()
    elif whose:
        warn_of_other_array(recording.metadata, array, str(source) or "the recording", whose=whose)
    name = f"{source}: " if str(source) else ""
    found = [
        replace(one, text=f"{name}{one.text}")
        for one in check_recording(_in_si(recording, array), array)
        if one.kind not in apart_from
    ]
    refuse_or_warn(found, force=force)
    for one in found:
        warn(one.text)
    return tuple(found)


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


def dead_channels(recording: Recording, array: AccelerometerArray) -> tuple[Finding, ...]:
    """Return the channels without any reading, or with one value throughout while the others have noise."""
    readings = recording.for_array(array)
    found = []
    present = np.isfinite(readings)
    constant = _constant(readings)
    noisy = noisy_channels(recording, array)
    others = int(np.count_nonzero(noisy)) >= max(1, int(np.count_nonzero(~constant & present.any(axis=0))) // 2)
    for name, seen, held, column in zip(array.channels, present.T, constant, readings.T, strict=True):
        if not seen.any():
            text = f"channel {name} has no readings: check its wiring"
            found.append(Finding("dead", text, False, (name,)))
        elif held and others and len(column) >= _FEWEST:
            value = column[seen][0]
            text = f"channel {name} reads {value:.4g} m/s² throughout: check its chip"
            found.append(Finding("dead", text, False, (name,)))
    return tuple(found)


def noisy_channels(recording: Recording, array: AccelerometerArray) -> NDArray[np.bool_]:
    """Return which channels surely have noise of their own, (c,); none where their data sheets are not known."""
    limits = _limits(recording, array)
    if limits is None:
        return np.zeros(array.n_channels, dtype=bool)
    return np.asarray(_noise(recording.for_array(array)) > _LEAST_NOISE * limits.noise)


def without_dead_channels(recording: Recording, array: AccelerometerArray, findings: Iterable[Finding]) -> Recording:
    """Return the recording with the readings of dead channels marked as missing."""
    dead = [name for finding in findings if finding.kind == "dead" for name in finding.channels]
    if not dead:
        return recording
    readings = recording.for_array(array).copy()
    readings[:, [array.index(name) for name in dead]] = np.nan
    return replace(recording, readings=readings, channels=array.channels)


def check_recording(recording: Recording, array: AccelerometerArray) -> tuple[Finding, ...]:
    """Look for a wrong unit, time, order or sign of columns, a wrong array, and dead channels.

    Parameters
    ----------
    recording : Recording
        Readings in m/s².
    array : AccelerometerArray
        The array that it is taken to be of.

    Returns
    -------
    tuple of Finding
        Refusals first. Empty for a recording that a correct array within its data sheets' limits may have made.

    Raises
    ------
    InputError
        If the recording lacks channels of the array, or holds raw counts.
    """
    readings = recording.for_array(array)
    dead = dead_channels(recording, array)
    limits = _limits(recording, array)
    if limits is None or len(recording) < _FEWEST:
        return dead
    alive = np.array([not any(name in one.channels for one in dead) for name in array.channels])
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
            found += [Finding("unit", f"{text} (likely, not certain)", False)] if text else []
    if not found and unseen_motions(array):  # too few channels to contradict one another
        text, refused = gravity_text(recording, array, limits)
        found += [Finding("unit", text, refused)] if text else []
    if not found:
        found += [Finding("reference", one.text, one.certain) for one in odd_rates(recording, array, limits, alive)]
    return (*sorted(found, key=lambda one: not one.refused), *dead)


def _limits(recording: Recording, array: AccelerometerArray) -> PartLimits | None:
    """Return the limits by the data sheets; None where they are not known."""
    if len(recording) < 2:
        return None
    try:
        return PartLimits.of(array, min(max(recording.sample_rate, 1.0), 1e5))
    except InputError:
        return None


def _constant(readings: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which channels (c,) hold one value in all their samples."""
    top = np.where(np.isfinite(readings), readings, -np.inf).max(axis=0, initial=-np.inf)
    low = np.where(np.isfinite(readings), readings, np.inf).min(axis=0, initial=np.inf)
    return np.asarray(top == low)


def _noise(readings: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the noise of each channel (c,) by the median of its second differences, m/s²."""
    second = np.abs(np.diff(readings, n=2, axis=0))
    seen = np.isfinite(second).any(axis=0) if len(second) else np.zeros(readings.shape[1], dtype=bool)
    noise = np.zeros(readings.shape[1])
    if seen.any():
        noise[seen] = np.nanmean(np.minimum(second[:, seen], 20 * np.nanmean(second[:, seen], axis=0)), axis=0)
    return noise / (np.sqrt(6.0) * np.sqrt(2.0 / np.pi))


def _time_against_metadata(recording: Recording) -> list[Finding]:
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
            return [Finding("time", text, True)]
    text = (
        f"column t_s gives {recording.sample_rate:.4g} Hz and the metadata state {stated:g} Hz; "
        "correct t_s, or sample_rate_hz in the metadata"
    )
    return [Finding("time", text, False)]


def _slow(recording: Recording, readings: NDArray[np.float64], limits: PartLimits) -> list[Finding]:
    """Warn of a rate that is implausible for a body that moves."""
    rate = recording.sample_rate
    seen = np.isfinite(readings).any(axis=0)
    moves = np.nanstd(readings[:, seen], axis=0) > 5.0 * limits.noise[seen]
    if rate < _SLOWEST and moves.any():
        text = (
            f"column t_s gives {rate:.4g} samples per second while the body moves: if it is in milliseconds or "
            "microseconds, convert it to seconds"
        )
        return [Finding("time", text, False)]
    if rate > 1.5 * limits.output_rate[1]:
        text = (
            f"column t_s gives {rate:.4g} samples per second and the part's fastest rate is "
            f"{limits.output_rate[1]:g} Hz; check its unit"
        )
        return [Finding("time", text, False)]
    return []


def _duplicates(readings: NDArray[np.float64], limits: PartLimits, array: AccelerometerArray) -> list[Finding]:
    """Find columns that hold the same values throughout though each should have noise of its own."""
    noise = _noise(readings)
    found = []
    for one, two in combinations(range(array.n_channels), 2):
        if min(noise[one] / limits.noise[one], noise[two] / limits.noise[two]) < _LEAST_NOISE:
            continue
        if np.array_equal(readings[:, one], readings[:, two], equal_nan=True):
            names = array.channels[one], array.channels[two]
            text = (
                f"channels {names[0]} and {names[1]} hold the same values in all {len(readings)} samples: one column "
                "was written twice; export the recording again, or leave the wrong one empty"
            )
            found.append(Finding("duplicate", text, True, names))
    return found


def _decide(evidence: Evidence) -> list[Finding]:
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


def _finding(way: Otherwise, alike: Sequence[Otherwise], *, refused: bool) -> Finding:
    text = way.text if refused else f"{way.text} (likely, not certain)"
    others = [one for one in alike if one.kind == way.kind and one.about != way.about][:3]
    if others and way.channels:
        text += "; as likely: " + ", or ".join(one.about for one in others)
    return Finding(way.kind, text, refused, way.channels)
