"""Gathering the evidence of a recording: means of its rests, a covariance, and windows of its motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.array.integration import integrate_samples
from gfimu.array.parts.limits import PartLimits
from gfimu.base.errors import InputError
from gfimu.recording.evidence.rigid import FEWEST, Evidence, Window
from gfimu.recording.recording import Recording
from gfimu.recording.rest import detect_rest

__all__ = ["gather"]

_RESTS = 8  # stretches of rest that are used, the longest
_MOST_RESTS = 200  # stretches of rest that are looked at, the longest
_FEWEST_STILL = 10  # samples of a rest in a window of motion, after decimation
_STILL = 0.02  # of the size of the mean readings, by which readings at rest may scatter, in whatever unit they are
_WINDOW = 2000  # samples of a window of motion, after decimation
_ROWS = 200  # of them that are compared
_RATE = 100.0  # Hz, to which faster recordings are averaged
_NOMINAL_RATES = (4.0, 20_000.0)  # Hz; outside of them rest is looked for as if at 100 Hz
_TABLE = {"tacho_rad_s", "command_rad_s", "angle_rad"}  # references of a body that turns about one axis only


def gather(recording: Recording, array: AccelerometerArray, limits: PartLimits, alive: NDArray[np.bool_]) -> Evidence:
    """Reduce a recording to what shows whether its channels fit one rigid body.

    Raises
    ------
    InputError
        As `gfimu.Recording.for_array`.
    """
    readings = np.where(alive, recording.for_array(array), 0.0)  # (n, c)
    whole: NDArray[np.bool_] = np.asarray(np.isfinite(readings).all(axis=1))
    rests = _rests(recording, array, readings, whole, alive, limits.noise)
    step = max(1, int(np.count_nonzero(whole)) // 20_000)
    covariance = np.cov(readings[whole][::step].T) if np.count_nonzero(whole) > 2 else np.zeros((0, 0))
    up = None
    if "mounting_rotvec_rad" in recording.metadata and _TABLE & set(recording.reference):
        up = Rotation.from_rotvec(recording.mounting_rotvec).inv().apply([0.0, 0.0, 1.0])
    longest = sorted(sorted(rests, key=lambda rest: rest.start - rest.stop)[:_RESTS], key=lambda rest: rest.start)
    means = np.array([readings[rest][whole[rest]].mean(axis=0) for rest in longest]).reshape(-1, array.n_channels)
    windows = _windows(recording, readings[:, alive], whole, rests)
    quiet, rate = _quiet(readings), recording.sample_rate
    return Evidence(array, alive, limits, means, covariance, windows, up, quiet, rate, recording.unit_from)


def _rests(
    recording: Recording,
    array: AccelerometerArray,
    readings: NDArray[np.float64],
    whole: NDArray[np.bool_],
    alive: NDArray[np.bool_],
    noise: NDArray[np.float64],
) -> list[slice]:
    """Return the stretches of rest, the longest ones of many."""
    t = recording.t_s
    rate = recording.sample_rate
    if not _NOMINAL_RATES[0] < rate < _NOMINAL_RATES[1]:
        t = np.arange(len(t)) / _RATE
    names = tuple(name for name, lives in zip(array.channels, alive, strict=True) if lives)
    try:
        tacho = {name: recording.reference[name] for name in ("tacho_rad_s",) if name in recording.reference}
        rest = detect_rest(Recording(t, readings[:, alive], names, tacho))
    except InputError:
        return []
    longest = np.sort(np.argsort(-rest.lengths, kind="stable")[:_MOST_RESTS])
    found = [slice(int(rest.start[place]), int(rest.stop[place])) for place in longest]
    kept = []
    for rows in found:
        inside = readings[rows][whole[rows]]
        if len(inside) >= FEWEST and np.all(
            inside.std(axis=0) < 3.0 * noise + _STILL * np.linalg.norm(inside.mean(axis=0))
        ):
            kept.append(rows)  # a perfect sensor's slowest motion is a rest for `detect_rest` too
    return kept


def _windows(
    recording: Recording, readings: NDArray[np.float64], whole: NDArray[np.bool_], rests: Sequence[slice]
) -> tuple[Window, ...]:
    """Return the first stretch of motion, and the one in which the readings vary most."""
    t, values = recording.t_s[whole], readings[whole]
    tacho = recording.reference.get("tacho_rad_s", np.full(len(whole), np.nan))[whole]
    group = max(1, int(recording.sample_rate // _RATE)) if recording.sample_rate < _NOMINAL_RATES[1] else 1
    count = len(t) // group
    if count < 2 * FEWEST:
        return ()
    t = t[: count * group].reshape(count, group).mean(axis=1)
    values = values[: count * group].reshape(count, group, -1).mean(axis=1)
    tacho = tacho[: count * group].reshape(count, group).mean(axis=1)
    length = min(_WINDOW, count)
    starts = np.arange(0, count - length + 1, max(1, length // 4))
    spread = [float(values[start : start + length].var(axis=0).sum()) for start in starts]
    after_rest = 0
    if rests:
        last = int(np.count_nonzero(whole[: rests[0].stop])) // group
        after_rest = max(0, min(last - FEWEST, count - length))
    passed = np.concatenate([[0], np.cumsum(whole)])
    edges = np.array([[passed[rest.start], passed[rest.stop]] for rest in rests]).reshape(-1, 2) // group
    chosen = dict.fromkeys([after_rest, int(starts[int(np.argmax(spread))])])
    windows = []
    for start in chosen:
        part = slice(start, start + length)
        still = _still(t[part], values[part], edges - start)
        integrals = integrate_samples(t[part], values[part] - still, method="trapezoid")
        rows = np.unique(np.linspace(0, length - 1, min(_ROWS, length)).astype(int))
        windows.append(
            Window(values[part][rows], integrals[rows], t[part][rows] - t[start], tacho[part][rows], 1.0 / group)
        )
    return tuple(windows)


def _still(t: NDArray[np.float64], values: NDArray[np.float64], rests: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return what channels (m, c) read while α is zero, interpolated between the rests (k, 2) of a window.

    A gain that is off by a tenth makes an α of gravity, another one in each pose, that would integrate to a rate. At
    rest, and in a steady spin, α is zero; so what is read there is taken off, and what is wrong with it is fitted.
    """
    inside = np.clip(rests, 0, len(t))
    inside = inside[inside[:, 1] - inside[:, 0] >= _FEWEST_STILL]
    if not len(inside):
        return np.zeros_like(values)
    middles = [float(t[start:stop].mean()) for start, stop in inside]
    means = np.array([values[start:stop].mean(axis=0) for start, stop in inside])
    return np.column_stack([np.interp(t, middles, column) for column in means.T])


def _quiet(readings: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the noise of each channel (c,) from second differences of its quietest tenth of samples, m/s²."""
    size = 20
    second = np.diff(readings, n=2, axis=0) / np.sqrt(6.0)
    count = len(second) // size
    if count < 1:
        return np.zeros(readings.shape[1])
    blocks = second[: count * size].reshape(count, size, -1)
    rms = np.sqrt(np.mean(blocks**2, axis=1))  # NaN where a sample is missing
    return np.nan_to_num(np.nanquantile(rms, 0.1, axis=0)) if np.isfinite(rms).any() else np.zeros(readings.shape[1])
