"""What stays the same over a run, biases and errors of the channels, and its places in the state of the filter."""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from gfimu.rate.filter_state import Carried, Places, Samples

__all__ = ["Constants"]


class Constants(NamedTuple):
    """Biases of α, of the null space and of p, and errors φ of the channels, as an estimate knows them.

    ``values`` (d,) are [b_α (3); b_z (m); b_p (0 or 3); φ (q)], and ``covariance`` (d, d) is theirs.
    """

    values: NDArray[np.float64]
    covariance: NDArray[np.float64]

    @classmethod
    def of_state(cls, carried: Carried, at: Places) -> Self:
        """Return those in the state of a filter."""
        places = np.r_[at.alpha : at.references, at.errors : at.end]
        return cls(carried.x[places], carried.covariance[np.ix_(places, places)])

    def put(self, carried: Carried, at: Places) -> None:
        """Put them into the state of a filter."""
        places = np.r_[at.alpha : at.references, at.errors : at.end]
        carried.x[places], carried.covariance[np.ix_(places, places)] = self

    def of_alpha(self, samples: Samples) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return what they make of A y, (n, 3), and its slopes by them, (n, 3, d)."""
        return self._of_rows(0, 3, samples.alpha_errors)

    def of_products(self, samples: Samples) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return what they make of z, (n, m), and its slopes, (n, m, d)."""
        return self._of_rows(3, samples.z.shape[1], samples.product_errors)

    def of_force(self, samples: Samples) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return what they make of P y, (n, 3), and its slopes, (n, 3, d)."""
        return self._of_rows(3 + samples.z.shape[1], 3, samples.force_errors)

    def variance_by(self, slopes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the covariance that they give quantities with these slopes (n, k, d), shape (n, k, k)."""
        return np.asarray(slopes @ self.covariance @ np.swapaxes(slopes, 1, 2))

    def _of_rows(
        self, first: int, count: int, errors: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        biases = len(self.values) - errors.shape[2]
        picked = np.broadcast_to(np.eye(biases)[first : first + count], (len(errors), count, biases))
        slopes = np.concatenate([picked, errors], axis=2)
        return slopes @ self.values, slopes
