"""Integration of sampled quantities: angular acceleration to rate, rate to table angle.

The rate obeys ω̇ = α(t) with α known at the samples only, so every method is a quadrature: the integral over one
sample interval of the polynomial through a few neighbouring samples. They differ in which neighbours they take:

==================  ===================================  ======================================
method              samples of the interval [0, 1]       error, causality
==================  ===================================  ======================================
``trapezoid``       0, 1                                 second order, causal
``runge_kutta``     0, 1, 2 and −1, 0, 1 in turn         fourth order, one sample late
``adams_moulton4``  −2 … 1                               fourth order, causal
``centred4``        −1 … 2                               fourth order, one sample late
``centred6``        −2 … 3                               sixth order, two samples late
==================  ===================================  ======================================

``runge_kutta`` is the GF-IMU paper's choice: the classical fourth-order Runge–Kutta step over two sample periods,
whose middle stages fall on the sample between. Without dependence on ω it is Simpson's rule
ω(t + 2h) = ω(t) + h/3 (α₀ + 4 α₁ + α₂); the rate at the middle sample comes from the same parabola. (A
Runge–Kutta step over one period, with α interpolated linearly for its middle stages, is the trapezoid.)

Weights follow from the actual sample times, so jitter is allowed for. No polynomial crosses a gap (a step longer than
1.5 median periods, or samples that are NaN) or two samples closer than a median period over 1.5, which would give their
neighbours large weights of either sign: inside each gapless stretch the samples near the ends use the nearest
stencil that fits, and the gap itself is bridged by its two end samples. Nothing is known about α inside a gap, so the
rate behind a long one is only as good as that straight line.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.quadrature import STENCILS, Stencil, polynomial_weights
from gfimu.base.compiled import compiled
from gfimu.base.errors import InputError, unknown_name

__all__ = ["METHODS", "integrate_rate", "integrate_samples"]


METHODS = tuple(STENCILS)
"""Names of the integration methods."""

_GAP_PERIODS = 1.5


def integrate_rate(
    t: ArrayLike, alpha: ArrayLike, omega0: ArrayLike = 0.0, *, method: str = "runge_kutta"
) -> NDArray[np.float64]:
    """Integrate angular acceleration to angular rate.

    Parameters
    ----------
    t : array_like, shape (n,)
        Sample times, s, strictly increasing.
    alpha : array_like, shape (n, 3)
        Angular acceleration in body axes, rad/s². Rows with NaN count as lost samples.
    omega0 : array_like, shape (3,) or scalar
        Rate at the first valid sample, rad/s.
    method : {"runge_kutta", "trapezoid", "adams_moulton4", "centred4", "centred6"}
        Quadrature; see the module's table.

    Returns
    -------
    ndarray, shape (n, 3)
        Angular rate in body axes, rad/s; NaN in the rows where ``alpha`` is.

    Raises
    ------
    InputError
        If the shapes don't fit, time does not increase, or the method is unknown.

    Notes
    -----
    GF-IMU paper, step 10 (d). In body axes dω/dt = α holds component by component, so no attitude is needed.

    Examples
    --------
    >>> import numpy as np
    >>> import gfimu
    >>> t = np.arange(101) / 100.0
    >>> round(float(gfimu.integrate_rate(t, np.tile([0.0, 0.0, 1.0], (101, 1)))[-1, 2]), 6)
    1.0
    """
    samples = np.asarray(alpha, dtype=float)
    if samples.ndim != 2 or samples.shape[1] != 3:
        raise InputError(f"alpha has shape {samples.shape}; it needs one row of three per sample")
    return integrate_samples(t, samples, omega0, method=method)


def integrate_samples(
    t: ArrayLike, samples: ArrayLike, initial: ArrayLike = 0.0, *, method: str = "runge_kutta"
) -> NDArray[np.float64]:
    """Integrate sampled quantities over time.

    Parameters
    ----------
    t : array_like, shape (n,)
        Sample times, s, strictly increasing.
    samples : array_like, shape (n,) or (n, k)
        Samples; rows with NaN count as lost.
    initial : array_like, shape (k,) or scalar
        Value of the integral at the first valid sample.
    method : str
        As for `integrate_rate`.

    Returns
    -------
    ndarray, shape of ``samples``
        The integral at each sample, in the unit of ``samples`` times s; NaN in the rows where ``samples`` is.

    Raises
    ------
    InputError
        As for `integrate_rate`.
    """
    times, values = _checked(t, samples)
    valid = np.isfinite(values).all(axis=1)
    kept = values[valid]
    integral = np.empty_like(kept)
    if len(kept):
        integral[0] = initial
        np.cumsum(_integrals(times[valid], kept, method), axis=0, out=integral[1:])
        integral[1:] += integral[0]
    result = np.full_like(values, np.nan)
    result[valid] = integral
    return result.reshape(np.shape(samples))


def _checked(t: ArrayLike, samples: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return times (n,) and samples (n, k), checked."""
    times = np.asarray(t, dtype=float)
    values = np.asarray(samples, dtype=float)
    if values.ndim == 1:
        values = values[:, None]
    if times.ndim != 1 or values.ndim != 2 or len(times) != len(values):
        raise InputError(f"times have shape {times.shape} and samples {np.shape(samples)}; one row per time is needed")
    if not np.isfinite(times).all() or np.any(np.diff(times) <= 0):
        raise InputError("times must be finite and strictly increasing; sort the samples and drop repeated ones")
    return times, values


def _integrals(t: NDArray[np.float64], values: NDArray[np.float64], method: str) -> NDArray[np.float64]:
    """Integral over each interval, shape (n − 1, k)."""
    if method not in STENCILS:
        raise unknown_name("integration method", method, METHODS)
    n = len(t)
    if n < 2:
        return np.zeros((0, values.shape[1]))
    first, points = _place_stencils(t, STENCILS[method])
    integrals = np.zeros((n - 1, values.shape[1]))
    _sum_intervals(np.ascontiguousarray(t), np.ascontiguousarray(values), first, points, integrals)
    return integrals


@compiled
def _sum_intervals(t, values, first, points, integrals):  # type: ignore[no-untyped-def]
    """Weigh and add the samples of every interval's stencil."""
    weights = np.empty(points.max())
    for left in range(len(first)):
        polynomial_weights(t, first[left], points[left], left, weights)
        for j in range(points[left]):
            for k in range(values.shape[1]):
                integrals[left, k] += weights[j] * values[first[left] + j, k]


def _place_stencils(t: NDArray[np.float64], stencil: Stencil) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First sample and number of samples of the stencil of each interval, so that none crosses a gap."""
    step = np.diff(t)
    period = np.median(step)
    gap = (step > _GAP_PERIODS * period) | (step < period / _GAP_PERIODS)
    left = np.arange(len(step))
    # Stretch [start, stop] of gapless samples that each interval lies in.
    stretch = np.concatenate([[0], np.cumsum(gap)])[:-1]
    edges = np.flatnonzero(gap)
    start = np.concatenate([[0], edges + 1])[stretch]
    stop = np.concatenate([edges, [len(step)]])[stretch]
    before = np.where((left - start) % 2 == 0, *stencil.before)
    first = np.maximum(left + before, start)
    if stencil.causal:  # fewer samples at the start of a stretch rather than a look ahead
        points = left + 2 - first
    else:
        points = np.minimum(stencil.points, stop - start + 1)
        first = np.minimum(first, stop - points + 1)
    return np.where(gap, left, first), np.where(gap, 2, points)
