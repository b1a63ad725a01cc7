"""The table's angle as a spline: one set of coefficients for angle, rate and angular acceleration."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import factorial

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solveh_banded

from gfimu.diagnosis.data.table.spins import State
from gfimu.model.world_model import Spin, SpinState

__all__ = ["DEGREE", "AngleSpline", "PushedSpin", "SplineSpin"]

DEGREE = 4
"""Numerical: of the spline of the angle. Its fourth derivative, which the prior acts on, is constant between knots."""
_REMEMBERED = 8  # numerical: time axes whose states a motion keeps
_ROUNDS = 4  # numerical: to a spline through a motion


@dataclass(frozen=True)
class AngleSpline:
    """Quartic spline whose knots are equally far apart, and closer by powers of two where it is cut.

    Parameters
    ----------
    start : float
        Time of the first knot, s.
    spacing : float
        Distance of the knots where nothing is cut, s.
    intervals : int
        Number k of knot intervals.
    halvings : tuple of int
        How often each interval was halved, from ``spacing``; empty where none was.
    """

    start: float
    spacing: float
    intervals: int
    halvings: tuple[int, ...] = ()

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
        return float(self.knots[-1]) if self.halvings else self.start + self.intervals * self.spacing

    @cached_property
    def widths(self) -> NDArray[np.float64]:
        """Width of every interval (k,), s."""
        return self.spacing * 0.5 ** np.array(self.halvings or (0,) * self.intervals, dtype=float)

    @cached_property
    def knots(self) -> NDArray[np.float64]:
        """Knots (k + 1,), s."""
        return self.start + np.append(0.0, np.cumsum(self.widths))

    @property
    def centres(self) -> NDArray[np.float64]:
        """Middle of every interval (k,), s."""
        return self.knots[:-1] + 0.5 * self.widths

    @property
    def finest(self) -> float:
        """Width of the narrowest interval, s."""
        return self.spacing * 0.5 ** max(self.halvings, default=0)

    def cut(self, where: NDArray[np.bool_]) -> AngleSpline:
        """Return the spline with some of its intervals (k,) halved."""
        levels = np.repeat(np.array(self.halvings or (0,) * self.intervals) + where, 1 + where)
        return AngleSpline(self.start, self.spacing, len(levels), tuple(levels.tolist()) if levels.any() else ())

    def interval(self, t: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Return the knot interval (n,) of each time and the share of it that has passed; clipped at the ends."""
        if not self.halvings:
            place = np.clip((t - self.start) / self.spacing, 0.0, self.intervals)
            first = np.minimum(place.astype(np.intp), self.intervals - 1)
            return first, place - first
        place = np.clip((t - self.start) / self.finest, 0.0, len(self._on_finest))
        first = self._on_finest[np.minimum(place.astype(np.intp), len(self._on_finest) - 1)]
        return first, (place - self._begin[first]) / self._steps[first]

    def places(self, t: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Return ``interval(t)``, kept for times that are asked for again."""
        key = (t.size, float(t.flat[0]), float(t.flat[-1])) if t.size else (0, 0.0, 0.0)
        known = self._asked.get(key)
        if known is None or not np.array_equal(known[0], t):
            if len(self._asked) >= _REMEMBERED:
                self._asked.clear()
            known = self._asked[key] = (t, *self.interval(t))
        return known[1], known[2]

    @cached_property
    def _asked(
        self,
    ) -> dict[tuple[int, float, float], tuple[NDArray[np.float64], NDArray[np.intp], NDArray[np.float64]]]:
        return {}

    @cached_property
    def _steps(self) -> NDArray[np.intp]:
        """Width of every interval (k,) in units of the narrowest."""
        return 2 ** (max(self.halvings, default=0) - np.array(self.halvings or (0,) * self.intervals))

    @cached_property
    def _begin(self) -> NDArray[np.intp]:
        """Where every interval (k,) begins, in units of the narrowest."""
        return np.cumsum(self._steps) - self._steps

    @cached_property
    def _on_finest(self) -> NDArray[np.intp]:
        """Interval of each piece as wide as the narrowest."""
        return np.repeat(np.arange(self.intervals), self._steps)

    @cached_property
    def pieces(self) -> NDArray[np.float64]:
        """Return five basis functions as polynomials of the share that has passed: (powers, 5), or of each (k, …)."""
        return _pieces() if not self.halvings else _pieces_between(self.widths)

    def angle_row(self, t: float) -> NDArray[np.float64]:
        """Return the row (m,) that takes the coefficients to the angle at a time."""
        first, rows = self.rows(np.array([t]), 0)
        row = np.zeros(self.size)
        row[first[0] : first[0] + DEGREE + 1] = rows[0]
        return row

    def rows(self, t: NDArray[np.float64], order: int) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Return the first coefficient (n,) at each time and what angle or derivative takes of five, (n, 5)."""
        first, passed = self.interval(t)
        pieces = self.pieces
        for _ in range(order):
            pieces = pieces[..., 1:, :] * np.arange(1.0, pieces.shape[-2])[:, None]
        powers = np.vander(passed, pieces.shape[-2], increasing=True)
        if not self.halvings:
            return first, powers @ pieces / self.spacing**order
        return first, np.einsum("np,npf->nf", powers, pieces[first]) / self.widths[first, None] ** order

    @cached_property
    def stencil(self) -> NDArray[np.float64]:
        """What the fourth derivative of the angle in each interval takes of five coefficients, (k, 5)."""
        if not self.halvings:
            return np.tile(np.diff(np.eye(DEGREE + 1), DEGREE, axis=0) / self.spacing**DEGREE, (self.intervals, 1))
        return np.asarray(factorial(DEGREE) * self.pieces[:, DEGREE] / self.widths[:, None] ** DEGREE)

    def bend(self, coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the fourth derivative of the angle in each interval (k,), rad/s⁴, of coefficients (m,)."""
        if not self.halvings:
            return np.asarray(np.diff(coefficients, DEGREE, axis=0) / self.spacing**DEGREE)
        windows = np.lib.stride_tricks.sliding_window_view(coefficients, DEGREE + 1, axis=0)  # (k, …, 5)
        return np.asarray(np.einsum("kf,k...f->k...", self.stencil, windows))

    @cached_property
    def log_units(self) -> float:
        """Log determinant of what takes coefficients to the angle, its derivatives at the start and its bends.

        Angle, rate, acceleration and jerk at the start, and the bends of all intervals, hold the same as the
        coefficients and mean the same whatever the knots: in these a prior can be compared between splines.
        """
        first = (self.pieces if not self.halvings else self.pieces[0])[:DEGREE, :DEGREE]
        begin = first * np.array([[factorial(order) / self.widths[0] ** order] for order in range(DEGREE)])
        return float(np.log(self.stencil[:, -1]).sum() + np.linalg.slogdet(begin)[1])

    def through(self, spin: Spin) -> NDArray[np.float64]:
        """Return the coefficients (m,) of the spline that a motion is closest to, sampled twice an interval."""
        t = np.ravel(self.knots[:-1, None] + self.widths[:, None] * np.array([0.25, 0.75]))
        first, values = self.rows(t, 0)  # (n, 5)
        normal, right = np.zeros((DEGREE + 1, self.size)), np.zeros(self.size)
        angle = spin.at(t).angle
        for i in range(DEGREE + 1):
            np.add.at(right, first + i, values[:, i] * angle)
            for j in range(i, DEGREE + 1):
                np.add.at(normal[j - i], first + i, values[:, i] * values[:, j])
        ridge = 1e-9 * normal[0].mean()  # numerical tolerance: the outermost coefficients are hardly determined
        normal[0] += ridge
        found = np.zeros(self.size)
        for _ in range(_ROUNDS):  # each takes away what the ridge did to the one before
            found = solveh_banded(normal, right + ridge * found, lower=True)
        return np.asarray(found)

    def spin(self, coefficients: NDArray[np.float64]) -> SplineSpin:
        """Return the motion with these coefficients (m,)."""
        return SplineSpin(self, coefficients)


@lru_cache(maxsize=1)
def _pieces() -> NDArray[np.float64]:
    """Return the five basis functions of an interval as polynomials of the share u that has passed: (powers, 5)."""
    return np.ascontiguousarray(_pieces_between(np.ones(1))[0])


def _pieces_between(widths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the basis functions of every interval as polynomials of the share of it that has passed: (k, powers, 5).

    By the recursion of Cox and de Boor. Beyond the ends the intervals go on as wide as the outermost.
    """
    count = len(widths)
    knots = np.cumsum(np.concatenate([[0.0], np.full(DEGREE, widths[0]), widths, np.full(DEGREE, widths[-1])]))
    own = np.arange(count) + DEGREE  # the knot at which each interval begins
    # pieces[degree][f] is function own − degree + f of that degree, (k, powers).
    pieces = [np.zeros((count, DEGREE + 1))]
    pieces[0][:, 0] = 1.0
    for degree in range(1, DEGREE + 1):
        after = [np.zeros((count, DEGREE + 1)) for _ in range(degree + 1)]
        for f, lower in enumerate(pieces):
            begin, end = knots[own - degree + 1 + f], knots[own + 1 + f]
            span = end - begin
            rising = (knots[own] - begin) / span, widths / span  # (t − begin)/span, in powers of the share
            moved = np.pad(lower[:, :-1], ((0, 0), (1, 0))) * rising[1][:, None]
            up = lower * rising[0][:, None] + moved
            after[f + 1] += up
            after[f] += lower - up
        pieces = after
    return np.stack(pieces, axis=2)


class SplineSpin:
    """Motion of a table as a spline; at a constant rate beyond its ends."""

    def __init__(self, spline: AngleSpline, coefficients: NDArray[np.float64]) -> None:
        self.spline, self.coefficients = spline, coefficients
        self._known: dict[tuple[int, float, float], tuple[NDArray[np.float64], State]] = {}

    @cached_property
    def _polynomials(self) -> NDArray[np.float64]:
        windows = np.lib.stride_tricks.sliding_window_view(self.coefficients, DEGREE + 1)  # (k, 5)
        if self.spline.halvings:
            return np.einsum("kpf,kf->pk", self.spline.pieces, windows)
        return np.ascontiguousarray(self.spline.pieces @ windows.T)  # (powers, k)

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
        first, u = self.spline.places(times)
        h = self.spline.widths[first] if self.spline.halvings else self.spline.spacing
        c0, c1, c2, c3, c4 = (powers[first] for powers in self._polynomials)
        rate = (c1 + u * (2.0 * c2 + u * (3.0 * c3 + u * (4.0 * c4)))) / h
        angle = c0 + u * (c1 + u * (c2 + u * (c3 + u * c4)))
        acceleration = (2.0 * c2 + u * (6.0 * c3 + u * (12.0 * c4))) / h**2
        beyond = times - np.clip(times, self.spline.start, self.spline.stop)
        return State(angle + rate * beyond, rate, acceleration)


class PushedSpin:
    """A motion with more angular acceleration, rad/s², at the same angle and rate."""

    def __init__(self, spin: Spin, acceleration: float) -> None:
        self._spin, self._acceleration = spin, acceleration

    def at(self, t: ArrayLike) -> SpinState:
        """Return the state at times (n,), s."""
        state = self._spin.at(t)
        return State(state.angle, state.rate, state.acceleration + self._acceleration)
