"""Simulated pairs of files of two clocks: tables, free bodies and two loggers, drawn at random.

The truth of a pair is t = offset + (1 + rate error) · t_reference. Every pair has its own motion, sample rates, noise,
counts, lever, lean, jitter of the stamps and clocks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from gfimu.recording import Recording, ReferenceSeries

FINE = 1000.0  # Hz, of the true motion
TABLES = ("sweep", "steps", "hand", "spin_up", "swing")


@dataclass(frozen=True)
class Pair:
    """Two files, and the truth between their clocks."""

    kind: str
    recording: Recording
    reference: ReferenceSeries
    offset: float
    rate_error: float

    def misses(self, alignment) -> tuple[float, float]:
        """Return the errors of the offset in the middle and of the rate error, in stated standard deviations."""
        lapse = np.array([self.reference.t_s[0], self.reference.t_s[-1]])
        t = self.offset + (1.0 + self.rate_error) * lapse
        middle = 0.5 * (max(t[0], self.recording.t_s[0]) + min(t[1], self.recording.t_s[-1]))
        u = (middle - self.offset) / (1.0 + self.rate_error)
        missed = alignment.offset + (1.0 + alignment.rate_error) * u - middle
        return missed / alignment.offset_std, (alignment.rate_error - self.rate_error) / alignment.rate_error_std


def _slow(rng, t: NDArray[np.float64], seconds: float) -> NDArray[np.float64]:
    """Return noise of unit size whose values are correlated over some seconds."""
    knots = np.arange(t[0] - 4.0 * seconds, t[-1] + 5.0 * seconds, seconds)
    series = CubicSpline(knots, rng.standard_normal(len(knots)))(t)
    return series / series.std()


def _integral(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the integral over the fine times; a sum alone would be half a step ahead, as long as a good clock's σ."""
    return cumulative_trapezoid(values, dx=1.0 / FINE, initial=0.0)


def table_rate(rng, profile: str, t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rate of a table, rad/s."""
    fast, length = rng.uniform(4.0, 14.0), t[-1]
    if profile == "sweep":
        a, b = rng.uniform(0.05, 0.2), rng.uniform(0.3, 0.8)
        return fast * (0.6 + 0.4 * np.sin(2.0 * np.pi * (a * t + 0.5 * (b - a) * t**2 / length)))
    if profile == "steps":
        times = np.sort(rng.uniform(0.0, length, int(length / rng.uniform(3.0, 8.0))))
        levels = rng.uniform(-fast, fast, len(times) + 1)
        rate = levels[np.searchsorted(times, t)]
        window = np.hanning(int(rng.uniform(0.5, 1.5) * FINE))
        return np.convolve(np.pad(rate, len(window), mode="edge"), window / window.sum(), "same")[
            len(window) : -len(window)
        ]
    if profile == "hand":
        return fast * 0.5 * _slow(rng, t, rng.uniform(0.4, 1.5)) + 0.3 * fast
    if profile == "swing":
        sway = rng.uniform(2.0, 4.5)
        return 4.0 * np.exp(-t / length) * np.sin(sway * t + 0.3 * np.sin(0.4 * t)) + 0.3 * _slow(rng, t, 1.0)
    start = rng.uniform(2.0, 0.2 * length)
    up = np.interp(t, [start, start + rng.uniform(1.0, 4.0)], [0.0, 1.0])
    window = np.hanning(int(0.6 * FINE))
    up = np.convolve(np.pad(up, len(window), mode="edge"), window / window.sum(), "same")[len(window) : -len(window)]
    return up * fast * np.exp(-np.maximum(t - start, 0.0) / rng.uniform(0.5 * length, 1.5 * length))


def _sampled(rng, t, motion, rate_hz, noise, count, jitter):
    """Return stamps and readings of a motion (n, c) sampled at a rate: noisy, in counts, with uneven stamps."""
    begin, end = t[0] + rng.uniform(0.0, 2.0), t[-1] - rng.uniform(0.0, 2.0)
    times = np.arange(begin, end, 1.0 / rate_hz)
    spline = CubicSpline(t, motion)
    values = spline(times) + noise * rng.standard_normal((len(times), motion.shape[1]))
    values = np.round(values / count) * count if count else values
    return times + np.clip(jitter * rng.standard_normal(len(times)), -0.4, 0.4) / rate_hz, values


def _names(chips: int) -> tuple[str, ...]:
    return tuple(f"a{chip}{axis}" for chip in range(1, chips + 1) for axis in (1, 2, 3))


def _log(rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def draw_pair(rng, kind: str | None = None, *, other: bool = False, clip: bool | None = None) -> Pair:
    """Return a pair; with ``other`` the reference is that of another motion of the same kind."""
    kind = kind or str(rng.choice([*TABLES, *TABLES, "angle", "gyro", "loggers", "loggers"]))
    length = rng.uniform(30.0, 100.0)
    t = np.arange(0.0, length, 1.0 / FINE)
    jitter = float(rng.choice([0.0, 0.1, 0.2]))
    offset, rate_error = rng.uniform(-300.0, 300.0), rng.uniform(-0.005, 0.005)
    noise, count = _log(rng, 0.005, 0.1), float(rng.choice([0.0, 0.004, 0.04]))
    rates = _log(rng, 20.0, 400.0), _log(rng, 20.0, 400.0)
    if kind in {"gyro", "loggers"}:
        chips = 1 if kind == "loggers" else 2
        first, second = (_free(rng, t, chips) for _ in range(2))
        accelerations, turning, _ = first
        gyro_noise = _log(rng, 0.002, 0.02)
        whole = np.column_stack([accelerations, turning])
        levels = np.r_[np.full(accelerations.shape[1], noise), np.full(3, gyro_noise)]
        times, values = _sampled(rng, t, whole, rates[0], levels, count, jitter)
        body = second if other else first
        reading = body[2] @ Rotation.random(random_state=int(rng.integers(1 << 31))).as_matrix()
        turned = body[1]
        theirs, seen = _sampled(
            rng,
            t,
            np.column_stack([reading, turned]),
            rates[1],
            np.r_[np.full(3, noise), [gyro_noise] * 3],
            0.0,
            jitter,
        )
        gyro = {f"gyro_{axis}_rad_s": one for axis, one in zip("xyz", values[:, -3:].T, strict=True)}
        columns = {f"gyro_{axis}_rad_s": one for axis, one in zip("xyz", seen[:, 3:].T, strict=True)}
        has_gyros = kind == "loggers" and bool(rng.integers(2))
        recording = Recording(times, values[:, :-3], _names(chips), gyro if has_gyros else {})
        channels = dict(zip(_names(1), seen[:, :3].T, strict=True)) if kind == "loggers" else {}
        if kind == "loggers" and not has_gyros:
            columns = {}
        series = ReferenceSeries("reference.csv", (theirs - offset) / (1.0 + rate_error), columns, channels=channels)
        return Pair(kind, recording, series, offset, rate_error)
    profile = str(rng.choice(TABLES)) if kind == "angle" else kind
    rate = table_rate(rng, profile, t)
    chips, lever = int(rng.choice([1, 2, 4])), _log(rng, 0.03, 0.3)
    lean = 9.81 * np.sin(np.radians(rng.uniform(0.0, 3.0)))
    angle, alpha = _integral(rate), np.gradient(rate, 1.0 / FINE)
    channels = []
    for chip in range(chips):
        r, turn = lever * (1.0 + 0.5 * chip), rng.uniform(0.0, 2.0 * np.pi)
        x = -r * rate**2 + lean * np.cos(angle + turn)
        y = r * alpha - lean * np.sin(angle + turn)
        channels += [np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y, 9.8 + 0.0 * x]
    motion = np.column_stack(channels)
    times, values = _sampled(rng, t, motion, rates[0], noise, count, jitter)
    if clip if clip is not None else rng.uniform() < 0.2:
        values = np.clip(values, *np.quantile(values, [0.1, 1.0], axis=0))
    turned = table_rate(rng, profile, t) if other else rate
    digital = rng.uniform() < 0.8  # it counts by its own clock
    tacho_noise = _log(rng, 0.003, 0.03)
    if kind == "angle":
        measured = _integral(turned)[:, None]
        theirs, seen = _sampled(rng, t, measured, min(rates[1], 200.0), 1e-3, 2.0 * np.pi / 4096, jitter)
        columns = {"angle_rad": seen[:, 0]}
    else:
        count = float(rng.choice([0.0, 0.02, 0.1]))
        theirs, seen = _sampled(
            rng, t, (1.0 + rate_error * digital) * turned[:, None], _log(rng, 10.0, 200.0), tacho_noise, count, jitter
        )
        columns = {"tacho_rad_s": seen[:, 0]}
    series = ReferenceSeries("reference.csv", (theirs - offset) / (1.0 + rate_error), columns)
    return Pair(kind, Recording(times, values, _names(chips)), series, offset, rate_error)


def _free(rng, t, chips):
    """Return accelerations of some chips of a free body, its rates, and the acceleration at another logger."""
    turning = np.column_stack([rng.uniform(0.5, 3.0) * _slow(rng, t, rng.uniform(0.3, 1.0)) for _ in range(3)])
    turning *= (0.3 + np.abs(_slow(rng, t, 6.0)))[:, None]
    alpha = np.gradient(turning, 1.0 / FINE, axis=0)
    steps = Rotation.from_rotvec(0.5 * (turning + np.roll(turning, -1, axis=0)) / FINE)
    up = np.empty((len(t), 3))
    matrices = steps.as_matrix()
    now = np.array([0.0, 0.0, 9.81])
    for row, matrix in enumerate(matrices):
        up[row] = now
        now = matrix.T @ now
    shaken = up + rng.uniform(0.1, 1.0) * np.column_stack([_slow(rng, t, 0.3) for _ in range(3)])
    levers = [rng.uniform(-0.2, 0.2, 3) for _ in range(chips + 1)]
    seen = [shaken + np.cross(turning, np.cross(turning, r)) + np.cross(alpha, r) for r in levers]
    return np.column_stack(seen[:-1]), turning, seen[-1]
