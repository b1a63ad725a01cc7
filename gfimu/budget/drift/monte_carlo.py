"""Monte Carlo of the position drift: the full nonlinear navigation on simulated sensor errors.

Beside the closed forms of `gfimu.budget.drift.budget`: nothing here is linearised. Errors are drawn per channel,
mapped through the array's pseudo-inverse, and integrated with the same rate, attitude and navigation functions that
real data take.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.integration import integrate_rate
from gfimu.array.kinematics import pseudo_inverse
from gfimu.base.errors import InputError
from gfimu.base.short_repr import short_repr
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.budget.drift.closed_forms import ErrorSources
from gfimu.motion.attitude import integrate_attitude
from gfimu.motion.navigation import navigate

__all__ = ["DriftSample", "monte_carlo_drift"]

_SAMPLES_PER_RADIAN = 10.0
_MOST_STEPS, _MOST_RUNS = 10**9, 10**6  # numerical: samples of all runs, hours of work; runs
_LEAST_STEPS = 60
# Even weights: Simpson's alternating ones would raise the variance of integrated white noise by a ninth.
_METHOD = "centred4"


@dataclass(frozen=True)
class DriftSample:
    """Position errors of many simulated runs.

    Parameters
    ----------
    t_s : ndarray, shape (n,)
        Time since the start of navigation, s.
    mean, std : ndarray, shape (n, 3)
        Mean and standard deviation over the runs of the position error in world axes, m.
    final : ndarray, shape (runs, 3)
        Position error of each run at the last time, m.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.drift("cube12", duration=5.0, noise_ug=290.0, monte_carlo=50)
    >>> found.sample.runs, found.sample.final.shape
    (50, (50, 3))
    """

    t_s: NDArray[np.float64]
    mean: NDArray[np.float64]
    std: NDArray[np.float64]
    final: NDArray[np.float64]

    __repr__ = short_repr

    @property
    def runs(self) -> int:
        """Number of runs."""
        return len(self.final)

    @property
    def relative_sampling_error(self) -> float:
        """Standard deviation of an estimated standard deviation, relative, for normal errors: 1/√(2(runs − 1))."""
        return 1.0 / math.sqrt(2.0 * (self.runs - 1))


def monte_carlo_drift(
    array: AccelerometerArray,
    time: float,
    sources: ErrorSources,
    *,
    runs: int,
    rng: np.random.Generator,
    rate: float = 0.0,
    offset: tuple[float, float] = (0.0, 0.0),
    gravity: float = STANDARD_GRAVITY,
    sample_rate: float = 100.0,
    progress: Callable[[float], object] | None = None,
) -> DriftSample:
    """Simulate the drift that `gfimu.budget.drift.budget.drift_budget` predicts.

    Parameters
    ----------
    array, time, sources, rate, offset, gravity
        As for `gfimu.budget.drift.budget.drift_budget`.
    runs : int
        Number of runs, at least 2.
    rng : numpy.random.Generator
        Random number generator.
    sample_rate : float
        Sample rate, Hz; raised where the run is short or the table fast, so that integration errors stay below the
        sampling error.
    progress : callable, optional
        Called with the share of the runs that is done.

    Returns
    -------
    DriftSample
        Mean and standard deviation of the position error over time.

    Raises
    ------
    InputError
        If ``runs`` < 2 or ``time`` or ``sample_rate`` is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> import gfimu
    >>> sources = gfimu.ErrorSources(noise_density=290e-6 * 9.80665)
    >>> cube = gfimu.AccelerometerArray.load("cube12")
    >>> sample = gfimu.monte_carlo_drift(cube, 5.0, sources, runs=50, rng=np.random.default_rng(1))
    >>> sample.final.shape
    (50, 3)
    """
    if runs < 2:
        raise InputError(f"{runs} Monte Carlo runs have no standard deviation; ask for 2 or more")
    if not (math.isfinite(time) and time > 0 and math.isfinite(sample_rate) and sample_rate > 0):
        raise InputError("time and sample rate must be above zero")
    steps = max(_LEAST_STEPS, math.ceil(time * max(sample_rate, _SAMPLES_PER_RADIAN * abs(rate))))
    if steps * runs > _MOST_STEPS or runs > _MOST_RUNS:
        raise InputError(f"{runs} runs of {steps} samples take too long; ask for fewer, or for a shorter time")
    t = np.linspace(0.0, time, steps + 1)
    inverse = pseudo_inverse(array)  # (6, c)
    true_omega = np.array([0.0, 0.0, rate])
    true_p = np.array([-(rate**2) * offset[0], -(rate**2) * offset[1], gravity])
    start = np.array([offset[0], offset[1], 0.0])
    cos, sin = np.cos(rate * t), np.sin(rate * t)
    truth = np.column_stack([offset[0] * cos - offset[1] * sin, offset[0] * sin + offset[1] * cos, np.zeros(len(t))])
    velocity0 = np.cross(true_omega, start)

    final = np.empty((runs, 3))
    mean, squares = np.zeros((len(t), 3)), np.zeros((len(t), 3))
    for run in range(runs):
        motion = _channel_errors(len(t), array.n_channels, t[1], sources, rng) @ inverse.T  # (n, 6)
        alpha = motion[:, :3]
        omega = integrate_rate(t, alpha, true_omega + sources.rate_drift * rng.standard_normal(3), method=_METHOD)
        quaternion = integrate_attitude(t, omega, alpha)
        error = (
            navigate(
                t,
                true_p + motion[:, 3:],
                quaternion,
                gravity=gravity,
                velocity0=velocity0,
                position0=start,
                method=_METHOD,
            ).position
            - truth
        )
        final[run] = error[-1]
        step = error - mean  # Welford's recurrence: no cancellation where the mean is large
        mean += step / (run + 1)
        squares += step * (error - mean)
        if progress is not None:
            progress((run + 1) / runs)
    return DriftSample(t, mean, np.sqrt(squares / (runs - 1)), final)


def _channel_errors(
    samples: int, channels: int, step: float, sources: ErrorSources, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Errors of the channels of one run, shape (n, c), m/s²."""
    errors = np.tile(sources.bias * rng.standard_normal(channels), (samples, 1))
    if sources.noise_density:
        # Variance of a sample = one-sided density² · sample rate / 2.
        errors += sources.noise_density / math.sqrt(2.0 * step) * rng.standard_normal((samples, channels))
    if sources.bias_random_walk:
        steps = sources.bias_random_walk * math.sqrt(step) * rng.standard_normal((samples - 1, channels))
        errors[1:] += np.cumsum(steps, axis=0)
    return errors
