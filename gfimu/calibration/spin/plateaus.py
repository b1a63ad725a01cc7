"""Plateaus of constant table rate: rates by the tachometer, and mean readings without the wave of the lean."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs, savgol_filter

from gfimu.base.errors import InputError
from gfimu.calibration.spin.policy import SpinPolicy
from gfimu.recording import Recording
from gfimu.recording.importing.guessing.likely_reference import reference_remedy
from gfimu.recording.timing.reference_times import reference_on_rows

__all__ = ["Plateaus", "find_plateaus"]

Floats = NDArray[np.float64]

_NOISE_OF_SLOPE = 4.0
_LEAST_NOISE = 1e-3  # numerical: of the wave's standard deviation; computed readings have no noise
_MAD = 1.4826  # numerical: standard deviation over median absolute deviation of normal numbers


@dataclass(frozen=True)
class Plateaus:
    """Means over stretches of constant rate.

    Parameters
    ----------
    start_s : ndarray, shape (k,)
        Start of each plateau, s.
    samples : ndarray of int, shape (k,)
        Samples in it.
    rate : ndarray, shape (k,)
        Mean rate, rad/s; zero of a rest.
    square, square_std : ndarray, shape (k,)
        Mean of the squared rate and its standard deviation, rad²/s²; zero of a rest.
    slope : ndarray, shape (k,)
        Rate of change of the rate, rad/s².
    means : ndarray, shape (k, c)
        Mean readings without the wave that a leaning axis makes once per turn, reading unit.
    variance : ndarray, shape (k, c)
        Variance of the means; infinite where a channel has no complete plateau.
    wave : ndarray, shape (k, c, 2)
        Cosine and sine of that wave, reading unit; zero of a rest.
    turns : ndarray, shape (k,)
        Turns in it.
    saturated : ndarray of bool, shape (k, c)
        Whether the channel sits at its limit there; its mean is then left out.
    """

    start_s: Floats
    samples: NDArray[np.intp]
    rate: Floats
    square: Floats
    square_std: Floats
    slope: Floats
    means: Floats
    variance: Floats
    wave: Floats
    turns: Floats
    saturated: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.rate)

    @property
    def spinning(self) -> NDArray[np.bool_]:
        """Whether each plateau turns, shape (k,)."""
        return self.square > 0.0

    def speeds(self, ratio: float) -> Floats:
        """Distinct speeds without their sign, ascending, rad/s: each ``ratio`` times the one before or more."""
        found: list[float] = []
        for speed in np.sort(np.abs(self.rate[self.spinning])):
            if not found or speed >= ratio * found[-1]:
                found.append(float(speed))
        return np.array(found)


def find_plateaus(recording: Recording, wave_std: Floats, min_duration_s: float, policy: SpinPolicy) -> Plateaus:
    """Find the plateaus of a recording and average them.

    Parameters
    ----------
    recording : Recording
        Readings (n, c) with ``tacho_rad_s``.
    wave_std : ndarray, shape (c,)
        Standard deviation, before the data, of the wave that a leaning axis makes on each channel, reading unit.
    min_duration_s : float
        Shortest plateau, s.
    policy : SpinPolicy
        What counts as a plateau.

    Raises
    ------
    InputError
        If there is no tachometer, or no plateau that turns.
    """
    recording = reference_on_rows(recording)
    tacho = recording.reference.get("tacho_rad_s")
    if tacho is None or not np.isfinite(tacho).any():
        likely = reference_remedy({**recording.extra, **recording.reference}, "tacho_rad_s")
        raise InputError(
            "spin needs the table's rate: the recording has no tacho_rad_s column" + f"; {likely}" * bool(likely)
        )
    stretches, noise = _stretches(recording, tacho, min_duration_s, policy)
    saturated = _saturated(recording.readings, stretches, policy)
    rows = [
        (*_average(recording, tacho, slice(*stretch), noise, wave_std, out, policy), out)
        for stretch, out in zip(stretches, saturated, strict=True)
    ]
    if not any(row[3] > 0.0 for row in rows):
        raise InputError(
            "no plateau of constant rate: hold each speed for "
            f"{min_duration_s + 3.0 * policy.slope_window_s:g} s or more, to {policy.slope_rad_s2:g} rad/s² steady"
        )
    columns = list(zip(*rows, strict=True))
    return Plateaus(*(np.array(column) for column in columns))


def _stretches(
    recording: Recording, tacho: Floats, min_duration_s: float, policy: SpinPolicy
) -> tuple[list[tuple[int, int]], float]:
    """Return first and last-plus-one sample of every plateau, and the noise of the tachometer, rad/s."""
    known = np.isfinite(tacho)
    filled = np.interp(recording.t_s, recording.t_s[known], tacho[known])
    period = recording.sample_period
    window = max(round(policy.slope_window_s / period) | 1, 5)
    if len(filled) < window:
        raise InputError(f"the recording is shorter than {policy.slope_window_s:g} s; record plateaus of constant rate")
    noise = _MAD * float(np.median(np.abs(np.diff(filled) - np.median(np.diff(filled))))) / np.sqrt(2.0)
    slope = savgol_filter(filled, window, 1, deriv=1, delta=period)
    limit = policy.slope_rad_s2 + _NOISE_OF_SLOPE * noise * float(
        np.linalg.norm(savgol_coeffs(window, 1, deriv=1, delta=period))
    )
    smooth = savgol_filter(filled, window, 1)
    steady = known & (np.abs(slope) <= limit + policy.slope_share_s * np.abs(smooth))
    steady[recording.gaps] = False
    edges = np.flatnonzero(np.diff(np.concatenate([[0], steady.astype(int), [0]])))
    found = []
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        # A slope within the limit may be that of a window which reaches into a ramp; as long again, the table settles.
        first = start + window if start else 0
        last = stop - window if stop < len(filled) else stop
        if (last - first) * period < min_duration_s:
            continue
        mean = float(smooth[first:last].mean())
        if np.abs(smooth[first:last] - mean).max() <= policy.spread * abs(mean) + policy.spread_rad_s:
            found.append((int(first), int(last)))
    return found, noise


def _saturated(readings: Floats, stretches: list[tuple[int, int]], policy: SpinPolicy) -> NDArray[np.bool_]:
    """Return where a channel sits at its own extreme, (k, c), although its noise is wider than a count elsewhere."""
    extremes = np.nanmax(readings, axis=0), np.nanmin(readings, axis=0)
    parts = [readings[start:stop] for start, stop in stretches]
    at_limit = np.array([[np.mean(part == extreme, axis=0) for extreme in extremes] for part in parts])  # (k, 2, c)
    at_own = [
        np.maximum(np.mean(part == part.max(axis=0), axis=0), np.mean(part == part.min(axis=0), axis=0))
        for part in parts
    ]
    if not parts:
        return np.empty((0, readings.shape[1]), dtype=bool)
    noisy = np.median(at_own, axis=0) < policy.own_extreme_share
    return np.asarray((at_limit.max(axis=1) > policy.saturated_share) & noisy)


def _average(
    recording: Recording,
    tacho: Floats,
    rows: slice,
    noise: float,
    wave_std: Floats,
    left_out: NDArray[np.bool_],
    policy: SpinPolicy,
) -> tuple[object, ...]:
    """Return the fields of `Plateaus` but the last for one plateau, in their order."""
    t, rate, readings = recording.t_s[rows], tacho[rows], recording.readings[rows]
    n, mean = len(t), float(rate.mean())
    still = abs(mean) < policy.rest_rad_s
    angle = np.concatenate([[0.0], np.cumsum(np.diff(t) * (rate[1:] + rate[:-1]) / 2.0)])
    turns = abs(float(angle[-1])) / (2.0 * np.pi)
    slope = 0.0 if still else float(np.polyfit(t - t.mean(), rate, 1)[0])
    # The product of neighbours has the square of the rate without the variance of the tachometer's noise.
    square = 0.0 if still else float(np.mean(rate[1:] * rate[:-1]))
    square_std = 0.0 if still else 2.0 * abs(mean) * noise / np.sqrt(n)
    c = readings.shape[1]
    means, variance, wave = np.zeros(c), np.full(c, np.inf), np.zeros((c, 2))
    design = np.ones((n, 1)) if still else np.column_stack([np.ones(n), np.cos(angle), np.sin(angle)])
    for channel in range(c):
        values = readings[:, channel]
        if left_out[channel] or not np.isfinite(values).all():
            continue
        spread = max(float(np.var(np.diff(values)) / 2.0), (_LEAST_NOISE * wave_std[channel]) ** 2)
        prior = np.zeros(design.shape[1])
        prior[1:] = spread / wave_std[channel] ** 2
        normal = np.linalg.inv(design.T @ design + np.diag(prior))
        solution = normal @ (design.T @ values)
        residual = values - design @ solution
        means[channel], variance[channel] = solution[0], normal[0, 0] * max(residual @ residual / n, spread)
        wave[channel, : len(solution) - 1] = solution[1:]
    return float(t[0]), n, 0.0 if still else mean, square, square_std, slope, means, variance, wave, turns
