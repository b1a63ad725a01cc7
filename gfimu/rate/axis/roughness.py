"""How rough a motion is, second by second: a table that changes its speed and then turns steadily is not one motion.

With one density of the change of α for a whole run, α follows noise where the rotation is steady, and lags where the
speed changes. A lever that is estimated with the motion is then too short: noise in α counts as motion (errors in
variables).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from gfimu.rate.axis.problem import AxisProblem, Settings

__all__ = ["with_roughness"]

_FACTORS = 10.0 ** np.arange(-3.0, 3.5)  # of the density that was learnt for the whole run; by choice
_SECOND = 1.0  # s: of one density; by choice


def with_roughness(
    problem: AxisProblem, settings: Settings, start: NDArray[np.float64], covariance: NDArray[np.float64]
) -> AxisProblem:
    """Return the problem with the density of the change of α of each second, over that of the settings.

    Of each second the density of the greatest likelihood is taken, of it and its neighbours the largest.

    Parameters
    ----------
    problem : AxisProblem
        Readings.
    settings : Settings
        Numbers of the filter.
    start, covariance : ndarray, shapes (3,) and (3, 3)
        State before the first sample and its covariance.
    """
    second = np.floor((problem.t - problem.t[0]) / _SECOND).astype(np.int64)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(second)) + 1])
    even = replace(problem, roughness=None)
    runs = [even.run(replace(settings, jerk=by * settings.jerk), start, covariance) for by in _FACTORS]
    sums = np.array([np.add.reduceat(np.nan_to_num(run.likelihoods, nan=-1e9), edges) for run in runs])  # (f, s)
    best = maximum_filter1d(np.argmax(sums, axis=0), 3, mode="nearest")
    counts = np.diff(np.append(edges, len(problem.t)))
    return replace(problem, roughness=np.repeat(_FACTORS[best], counts))
