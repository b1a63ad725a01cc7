"""Starting while already spinning: which of ω and −ω it is.

Centripetal readings are the same for ω and −ω, so a start in the dark is followed by two filters that begin at
opposite rates. What distinguishes them is α: if ω grows while α points along it, the sign was right. The ratio of the
filters' likelihoods says which; but at constant ω both explain the readings equally well, and the logarithm of the
ratio is a random walk that sooner or later crosses any threshold. So it is accumulated only during a manoeuvre: while
α, averaged over the filters' memory 1/|ω|, is six standard deviations from zero in both filters, their uncertain
biases included. During such a manoeuvre the wrong filter lags by at least a dozen of its standard deviations, and the
ratio grows by tens per memory length. Until it has grown by `THRESHOLD` the sign is undecided.

The filters are linearised about their start, so they begin only at a sample whose rate stands `CLEAR` standard
deviations above what noise and biases can feign; until then all that is known is how fast the body can be turning.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import GeometryError
from gfimu.rate.bounds.sample import omega_products_jacobian
from gfimu.rate.maximum_likelihood import rate_of_null_space
from gfimu.rate.recursion_data import RecursionOutput
from gfimu.rate.sensing import ChannelTables, SensorErrors

__all__ = ["THRESHOLD", "InitialRate", "SignTest"]

THRESHOLD = 20.0
"""Logarithm of the likelihood ratio at which the sign counts as decided."""

CLEAR = 25.0
"""Standard deviations by which a rate must stand clear of the biases to start from: they don't average out."""

_CLEAR_OF_NOISE = 5.0  # standard deviations of a single sample, noise and biases together

_SIGNIFICANT = 36.0  # of the averaged α, variances
_FITTING = 1.5  # the winner's normalised innovations squared per degree of freedom during the manoeuvre, at most
_TINY = 1e-9
_RATIO = 0


@dataclass
class SignTest:
    """Running comparison of the two hypotheses.

    Parameters
    ----------
    winner : int or None
        0 or 1 once decided.
    log_likelihood_ratio : float
        Of hypothesis 0 against 1, accumulated during manoeuvres.
    """

    winner: int | None = None
    _sums: NDArray[np.float64] = field(default_factory=lambda: np.zeros(4))

    @property
    def log_likelihood_ratio(self) -> float:
        """Of hypothesis 0 against 1, accumulated during manoeuvres."""
        return float(self._sums[_RATIO])

    def update(self, first: RecursionOutput, second: RecursionOutput) -> int | None:
        """Take the outputs of both filters for the same samples; returns the sample that decided, if one did."""
        place = _compare(
            first.likelihood, second.likelihood, first.manoeuvre, second.manoeuvre, first.nis, second.nis, first.dof,
            self._sums,
        )  # fmt: skip
        if place < 0:
            return None
        self.winner = 0 if self._sums[_RATIO] > 0 else 1
        return int(place)


@njit(cache=True)
def _compare(likely0, likely1, manoeuvre0, manoeuvre1, nis0, nis1, dof, sums):  # type: ignore[no-untyped-def]
    """Accumulate; returns the first sample at which the ratio is decisive and its winner fits, or −1."""
    for k in range(len(likely0)):
        if manoeuvre0[k] < _SIGNIFICANT or manoeuvre1[k] < _SIGNIFICANT or dof[k] == 0:
            continue
        sums[0] += likely0[k] - likely1[k]
        sums[1] += nis0[k]
        sums[2] += nis1[k]
        sums[3] += dof[k]
        squares = sums[1] if sums[0] > 0 else sums[2]
        if abs(sums[0]) > THRESHOLD and squares < _FITTING * sums[3]:
            return k
    return -1


class InitialRate:
    """Rate of a single sample, up to the sign, with nothing known of the biases but their spread.

    Parameters
    ----------
    array : AccelerometerArray
        The array.
    errors : SensorErrors
        Errors of its sensors.

    Raises
    ------
    GeometryError
        If the array sees fewer than three products of ω.
    """

    def __init__(self, array: AccelerometerArray, errors: SensorErrors) -> None:
        tables = ChannelTables(array, errors)
        if tables.n_null == 0 or np.linalg.matrix_rank(tables.null_sensitivity[0], tol=1e-9) < 3:
            raise GeometryError(
                f"array {array.name!r} sees fewer than three products of the rate, so it can't find an unknown rate; "
                "start at rest or give the rate at the start"
            )
        # Biases count as noise here: the rows are weighted by both.
        total = np.eye(tables.n_null) + tables.bias_covariance(errors.bias_std)[3:, 3:]
        white = np.linalg.inv(np.linalg.cholesky(total))
        biases = total - (1.0 - _TINY) * np.eye(tables.n_null)
        self._against_bias = np.linalg.inv(np.linalg.cholesky(biases)) @ tables.null_sensitivity[0]
        self._rows = white @ tables.null_rows[0]
        self._sensitivity = np.ascontiguousarray(white @ tables.null_sensitivity[0])

    def find(self, readings: NDArray[np.float64]) -> tuple[NDArray[np.float64], bool]:
        """Rate (3,), rad/s, that fits a complete sample (c,) best, and whether it stands clear of the biases."""
        omega = rate_of_null_space(self._rows @ readings, self._sensitivity)
        clear = all(
            float(np.linalg.svd(sensitivity @ omega_products_jacobian(omega), compute_uv=False)[-1])
            * float(np.linalg.norm(omega))
            > least
            for sensitivity, least in ((self._sensitivity, _CLEAR_OF_NOISE), (self._against_bias, CLEAR))
        )
        return omega, clear

    def limit(self, omega: NDArray[np.float64]) -> float:
        """How fast a body can turn whose sample gave ``omega``, rad/s (standard deviation of each component)."""
        weakest = float(np.linalg.svd(self._sensitivity, compute_uv=False).min())
        feigned = 1.0 / weakest if weakest > 0 else np.inf  # of a product of ω, by noise and biases
        return float(np.sqrt(omega @ omega + feigned))
