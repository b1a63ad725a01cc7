"""A clock whose rate walks: its offset against another clock, from arrivals that are late by a little or by a lot."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["ClockTrack", "TrackPolicy", "track_clock"]

_MAD_TO_STD = 1.4826
_ANYWHERE = 1e12  # variance of an offset that nothing is known of, in variances of the noise
_LEAST_SHARE = 1e-3  # of the likelihood, below which a track is left out


@dataclass(frozen=True)
class TrackPolicy:
    """Numbers of the clock model.

    Parameters
    ----------
    rate_walks : tuple of float
        Strengths of the random walk of the rate to weigh against each other, 1/√s: none, and half decades from a
        crystal in an oven to one that warms by a kelvin a second.
    most_rate : float
        Standard deviation of the rate of one clock against another at the start: ±0.1 % covers ceramic resonators.
    huber : float
        Residual in units of the spread beyond which an arrival loses weight; 95 % efficient for normal errors
        (Huber, Robust Statistics, 1981).
    passes : int
        Rounds of weighting.
    """

    rate_walks: tuple[float, ...] = (0.0, *(10.0 ** (0.5 * k) for k in range(-18, -9)))
    most_rate: float = 1e-3
    huber: float = 1.345
    passes: int = 4


@dataclass(frozen=True)
class ClockTrack:
    """Offset of a clock at the times of its arrivals.

    Parameters
    ----------
    offset_s, std_s : ndarray, shape (n,)
        Smoothed offset and its standard deviation, s.
    rate : float
        Rate at the last arrival, relative.
    rate_std : float
        Its standard deviation.
    rate_walk : float
        Mean strength of the random walk of the rate, 1/√s.
    residual_s : float
        Robust spread of the arrivals about the track, s.
    """

    offset_s: NDArray[np.float64]
    std_s: NDArray[np.float64]
    rate: float
    rate_std: float
    rate_walk: float
    residual_s: float


def track_clock(time_s: NDArray[np.float64], offset_s: NDArray[np.float64], jump: NDArray[np.bool_]) -> ClockTrack:
    """Smooth measured offsets of a clock whose rate is a random walk of unknown strength.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Times of the measurements, s, increasing.
    offset_s : ndarray, shape (n,)
        Measured offsets, s; NaN where only the track is wanted.
    jump : ndarray, shape (n,)
        Whether the offset may have any value here whatever it was before (the clock was set anew; its rate goes on).

    Notes
    -----
    State: offset x and rate r, dx = r dt, dr = q dw (the two-state clock model; Zucca & Tavella, IEEE Trans. UFFC
    52(2):289, 2005). Kalman filter and Rauch-Tung-Striebel smoother per strength q; the scale of the measurement noise
    is concentrated out of the likelihood, and the tracks are averaged with the likelihoods as weights. Huber's weights
    keep late arrivals from bending the track.
    """
    rule = TrackPolicy()
    seen = np.isfinite(offset_s)
    unit = _noise_level(offset_s[seen])
    start = float(offset_s[seen][0])
    measured = np.where(seen, (offset_s - start) / unit, 0.0)
    steps = np.diff(time_s, prepend=time_s[0]).tolist()
    weights = seen.astype(float)
    for _ in range(rule.passes):
        series = _Series(steps, measured.tolist(), weights.tolist(), jump.tolist(), rule.most_rate / unit)
        mixed = _mixture(series, [walk / unit for walk in rule.rate_walks])
        residual = np.where(seen, np.abs(measured - mixed.offset_s), 0.0)
        spread = max(float(np.median(residual[seen])) * _MAD_TO_STD, 1e-6)
        weights = np.where(seen, np.minimum(1.0, rule.huber * spread / np.maximum(residual, 1e-300)), 0.0)
    return ClockTrack(
        mixed.offset_s * unit + start,
        mixed.std_s * unit,
        mixed.rate * unit,
        mixed.rate_std * unit,
        mixed.rate_walk * unit,
        spread * unit,
    )


def _noise_level(offset_s: NDArray[np.float64]) -> float:
    """Robust level of the noise from second differences, s: neither an offset nor a rate adds to it."""
    second = np.diff(offset_s, 2) if len(offset_s) > 2 else np.zeros(1)
    return max(float(np.median(np.abs(second))) * _MAD_TO_STD / math.sqrt(6.0), 1e-9)


@dataclass(frozen=True)
class _Series:
    """Measurements in units of their noise, as lists: the recursions below are scalar."""

    steps: list[float]
    offset: list[float]
    weight: list[float]
    jump: list[bool]
    most_rate: float


def _mixture(series: _Series, walks: list[float]) -> ClockTrack:
    """Average the tracks of several strengths of the random walk by their likelihoods."""
    runs = [_filter(series, walk**2) for walk in walks]
    most = max(run.log_likelihood for run in runs)
    shares = [math.exp(run.log_likelihood - most) for run in runs]
    kept = [(run, walk, share) for run, walk, share in zip(runs, walks, shares, strict=True) if share > _LEAST_SHARE]
    total = sum(share for *_, share in kept)
    tracks = [(*_smooth(series, run), share / total) for run, _, share in kept]
    offset = np.sum([share * x for x, _, share in tracks], axis=0)
    variance = np.sum([share * (v + (x - offset) ** 2) for x, v, share in tracks], axis=0)
    rate = sum(share * run.rate for run, _, share in kept) / total
    rate_variance = sum(share * (run.rate_variance + (run.rate - rate) ** 2) for run, _, share in kept) / total
    walk = sum(share * walk * math.sqrt(run.scale) for run, walk, share in kept) / total
    return ClockTrack(offset, np.sqrt(variance), rate, math.sqrt(rate_variance), walk, 0.0)


@dataclass(frozen=True)
class _Filtered:
    """A run of the filter: states and covariances before and after each measurement."""

    predicted: list[tuple[float, float, float, float, float]]
    updated: list[tuple[float, float, float, float, float]]
    scale: float
    log_likelihood: float

    @property
    def rate(self) -> float:
        """Rate after the last measurement."""
        return self.updated[-1][1]

    @property
    def rate_variance(self) -> float:
        """Its variance."""
        return self.updated[-1][4] * self.scale


def _filter(series: _Series, q: float) -> _Filtered:
    """Kalman filter over (offset, rate); variances are relative to the measurement noise, whose scale comes out."""
    x, r, pxx, pxr, prr = 0.0, 0.0, _ANYWHERE, 0.0, series.most_rate**2
    predicted, updated = [], []
    squares = logs = 0.0
    number = 0
    for h, y, w, anew in zip(series.steps, series.offset, series.weight, series.jump, strict=True):
        x += r * h
        pxx += h * (2.0 * pxr + h * prr) + q * h**3 / 3.0
        pxr += h * prr + q * h**2 / 2.0
        prr += q * h
        if anew:
            pxx += _ANYWHERE
        predicted.append((x, r, pxx, pxr, prr))
        if w > 0.0:
            total = pxx + 1.0 / w
            gain_x, gain_r, innovation = pxx / total, pxr / total, y - x
            x, r = x + gain_x * innovation, r + gain_r * innovation
            prr -= gain_r * pxr
            pxx, pxr = gain_x / w, gain_r / w
            if total < 0.5 * _ANYWHERE:  # the first after a jump says nothing of the noise
                squares += innovation**2 / total
                logs += math.log(total * w)
                number += 1
        updated.append((x, r, pxx, pxr, prr))
    scale = max(squares / max(number, 1), 1e-12)
    return _Filtered(predicted, updated, scale, -0.5 * (number * math.log(scale) + logs))


def _smooth(series: _Series, run: _Filtered) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rauch-Tung-Striebel smoother: offsets and their variances, shapes (n,), (n,)."""
    x, r, pxx, pxr, prr = run.updated[-1]
    offsets, variances = [x], [pxx]
    for k in range(len(run.updated) - 2, -1, -1):
        h = series.steps[k + 1]
        ax, ar, axx, axr, arr = run.updated[k]
        bx, br, bxx, bxr, brr = run.predicted[k + 1]
        determinant = bxx * brr - bxr * bxr
        cxx, cxr = axx + h * axr, axr  # rows of P F'
        crx, crr = axr + h * arr, arr
        gxx, gxr = (cxx * brr - cxr * bxr) / determinant, (cxr * bxx - cxx * bxr) / determinant
        grx, grr = (crx * brr - crr * bxr) / determinant, (crr * bxx - crx * bxr) / determinant
        dx, dr = x - bx, r - br
        dxx, dxr, drr = pxx - bxx, pxr - bxr, prr - brr
        x, r = ax + gxx * dx + gxr * dr, ar + grx * dx + grr * dr
        pxx = axx + gxx * (gxx * dxx + gxr * dxr) + gxr * (gxx * dxr + gxr * drr)
        pxr = axr + gxx * (grx * dxx + grr * dxr) + gxr * (grx * dxr + grr * drr)
        prr = arr + grx * (grx * dxx + grr * dxr) + grr * (grx * dxr + grr * drr)
        offsets.append(x)
        variances.append(pxx)
    return np.array(offsets[::-1]), np.maximum(np.array(variances[::-1]), 0.0) * run.scale
