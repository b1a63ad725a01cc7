"""Guard of the rate filter: whether its innovations contradict it for half a second, and where it can start again.

A filter that is far from the truth does not find back by itself: it is linearised at a wrong rate and sure of it. So
every half second whose innovations squared are ten times as large as stated is judged by the single samples. With the
biases as uncertain as before the run, each sample has a most likely rate of its own. The filter starts again from that
rate where it fits the readings better than the filter's does, by more than three parameters can by chance, or far
better than the filter predicted them. Where the single samples don't fit either, nothing is known of the rate until
they do.

Noise larger than stated is no contradiction: misfits are compared with what the best fits leave.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gfimu.array.kinematics import omega_products
from gfimu.rate.maximum_likelihood import rates_of_null_space
from gfimu.rate.sensing import ChannelTables, SensorErrors
from gfimu.rate.start import CONTRADICTION

__all__ = ["GUARD_S", "Guard", "Verdict"]

GUARD_S = 0.5
"""Length of a window whose innovations are judged, s."""

_TIMES = 10.0  # innovations squared over the stated ones, from which a window is judged; over what the best fits leave,
# from which the biases are wrong
_ALIKE = 2.0  # the same ratio, up to which the filter predicts the readings as well as anything can
_UNUSABLE = 100.0  # misfit squared of the best fits per degree of freedom: ten times noise and biases
_FEWEST = 0.5  # share of a window's samples that must be complete to judge it
_LAST = 0.25  # share of a window, at its end, in which the single samples must fit to start again


class Verdict(NamedTuple):
    """What was found of a window."""

    contradicted: bool
    first: int  # sample of the window to start again from; −1 where the single samples don't fit
    omega: NDArray[np.float64]  # (3,) its rate but for the sign, rad/s


class Guard:
    """Judges windows of a filter.

    Parameters
    ----------
    tables : ChannelTables
        Of the array.
    errors : SensorErrors
        Errors of its sensors before the run.
    """

    def __init__(self, tables: ChannelTables, errors: SensorErrors) -> None:
        sensitivity = tables.null_sensitivity[0]
        self.possible = tables.n_null > 0 and np.linalg.matrix_rank(sensitivity, tol=1e-9) >= 3
        if self.possible:
            spread = np.eye(tables.n_null) + tables.bias_covariance(errors.bias_std)[3:, 3:]
            self._white = np.linalg.inv(np.linalg.cholesky(spread))
            self._sensitivity = np.ascontiguousarray(self._white @ sensitivity)

    def suspects(self, nis: float, freedom: int) -> bool:
        """Whether a window's sum of innovations squared is too large for its degrees of freedom."""
        return not nis <= _TIMES * max(freedom, 1)

    def judge(
        self, z: NDArray[np.float64], complete: NDArray[np.bool_], omega: NDArray[np.float64], nis: float
    ) -> Verdict | None:
        """Judge a window.

        Parameters
        ----------
        z : ndarray, shape (w, d)
            Its null space.
        complete : ndarray of bool, shape (w,)
            Samples that have all channels.
        omega : ndarray, shape (w, 3)
            Rates of the filter, rad/s.
        nis : float
            Innovations squared of the filter, per degree of freedom.

        Returns
        -------
        Verdict or None
            None where too few samples are complete.
        """
        unknown = Verdict(True, -1, np.zeros(3))
        if complete.sum() < max(2, _FEWEST * len(z)):
            return None
        shown = z[complete] @ self._white.T
        own, _ = rates_of_null_space(shown, self._sensitivity)
        best = np.sum((shown - omega_products(own) @ self._sensitivity.T) ** 2, axis=1)
        freedom = max(1, shown.shape[1] - 3)
        misfit = np.sum((shown - omega_products(omega[complete]) @ self._sensitivity.T) ** 2, axis=1)
        typical = max(1.0, float(np.median(best)) / freedom)
        fits = best < _UNUSABLE * freedom
        close = float(np.mean(misfit - best)) <= CONTRADICTION * typical and nis <= _TIMES * typical
        # Innovations no larger than what the best fits leave contradict nothing.
        contradicted = not (close or nis <= _ALIKE * typical)
        if not contradicted and fits.mean() > _FEWEST:
            return Verdict(False, -1, np.zeros(3))
        last = round((1.0 - _LAST) * len(fits))
        if not fits[last:].all():
            return unknown
        bad = np.flatnonzero(~fits)
        first = int(bad[-1]) + 1 if bad.size else 0
        return Verdict(True, int(np.flatnonzero(complete)[first]), own[first])
