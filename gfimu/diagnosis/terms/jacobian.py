"""Derivative of the observations by the drive's coefficients, whatever the world between them does.

By coloured finite differences (Curtis, Powell and Reid, J. Inst. Maths Applics 13, 1974): a coefficient acts over its
spline support and, where the world has a memory, over some time before and after; coefficients further apart than that
are moved together. The memory is measured by moving a few coefficients alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.terms.spline import DEGREE, AngleSpline

__all__ = ["Jacobian", "Reach", "differentiate", "measured_reach"]

Predict = Callable[[NDArray[np.float64]], NDArray[np.float64]]

STEP = 1e-6
"""Numerical: finite difference of a coefficient of the angle, rad."""
_FORGOTTEN = 3e-3  # numerical: share of a response's peak below which it counts as over
_PROBES = 8  # numerical: coefficients at which the memory is measured at once
_SHIFTS = 4  # numerical: how often, each time at others
_LEAST_SHARE = 1e-11  # numerical: power of a combination of observations that is second order in the step
_INTERVALS = 12  # numerical: knot intervals of a block of rows


@dataclass(frozen=True)
class Reach:
    """Knot intervals, of the narrowest, before and after its spline support over which a coefficient acts."""

    before: int = 0
    after: int = 0

    @property
    def width(self) -> int:
        """Number of coefficients that one sample depends on, where the knots are closest."""
        return DEGREE + 1 + self.before + self.after


@dataclass(frozen=True)
class Jacobian:
    """Banded derivative, factored over observations: J_c = Σ_r loading[r, c] J_r.

    All sensors of a rigid body see the drive through few functions of time, so that far fewer J_r are needed than
    there are observations.

    Parameters
    ----------
    size : int
        Number m of coefficients.
    blocks : tuple of (slice, slice, ndarray)
        Rows, coefficients, and J_r there, (R, rows, coefficients); they cover all rows.
    loading : ndarray, shape (R, c)
        V.
    predictions : int
        How many predictions it took.
    """

    size: int
    blocks: tuple[tuple[slice, slice, NDArray[np.float64]], ...]
    loading: NDArray[np.float64]
    predictions: int = 0

    def transposed(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return J_rᵀ v of values (n, P), the same for every r, shape (R, m, P)."""
        out = np.zeros((len(self.loading), self.size, values.shape[1]))
        for rows, at, block in self.blocks:
            for total, one in zip(out, block, strict=True):
                total[at] += one.T @ values[rows]
        return out

    def backward(self, c: int, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return J_cᵀ v of values (n, P) of one observation, shape (m, P)."""
        out = np.zeros((self.size, values.shape[1]))
        for rows, at, block in self.blocks:
            mixed = self.loading[:, c, None, None] * values[rows]  # (R, rows, P)
            out[at] += block.reshape(-1, block.shape[2]).T @ mixed.reshape(-1, mixed.shape[2])
        return out

    def correlate(self, combined: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return Σ_r J_rᵀ v_r of values (R, n, P), shape (m, P)."""
        out = np.zeros((self.size, combined.shape[2]))
        for rows, at, block in self.blocks:
            for one, values in zip(block, combined, strict=True):
                out[at] += one.T @ values[rows]
        return out

    def times(self, step: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return J δ of every observation, shape (n, c)."""
        parts = np.concatenate([block @ step[at] for _, at, block in self.blocks], axis=1)  # (R, n)
        return np.asarray(parts.T @ self.loading)

    def information(self, weights: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return Σ_c w_c J_cᵀJ_c for weights (c,), shape (m, m)."""
        gram = (self.loading * weights) @ self.loading.T
        power, turn = np.linalg.eigh(gram)
        root = (turn * np.sqrt(np.maximum(power, 0.0))).T  # (R, R): gram = rootᵀ root
        out = np.zeros((self.size, self.size))
        for _, at, block in self.blocks:
            mixed = np.tensordot(root, block, axes=1).reshape(-1, block.shape[2])
            out[at, at] += mixed.T @ mixed
        return out


def differentiate(
    predict: Predict,
    spline: AngleSpline,
    coefficients: NDArray[np.float64],
    base: NDArray[np.float64],
    weight: NDArray[np.float64],
    t: NDArray[np.float64],
    reach: Reach,
) -> Jacobian:
    """Differentiate a prediction by coloured finite differences.

    Parameters
    ----------
    predict : callable
        From coefficients (m,) to observations (n, c).
    spline : AngleSpline
        The drive's spline.
    coefficients : ndarray, shape (m,)
        Where.
    base : ndarray, shape (n, c)
        The prediction there.
    weight : ndarray, shape (n, c)
        Weight of every sample's derivative.
    t : ndarray, shape (n,)
        Sample times, s.
    reach : Reach
        Over how much more than its support a coefficient acts.
    """
    first, width = _dependence(spline, t, reach)
    n, c = base.shape
    values = np.zeros((width, n, c))
    rows = np.arange(n)
    for colour in range(width):
        moved = coefficients.copy()
        moved[colour::width] += STEP
        # Coefficient first + k of a sample has this colour.
        values[(colour - first) % width, rows] = predict(moved) - base
    places = first + np.arange(width)[:, None]
    values *= (weight * (1.0 / STEP))[None] * ((places >= 0) & (places < spline.size))[:, :, None]
    flat = values.reshape(-1, c)
    power, turn = np.linalg.eigh(flat.T @ flat)
    kept = power > _LEAST_SHARE * max(float(power[-1]), 1e-300)
    turn = turn[:, kept] if kept.any() else turn[:, -1:]
    parts = (flat @ turn).reshape(width, n, -1)  # (w, n, R)
    return Jacobian(spline.size, tuple(_blocks(parts, first, spline.size)), turn.T, width + 1)


def _dependence(spline: AngleSpline, t: NDArray[np.float64], reach: Reach) -> tuple[NDArray[np.intp], int]:
    """Return the first coefficient that each sample (n,) depends on, and on how many from there it does at most."""
    if not spline.halvings:
        return spline.interval(t)[0] - reach.before, reach.width
    first = spline.interval(t - reach.before * spline.finest)[0]
    last = spline.interval(t + reach.after * spline.finest)[0] + DEGREE
    return first, int((last - first).max()) + 1


def _blocks(
    parts: NDArray[np.float64], first: NDArray[np.intp], size: int
) -> list[tuple[slice, slice, NDArray[np.float64]]]:
    """Put values (w, n, R) of coefficients first … first + w − 1 into dense blocks of some knot intervals each."""
    width, n, count = parts.shape
    edges = np.flatnonzero(np.diff((first - first[0]) // _INTERVALS)) + 1
    out = []
    for start, stop in zip([0, *edges], [*edges, n], strict=True):
        low = int(first[start])
        span = int(first[stop - 1]) - low + width
        block = np.zeros((count, stop - start, span))
        at = first[start:stop] - low
        rows = np.arange(stop - start)
        for k in range(width):
            block[:, rows, at + k] = parts[k, start:stop].T
        left, right = max(low, 0), min(low + span, size)
        out.append(
            (slice(start, stop), slice(left, right), np.ascontiguousarray(block[:, :, left - low : right - low]))
        )
    return out


def measured_reach(
    predict: Predict,
    spline: AngleSpline,
    coefficients: NDArray[np.float64],
    base: NDArray[np.float64],
    t: NDArray[np.float64],
    times: NDArray[np.float64],
) -> Reach:
    """Measure over how many intervals before and after its support a coefficient acts, by a few moved at once.

    Readings belong to other times than those of their stamps, ``times`` (n, c), as far as clocks and delays say: a
    slow clock shows at its end a motion that is many intervals ahead. What is measured is the memory beyond that. One
    longer than the distance of the moved coefficients has to be declared by what has it.
    """
    apart = spline.size // _PROBES
    interval, knots = spline.interval(times)[0], spline.knots
    before = after = 0
    earlier = later = 0.0  # s
    for shift in range(_SHIFTS):
        probes = np.arange((2 * shift + 1) * apart // (2 * _SHIFTS), spline.size, apart)[:_PROBES]
        moved = coefficients.copy()
        moved[probes] += STEP
        response = np.abs(predict(moved) - base)
        size = response / np.maximum(response.max(axis=0), 1e-300)  # (n, c)
        # A coefficient acts on intervals probe − DEGREE … probe of its support; each reading is nearest to one probe.
        nearest = (interval - (probes[0] - DEGREE - apart // 4)) // apart
        among = (nearest >= 0) & (nearest < len(probes))
        nearest, size, since, at = nearest[among], size[among], interval[among], times[among]
        largest = np.zeros(len(probes))
        np.maximum.at(largest, nearest, size)
        mine = size > _FORGOTTEN * largest[nearest]
        if not mine.any():
            continue
        probe, since, at = probes[nearest[mine]], since[mine], at[mine]
        before = max(before, int((since - probe).max()))
        after = max(after, int((probe - DEGREE - since).max()))
        earlier = max(earlier, float((at - knots[np.minimum(probe + 1, spline.intervals)]).max()))
        later = max(later, float((knots[np.maximum(probe - DEGREE, 0)] - at).max()))
    if not spline.halvings:
        ahead = interval - spline.interval(t)[0][:, None]
        return Reach(before + max(-int(ahead.min()), 0), after + max(int(ahead.max()), 0))
    earlier += max(float((t[:, None] - times).max()), 0.0)
    later += max(float((times - t[:, None]).max()), 0.0)
    # Where knots are closer than samples, the ends of a response lie between these.
    return Reach(int(earlier / spline.finest) + 1, int(later / spline.finest) + 1)
