"""The drive of the table as one smooth unknown: a spline of the angle with a prior on its roughness.

Rate and angular acceleration are derivatives of the same spline, so they are estimated jointly from the reference
and from the channels, never by differentiating a noisy tachometer.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solveh_banded
from scipy.ndimage import gaussian_filter1d
from scipy.sparse import csr_array

from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.drive_root import banded
from gfimu.world_model import Spin, SpinState

__all__ = ["DEGREE", "AngleSpline", "JoinedSpin", "ScaledSpin", "ShiftedSpin", "SplineState", "smooth_rate"]

DEGREE = 4
"""Of the spline of the angle."""
_REMEMBERED = 8


class SplineState:
    """Angle, rate and acceleration of the spline at n times."""

    def __init__(
        self, angle: NDArray[np.float64], rate: NDArray[np.float64], acceleration: NDArray[np.float64]
    ) -> None:
        self.angle, self.rate, self.acceleration = angle, rate, acceleration


class AngleSpline:
    """Quartic spline of the table angle.

    Parameters
    ----------
    breaks : ndarray, shape (k + 1,)
        Ends of the k knot intervals, ascending, s.
    """

    def __init__(self, breaks: NDArray[np.float64]) -> None:
        self.breaks = np.asarray(breaks, dtype=float)
        self.widths = np.diff(self.breaks)
        self.start, self.stop = float(self.breaks[0]), float(self.breaks[-1])
        self.spacing = float(self.widths.max())
        reach = np.arange(1, DEGREE + 1)
        before = self.start - self.widths[0] * reach[::-1]
        self.knots = np.concatenate([before, self.breaks, self.stop + self.widths[-1] * reach])
        self.size = len(self.widths) + DEGREE
        self._pieces = _pieces(self.knots)
        degrees = np.arange(1.0, DEGREE + 1)[:, None]
        self._once = self._pieces[:, 1:] * degrees  # first derivative of each piece
        self._twice = self._once[:, 1:] * degrees[:-1]
        self._known: dict[bytes, tuple[NDArray[np.intp], NDArray[np.float64]]] = {}

    @classmethod
    def uniform(cls, start: float, stop: float, spacing: float) -> AngleSpline:
        """Return a spline on equal intervals of at most ``spacing`` s."""
        return cls(np.linspace(start, stop, max(int(np.ceil((stop - start) / spacing)), 8) + 1))

    def halved(self, chosen: NDArray[np.bool_]) -> AngleSpline:
        """Return the spline with the chosen intervals (k,) cut in two."""
        middle = self.interval_centres()[chosen]
        return AngleSpline(np.sort(np.concatenate([self.breaks, middle])))

    def within(self, start: float, stop: float) -> AngleSpline:
        """Return the spline on the same breaks between two times, s."""
        apart = 0.1 * float(self.widths.min())  # an interval much narrower than its neighbours is ill conditioned
        inner = self.breaks[(self.breaks > start + apart) & (self.breaks < stop - apart)]
        return AngleSpline(np.concatenate([[start], inner, [stop]]))

    def widened(self, before: float, after: float) -> AngleSpline:
        """Return the spline with intervals added at its ends over times, s."""
        ends = [
            np.linspace(0.0, more, int(np.ceil(more / self.spacing)) + 1)[1:] if more > 0 else np.zeros(0)
            for more in (before, after)
        ]
        return AngleSpline(np.concatenate([self.start - ends[0][::-1], self.breaks, self.stop + ends[1]]))

    def local(self, t: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Return the first coefficient (n,) that matters at each time, and what angle, rate and acceleration take
        from it and the four after it, shape (3, n, 5); constant rate beyond the ends.
        """  # noqa: D205
        # The same few time axes are asked for thousands of times, by several threads.
        key = t.tobytes()
        known = self._known.get(key)
        if known is None:
            known = self._local(t)
            _remember(self._known, key, known)
        return known

    def interval(self, t: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Return the knot interval (n,) of each time, and the time since its start, s; clipped at the ends."""
        inside = np.clip(t, self.start, self.stop)
        first = np.clip(np.searchsorted(self.breaks, inside, side="right") - 1, 0, len(self.widths) - 1)
        return first, inside - self.breaks[first]

    @property
    def accelerations(self) -> NDArray[np.float64]:
        """Acceleration of each interval's five basis functions as coefficients of 1, s, s², shape (k, 3, 5)."""
        return self._twice

    def polynomials(self, coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the angle on each interval as coefficients of 1, s, … s⁴ from the interval's start, (5, k)."""
        local = np.lib.stride_tricks.sliding_window_view(coefficients, DEGREE + 1)  # (k, 5)
        return np.ascontiguousarray(np.einsum("kpj,kj->pk", self._pieces, local))

    def _local(self, t: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        first, since = self.interval(t)
        powers = np.vander(since, DEGREE + 1, increasing=True)[:, None]  # (n, 1, 5)
        parts = (self._pieces, self._once, self._twice)
        values = np.stack([(powers[..., : part.shape[1]] @ part[first])[:, 0] for part in parts])
        beyond = t - np.clip(t, self.start, self.stop)
        if beyond.any():
            values[0] += values[1] * beyond[:, None]
        return first, values

    def matrix(self, t: NDArray[np.float64], slopes: NDArray[np.float64]) -> csr_array:
        """Return the matrix (n, m) from the coefficients to Σ slopes · (angle, rate, acceleration) at times ``t``.

        Parameters
        ----------
        t : ndarray, shape (n,)
            Times, s.
        slopes : ndarray, shape (3, n)
            Weights of angle, rate and acceleration at each time.
        """
        first, values = self.local(t)
        data = np.einsum("sn,snj->nj", slopes, values)
        columns = first[:, None] + np.arange(DEGREE + 1)
        ends = np.arange(0, data.size + 1, DEGREE + 1)
        return csr_array((data.ravel(), columns.ravel(), ends), shape=(len(t), self.size))

    def matrices(self, t: NDArray[np.float64]) -> tuple[csr_array, csr_array, csr_array]:
        """Return matrices (n, m) from the coefficients to angle, rate and acceleration at times ``t``."""
        one = np.eye(3)[:, :, None] * np.ones(len(t))  # (3, 3, n)
        return self.matrix(t, one[0]), self.matrix(t, one[1]), self.matrix(t, one[2])

    def roughness_rows(self) -> csr_array:
        """Return the matrix from the coefficients to the third derivative of the rate per knot interval, rad/s⁴."""
        # The fourth derivative of a quartic is constant on each interval.
        fourth = 24.0 * self._pieces[:, DEGREE]  # (k, 5)
        rows = len(fourth)
        columns = np.arange(rows)[:, None] + np.arange(DEGREE + 1)
        ends = np.arange(0, fourth.size + 1, DEGREE + 1)
        return csr_array((fourth.ravel(), columns.ravel(), ends), shape=(rows, self.size))

    def interval_centres(self) -> NDArray[np.float64]:
        """Return the centre of each knot interval, s."""
        return np.asarray(0.5 * (self.breaks[:-1] + self.breaks[1:]), dtype=np.float64)

    def moving_average(self, values: NDArray[np.float64], width: float) -> NDArray[np.float64]:
        """Return the average of values per interval (k,) over a width of time about each interval's centre, s."""
        area = np.concatenate([[0.0], np.cumsum(values * self.widths)])
        centres = self.interval_centres()
        half = np.maximum(0.5 * width, 0.5 * self.widths)
        low, high = np.maximum(centres - half, self.start), np.minimum(centres + half, self.stop)
        return np.asarray((np.interp(high, self.breaks, area) - np.interp(low, self.breaks, area)) / (high - low))

    def through(self, t: NDArray[np.float64], state: SpinState) -> NDArray[np.float64]:
        """Return the coefficients that come closest to a known motion at times ``t``."""
        angle, rate, acceleration = self.matrices(t)
        lhs = banded(csr_array(1e4 * angle.T @ angle + 1e2 * rate.T @ rate + acceleration.T @ acceleration))
        lhs[0] += 1e-9 * lhs[0].mean()
        rhs = 1e4 * angle.T @ state.angle + 1e2 * rate.T @ state.rate + acceleration.T @ state.acceleration
        return np.asarray(solveh_banded(lhs, rhs, lower=True), dtype=np.float64)

    def spin(self, coefficients: NDArray[np.float64]) -> _SplineSpin:
        """Return the motion with these coefficients."""
        return _SplineSpin(self, coefficients)


def _remember(known: dict[bytes, Any], key: bytes, value: Any) -> None:
    """Keep a value, the oldest forgotten; a thread that finds nothing computes it anew."""
    for old in tuple(known)[: max(len(known) + 1 - _REMEMBERED, 0)]:
        known.pop(old, None)
    known[key] = value


def _pieces(knots: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the coefficients of 1, s, … s⁴ (s from an interval's start) of its five basis functions, (k, 5, 5).

    The recurrence of Cox and de Boor (de Boor 1978, ch. X) on polynomials instead of values.
    """
    start = np.arange(DEGREE, len(knots) - DEGREE - 1)  # knot at which each interval starts
    lower = np.ones((len(start), 1, 1))  # (k, powers, functions)
    for degree in range(1, DEGREE + 1):
        out = np.zeros((len(start), degree + 1, degree + 1))
        for function in range(degree + 1):
            knot = start - degree + function
            if function > 0:  # (t − k_i) / (k_{i+p} − k_i) of the function before
                span, part = knots[knot + degree] - knots[knot], lower[:, :, function - 1]
                out[:, :-1, function] += ((knots[start] - knots[knot]) / span)[:, None] * part
                out[:, 1:, function] += part / span[:, None]
            if function < degree:  # (k_{i+p+1} − t) / (k_{i+p+1} − k_{i+1}) of the function itself
                end = knots[knot + degree + 1]
                span, part = end - knots[knot + 1], lower[:, :, function]
                out[:, :-1, function] += ((end - knots[start]) / span)[:, None] * part
                out[:, 1:, function] -= part / span[:, None]
        lower = out
    return lower


class _SplineSpin:
    """Motion of a table as a spline."""

    def __init__(self, spline: AngleSpline, coefficients: NDArray[np.float64]) -> None:
        self._spline = spline
        self._polynomials = spline.polynomials(coefficients)
        self._known: dict[bytes, SplineState] = {}

    def at(self, t: ArrayLike) -> SpinState:
        """Return the state at times (n,), s; constant rate beyond the ends."""
        times = np.asarray(t, dtype=float)
        # Hundreds of effects ask for the same times of the same drive.
        key = times.tobytes()
        known = self._known.get(key)
        if known is None:
            first, since = self._spline.interval(times)
            c0, c1, c2, c3, c4 = (powers[first] for powers in self._polynomials)
            rate = c1 + since * (2.0 * c2 + since * (3.0 * c3 + since * (4.0 * c4)))
            angle = c0 + since * (c1 + since * (c2 + since * (c3 + since * c4)))
            beyond = times - np.clip(times, self._spline.start, self._spline.stop)
            acceleration = 2.0 * c2 + since * (6.0 * c3 + since * (12.0 * c4))
            known = SplineState(angle + rate * beyond, rate, acceleration)
            _remember(self._known, key, known)
        return known


class ScaledSpin:
    """A spin over the gain of the reference that it was read by."""

    def __init__(self, spin: Spin, gain: float) -> None:
        self._spin, self._gain = spin, gain

    def at(self, t: ArrayLike) -> SpinState:
        """Return the state at times (n,), s."""
        state = self._spin.at(t)
        return SplineState(state.angle / self._gain, state.rate / self._gain, state.acceleration / self._gain)


class JoinedSpin:
    """One spin before an instant, s, and another from it on."""

    def __init__(self, before: Spin, after: Spin, instant: float) -> None:
        self._before, self._after, self._instant = before, after, instant

    def at(self, t: ArrayLike) -> SpinState:
        """Return the state at times (n,), s."""
        first, second = self._before.at(t), self._after.at(t)
        early = np.asarray(t) < self._instant
        return SplineState(
            np.where(early, first.angle, second.angle),
            np.where(early, first.rate, second.rate),
            np.where(early, first.acceleration, second.acceleration),
        )


class ShiftedSpin:
    """A spin with one state shifted by a constant."""

    def __init__(self, spin: Spin, place: int, step: float) -> None:
        self._spin, self._place, self._step = spin, place, step

    def at(self, t: ArrayLike) -> SpinState:
        """Return the state at times (n,), s."""
        state = self._spin.at(t)
        parts = [state.angle, state.rate, state.acceleration]
        parts[self._place] = parts[self._place] + self._step
        return SplineState(*parts)


def smooth_rate(run: Run, *, is_angle: bool, width: float = 0.1) -> NDArray[np.float64]:
    """Smooth the reference to a rate, for starting values and the prior only, shape (n,), rad/s."""
    known = run.reference_valid
    if not known.any():
        return np.zeros(len(run.t))
    rate = np.interp(run.t, run.t[known], run.reference[known])
    if is_angle:  # before smoothing, which would bend a turning angle at the ends
        rate = np.gradient(rate, run.sample_period)
    return np.asarray(gaussian_filter1d(rate, max(width / run.sample_period / 2.0, 0.5), mode="nearest"))
