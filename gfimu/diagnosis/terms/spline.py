"""The table's angle as a spline: one set of coefficients for angle, rate and angular acceleration."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BSpline
from scipy.linalg import solveh_banded

from gfimu.diagnosis.data.spins import State
from gfimu.world_model import Spin, SpinState

__all__ = ["DEGREE", "AngleSpline", "SplineSpin"]

DEGREE = 4
"""Numerical: of the spline of the angle. Its fourth derivative, which the prior acts on, is constant between knots."""
_REMEMBERED = 8  # numerical: time axes whose states a motion keeps


@dataclass(frozen=True)
class AngleSpline:
    """Quartic spline on equal intervals.

    Parameters
    ----------
    start : float
        Time of the first knot, s.
    spacing : float
        Distance of the knots, s.
    intervals : int
        Number of knot intervals.
    """

    start: float
    spacing: float
    intervals: int

    @classmethod
    def over(cls, start: float, stop: float, spacing: float) -> AngleSpline:
        """Return the spline that covers a span of time, s."""
        return cls(start, spacing, max(int(np.ceil((stop - start) / spacing)), 2 * DEGREE))

    @property
    def size(self) -> int:
        """Number m of coefficients."""
        return self.intervals + DEGREE

    @property
    def stop(self) -> float:
        """Time of the last knot, s."""
        return self.start + self.intervals * self.spacing

    def interval(self, t: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Return the knot interval (n,) of each time and the share of it that has passed; clipped at the ends."""
        place = np.clip((t - self.start) / self.spacing, 0.0, self.intervals)
        first = np.minimum(place.astype(np.intp), self.intervals - 1)
        return first, place - first

    def angle_row(self, t: float) -> NDArray[np.float64]:
        """Return the row (m,) that takes the coefficients to the angle at a time."""
        first, passed = self.interval(np.array([t]))
        row = np.zeros(self.size)
        row[first[0] : first[0] + DEGREE + 1] = np.vander(passed, DEGREE + 1, increasing=True)[0] @ _pieces()
        return row

    def rows(self, t: NDArray[np.float64], order: int) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Return the first coefficient (n,) at each time and what angle or derivative takes of five, (n, 5)."""
        first, passed = self.interval(t)
        pieces = _pieces()
        for _ in range(order):
            pieces = pieces[1:] * np.arange(1.0, len(pieces))[:, None] / self.spacing
        return first, np.vander(passed, len(pieces), increasing=True) @ pieces

    def bend(self, coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the fourth derivative of the angle in each interval (k,), rad/s⁴, of coefficients (m,)."""
        return np.asarray(np.diff(coefficients, DEGREE, axis=0) / self.spacing**DEGREE)

    def through(self, spin: Spin) -> NDArray[np.float64]:
        """Return the coefficients (m,) of the spline that a motion is closest to, sampled twice an interval."""
        t = np.asarray(self.start + 0.5 * self.spacing * (np.arange(2.0 * self.intervals) + 0.5), dtype=np.float64)
        first, passed = self.interval(t)
        values = np.vander(passed, DEGREE + 1, increasing=True) @ _pieces()  # (n, 5)
        normal, right = np.zeros((DEGREE + 1, self.size)), np.zeros(self.size)
        angle = spin.at(t).angle
        for i in range(DEGREE + 1):
            np.add.at(right, first + i, values[:, i] * angle)
            for j in range(i, DEGREE + 1):
                np.add.at(normal[j - i], first + i, values[:, i] * values[:, j])
        normal[0] += 1e-9 * normal[0].mean()  # numerical tolerance: the outermost coefficients are hardly determined
        return np.asarray(solveh_banded(normal, right, lower=True))

    def spin(self, coefficients: NDArray[np.float64]) -> SplineSpin:
        """Return the motion with these coefficients (m,)."""
        return SplineSpin(self, coefficients)


@lru_cache(maxsize=1)
def _pieces() -> NDArray[np.float64]:
    """Return the five basis functions of an interval as polynomials of the share u that has passed: (powers, 5)."""
    knots = np.arange(DEGREE + 2.0)
    one = BSpline.basis_element(knots, extrapolate=False)
    out = np.zeros((DEGREE + 1, DEGREE + 1))
    factorial = 1.0
    for power in range(DEGREE + 1):
        derivative = one.derivative(power) if power else one
        factorial *= max(power, 1)
        # In the middle of the interval, where no derivative jumps, then moved to its start.
        for function in range(DEGREE + 1):
            out[power, function] = derivative(DEGREE - function + 0.5) / factorial
    shift = np.array(
        [[_binomial(high, low) * (-0.5) ** (high - low) for high in range(DEGREE + 1)] for low in range(DEGREE + 1)]
    )
    return shift @ out


def _binomial(n: int, k: int) -> float:
    return float(np.prod([(n - i) / (i + 1) for i in range(k)])) if 0 <= k <= n else 0.0


class SplineSpin:
    """Motion of a table as a spline; at a constant rate beyond its ends."""

    def __init__(self, spline: AngleSpline, coefficients: NDArray[np.float64]) -> None:
        self.spline, self.coefficients = spline, coefficients
        self._known: dict[tuple[int, float, float], tuple[NDArray[np.float64], State]] = {}

    @cached_property
    def _polynomials(self) -> NDArray[np.float64]:
        windows = np.lib.stride_tricks.sliding_window_view(self.coefficients, DEGREE + 1)  # (k, 5)
        return np.ascontiguousarray(_pieces() @ windows.T)  # (powers, k)

    def at(self, t: ArrayLike) -> SpinState:
        """Return the state at times (n,), s."""
        times = np.asarray(t, dtype=float)
        # Hundreds of effects ask for the same times of the same drive.
        key = (times.size, float(times.flat[0]), float(times.flat[-1])) if times.size else (0, 0.0, 0.0)
        known = self._known.get(key)
        if known is not None and np.array_equal(known[0], times):
            return known[1]
        state = self._at(times)
        if len(self._known) >= _REMEMBERED:
            self._known.clear()
        self._known[key] = (times, state)
        return state

    def _at(self, times: NDArray[np.float64]) -> State:
        h = self.spline.spacing
        first, u = self.spline.interval(times)
        c0, c1, c2, c3, c4 = (powers[first] for powers in self._polynomials)
        rate = (c1 + u * (2.0 * c2 + u * (3.0 * c3 + u * (4.0 * c4)))) / h
        angle = c0 + u * (c1 + u * (c2 + u * (c3 + u * c4)))
        acceleration = (2.0 * c2 + u * (6.0 * c3 + u * (12.0 * c4))) / h**2
        beyond = times - np.clip(times, self.spline.start, self.spline.stop)
        return State(angle + rate * beyond, rate, acceleration)
